"""What a format calls its elements and attributes: a name that is misspelt is not passed over.

Near a name that is read, an unknown one is refused, as what it holds, a mass say, would vanish. Any other is
noted, and told wherever the robot is used. Names with a namespace are extensions.
"""

from collections import Counter
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from functools import lru_cache
from typing import TypeAlias
from xml.etree.ElementTree import Element

from linkwise.errors import LinkwiseError
from linkwise.escape import short
from linkwise.robot.notes import Note

FAR = 3
"""Wrong letters that make another name of it."""
SHORT = 6
"""Letters from which on two may be wrong."""

Names: TypeAlias = frozenset[str]


def names(text: str) -> Names:
    """Names from a list with spaces between them."""
    return frozenset(text.split())


@dataclass(frozen=True)
class Known:
    """What an element may hold: children that are read `once` or `many` times, and attributes.

    idle: children and attributes that are known not to load a joint, or whose loads are told by themselves
    """

    once: Names = frozenset()
    many: Names = frozenset()
    attributes: Names = frozenset()
    idle: Names = field(default=frozenset())


Vocabulary: TypeAlias = Callable[[Element], Known | None]
"""What the format knows of an element; None for one that is not looked into."""


def ignored(elements: Iterable[Element], known: Vocabulary, format: str) -> tuple[Note, ...]:
    """A note for each kind of child and attribute that is not read, with how often.

    Raises LinkwiseError for a name near one that is read, and for a second child where one is read.
    """
    counts, unknown = Counter[str](), Counter[str]()
    for element in elements:
        _look_into(element, known, f"<{element.tag}>", counts, unknown)
    effect = f"ignored, as {format} has no such name"
    return (
        *(Note("ignored", what, f"{count} ×") for what, count in sorted(counts.items())),
        *(Note("ignored", what, f"{count} ×", effect) for what, count in sorted(unknown.items())),
    )


def _look_into(
    element: Element, known: Vocabulary, place: str, counts: Counter[str], unknown: Counter[str]
) -> None:
    here = known(element)
    if here is None:
        return
    inside = place if element.get("name") is None else f"{element.tag} {short(repr(element.get('name')))}"
    read = here.once | here.many
    seen = Counter(str(child.tag) for child in element)
    for tag, count in seen.items():
        if tag in here.once and count > 1:
            raise LinkwiseError(f"{inside} has <{tag}> {count} times; keep one")
        if local_name(tag) in here.idle:
            counts[local_name(tag)] += count
        elif tag not in read:
            refuse_misspelt(inside, f"<{short(tag)}>", tag, {f"<{name}>": name for name in read})
            unknown[_shown(tag)] += count
    for name in element.attrib:
        if name not in here.attributes | here.idle:
            refuse_misspelt(inside, f"{short(name)}=…", name, {f"{a}=…": a for a in here.attributes})
            unknown[f"{_shown(name)} of <{element.tag}>"] += 1
    for child in element:
        if child.tag in read:
            _look_into(child, known, f"{inside}, <{child.tag}>", counts, unknown)


def refuse_misspelt(place: str, shown: str, name: str, meant: dict[str, str]) -> None:
    """Raise LinkwiseError for a name near one that is meant, of those shown otherwise."""
    near = (
        (_distance(name.lower(), one.lower()), sorted(name) != sorted(one), as_shown, one)
        for as_shown, one in meant.items()
    )
    wrong, _, as_shown, one = min(near, default=(FAR, True, "", ""))
    if wrong <= (2 if len(one) >= SHORT else 1) and name == local_name(name):
        raise LinkwiseError(f"{place} has {shown}, which is not read; did you mean {as_shown}?")


def local_name(name: str) -> str:
    """A name without its namespace."""
    return name.rpartition("}")[2].rpartition(":")[2]


def _shown(name: str) -> str:
    """A name with its namespace behind it."""
    space, _, rest = name.removeprefix("{").rpartition("}")
    return f"{rest} of {space}" if space else rest


@lru_cache
def _distance(a: str, b: str) -> int:
    """Letters to put in, leave out, change, or exchange with the next, to make one of the other."""
    if abs(len(a) - len(b)) > FAR:
        return FAR
    if not a or not b:
        return len(a) + len(b)
    if a[0] == b[0]:
        return _distance(a[1:], b[1:])
    ways = [_distance(a[1:], b), _distance(a, b[1:]), _distance(a[1:], b[1:])]
    if a[:2] == b[1::-1]:
        ways.append(_distance(a[2:], b[2:]))
    return 1 + min(ways)
