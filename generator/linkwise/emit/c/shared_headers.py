"""Headers that are the same for every robot, in a folder of their own: those that its files include."""

import re
from collections.abc import Iterable, Iterator
from importlib import resources

FOLDER = "linkwise"
"""Of a package's C."""
INCLUDED = re.compile(rf'^#include "{FOLDER}/(\w+\.h)"', re.MULTILINE)
INNER = re.compile(r'^#include "(\w+\.h)"', re.MULTILINE)
"""Of headers beside the file that includes them: of each other, and of a robot's own."""


def with_headers(files: Iterable[tuple[str, str]]) -> Iterator[tuple[str, str]]:
    """A robot's C, paths inside the package and texts, and the headers that it includes, or that these do."""
    left, found = [], dict[str, str]()
    for path, text in files:
        yield path, text
        left += INCLUDED.findall(text)
    while left:
        file = left.pop()
        if file not in found:
            found[file] = resources.files("linkwise").joinpath("c", file).read_text(encoding="utf-8")
            left += INNER.findall(found[file])
    for file in sorted(found):
        yield f"c/{FOLDER}/{file}", found[file]
