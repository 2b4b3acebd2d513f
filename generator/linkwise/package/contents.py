"""Comparison of the folder of a generated package with the files that its manifest lists."""

import hashlib
import os
from collections.abc import Iterator, Mapping
from pathlib import Path

from linkwise.package.bytecode import CACHE, cache_of
from linkwise.package.manifest import FILE, LARGEST, is_too_large


def changed_files(directory: Path, files: Mapping[str, str]) -> list[str]:
    """Return what is wrong with the listed files, in words, such as "forms/link_1.py was changed".

    The list is empty if nothing is wrong.
    """
    return [f"{path} {fault}" for path, fault in faults(directory, files).items()]


def faults(directory: Path, files: Mapping[str, str]) -> dict[str, str]:
    """Return the faults of the listed files that have one, by path: "was changed", "is missing"."""
    return {path: fault for path, digest in files.items() if (fault := _fault(directory, path, digest))}


def unlisted_files(directory: Path, files: Mapping[str, str]) -> list[str]:
    """Return the paths of what the manifest doesn't list, caches of the listed modules aside.

    Raises OSError.
    """
    known = {FILE, *files}
    found = (path.relative_to(directory) for path in entries(directory))
    return [
        path.as_posix()
        for path in sorted(found)
        if path.as_posix() not in known and not _is_cache(directory / path, path, known)
    ]


def entries(directory: Path) -> Iterator[Path]:
    """Yield everything below a folder but folders; links to folders are not followed. Raises OSError."""

    def fail(error: OSError) -> None:
        raise error

    for place, folders, names in os.walk(directory, onerror=fail):
        links = [name for name in folders if Path(place, name).is_symlink()]
        yield from (Path(place, name) for name in (*links, *names))


def link_on_the_way(directory: Path, path: str) -> str | None:
    """Return the first part of a path in a package that is a symbolic link; None if there is none."""
    parts = (Path(path), *Path(path).parents)[:-1]
    return next((part.as_posix() for part in reversed(parts) if (directory / part).is_symlink()), None)


def _fault(directory: Path, path: str, digest: str) -> str:
    file = directory / path
    link = link_on_the_way(directory, path)
    if link is not None:
        return "is a symbolic link" if link == path else f"is behind the symbolic link {link}"
    if not file.is_file():
        return "is missing"
    try:
        if is_too_large(file):
            return f"has {file.stat().st_size:,} bytes, and no file of a package has more than {LARGEST:,}"
        with file.open("rb") as opened:
            return "" if hashlib.file_digest(opened, "sha256").hexdigest() == digest else "was changed"
    except OSError as error:
        return f"cannot be read ({error.strerror})"


def _is_cache(file: Path, path: Path, known: set[str]) -> bool:
    """Return whether this is the cache that Python leaves beside a listed module when it compiles it."""
    if path.parent.name != CACHE or file.is_symlink() or file.parent.is_symlink() or not file.is_file():
        return False
    cache = cache_of(path)
    return cache is not None and cache.source.as_posix() in known
