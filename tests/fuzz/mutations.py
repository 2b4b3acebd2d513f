"""Valid files made invalid: trees of data, XML, lines of text and bytes, a few changes at a time."""

import copy
import math
import re
import string
from collections.abc import Iterator
from random import Random
from typing import Any
from xml.etree import ElementTree

NUMBERS = (
    0, -1, 1, 2, 10**30, 10**400, -(10**18), 1e-320, 1e-9, 0.5, 1e16, 1e150, 1e308, -1e308, math.nan,
    math.inf, -math.inf,
)  # fmt: skip
TEXTS = (
    "", " ", "\t", "\n", "a\nb", "\x00", "\x07\x1b[31mred", "\x7f", "\x85", "\u2028", "\u202egnp.exe",
    "\ufeff", "ÅÄÖ", "関節", "é" * 300, "a" * 1500, "a b c", "../../up", "/etc/passwd", "..", ".", "CON", "~",
    "$HOME", "{{ x }}", "{x}", "{% raw %}", "%s%n", "'", '"', "\\", "\\input{x}", "$x_1^2$", "<b>bold</b>",
    "</script>", "&amp;", "]]>", "|", "`ls`", "# x", "nan", "inf", "-inf", "1e400", "1" * 400, "1" * 5000,
    "0x1F", "1_000", "١٢٣", "1,5", "1e", "--1", "true", "None", "pi", "1/0", "pi**8", "9**9**9", "x",
    "(" * 180 + "1" + ")" * 180, "-" * 190 + "1", "__import__('os')", "sin(1)", "sqrt(-1)", "a=1", "base",
    "joint1", "joint1 link", "joint1_x", "class", "numpy", "floating", "planar", "ball", "fixed", "screw",
    "revolute", "0 0 0", "1 2", "0 0 1e-300", "1e200 1e200 0", "nan 0 0",
)  # fmt: skip
MARKS = tuple("\x00\x07\x1b\x7f\x85\u2028\ufeff\"'<>&[]{}=,;\t\n\r#\\-+.0e")
NUMBER = re.compile(r"-?\d+(\.\d+)?(e-?\d+)?")
FACTORS = (-1.0, 1e-14, 1e-7, 1e-3, 1e3, 1e7, 1e14, 1e100)
DEEP = (10, 100, 1000)


def mutated_data(rng: Random, data: Any) -> Any:
    """A tree of dicts and lists with up to four changes in it."""
    data = copy.deepcopy(data)
    for _ in range(rng.randint(1, 4)):
        _change_data(rng, data)
    return data


def _places(data: Any) -> Iterator[tuple[Any, Any]]:
    """(holder, key) of every value in a tree."""
    for key in list(data) if isinstance(data, dict) else range(len(data)):
        yield data, key
        if isinstance(data[key], dict | list):
            yield from _places(data[key])


def _change_data(rng: Random, data: Any) -> None:
    places = list(_places(data))
    if not places:
        return
    at, key = rng.choice(places)
    match rng.randrange(9):
        case 0:
            del at[key]
        case 1 if isinstance(at, list):
            at.append(copy.deepcopy(at[key]))
        case 1:
            at[rng.choice(TEXTS)] = at.pop(key)
        case 2 if isinstance(at, list):
            rng.shuffle(at)
        case 3:
            value = at[key]
            for _ in range(rng.choice(DEEP[:2])):
                value = [value] if rng.random() < 0.5 else {"x": value}
            at[key] = value
        case 4:
            other, there = rng.choice(places)
            at[key] = copy.deepcopy(other[there])
        case 5 | 6 if isinstance(at[key], float):
            at[key] *= rng.choice(FACTORS)
        case _:
            at[key] = odd_value(rng)


def odd_value(rng: Random) -> Any:
    """A number, a text, or another kind of value."""
    return rng.choice(
        (rng.choice(NUMBERS), rng.choice(TEXTS), rng.choice((None, True, [], {}, [1, 2, 3], [[]])))
    )


def mutated_xml(rng: Random, text: str) -> str:
    """XML with elements deleted, doubled, moved, renamed, nested or given odd attributes."""
    root = ElementTree.fromstring(text.encode())
    for _ in range(rng.randint(1, 4)):
        _change_xml(rng, root)
    return ElementTree.tostring(root, encoding="unicode")


