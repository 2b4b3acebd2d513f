"""Patterns of column names: * stands for anything in one part of a name, and ** for any parts."""

import re
from collections.abc import Iterable, Sequence

from linkwise_runtime.chosen_names import nearest_first

from linkwise.errors import LinkwiseError
from linkwise.escape import listed, short

WILD = re.compile(r"(\*+)")
LONGEST = 200
"""Most characters of a pattern that a message shows, and that names are compared with."""


def patterns_of(given: object) -> tuple[str, ...]:
    """Return presets and patterns, one or a list; raises LinkwiseError for what is none of these."""
    several = (given,) if isinstance(given, str) else given
    if not isinstance(several, list | tuple) or not all(isinstance(one, str) for one in several):
        raise LinkwiseError(f'columns is {short(str(given))}; give words such as "sums", or a list of them')
    return tuple(several)


def fitting(place: str, names: Iterable[str], patterns: Sequence[str]) -> list[str]:
    """Return the names that any pattern fits, in their order: tau/* fits tau/knee, and not tau/knee/foot.

    Raises LinkwiseError, with the place where they are written, for a pattern that fits none.
    """
    names = list(names)
    found = set[str]()
    for pattern in dict.fromkeys(patterns):
        fits = matching(names, pattern)
        if not fits:
            near = listed(map(repr, nearest_first(pattern[:LONGEST], names)))
            raise LinkwiseError(
                f"{place} has {short(pattern, LONGEST)!r}, which no column is called; nearest are {near}"
            )
        found |= fits
    return [name for name in names if name in found]


def matching(names: Iterable[str], pattern: str) -> set[str]:
    """Return the names that a pattern fits."""
    pieces = WILD.split(pattern)
    return {name for name in names if _fits(pieces, name)}


def _fits(pieces: Sequence[str], name: str) -> bool:
    """Return whether the pieces of a pattern, texts with stars between them, fit the whole name.

    The pieces are followed with all places in the name where the part before may end. A regular expression
    tries them one after the other, which takes forever for a dozen stars.
    """
    first, *rest = pieces
    ends = {len(first)} if name.startswith(first) else set[int]()
    for stars, text in zip(rest[::2], rest[1::2], strict=True):
        starts = {at for end in ends for at in _reached(name, end, len(stars) > 1)}
        ends = {at + len(text) for at in starts if name.startswith(text, at)}
        if not ends:
            return False
    return len(name) in ends


def _reached(name: str, end: int, over_parts: bool) -> range:
    """Return the places where the text after a star may begin."""
    slash = -1 if over_parts else name.find("/", end)
    return range(end, (len(name) if slash < 0 else slash) + 1)
