"""Parsing of XML files within bounds, and the numbers of their attributes."""

from collections.abc import Callable
from pathlib import Path
from xml.etree.ElementTree import Element, ParseError, TreeBuilder

from defusedxml import DefusedXmlException
from defusedxml.ElementTree import DefusedXMLParser

from linkwise.bounded_file import MIB, content
from linkwise.errors import LinkwiseError

XACRO = "this is xacro, a language of macros; expand it first: xacro FILE > robot.urdf"
LARGEST = 4 * MIB
"""Largest size of a file, in bytes."""
MAX_DEPTH = 256
"""Deepest nesting of elements: MJCF nests the links of a chain."""

MACROS = ("${", "$(")


class _Builder(TreeBuilder):
    """Builder of the elements of a file that is neither deep nor full of macros."""

    def __init__(self) -> None:
        super().__init__()
        self.depth = 0

    def start(self, tag: str, attrs: dict[str, str]) -> Element:
        self.depth += 1
        if self.depth > MAX_DEPTH:
            raise LinkwiseError(
                f"malformed XML: elements more than {MAX_DEPTH} deep, which no robot's file needs"
            )
        namespace = tag.rpartition("}")[0]
        paths = ("filename", "file")
        texts = [value for name, value in attrs.items() if name not in paths]
        if "xacro" in namespace or any(macro in text for text in texts for macro in MACROS):
            raise LinkwiseError(XACRO)
        return super().start(tag, attrs)

    def end(self, tag: str) -> Element:
        self.depth -= 1
        return super().end(tag)


def parse(path: Path, largest: int = LARGEST, as_xml: Callable[[bytes], bytes] | None = None) -> Element:
    """Return the root element; raises LinkwiseError for malformed XML, and for xacro, to be expanded first.

    largest: most bytes of the file; as_xml: makes XML of a file that is not quite
    """
    return parse_text(content(path, largest), as_xml)


def parse_text(data: bytes, as_xml: Callable[[bytes], bytes] | None = None) -> Element:
    """Return the root element of a file's bytes, as `parse` does."""
    data = as_xml(data) if as_xml else data
    parser = DefusedXMLParser(target=_Builder())
    try:
        parser.feed(data)
        root: Element = parser.close()
    except DefusedXmlException:
        raise LinkwiseError(
            "malformed XML: it defines entities or refers to other files; write the text out"
        ) from None
    except LinkwiseError:
        raise
    except (ParseError, UnicodeDecodeError, ValueError, LookupError) as error:
        if b"<xacro:" in data:
            raise LinkwiseError(XACRO) from None
        raise LinkwiseError(f"malformed XML: {error}") from None
    return root


def numbers(element: Element, key: str, default: str, count: int, place: str) -> tuple[float, ...]:
    """Return the numbers of an attribute; raises LinkwiseError naming the element unless they are `count`."""
    text = element.get(key, default)
    try:
        values = tuple(float(item) for item in text.split())
    except ValueError:
        values = ()
    if len(values) != count:
        raise LinkwiseError(
            f"{place}: <{element.tag} {key}={text!r}> needs {count} number{'s' * (count > 1)}"
        )
    return values
