"""Numbers of values in a link's results, and their place among those of the robot."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from linkwise.dynamics.link_forms import LinkForms

ARRAYS = ("c2", "c1", "g", "tau", "h1")
"""Arrays of the decomposition in the order of the API; c0 has as many values as c1."""

GROUP = 384
"""Most values of a sample that wait in blocks at a time."""

TILE = 8
"""Blocks that one link's functions work on before the next link's do.

The links' functions of a robot of seven joints are some 40 kB of code, more than a first-level cache holds:
so they come from the second-level cache once per tile, in which its results, 192 KiB at most, wait too.
"""


@dataclass(frozen=True)
class EntryCounts:
    """A number of values, or a place, in each array; tau is as long as g, c0 as long as c1."""

    c2: int = 0
    c1: int = 0
    g: int = 0
    h1: int = 0

    def __add__(self, other: "EntryCounts") -> "EntryCounts":
        return EntryCounts(self.c2 + other.c2, self.c1 + other.c1, self.g + other.g, self.h1 + other.h1)

    def __sub__(self, other: "EntryCounts") -> "EntryCounts":
        return EntryCounts(self.c2 - other.c2, self.c1 - other.c1, self.g - other.g, self.h1 - other.h1)

    def of(self, array: str) -> int:
        """Return the number of values in an array, or where it begins."""
        return {
            "c2": self.c2,
            "c1": self.c1,
            "g": self.g,
            "tau": self.g,
            "h1": self.h1,
            "c0": self.c1,
        }[array]

    @property
    def total(self) -> int:
        """Values of all arrays together."""
        return sum(map(self.of, ARRAYS))

    @property
    def arrays(self) -> tuple[str, ...]:
        """Arrays that hold anything, h1 being empty where all is quadratic in the velocities."""
        return tuple(array for array in ARRAYS if self.of(array))


@dataclass(frozen=True)
class Span:
    """Consecutive links, counted from 1: how many values they have, and where these begin."""

    first: int
    last: int
    size: EntryCounts
    start: EntryCounts


def link_spans(links: Sequence[LinkForms]) -> tuple[Span, ...]:
    """Return each link by itself, in order."""
    spans: list[Span] = []
    start = EntryCounts()
    for number, forms in enumerate(links, 1):
        c2, c1, g, h1 = forms.acceleration, forms.velocity, forms.gravity, forms.velocity_excess
        size = EntryCounts(len(c2), len(c1), len(g), len(h1))
        spans.append(Span(number, number, size, start))
        start += size
    return tuple(spans)


def whole(links: Sequence[Span]) -> Span:
    """Return consecutive links as one."""
    return Span(links[0].first, links[-1].last, sum((k.size for k in links), EntryCounts()), links[0].start)


def tile(waiting: EntryCounts) -> int:
    """Return how many blocks are worked on at a time; fewer where a link has more than GROUP values."""
    return max(1, min(TILE, TILE * GROUP // max(waiting.total, 1)))


def groups(links: Sequence[Span]) -> Iterator[tuple[Span, ...]]:
    """Yield groups of links whose results stay in the cache, by block, until they turn into rows together.

    A group has at most GROUP values; a link that is larger is one by itself.
    """
    group: list[Span] = []
    for link in links:
        if group and whole(group).size.total + link.size.total > GROUP:
            yield tuple(group)
            group = []
        group.append(link)
    yield tuple(group)


def most_counts(sizes: Sequence[EntryCounts]) -> EntryCounts:
    """Return counts that are large enough for any of these."""
    return EntryCounts(*(max(size.of(array) for size in sizes) for array in ("c2", "c1", "g", "h1")))


def waiting_counts(links: Sequence[Span]) -> EntryCounts:
    """Return counts that are large enough for any group of links: what waits of a block."""
    return most_counts([whole(part).size for part in groups(links)])
