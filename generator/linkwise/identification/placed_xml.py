"""An XML file's elements and their places in its bytes: a few attributes change, and all else stays."""

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import NamedTuple
from xml.parsers import expat
from xml.sax.saxutils import quoteattr

from linkwise.errors import LinkwiseError

NAME = re.compile(rb"<[^\s/>]+")
ATTRIBUTE = re.compile(rb"""\s+([^\s=]+)\s*=\s*("[^"]*"|'[^']*')""")
TAG_END = re.compile(rb"\s*(/?)>")
BLANKS = re.compile(rb"\s*\Z")


class Edit(NamedTuple):
    """What stands in the place of the bytes from `start` to `stop`."""

    start: int
    stop: int
    text: bytes


@dataclass(frozen=True)
class PlacedElement:
    """An element from byte `start` to `stop`; `inside` are the elements in it."""

    tag: str
    attributes: Mapping[str, str]
    start: int
    stop: int
    inside: tuple["PlacedElement", ...]

    def every(self, tag: str) -> tuple["PlacedElement", ...]:
        """Those right inside it of a tag."""
        return tuple(element for element in self.inside if element.tag == tag)

    def first(self, tag: str) -> "PlacedElement | None":
        """The first of them."""
        return next(iter(self.every(tag)), None)


class _Reader:
    """Gathers elements, the innermost first."""

    def __init__(self, data: bytes) -> None:
        self.data = data
        self.parser = expat.ParserCreate()
        self.parser.StartElementHandler = self.start
        self.parser.EndElementHandler = self.end
        self.open: list[tuple[str, dict[str, str], int]] = []
        self.inside: list[list[PlacedElement]] = [[]]

    def start(self, tag: str, attributes: dict[str, str]) -> None:
        self.open.append((tag, attributes, self.parser.CurrentByteIndex))
        self.inside.append([])

    def end(self, _: str) -> None:
        (tag, attributes, start), inside = self.open.pop(), tuple(self.inside.pop())
        tag_end = TAG_END.match(self.data, _behind_attributes(self.data, start))
        assert tag_end is not None
        at = tag_end.start() if tag_end[1] else self.parser.CurrentByteIndex
        stop = self.data.index(b">", at) + 1
        self.inside[-1].append(PlacedElement(tag, attributes, start, stop, inside))


def placed_elements(data: bytes) -> PlacedElement:
    """The root of a file that has been read as XML already; raises LinkwiseError for UTF-16."""
    if b"\0" in data:
        raise LinkwiseError("not UTF-8 text, which alone is written back; save it as UTF-8")
    reader = _Reader(data)
    reader.parser.Parse(data, True)
    return reader.inside[0][0]


def with_attributes(data: bytes, element: PlacedElement, values: Mapping[str, str]) -> list[Edit]:
    """Give an element these attributes: in their places where it has them, else behind the others."""
    name = NAME.match(data, element.start)
    assert name is not None
    edits, left, at = [], dict(values), name.end()
    while found := ATTRIBUTE.match(data, at):
        at = found.end()
        if (value := left.pop(found[1].decode(), None)) is not None:
            edits.append(Edit(found.start(2), found.end(2), quoteattr(value).encode()))
    more = "".join(f" {key}={quoteattr(value)}" for key, value in left.items())
    return [*edits, Edit(at, at, more.encode())] if more else edits


def with_child(data: bytes, parent: PlacedElement, tag: str, values: Mapping[str, str]) -> Edit:
    """Put an element behind those of a parent that has some, on a line of its own where they have lines."""
    last = parent.inside[-1]
    blanks = BLANKS.search(data, 0, last.start)
    assert blanks is not None
    attributes = "".join(f" {key}={quoteattr(value)}" for key, value in values.items())
    return Edit(last.stop, last.stop, blanks[0] + f"<{tag}{attributes}/>".encode())


def edited(data: bytes, edits: Iterable[Edit]) -> bytes:
    """The file with edits that do not overlap."""
    for edit in sorted(edits, reverse=True):
        data = data[: edit.start] + edit.text + data[edit.stop :]
    return data


def _behind_attributes(data: bytes, start: int) -> int:
    found = NAME.match(data, start)
    assert found is not None
    at = found.end()
    while more := ATTRIBUTE.match(data, at):
        at = more.end()
    return at
