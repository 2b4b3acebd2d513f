"""The files that packages have alike: copies of the runtime, and headers that serve every robot."""

from functools import cache
from importlib.resources import files


@cache
def own_text(path: str) -> bytes | None:
    """The file of linkwise that a package has a copy of at this path; None where that is no copy."""
    places = {"linkwise_runtime/": files("linkwise_runtime"), "c/linkwise/": files("linkwise").joinpath("c")}
    for start, folder in places.items():
        if path.startswith(start) and (file := folder.joinpath(path.removeprefix(start))).is_file():
            return file.read_text(encoding="utf-8").encode()  # as it was written, whatever ends lines here
    return None
