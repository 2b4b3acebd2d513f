"""Which few of many have a name and a colour of their own in a picture."""

from collections.abc import Sequence

from linkwise.package.load import Array


def largest_few(sizes: Sequence[float] | Array, most: int) -> tuple[list[int], list[int]]:
    """Indices of the `most` largest, and of the others, which are never one alone; both in their order."""
    order = sorted(range(len(sizes)), key=lambda at: -float(sizes[at]))
    named = len(order) if len(order) == most + 1 else most
    return sorted(order[:named]), sorted(order[named:])
