"""Which motion propagation torques are to be cancelled, by number."""

from collections.abc import Iterable
from typing import Any

from ..chosen_names import short
from ..structure import Structure

ORDERS = (1, 2)
"""Of velocity and of acceleration."""
Entry = tuple[int, int, int, int]
"""i, j, k and the order."""


def cancelled_motions(entries: Iterable[Any], structure: Structure) -> tuple[Entry, ...]:
    """Numbers of what is chosen by name or number, None in a place standing for all that there are.

    Raises ValueError for what is not there, what is always zero, and what is named twice.
    """
    found: dict[Entry, None] = {}
    if isinstance(entries, str) or not isinstance(entries, Iterable):
        raise TypeError(
            f"{short(entries)} is to be cancelled; give a set of (joint, link, coordinate, order)"
        )
    for entry in entries:
        if not isinstance(entry, tuple) or len(entry) != 4:
            raise ValueError(f"{short(entry)} is to be cancelled; give (joint, link, coordinate, order)")
        here = _meant(entry, structure)
        if not here:
            raise ValueError(
                f"{short(entry)} is to be cancelled, but is always zero, as a joint "
                "acts on the links that it moves"
            )
        if None not in entry and here[0] in found:
            raise ValueError(f"{short(entry)} is to be cancelled twice; name it once")
        found.update(dict.fromkeys(here))
    if not found:
        raise ValueError("nothing is to be cancelled; give (joint, link, coordinate, order), one or more")
    return tuple(sorted(found))


def _meant(entry: tuple[Any, ...], structure: Structure) -> list[Entry]:
    """All that an entry stands for and that is not always zero."""
    joint, link, coordinate, order = entry
    if order is not None and (isinstance(order, bool) or order not in ORDERS):
        raise ValueError(
            f"the order of {short(entry)} is {short(order)}; cancel 1, of velocity, or 2, of "
            "acceleration, as gravity, as any potential, is compensated in any case"
        )
    i_wanted = None if joint is None else structure.joint_index(joint)
    j_wanted = None if link is None else structure.link_index(link)
    k_wanted = None if coordinate is None else structure.joint_index(coordinate, "coordinate")
    return [
        (i, j, k, m)
        for j, path in enumerate(structure.paths)
        for i in path
        for k in path
        for m in ORDERS
        if i_wanted in (None, i) and j_wanted in (None, j) and k_wanted in (None, k) and order in (None, m)
    ]
