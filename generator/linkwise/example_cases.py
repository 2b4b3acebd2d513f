"""Whole cases to try linkwise on: a robot, a movement, what acts on it, and what to type.

They are data of the package `linkwise.examples`. SHA256SUMS there lists them, as `sha256sum` writes it, and
no file leaves the package that has another hash.
"""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from hashlib import sha256
from importlib.resources import files
from pathlib import Path

from linkwise.errors import LinkwiseError
from linkwise.output import refuse_unless_folder, whole_directory
from linkwise.package.contents import entries, faults
from linkwise.package.write import refuse_inside_package

HOME = "linkwise.examples"
SUMS = "SHA256SUMS"
README = "README.md"
ANOTHER = "give another --out"


@dataclass(frozen=True)
class ExampleCase:
    """A case: its name, and the SHA-256 of its files by name."""

    name: str
    files: Mapping[str, str]

    @property
    def title(self) -> str:
        """Headline of its README: what it is, in a line."""
        return self._readme.partition("\n")[0].removeprefix("# ")

    @property
    def first_command(self) -> tuple[str, ...]:
        """Lines of the first command that its README shows, which is to be typed in its folder."""
        shown = re.search(r"^```sh\n(.*?)^```", self._readme, re.MULTILINE | re.DOTALL)
        return tuple(shown[1].splitlines()) if shown else ()

    def content(self, name: str) -> bytes:
        """Return the bytes of a file; raises LinkwiseError where they are not those that linkwise brought."""
        try:
            found = files(HOME).joinpath(self.name, name).read_bytes()
        except OSError as error:
            raise LinkwiseError(
                f"example {self.name}: cannot read {name}: {error.strerror}; install linkwise again"
            ) from error
        if sha256(found).hexdigest() != self.files[name]:
            raise LinkwiseError(
                f"example {self.name}: {name} is not what was published; install linkwise again"
            )
        return found

    @property
    def _readme(self) -> str:
        return self.content(README).decode("utf-8")


@cache
def example_cases() -> Mapping[str, ExampleCase]:
    """Return all cases by name, in the order of their names."""
    found: dict[str, dict[str, str]] = {}
    for line in files(HOME).joinpath(SUMS).read_text(encoding="utf-8").splitlines():
        digest, _, path = line.partition("  ")
        name, _, file = path.partition("/")
        found.setdefault(name, {})[file] = digest
    return {name: ExampleCase(name, found[name]) for name in sorted(found)}


def example_case(name: str) -> ExampleCase:
    """Return the case of that name; raises LinkwiseError, which lists the names, where there is none."""
    cases = example_cases()
    if name not in cases:
        raise LinkwiseError(f"there is no example {name[:80]!a}; give one of {', '.join(cases)}")
    return cases[name]


def write_case(case: ExampleCase, target: Path) -> bool:
    """Write the files of a case into a folder that is new or empty, all or none, and return True.

    Where all of them are there already, whatever else is beside them, nothing is written, and False is
    returned. Raises LinkwiseError for anything else at `target`.
    """
    refuse_inside_package(target)
    if target.is_dir() and not target.is_symlink() and not faults(target, case.files):
        return False
    contents = {name: case.content(name) for name in case.files}
    with whole_directory(target, lambda place: _refuse_unless_empty(place, case)) as draft:
        for name, content in contents.items():
            (draft / name).write_bytes(content)
    return True


def _refuse_unless_empty(target: Path, case: ExampleCase) -> None:
    refuse_unless_folder(target, ANOTHER)
    if next(entries(target), None) is None:
        return
    wrong = faults(target, case.files)
    if len(wrong) < len(case.files):
        file, fault = next(iter(wrong.items()))
        raise LinkwiseError(f"{target} holds this example, but {file} {fault}; move it away, or {ANOTHER}")
    there = (one.name for one in example_cases().values() if len(faults(target, one.files)) < len(one.files))
    other = next(there, None)
    what = "is not empty" if other is None else f"holds the example {other}"
    raise LinkwiseError(f"{target} {what}; {ANOTHER}")
