"""Which columns a pattern is of: * stands for anything in one part of a name, ** for any parts."""

import re
from collections.abc import Iterable, Sequence

from linkwise.errors import LinkwiseError
from linkwise.escape import listed
from linkwise.runtime.chosen_names import nearest_first

WILD = re.compile(r"\*\*|\*")


def fitting(place: str, names: Iterable[str], patterns: Sequence[str]) -> list[str]:
    """The names that any pattern fits, in their order: tau/* is tau/knee, and not tau/knee/foot.

    Raises LinkwiseError, with the place of the study's file, for a pattern that fits none.
    """
    names = list(names)
    found = set[str]()
    for pattern in patterns:
        expression = _expression(pattern)
        fits = {name for name in names if expression.fullmatch(name)}
        if not fits:
            near = listed(map(repr, nearest_first(pattern, names)))
            raise LinkwiseError(f"{place} has {pattern!r}, which no column is called; nearest are {near}")
        found |= fits
    return [name for name in names if name in found]


def _expression(pattern: str) -> re.Pattern[str]:
    plain = WILD.split(pattern)
    wild = [".*" if sign == "**" else "[^/]*" for sign in WILD.findall(pattern)]
    pieces = [re.escape(text) + sign for text, sign in zip(plain, [*wild, ""], strict=True)]
    return re.compile("".join(pieces), re.DOTALL)
