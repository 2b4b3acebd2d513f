"""Joints, links and others chosen by number or by name, and what to offer where there is no such name."""

import difflib
from collections.abc import Iterable, Sequence
from operator import index
from typing import Any

MOST_NAMES = 6
LONGEST = 60


def position_of(given: Any, names: Sequence[str], kind: str, argument: str) -> int:
    """Position from 0 of what is given by number or by name; raises ValueError, which names the argument.

    kind: what there are names of, such as joint; joint_names then lists them
    """
    if isinstance(given, str) and given in names:
        return names.index(given)
    number = whole_number(given)
    if number is not None and 0 <= number < len(names):
        return number
    raise ValueError(
        f"{argument} is {short(given)}; choose a {kind} by number, 0..{len(names) - 1}, or by name: "
        f"{choice(given, names, f'{kind}_names')}"
    )


def whole_number(given: Any) -> int | None:
    """An integer of any kind, NumPy's too, as such; None for all else, truth values among it."""
    try:
        return None if isinstance(given, bool) else index(given)
    except TypeError:
        return None


def choice(given: Any, names: Iterable[str], whole: str) -> str:
    """All names where they are few, else those near the given one, and where all of them are."""
    known = list(names)
    if len(known) <= MOST_NAMES:
        return ", ".join(map(plain, known))
    near = difflib.get_close_matches(str(given), known, MOST_NAMES, 0.5) or known[:MOST_NAMES]
    return f"near it are {', '.join(map(plain, near))}, and `{whole}` has all {len(known)}"


def plain(name: str) -> str:
    """A name as one line may hold it."""
    return name if name.isprintable() and len(name) <= LONGEST else short(name)


def short(value: Any) -> str:
    """Any value in one line."""
    text = repr(value).replace("\n", " ")
    return text if len(text) <= LONGEST else f"{text[:LONGEST]}..."
