"""Files that an MJCF file is made of: those that it includes or attaches, its meshes and its pictures."""

import os
import re
import stat
from collections.abc import Iterator
from contextlib import nullcontext
from dataclasses import dataclass, field
from html import unescape
from itertools import product
from pathlib import Path

from linkwise.errors import LinkwiseError, within
from linkwise.input_file import require_file
from linkwise.robot.readers.bounded import content
from linkwise.robot.readers.xml_file import LARGEST

NAMED = re.compile(rb"""\b(file|assetdir|meshdir|texturedir)\w*+\s*+=\s*+(?:"([^"]*)"|'([^']*)')""")
"""Names of files and their folders: MuJoCo reads what is not quite XML, so that no parser finds them."""
BEFORE_XML = b"\xef\xbb\xbf \t\r\n"
MOST = 100_000
"""Most places that are looked into; for a robot these are some hundred."""


@dataclass(frozen=True)
class MjcfFiles:
    """Files that are there: `documents` of XML, the robot's own first, and `others`, which these name."""

    documents: tuple[Path, ...]
    others: tuple[Path, ...]


def mjcf_files(path: Path) -> MjcfFiles:
    """Return all files that MuJoCo may open for a robot's file.

    MuJoCo looks for a name in some of the folders of the documents, and of those that their <compiler> gives;
    this looks in all of them. Raises LinkwiseError for far too large a document, and for a device or a pipe,
    for whose end MuJoCo would wait.
    """
    named, found = _NamedFiles(), {os.path.realpath(path): path}
    fresh = dict(found)
    while fresh:
        for file in fresh.values():
            with nullcontext() if file is path else within(str(file)):
                named.read(file)
        there = {os.path.realpath(file): file for file in named.there()}
        fresh = {real: file for real, file in there.items() if real not in found and _is_xml(file)}
        found |= fresh
    return MjcfFiles(tuple(found.values()), tuple(there[real] for real in there if real not in found))


@dataclass
class _NamedFiles:
    """Files that documents name, and the folders that they may be in; dictionaries keep the order."""

    folders: dict[Path, None] = field(default_factory=dict)
    below: dict[str, None] = field(default_factory=lambda: {"": None})
    """Paths below `folders`, as <compiler> gives them."""
    files: dict[str, None] = field(default_factory=dict)

    def read(self, path: Path) -> None:
        """Add the files that a document names.

        Raises LinkwiseError for far too large a document, and for too many places.
        """
        self.folders[path.parent] = None
        for kind, *quoted in NAMED.findall(content(path, LARGEST)):
            name = unescape(b"".join(quoted).decode("utf-8", "surrogateescape"))
            if kind == b"file":
                self.files |= dict.fromkeys((name, os.path.basename(name)))  # the latter by strippath
            else:
                self.below[name] = None
        if len(self.folders) * len(self.below) * len(self.files) > MOST:
            raise LinkwiseError(f"its files may be in more than {MOST:,} places; name fewer files or folders")

    def there(self) -> Iterator[Path]:
        """Yield the named files that exist; raises LinkwiseError for one without an end."""
        for folder, part, name in product(self.folders, self.below, self.files):
            path = folder / part / name
            try:
                mode = path.stat().st_mode
            except (OSError, ValueError):  # not there, or not a path at all
                continue
            if not stat.S_ISDIR(mode):
                with within(str(path)):
                    require_file(path)
                yield path


def _is_xml(path: Path) -> bool:
    """Return whether a file begins as XML does; other files that may be attached name no files."""
    with path.open("rb") as file:
        return file.read(1 << 10).lstrip(BEFORE_XML).startswith(b"<")
