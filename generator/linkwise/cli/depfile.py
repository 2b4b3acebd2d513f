"""Dependencies of a package's files, as make and ninja read them.

A package is made of the robot's file, of its own modules where it is one of Python, and of what
`generator_fingerprint` lists.
"""

import re
import sys
import sysconfig
from collections.abc import Iterable, Iterator
from importlib import import_module
from pathlib import Path, PurePath

from linkwise.errors import LinkwiseError
from linkwise.generator_fingerprint import HOMES

INSTALLED = {"site-packages", "dist-packages"}
SPOKEN = str.maketrans({" ": "\\ ", "#": "\\#", "$": "$$"})
UNFIT = re.compile(r"""[\x00-\x1f"&'*;<>?\[\\\]^`|:]|^~|\)$""")
"""Characters of a file's name that make or ninja cannot write, or that each writes in its own way."""
PATTERN = re.compile("[%=+!]")
"""Characters that change the meaning of a line of make that begins with a file's name."""


def depfile_text(targets: Iterable[str], inputs: Iterable[str]) -> str:
    """Return make's rule by which `targets` depend on `inputs`; raises LinkwiseError for an unfit name.

    Each input has an empty rule of its own too, as those of `gcc -MP`: one that is gone then means "make it
    again" and not an error.
    """
    names = [_spoken(name) for name in dict.fromkeys(inputs)]
    whole = " \\\n  ".join([" ".join(map(_spoken, targets)) + ":", *names])
    alone = "".join(f"{name}:\n" for name in names if not PATTERN.search(name))
    return f"{whole}\n{alone}"


def own_modules(before: Iterable[str]) -> Iterator[str]:
    """Yield the files of modules that a file of energies imported since `before`.

    Python's own and installed modules are left out.
    """
    places = [Path(sysconfig.get_path("stdlib")), Path(sysconfig.get_path("platstdlib"))]
    places += [Path(str(import_module(home).__file__)).parent for home in HOMES]
    for name in sorted(sys.modules.keys() - set(before)):
        path = Path(getattr(sys.modules[name], "__file__", None) or "")
        installed = INSTALLED.intersection(path.parts) or any(map(path.is_relative_to, places))
        if path.suffix == ".py" and path.is_file() and not installed:
            yield path.as_posix()


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
