"""Closing sums of a result: how far the terms of each whole are from it, at every sample."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from linkwise.analysis.result_quantities import QUANTITIES
from linkwise.analysis.result_rows import ResultRows
from linkwise.analysis.turned_rows import TURNED, scratch
from linkwise.arrays import Array, Index

SIZED = 16
"""Samples of which the size of one is taken, against which errors are held."""


class Sum(NamedTuple):
    """A whole and its parts, by the numbers of their rows, and its joint."""

    joint: int
    whole: int
    parts: Sequence[int]


class ClosingSums:
    """Sums of rows of a result, which are added up for all wholes at once, part by part."""

    def __init__(self, units: Sequence[str], rows: ResultRows, whole: str, *parts: str) -> None:
        """Set up the sums of all entries of a quantity, of parts with the same indices along its axes.

        units: those of all joints
        """
        axes = QUANTITIES[whole].axes
        found = [
            Sum(index[0], row, rows.numbers(*parts, **dict(zip(axes, index, strict=True))).tolist())
            for row, index in rows[whole].listed()
        ]
        self.sums = tuple(sorted(found, key=lambda one: -len(one.parts)))
        """Sums, those of most parts first."""
        own = [units[one.joint] for one in self.sums]
        self.of_unit = {
            unit: np.array([other == unit for other in own], np.bool_) for unit in dict.fromkeys(units)
        }
        """True for the sums that are of joints of a unit, by unit."""
        self._wholes: Index = np.array([one.whole for one in self.sums], np.intp)
        most = len(self.sums[0].parts) if self.sums else 0
        self._parts = [self._numbered(number) for number in range(most)]

    def _numbered(self, number: int) -> Index:
        """Return the rows of all parts with this number, whose wholes come first among all."""
        return np.array([one.parts[number] for one in self.sums if len(one.parts) > number], np.intp)

    def residuals(self, out: Array) -> tuple[Array, Array]:
        """Return the largest |Σ parts - whole| over samples, and the largest Σ |parts|, (sums,) each.

        The latter is of every `SIZED`th sample, which makes a relative error no smaller.

        out: rows of a result, (rows, S)
        """
        errors, sizes = np.zeros((2, len(self.sums)))
        for at in range(0, out.shape[1], TURNED):
            some = out[:, at : at + TURNED]
            total = self._summed(some)
            np.subtract(total, some[self._wholes], out=total)
            np.maximum(errors, np.abs(total, out=total).max(axis=1), out=errors)
        np.maximum(sizes, self._summed(np.abs(out[:, ::SIZED])).max(axis=1, initial=0.0), out=sizes)
        return errors, sizes

    def _summed(self, some: Array) -> Array:
        """Return the sums of the parts (sums, S) of some samples."""
        total = scratch("total", len(self.sums), some.shape[1])
        total[:] = 0.0
        for rows in self._parts:
            total[: len(rows)] += some[rows]
        return total
