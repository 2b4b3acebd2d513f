"""Check of a package's own files, read as text before anything of them runs.

A hash shows that a file is as its manifest lists it, not that it came from here: whoever sends a package can
write both anew. What linkwise emits is limited to arithmetic, sines and the like, and records of its runtime.
So these files are read by that small grammar, and refused with the line where they say anything else. Files
that are the same in every package are compared with those of this version, byte for byte.
"""

from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

from linkwise_runtime.version import VERSION

from linkwise.package.emitted_c import foreign_c, foreign_includes
from linkwise.package.emitted_python import foreign_python
from linkwise.package.manifest import Manifest
from linkwise.package.own_files import own_text
from linkwise.package.runtime_imports import is_copied

READ = frozenset(("formulas.txt", "formulas.tex", "py.typed"))
"""Files that nothing runs."""


def foreign(directory: Path, manifest: Manifest) -> list[str]:
    """Return what in a package's files linkwise does not write, each with its file and line.

    The list is empty if there is nothing. Raises OSError for a file that cannot be read.
    """
    source = Source.of(manifest)
    found = []
    for path in manifest.files:
        told = foreign_text(path, (directory / path).read_bytes(), source)
        found += [] if told is None else [f"{path} {told}"]
    return found


@dataclass(frozen=True)
class Source:
    """A manifest's description of the package that a file belongs to.

    version: the linkwise that wrote it; files of another's runtime are not at hand to compare with
    files: paths of all that are listed
    """

    name: str
    version: str | None
    files: frozenset[str]

    @classmethod
    def of(cls, manifest: Manifest) -> "Source":
        """Return the description in a package's manifest."""
        return cls(manifest.name, manifest.generator.get("linkwise"), frozenset(manifest.files))


@lru_cache(maxsize=1024)
def foreign_text(path: str, text: bytes, source: Source) -> str | None:
    """Return what in one file of a package linkwise does not write, without the path; None if nothing."""
    own, ending = own_text(path), path.rpartition(".")[2]
    try:
        if own is not None or is_copied(path):
            if source.version == VERSION and own != text:
                return f"is not that of linkwise {VERSION}"
        elif ending == "py":
            return next(foreign_python(path, text), None)
        elif ending not in ("h", "c"):
            return None if path in READ else "is no file that linkwise writes"
        elif told := next(foreign_c(text.decode(), source.name), None):
            return told
        # C of the runtime is compiled with Python's headers.
        in_c = ending in ("h", "c") and not is_copied(path)
        folder = path.rpartition("/")[0]
        return next(foreign_includes(text.decode(), folder, source.files), None) if in_c else None
    except (RecursionError, MemoryError):  # the last by Python's parser
        return "cannot be read (it is nested too deeply)"
    except (SyntaxError, ValueError) as error:
        return f"cannot be read ({' '.join(str(error).split())})"
