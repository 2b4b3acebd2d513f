"""An XML file's elements and their places in its bytes: a few numbers change, and all else stays."""

import re
from collections.abc import Iterable, Mapping
from typing import NamedTuple
from xml.etree.ElementTree import Element, TreeBuilder
from xml.parsers import expat
from xml.sax.saxutils import escape, quoteattr

NAME = re.compile(rb"<[^\s/>]+")
ATTRIBUTE = re.compile(rb"""\s+([^\s=]+)\s*=\s*("[^"]*"|'[^']*')""")
COMMENT = re.compile(rb"<!--.*?-->", re.DOTALL)
TAG_END = re.compile(rb"\s*(/?)>")


class Edit(NamedTuple):
    """New text for the bytes from `start` to `stop`."""

    start: int
    stop: int
    text: bytes


class ElementBytes(NamedTuple):
    """Places in an element's bytes: where its tag begins, its tag ends, its content ends, and it ends.

    For an element that is closed at once, such as <a/>, the tag ends behind its attributes, and its content
    ends there too.
    """

    start: int
    inside: int
    inside_stop: int
    stop: int


class PlacedXml:
    """A file that has already been read as XML, its `root`, and the places of its elements."""

    def __init__(self, data: bytes, as_xml: bytes | None = None) -> None:
        """Read the elements of `data` and their places.

        as_xml: valid XML, byte for byte in the same places, where a reader accepts data that are not quite
        XML
        """
        self.data = data if as_xml is None else as_xml
        reader = _Reader(self.data)
        self.root, self._places = reader.root, reader.places
        self._own = data

    def with_attributes(self, element: Element, values: Mapping[str, str | None]) -> list[Edit]:
        """Give an element these attributes, in their places or behind the others; None removes one."""
        at = _behind(NAME, self.data, self._places[element].start)
        edits, left = [], dict(values)
        while found := ATTRIBUTE.match(self.data, at):
            at, key = found.end(), found[1].decode()
            if key in left:
                value = left.pop(key)
                place = found.span() if value is None else found.span(2)
                edits.append(Edit(*place, b"" if value is None else quoteattr(value).encode()))
        more = "".join(f" {key}={quoteattr(value)}" for key, value in left.items() if value is not None)
        return [*edits, Edit(at, at, more.encode())] if more else edits

    def with_text(self, element: Element, text: str) -> Edit:
        """Give an element without child elements this text; blanks and comments around it stay."""
        place = self._places[element]
        if place.inside == place.inside_stop:
            return self.with_children(element, [], text)
        inside = self.data[place.inside : place.inside_stop]
        bare = COMMENT.sub(lambda comment: b" " * len(comment[0]), inside)
        start, stop = len(bare) - len(bare.lstrip()), len(bare.rstrip())
        comments = b" ".join(COMMENT.findall(inside, start, stop))  # comments amid the text
        return Edit(
            place.inside + start,
            place.inside + max(start, stop),
            b" ".join(filter(None, [escape(text).encode(), comments])),
        )

    def with_children(self, parent: Element, tags: Iterable[str], text: str = "") -> Edit:
        """Add elements, given as text, behind the children of a parent, with the same indentation."""
        place, last = self._places[parent], next(reversed(parent), None)
        if last is not None:
            own = self._places[last]
            before = self.data[: own.start]
            blanks = before[len(before.rstrip()) :]
            return Edit(own.stop, own.stop, b"".join(blanks + tag.encode() for tag in tags))
        inside = escape(text).encode() + "".join(tags).encode()
        if place.inside_stop < place.stop and self.data[place.inside_stop : place.inside_stop + 2] == b"</":
            return Edit(place.inside_stop, place.inside_stop, inside)
        return Edit(place.inside, place.stop, b">" + inside + f"</{parent.tag}>".encode())

    def apply_edits(self, edits: Iterable[Edit]) -> bytes:
        """Return the file with edits that do not overlap."""
        data = self._own
        for edit in sorted(edits, reverse=True):
            data = data[: edit.start] + edit.text + data[edit.stop :]
        return data


class _Reader:
    """Builds the elements, and collects their places."""

    def __init__(self, data: bytes) -> None:
        self.data, self.places = data, dict[Element, ElementBytes]()
        self.builder, self.open = TreeBuilder(), list[tuple[Element, int, int, bool]]()
        self.parser = expat.ParserCreate()
        self.parser.StartElementHandler = self.start
        self.parser.EndElementHandler = self.end
        self.parser.CharacterDataHandler = self.builder.data
        self.parser.Parse(data, True)
        self.root: Element = self.builder.close()

    def start(self, tag: str, attributes: dict[str, str]) -> None:
        at = _behind(NAME, self.data, start := self.parser.CurrentByteIndex)
        while more := ATTRIBUTE.match(self.data, at):
            at = more.end()
        tag_end = TAG_END.match(self.data, at)
        assert tag_end is not None
        closed = bool(tag_end[1])
        self.open.append(
            (self.builder.start(tag, attributes), start, at if closed else tag_end.end(), closed)
        )

    def end(self, tag: str) -> None:
        element, start, inside, closed = self.open.pop()
        self.builder.end(tag)
        inside_stop = inside if closed else self.parser.CurrentByteIndex
        self.places[element] = ElementBytes(
            start, inside, inside_stop, self.data.index(b">", inside_stop) + 1
        )


def _behind(pattern: re.Pattern[bytes], data: bytes, start: int) -> int:
    found = pattern.match(data, start)
    assert found is not None
    return found.end()


def tag(name: str, values: Mapping[str, str]) -> str:
    """Return an element as text, with attributes only."""
    return f"<{name}{''.join(f' {key}={quoteattr(value)}' for key, value in values.items())}/>"
