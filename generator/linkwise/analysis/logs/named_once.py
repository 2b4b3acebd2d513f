"""Check that names are unique: of two columns of one name, none could be chosen."""

from collections.abc import Sequence

from linkwise.errors import LinkwiseError
from linkwise.escape import short

SHOWN = 60
"""Most characters of a name that a message shows."""


def named_once(names: Sequence[str], what: str = "columns") -> tuple[str, ...]:
    """Return the names; raise LinkwiseError that says where two are the same, counted from 1."""
    seen: dict[str, int] = {}
    for at, name in enumerate(names, 1):
        if (first := seen.setdefault(name, at)) != at:
            raise LinkwiseError(f"{what} {first} and {at} are both named {short(name, SHOWN)!r}; rename one")
    return tuple(names)
