"""Names of a format's elements and attributes: a name that is misspelt is not passed over.

An unknown name near one that is read is refused, as its content, for example a mass, would vanish. Any other
is noted with its place, and reported wherever the robot is used; so is an element that says how a robot moves
but stands where nothing reads it, for example an <inertial> within a <visual>. Names with a namespace are
extensions.
"""

from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field
from functools import lru_cache
from typing import TypeAlias
from xml.etree.ElementTree import Element

from linkwise.errors import LinkwiseError
from linkwise.escape import short
from linkwise.robot.notes import Note

FAR = 3
"""Number of wrong letters that make it another name."""
SHORT = 6
"""Shortest name, in letters, of which two may be wrong."""

Names: TypeAlias = frozenset[str]


def names(text: str) -> Names:
    """Return the names in a list with spaces between them."""
    return frozenset(text.split())


@dataclass(frozen=True)
class Known:
    """Names that an element may hold: children that are read `once` or `many` times, and attributes.

    idle: children and attributes that are known not to load a joint, or whose loads are reported by
    themselves
    """

    once: Names = frozenset()
    many: Names = frozenset()
    attributes: Names = frozenset()
    idle: Names = field(default=frozenset())


STRAYS = names("model link joint inertial mass inertia mimic dynamics")
"""Elements that describe how a robot moves; they are looked for where nothing is read."""
FOREIGN = names("actor components gazebo loop_joint plugin population ros2_control state transmission")
"""Elements in which such names mean something else, or are reported by themselves."""

Place: TypeAlias = tuple[str, ...]
"""Path to an element, from the nearest around it that has a name inwards."""
Vocabulary: TypeAlias = Callable[[Element], Known | None]
"""Function that gives the names known in an element; None for one that is not looked into."""


@dataclass(frozen=True)
class _Unread:
    """Names that are not read: counts of those that are known, and places of those that are not."""

    idle: Counter[str] = field(default_factory=Counter)
    unknown: dict[str, list[Place]] = field(default_factory=dict)

    def add(self, what: str, place: Place, count: int = 1) -> None:
        """Add an unknown name at a place, `count` times."""
        self.unknown.setdefault(what, []).extend([place] * count)


def ignored(elements: Iterable[Element], known: Vocabulary, format: str) -> tuple[Note, ...]:
    """Return a note, with a count, for each kind of child and attribute that is not read.

    An unknown one is noted with its place. Raises LinkwiseError for a name near one that is read, and for a
    second child where one is read.
    """
    unread = _Unread()
    for element in elements:
        _look_into(element, known, (), unread)
    effect = f"ignored, as {format} has no such name there"
    return (
        *(Note("ignored", what, f"{count} ×") for what, count in sorted(unread.idle.items())),
        *(Note("ignored", what, _times(places), effect) for what, places in sorted(unread.unknown.items())),
    )


def _times(places: list[Place]) -> str:
    """Return in words how often something occurs, and where first."""
    return f"{len(places)} ×{' first' if len(places) > 1 else ''} in {' of '.join(reversed(places[0]))}"


def _look_into(element: Element, known: Vocabulary, outside: Place, unread: _Unread) -> None:
    here = known(element)
    if here is None:
        return
    name = element.get("name")
    path = (*outside, f"<{element.tag}>") if name is None else (f"{element.tag} {short(repr(name))}",)
    inside, read = ", ".join(path), here.once | here.many
    seen = Counter(str(child.tag) for child in element)
    for tag, count in seen.items():
        if tag in here.once and count > 1:
            raise LinkwiseError(f"{inside} has <{tag}> {count} times; keep one")
        if local_name(tag) in here.idle:
            unread.idle[local_name(tag)] += count
        elif tag not in read:
            refuse_misspelt(inside, f"<{short(tag)}>", tag, {f"<{name}>": name for name in read})
            unread.add(_shown(tag), path, count)
    for key in element.attrib:
        if key not in here.attributes | here.idle:
            refuse_misspelt(inside, f"{short(key)}=…", key, {f"{a}=…": a for a in here.attributes})
            unread.add(f"{_shown(key)} of <{element.tag}>", path if name is not None else outside or path)
    for child in element:
        if child.tag in read:
            _look_into(child, known, path, unread)
        elif local_name(child.tag) in here.idle:
            for tag in _strays(child):
                unread.add(tag, (*path, f"<{local_name(child.tag)}>"))


def _strays(element: Element) -> Iterator[str]:
    """Yield tags in an element that is not read which elsewhere would describe how the robot moves."""
    for child in element if local_name(element.tag) not in FOREIGN else ():
        if child.tag in STRAYS:
            yield child.tag
        else:
            yield from _strays(child)


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
    """Return a name without its namespace."""
    return name.rpartition("}")[2].rpartition(":")[2]


def _shown(name: str) -> str:
    """Return a name with its namespace behind it."""
    space, _, rest = name.removeprefix("{").rpartition("}")
    return f"{rest} of {space}" if space else rest


@lru_cache
def _distance(a: str, b: str) -> int:
    """Return the count of letters to insert, leave out, change, or swap with the next, to make a into b."""
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
