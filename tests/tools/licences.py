"""Write docs/licences.md's tables from what installed packages say of themselves: `make licences`.

Only packages that are installed can be asked: run it where all extras are.
"""

import re
import sys
from collections.abc import Sequence
from importlib.metadata import Distribution
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

from helpers.installation import needs_of

PAGE = Path(__file__).parents[2] / "docs/licences.md"
MARK = "<!-- from here on by `make licences` -->\n"
USERS = (
    "",
    "torch",
    "onnx",
    "mjcf",
    "motion",
    "logs",
    "identify",
    "names",
    "markers",
    "study",
    "ray",
    "opensim",
)
BINDING = ("spm",)
"""Extras whose packages bind the programs that use them; `all` brings none of these."""
DEVELOPERS = ("docs", "release", "test", "lint")
NOT_LISTED = re.compile(r"linkwise$|(nvidia|cuda|triton)\b")
"""linkwise itself, and what PyTorch brings for GPUs of one maker, of which the page says a line."""


def licence(package: Distribution) -> str:
    """Return what a package's metadata say: the expression, else the classifiers, else the text if it is a
    name."""
    metadata = package.metadata
    if expression := metadata.get("License-Expression"):
        return str(expression)
    classifiers = [c for c in metadata.get_all("Classifier") or () if c.startswith("License :: ")]
    if named := [c for c in classifiers if c != "License :: OSI Approved"]:  # which names none
        return " or ".join(sorted(c.rpartition(" :: ")[2].replace(" License", "") for c in named))
    lines = (metadata.get("License") or "").strip().splitlines()
    return lines[0] if len(lines) == 1 else "in its files"


def name_of(package: Distribution) -> str:
    """Return a package's name as indexes write it."""
    return re.sub(r"[-_.]+", "-", package.name).lower()


def packages_of(extras: Sequence[str]) -> dict[str, Distribution]:
    """Return what these extras bring, or the core for "", by name."""
    found = {name_of(package): package for package in needs_of(f"linkwise[{extra}]" for extra in extras)}
    return {name: package for name, package in sorted(found.items()) if not NOT_LISTED.match(name)}


def rows() -> dict[str, tuple[str, str]]:
    """Return the licence of each package that is installed for linkwise, and the first that brings it."""
    found: dict[str, tuple[str, str]] = {}
    for extra in (*USERS, *BINDING, *DEVELOPERS):
        for name, package in packages_of([extra]).items():
            found.setdefault(name, (licence(package), extra or "core"))
    return found


def tables() -> str:
    """Tables of what users get, of what binds them, and of what linkwise's own tests and checks need."""
    texts = []
    groups = {
        "What users install": ("core", *USERS[1:]),
        "What binds programs that use it": BINDING,
        "What developers add": DEVELOPERS,
    }
    for title, extras in groups.items():
        lines = [f"## {title}\n", "| package | licence | for |", "|---|---|---|"]
        for extra in extras:
            lines += [f"| {name} | {text} | {own} |" for name, (text, own) in rows().items() if own == extra]
        texts.append("\n".join(lines) + "\n")
    return "\n".join(texts)


if __name__ == "__main__":
    before = PAGE.read_text(encoding="utf-8").partition(MARK)[0]
    PAGE.write_text(f"{before}{MARK}\n{tables()}", encoding="utf-8")
    sys.exit(0)
