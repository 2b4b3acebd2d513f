"""Sums of rows of a result, such as a cause's net torque, with their standard deviations.

A sum of one row has that row's deviation. One of several has at most the sum of theirs, however their errors
go together: sd(x + y) <= sd(x) + sd(y). Rows without a deviation count as certain.
"""

from collections.abc import Sequence

import numpy as np

from linkwise.analysis.certain_signs import DEVIATIONS, SMALL
from linkwise.analysis.result_rows import ResultRows
from linkwise.arrays import Array, Index, Mask


class RowSums:
    """Sums of some rows each, none of them of no row."""

    def __init__(self, sums: Sequence[Index]) -> None:
        """Set up the sums; each is given by the numbers of its rows."""
        counts = np.array([len(some) for some in sums], np.intp)
        self._rows: Index = np.concatenate([np.zeros(0, np.intp), *sums])
        self._starts = np.concatenate([[0], np.cumsum(counts)[:-1]]).astype(np.intp)[: len(counts)]

    def __call__(self, values: Array) -> Array:
        """Return the sums (sums, S) of rows of a part of a result, (rows, S)."""
        if not len(self._starts):
            return np.zeros((0, values.shape[1]))
        sums: Array = np.add.reduceat(values[self._rows], self._starts, axis=0)
        return sums


class SumDeviations:
    """Standard deviations of sums of rows, at most, and whether the signs of the sums are certain by these.

    It looks through a result part by part; of sums none of whose rows has a deviation it knows nothing.
    """

    def __init__(self, rows: ResultRows, sums: Sequence[Index]) -> None:
        """Set up the search; each sum is given by the numbers of its rows."""
        beside = [rows.deviations(some) for some in sums]
        self.count = len(sums)
        self.known: Index = np.flatnonzero([len(some) for some in beside])
        """Numbers of the sums that have a deviation."""
        self.exact = all(len(sums[at]) == 1 for at in self.known.tolist())
        """True if each of them is of one row, whose deviation is its own and not a bound."""
        self._values = RowSums([sums[at] for at in self.known.tolist()])
        self._deviations = RowSums([beside[at] for at in self.known.tolist()])
        self._samples, self._totals = 0, np.zeros(len(self.known))
        self._peaks = np.zeros((2, len(self.known)))
        self._seen = np.full(len(self.known), -1.0)

    def __call__(self, values: Array) -> tuple[Array, Array]:
        """Return the known sums and their deviations, (known, S) each, of a part of a result (rows, S)."""
        return self._values(values), self._deviations(values)

    def add(self, values: Array) -> None:
        """Look through a part of a result, (rows, S)."""
        if not len(self.known):
            return
        sums, deviations = self(values)
        self._samples += values.shape[1]
        self._totals += deviations.sum(axis=1)
        at = np.abs(sums).argmax(axis=1)[:, None]
        found = np.array([np.take_along_axis(one, at, axis=1)[:, 0] for one in (sums, deviations)])
        self._peaks = np.where(np.abs(found[0]) > self._seen, found, self._peaks)
        self._seen = np.abs(self._peaks[0])

    def mean(self) -> Array:
        """Return the mean deviation of every sum over the samples, 0 where none is known.

        The standard deviation of the mean of a sum, and of its mean magnitude, is this at most.
        """
        found = np.zeros(self.count)
        found[self.known] = self._totals / max(1, self._samples)
        return found

    def unsure(self, groups: Sequence[int] | Index) -> Mask:
        """Return which sums have no certain sign where they are largest, and are not surely nothing.

        groups: the joint of each sum, of whose largest sum next to nothing is a part
        """
        most = np.zeros(1 + max(groups, default=0))
        own = np.asarray(groups, np.intp)[self.known]
        sizes = np.abs(self._peaks[0])
        np.maximum.at(most, own, sizes)
        found = np.zeros(self.count, np.bool_)
        may_be = DEVIATIONS * self._peaks[1]
        found[self.known] = (sizes + may_be > SMALL * most[own]) & (sizes < may_be)
        return found
