"""Files that all packages share: copies of the runtime, headers that serve every robot, and their licence."""

from functools import cache
from importlib.resources import files

FOLDERS = ("linkwise_runtime/", "c/linkwise/")
"""Folders of these files in a package."""
LICENSE = "LICENSE"
"""Name of the text that whoever passes these files on gives along; each of the folders has it."""


def own_folder(path: str) -> str | None:
    """Return which of these folders a path is in; None for a file of the robot's."""
    return next((folder for folder in FOLDERS if path.startswith(folder)), None)


@cache
def own_text(path: str) -> bytes | None:
    """Return the file of linkwise that a package has a copy of at this path; None if that is no copy."""
    start = own_folder(path)
    if start is None:
        return None
    name = path.removeprefix(start)
    is_of_runtime = start == FOLDERS[0] or name == LICENSE
    file = (files("linkwise_runtime") if is_of_runtime else files("linkwise").joinpath("c")).joinpath(name)
    # as it was written, whatever ends lines here
    return file.read_text(encoding="utf-8").encode() if file.is_file() else None
