"""What the files of a package depend on, as make and ninja read it.

A package is made of the robot's file and of linkwise. Of linkwise every file counts, for whoever changes one,
and the record that installers keep of a version, for an upgrade: its path has the version in it, and so is
gone afterwards, whatever times the new files bring along. The same goes for SymPy, and for MuJoCo where it
read the robot.
"""

import re
import sys
import sysconfig
from collections.abc import Iterable, Iterator
from importlib import import_module, metadata
from pathlib import Path, PurePath

from linkwise.errors import LinkwiseError

SUFFIXES = (".py", ".j2", ".toml", ".h", ".c")
HOMES = ("linkwise", "linkwise.templates")
MAKERS = ("linkwise", "sympy", "mujoco")
INSTALLED = {"site-packages", "dist-packages"}
SPOKEN = str.maketrans({" ": "\\ ", "#": "\\#", "$": "$$"})
UNFIT = re.compile(r"""[\x00-\x1f"&'*;<>?\[\\\]^`|:]|^~|\)$""")
"""What make or ninja has no way to say in a file's name, or each a way of its own."""
PATTERN = re.compile("[%=+!]")
"""What makes something else of a line of make that begins with a file's name."""


def depfile_text(targets: Iterable[str], inputs: Iterable[str]) -> str:
    """Say in make's syntax that `targets` are made of `inputs`; raises LinkwiseError for an unfit name.

    Each input has an empty rule of its own too, as those of `gcc -MP`: one that is gone then means "make it
    again" and not an error.
    """
    names = [_spoken(name) for name in dict.fromkeys(inputs)]
    whole = " \\\n  ".join([" ".join(map(_spoken, targets)) + ":", *names])
    alone = "".join(f"{name}:\n" for name in names if not PATTERN.search(name))
    return f"{whole}\n{alone}"


def generator_files() -> Iterator[str]:
    """Paths of linkwise's own files, and of the records of what took part."""
    for home in HOMES:
        folder = Path(str(import_module(home).__file__)).parent
        found = (path for path in folder.rglob("*") if path.suffix in SUFFIXES)
        yield from (path.as_posix() for path in sorted(found))
    for name in MAKERS:
        if name in sys.modules:
            yield from _record(name)


def own_modules(before: Iterable[str]) -> Iterator[str]:
    """Files of modules that a file of energies imported since `before`, not Python's own nor installed."""
    places = [Path(sysconfig.get_path("stdlib")), Path(sysconfig.get_path("platstdlib"))]
    places += [Path(str(import_module(home).__file__)).parent for home in HOMES]
    for name in sorted(sys.modules.keys() - set(before)):
        path = Path(getattr(sys.modules[name], "__file__", None) or "")
        installed = INSTALLED.intersection(path.parts) or any(map(path.is_relative_to, places))
        if path.suffix == ".py" and path.is_file() and not installed:
            yield path.as_posix()


def _record(distribution: str) -> Iterator[str]:
    """METADATA of an installed package; nothing of one that was never installed.

    Beside the record there may be what setuptools leaves in a source tree, which has none.
    """
    for found in metadata.distributions(name=distribution):
        records = (file for file in found.files or [] if file.name == "METADATA" and len(file.parts) == 2)
        yield from (Path(str(found.locate_file(file))).as_posix() for file in records)


def _spoken(name: str) -> str:
    path = PurePath(name)
    drive = path.drive if path.is_absolute() else ""  # C:/arm of Windows, where alone make takes its colon
    wrong = UNFIT.search(name.removeprefix(drive))
    if wrong is not None:
        raise LinkwiseError(
            f"--depfile: {name!r} has {wrong[0]!r} in it, which make and ninja cannot read; rename it, or "
            "leave --depfile out"
        )
    return name.translate(SPOKEN)
