"""Packed values of samples, turned into rows of a result, in memory that is used again and again.

Fresh memory for a few hundred samples costs more than what is computed in it: the system clears it page by
page.
"""

import math
import threading

import numpy as np

from linkwise.arrays import Array, Index

TURNED = 256
"""Samples that are turned at once, whose values stay in the cache."""


class Scratch(threading.local):
    """Memory of one thread by its use; what was in it is gone at the next call for that use."""

    def __init__(self) -> None:
        self._held: dict[str, Array] = {}

    def __call__(self, use: str, *shape: int) -> Array:
        """Return an array of this shape, which holds anything."""
        count = math.prod(shape)
        held = self._held.get(use)
        if held is None or held.size < count:
            held = self._held[use] = np.empty(count)
        return held[:count].reshape(shape)

    def __enter__(self) -> None:
        """Begin with what is there."""

    def __exit__(self, *_: object) -> None:
        """Give the memory of this thread back; that of others ends with them."""
        self._held.clear()


scratch = Scratch()


def turned(values: Array, use: str) -> Array:
    """Return values (S, count) as contiguous rows (count, S), in the scratch memory of a use."""
    found = scratch(use, values.shape[1], len(values))
    np.copyto(found, values.T)
    return found


def taken(rows: Array, numbers: Index, use: str) -> Array:
    """Return some rows (count, S) of contiguous ones, in the scratch memory of a use."""
    found = scratch(use, len(numbers), rows.shape[1])
    np.take(rows, numbers, axis=0, out=found, mode="clip")  # other modes copy once more
    return found


def spread(
    out: Array,
    rows: slice | Index,
    values: Array | None,
    places: Index,
    causes: tuple[Array, Index] | None = None,
) -> None:
    """Fill rows with the packed values (S, values) at these places, times the motion of causes if given.

    values: may be None where there is no row
    causes: motion (S, n), and the coordinate of each row
    """
    for at in range(0, 0 if values is None or not len(places) else len(values), TURNED):
        assert values is not None
        some = slice(at, at + TURNED)
        found = taken(turned(values[some], "turned"), places, "rows")
        if causes is None:
            out[rows, some] = found
            continue
        motion, of = causes
        moved = taken(turned(motion[some], "motion"), of, "moved")
        if isinstance(rows, slice):
            np.multiply(found, moved, out=out[rows, some])
        else:
            out[rows, some] = np.multiply(found, moved, out=found)
