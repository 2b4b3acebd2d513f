"""Columns have names of their own: what two of them are called says which one is meant of neither."""

from collections.abc import Sequence

from linkwise.errors import LinkwiseError
from linkwise.escape import short

SHOWN = 60
"""Letters of a name that a message shows."""


def named_once(names: Sequence[str], what: str = "columns") -> tuple[str, ...]:
    """Return the names; raises LinkwiseError that says where two are the same, counted from 1."""
    seen: dict[str, int] = {}
    for at, name in enumerate(names, 1):
        if (first := seen.setdefault(name, at)) != at:
            raise LinkwiseError(f"{what} {first} and {at} are both named {short(name, SHOWN)!r}; rename one")
    return tuple(names)
