"""Joints, links and others chosen by number or by name, and suggestions where a name does not exist."""

import difflib
from collections.abc import Collection, Iterable, Sequence
from operator import index
from typing import Any

MOST_NAMES = 6
LONGEST = 60
STATES = ("value", "speed")
"""Ends of the path of a coordinate's state in OpenSim: /jointset/JOINT/COORDINATE/value."""


def known_as(given: str, names: Collection[str]) -> str | None:
    """Return the name that is given, or the one at the end of an OpenSim path; None where neither is known.

    /jointset/hip_r/hip_flexion_r/value is hip_flexion_r, /bodyset/foot_r is foot_r.
    """
    if given in names:
        return given
    name = end_of_path(given)
    return name if name in names else None


def end_of_path(given: str) -> str:
    """Return the name of what an OpenSim path leads to; any other text as it is."""
    parts = given.split("/")
    state = parts[-1] in STATES
    if len(parts) < 3 or not (state or given.startswith("/")):
        return given
    return parts[-2] if state else parts[-1]


def nearest_first(given: object, names: Iterable[str]) -> list[str]:
    """Return the names, first those whose letters and digits are most like those of the given text."""
    if not isinstance(given, str):
        return list(names)
    wanted = difflib.SequenceMatcher(b=_letters(given))

    def likeness(name: str) -> float:
        wanted.set_seq1(_letters(name))
        return wanted.ratio()

    return sorted(names, key=likeness, reverse=True)


def known_kind(given: object, kind: type) -> str:
    """Return how errors describe a value that is not of the class `kind`.

    For an instance of the same class in another copy of the runtime they name the package it comes from.
    """
    found = type(given)
    package, copied, _ = found.__module__.partition(".linkwise_runtime.")
    if found.__name__ == kind.__name__ and (copied or ".linkwise_runtime." in kind.__module__):
        whose = package if copied else "linkwise_runtime"
        return f"the {kind.__name__} of {whose}, which is another copy of the runtime than this robot's"
    return short(given)


def position_of(given: object, names: Sequence[str], kind: str, argument: str) -> int:
    """Return the position, counted from 0, of what is given by number or by name.

    kind: what the names are names of, such as joint; joint_names then lists them

    Raises ValueError, which names the argument, for what is neither.
    """
    if isinstance(given, str) and (name := known_as(given, names)) is not None:
        return names.index(name)
    number = whole_number(given)
    if number is not None and 0 <= number < len(names):
        return number
    raise ValueError(
        f"{argument} is {short(given)}; choose a {kind} by number, 0..{len(names) - 1}, or by name: "
        f"{choice(given, names, f'{kind}_names')}"
    )


def whole_number(given: Any) -> int | None:
    """Return an integer of any kind, also of NumPy, as int; None for all else, also for truth values."""
    try:
        return None if isinstance(given, bool) else index(given)
    except TypeError:
        return None


def _letters(name: str) -> str:
    return "".join(c for c in end_of_path(name).casefold() if c.isalnum())


def choice(given: object, names: Iterable[str], whole: str) -> str:
    """Return the names as text, nearest to the given one first.

    Of many names only the nearest are listed, and `whole` says where to find all of them.
    """
    known = nearest_first(given, names)
    near = ", ".join(map(plain, known[:MOST_NAMES]))
    if len(known) <= MOST_NAMES:
        return near
    return f"near it are {near}, and `{whole}` has all {len(known)}"


def numbered(names: Iterable[str]) -> tuple[str, ...]:
    """Return names that differ: one that was there before has its count behind it, as in "hand (2)"."""
    found: list[str] = []
    for name in names:
        count = sum(other == name or other.startswith(f"{name} (") for other in found)
        found.append(f"{name} ({count + 1})" if count else name)
    return tuple(found)


def plain(name: str) -> str:
    """Return a name such that it fits into one line."""
    return name if name.isprintable() and len(name) <= LONGEST else short(name)


def listed(names: Sequence[str]) -> str:
    """Return names joined in one line, the first few of many."""
    shown = ", ".join(plain(name) for name in names[:MOST_NAMES])
    return shown + (f" and {len(names) - MOST_NAMES} more" if len(names) > MOST_NAMES else "")


def sample_of(place: Sequence[int]) -> str:
    """Return the place in a batch in words; "" where there is no batch."""
    return f" at sample {', '.join(map(str, place))}" if len(place) else ""


def short(value: object) -> str:
    """Return any value as text in one line, cut off where it is long."""
    text = repr(value).replace("\n", " ")
    return text if len(text) <= LONGEST else f"{text[:LONGEST]}..."
