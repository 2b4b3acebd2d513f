"""Closing sums of a result: how far the terms of each whole are from it, at every sample."""

from collections.abc import Collection, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from linkwise.analysis.result_quantities import QUANTITIES
from linkwise.analysis.result_rows import ResultRows
from linkwise.analysis.turned_rows import scratch
from linkwise.analysis.verify import NO_ERRORS, Closure
from linkwise.arrays import Array, Index

SIZED = 32
"""Samples of which the size is taken, against which errors are held."""
NEXT_TO_NOTHING = 1e-12
"""Errors that are a greater part of these sizes are held against those of all samples."""


class Sum(NamedTuple):
    """A whole and its parts, by the numbers of their rows, and its joint."""

    joint: int
    whole: int
    parts: Sequence[int]


class ClosingSums:
    """Sums of rows of a result, which are added up for all wholes at once, part by part."""

    def __init__(
        self,
        units: Sequence[str],
        rows: ResultRows,
        whole: str,
        *parts: str,
        joints: Collection[int] | None = None,
    ) -> None:
        """Set up the sums of all entries of a quantity, of parts with the same indices along its axes.

        units: those of all joints; joints: those whose sums are meant, all if not given
        """
        axes = QUANTITIES[whole].axes
        found = [
            Sum(index[0], row, rows.numbers(*parts, **dict(zip(axes, index, strict=True))).tolist())
            for row, index in rows[whole].listed()
            if joints is None or index[0] in joints
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

        The latter is over the first `SIZED` samples alone where all errors are next to nothing beside it.

        out: rows of a result, (rows, S)
        """
        total = self._summed(out)
        np.subtract(total, out[self._wholes], out=total)
        errors: Array = np.abs(total, out=total).max(axis=1, initial=0.0)
        for count in (SIZED, out.shape[1]):
            sizes: Array = self._summed(np.abs(out[:, :count])).max(axis=1, initial=0.0)
            if (errors <= NEXT_TO_NOTHING * sizes).all():
                break
        return errors, sizes

    def _summed(self, some: Array) -> Array:
        """Return the sums of the parts (sums, S) of some samples, in scratch memory."""
        total = scratch("total", len(self.sums), some.shape[1])
        total[:] = 0.0
        for rows in self._parts:
            total[: len(rows)] += some[rows]
        return total


def closing(sums: Mapping[str, ClosingSums], out: Array, partial: Array, units: Sequence[str]) -> Closure:
    """Return the largest errors of closing sums, by unit, under their names among those of `Closure`.

    A joint that carries only rounding is measured by its peers.

    out: rows of a result, (rows, S); units: those of all joints
    partial: tau_ij (S, n, N) before contacts carry any; what they leave may be only its rounding
    """
    worst = NO_ERRORS
    before = np.abs(partial).sum(axis=-1).max(axis=0, initial=0.0)
    found = {name: (some, *some.residuals(out)) for name, some in sums.items()}
    for unit in dict.fromkeys(units):
        least = max(size for size, other in zip(before, units, strict=True) if other == unit)
        errors_of = {}
        for name, (some, errors, sizes) in found.items():
            alike = some.of_unit[unit]
            error, size = errors[alike].max(initial=0.0), sizes[alike].max(initial=least)
            errors_of[f"{name}_absolute"] = float(error)
            errors_of[f"{name}_relative"] = float(error / size if size else error)
        worst |= Closure(**errors_of)
    return worst
