"""What packages are made by: every file of linkwise counts, for whoever changes one.

For an upgrade there is the record that installers keep of a version: its path has the version in it, and so
is gone afterwards, whatever times the new files bring along. The same goes for SymPy, and for MuJoCo where it
read the robot.
"""

import sys
from collections.abc import Iterator
from importlib import import_module, metadata
from pathlib import Path

SUFFIXES = (".py", ".j2", ".toml", ".h", ".c")
HOMES = ("linkwise", "linkwise.templates")
MAKERS = ("linkwise", "sympy", "mujoco")


def generator_files() -> Iterator[str]:
    """Paths of linkwise's own files, and of the records of what took part."""
    for home in HOMES:
        folder = Path(str(import_module(home).__file__)).parent
        found = (path for path in folder.rglob("*") if path.suffix in SUFFIXES)
        yield from (path.as_posix() for path in sorted(found))
    for name in MAKERS:
        if name in sys.modules:
            yield from _record(name)


def _record(distribution: str) -> Iterator[str]:
    """METADATA of an installed package; nothing of one that was never installed.

    Beside the record there may be what setuptools leaves in a source tree, which has none.
    """
    for found in metadata.distributions(name=distribution):
        records = (file for file in found.files or [] if file.name == "METADATA" and len(file.parts) == 2)
        yield from (Path(str(found.locate_file(file))).as_posix() for file in records)
