"""Checks of a file that a user names, before it is opened: it must be there, and have an end."""

import os
import stat
from pathlib import Path

from linkwise.errors import LinkwiseError

KINDS = {
    stat.S_IFDIR: "a directory",
    stat.S_IFCHR: "a device",
    stat.S_IFBLK: "a device",
    stat.S_IFIFO: "a pipe",
    stat.S_IFSOCK: "a socket",
}


def require_file(path: Path, missing: str = "no such file", wanted: str = "a file") -> None:
    """Raise LinkwiseError, without the path, unless `path` is a regular file or a link to one.

    Whatever else can be opened may never end, or keep its reader waiting. `missing` is the message where
    nothing is; `wanted` is what else to give.
    """
    try:
        mode = path.stat().st_mode
    except (FileNotFoundError, NotADirectoryError) as error:
        raise LinkwiseError(missing) from error
    except OSError as error:
        raise LinkwiseError(f"cannot be read: {error.strerror}") from error
    except ValueError as error:  # a path with a zero byte
        raise LinkwiseError(f"cannot be read: {error}") from error
    if not stat.S_ISREG(mode):
        pipe = ", which cannot be read twice" if stat.S_ISFIFO(mode) else ""
        raise LinkwiseError(f"this is {kind_of(mode)}{pipe}; give {wanted}")


def kind_of(mode: int) -> str:
    """Return in words the kind of a file that is not regular."""
    return KINDS.get(stat.S_IFMT(mode), "not a file")


def is_file(path: Path) -> bool:
    """Return whether `path` is a regular file, for any text that might be a path."""
    try:
        require_file(path)
    except LinkwiseError:
        return False
    return True


def is_inside(path: Path, folder: Path) -> bool:
    """Return whether `path` lies somewhere in `folder`, also by links or with letters in another case."""
    parents = Path(os.path.realpath(path)).parents
    if folder.exists():
        return any(parent.exists() and parent.samefile(folder) for parent in parents)
    return Path(os.path.realpath(folder)) in parents


def is_same(path: Path, other: Path) -> bool:
    """Return whether two paths are of one file, or will be."""
    there = path.exists() and other.exists()
    return path.samefile(other) if there else path.resolve() == other.resolve()