def _change_xml(rng: Random, root: ElementTree.Element) -> None:
    elements = list(root.iter())
    parent = rng.choice([element for element in elements if len(element)] or [root])
    other = rng.choice(elements)
    child = rng.choice(list(parent)) if len(parent) else other
    match rng.randrange(9):
        case 0 if child in parent:
            parent.remove(child)
        case 1:
            parent.append(copy.deepcopy(child))
        case 2:
            other.append(copy.deepcopy(child))
        case 3:
            other.tag = rng.choice(elements).tag
        case 4:
            for _ in range(rng.choice(DEEP[:2])):
                other = ElementTree.SubElement(other, other.tag, other.attrib)
        case 5 if other.attrib:
            del other.attrib[rng.choice(list(other.attrib))]
        case 6:
            other.text = _xml_text(rng)
        case _:
            named = list(other.attrib) or [
                "name",
                "type",
                "xyz",
                "rpy",
                "value",
                "axis",
                "pos",
                "quat",
                "size",
            ]
            other.set(rng.choice(named), _xml_text(rng))


def _xml_text(rng: Random) -> str:
    """A text that XML can hold, for the rest is broken by `mutated_text`."""
    text = rng.choice((rng.choice(TEXTS), repr(rng.choice(NUMBERS))))
    return "".join(mark for mark in text if mark in "\t\n" or mark >= " ")


def mutated_text(rng: Random, text: str) -> str:
    """Lines deleted, doubled, swapped or cut, numbers and marks replaced."""
    for _ in range(rng.randint(1, 4)):
        lines = text.split("\n")
        at, other = rng.randrange(len(lines)), rng.randrange(len(lines))
        match rng.randrange(9):
            case 0:
                del lines[at]
            case 1:
                lines.insert(other, lines[at])
            case 2:
                lines[at], lines[other] = lines[other], lines[at]
            case 3:
                lines[at] = lines[at][: rng.randint(0, len(lines[at]))]
            case 4:
                lines = [*lines[:at], lines[at][: rng.randint(0, len(lines[at]))]]
            case 5:
                place = rng.randint(0, len(lines[at]))
                mark = rng.choice((*MARKS, rng.choice(string.printable)))
                lines[at] = lines[at][:place] + mark * rng.choice((1, 1, 1, 50, 2000)) + lines[at][place:]
            case 6:
                lines[at] = rng.choice(TEXTS)
            case _:
                numbers = list(NUMBER.finditer(lines[at]))
                if numbers:
                    found, put = (
                        rng.choice(numbers),
                        rng.choice((rng.choice(TEXTS), repr(rng.choice(NUMBERS)))),
                    )
                    lines[at] = lines[at][: found.start()] + put + lines[at][found.end() :]
        text = "\n".join(lines)
    return text


def mutated_bytes(rng: Random, content: bytes) -> bytes:
    """Bytes flipped, put in, taken out or moved, the end cut off."""
    data = bytearray(content)
    for _ in range(rng.choice((1, 1, 2, 8))):
        if not data:
            break
        at = rng.randrange(len(data))
        match rng.randrange(5):
            case 0:
                data[at] ^= 1 << rng.randrange(8)
            case 1:
                data[at] = rng.choice((0, 0xFF, 0x80, 0x0A, rng.randrange(256)))
            case 2:
                del data[at : at + rng.choice((1, 4, 100))]
            case 3:
                data[at:at] = data[at : at + rng.choice((1, 8, 200))]
            case _ if rng.random() < 0.3:
                del data[at:]
    return bytes(data)


def encoded(rng: Random, text: str) -> bytes:
    """A text's bytes: nearly always as UTF-8, else in another encoding or damaged."""
    chance = rng.random()
    content = text.encode("utf-8", "replace")
    if chance < 0.85:
        return content
    if chance < 0.92:
        return mutated_bytes(rng, content)
    return text.encode(rng.choice(("utf-8-sig", "utf-16", "utf-32", "latin-1", "cp1252")), "replace")
