"""The files that every package has alike: copies of linkwise's own runtime."""

from functools import cache
from importlib.resources import files


@cache
def own_text(path: str) -> bytes | None:
    """The file of linkwise that a package has a copy of at this path; None where that is no copy."""
    folder, _, name = path.partition("/")
    places = {"runtime": files("linkwise.runtime"), "c": files("linkwise.runtime").joinpath("c")}
    if folder in places and (file := places[folder].joinpath(name)).is_file():
        return file.read_text(encoding="utf-8").encode()  # as it was written, whatever ends lines here
    return None
