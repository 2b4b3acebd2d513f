"""Files that packages are made by: a change in any file of linkwise counts.

For an upgrade there is the record that installers keep of a version: its path has the version in it, and so
is gone afterwards, whatever times the new files bring along. The same goes for SymPy, and for MuJoCo where it
read the robot.
"""

import sys
from collections.abc import Iterator
from functools import cache
from hashlib import sha256
from importlib import import_module, metadata
from pathlib import Path

SUFFIXES = (".py", ".j2", ".toml", ".h", ".c")
HOMES = ("linkwise", "linkwise.templates", "linkwise_runtime")
BUILT = "build"
"""Folder where building the runtime's own wheel leaves a copy of it."""
MAKERS = ("linkwise", "sympy", "mujoco")


@cache
def fingerprint() -> str:
    """Return the hash of linkwise's own files by content: the same on every machine with this linkwise."""
    digest = sha256()
    for path in _own_files():
        digest.update(path.read_bytes())
    return digest.hexdigest()


@cache
def _own_files() -> tuple[Path, ...]:
    folders = [Path(str(import_module(home).__file__)).parent for home in HOMES]
    return tuple(
        path
        for folder in folders
        for path in sorted(folder.rglob("*"))
        if path.suffix in SUFFIXES and path.relative_to(folder).parts[0] != BUILT
    )


def generator_files() -> Iterator[str]:
    """Yield the paths of linkwise's own files, and of the records of the packages that took part."""
    yield from (path.as_posix() for path in _own_files())
    for name in MAKERS:
        if name in sys.modules:
            yield from _record(name)


@cache
def _record(distribution: str) -> tuple[str, ...]:
    """Return the paths of METADATA of an installed package; none for one that was never installed.

    Beside the record there may be what setuptools leaves in a source tree, which has none.
    """
    return tuple(
        Path(str(found.locate_file(file))).as_posix()
        for found in metadata.distributions(name=distribution)
        for file in found.files or []
        if file.name == "METADATA" and len(file.parts) == 2
    )
