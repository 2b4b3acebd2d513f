"""Headers that are the same for every robot, in a folder of their own, as its files include them."""

import re
from collections.abc import Iterable, Iterator
from importlib import resources

from linkwise.package.own_files import LICENSE

FOLDER = "linkwise"
"""Folder of these headers in a package's C."""
INCLUDED = re.compile(rf'^#include "{FOLDER}/(\w+\.h)"', re.MULTILINE)
INNER = re.compile(r'^#include "(\w+\.h)"', re.MULTILINE)
"""Pattern of headers beside the file that includes them: shared ones, and a robot's own."""


def with_headers(files: Iterable[tuple[str, str]]) -> Iterator[tuple[str, str]]:
    """Yield a robot's C, paths inside the package and texts, and all headers that it includes.

    Headers that these include are among them, and the licence of all.
    """
    left, found = [], dict[str, str]()
    for path, text in files:
        yield path, text
        left += INCLUDED.findall(text)
    while left:
        file = left.pop()
        if file not in found:
            found[file] = resources.files("linkwise").joinpath("c", file).read_text(encoding="utf-8")
            left += INNER.findall(found[file])
    if found:
        found[LICENSE] = resources.files("linkwise_runtime").joinpath(LICENSE).read_text(encoding="utf-8")
    for file in sorted(found):
        yield f"c/{FOLDER}/{file}", found[file]
