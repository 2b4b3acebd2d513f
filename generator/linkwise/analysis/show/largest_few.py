"""Choice of the few among many that have a name and a colour of their own in a picture."""

from collections.abc import Sequence

from linkwise.package.load import Array


def largest_few(sizes: Sequence[float] | Array, most: int) -> tuple[list[int], list[int]]:
    """Return the indices of the `most` largest and of the others, each ascending; never only one other."""
    order = sorted(range(len(sizes)), key=lambda at: -float(sizes[at]))
    named = len(order) if len(order) == most + 1 else most
    return sorted(order[:named]), sorted(order[named:])
