"""Products of a factor and of the motion among rows of a result: what noise of both adds to their variances.

Differences along one direction after the other see of a product A B, with A_r and B_r its changes by one
standard deviation along direction r, everything but pairs of directions. Where B is linear in normal noise
and A nearly so, these add

    sum_(r<s) (A_r B_s + A_s B_r)^2 = var(A) var(B) + cov(A, B)^2 - 2 sum_r (A_r B_r)^2

which counts where A or B is near zero itself: a joint that reverses, a centre of mass on its axis.
"""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from linkwise.analysis.result_quantities import MOTION, TORQUE_OF
from linkwise.analysis.result_rows import ResultRows
from linkwise.arrays import Array, Index

CAUSE_OF = dict(zip(MOTION, ("qdd", "qd"), strict=True))
"""Motion of the cause, by the torque that is c2 or c1 times it."""


class ProductRows(NamedTuple):
    """Products among perturbed rows: torques by cause, and powers, whose factors may be such torques."""

    products: Index
    first: Index
    """Rows of the factors c2, c1 and torques."""
    second: Index
    """Rows of the factors qdd and qd."""
    of_torques: int
    """Number of products that are torques; they come first."""

    @classmethod
    def of(cls, rows: ResultRows, places: Mapping[str, slice], factors: str) -> "ProductRows":
        """Return the products of a result.

        places: where the rows of each quantity are among those that are perturbed, and under the name
        `factors` c2 of all rows tau_qdd, then c1 of all rows tau_qd
        """
        at = {name: np.arange(span.start, span.stop) for name, span in places.items()}
        products = [at[name] for name in CAUSE_OF]
        second = [at[of][rows[name].at[:, 2]] for name, of in CAUSE_OF.items()]
        first = [at[factors]]
        for power, torque in TORQUE_OF.items():
            if power in at:
                products.append(at[power])
                first.append(at[torque])
                second.append(at["qd"][rows[power].at[:, 0]])
        every = np.concatenate(products), np.concatenate(first), np.concatenate(second)
        return cls(*every, len(at[factors]))


class PairedDirections:
    """Sums over directions of A_r B_r, and of their squares, from which those over pairs follow."""

    def __init__(self, rows: ProductRows, samples: int) -> None:
        self._rows = rows
        self._sum, self._squares = np.zeros((2, len(rows.products), samples))

    def add(self, changes: Sequence[Array]) -> None:
        """Add a direction by the changes of all rows along it, one array (rows, S)."""
        [change] = changes
        both = change[self._rows.first]
        both *= change[self._rows.second]
        self._sum += both
        both *= both
        self._squares += both

    def widen(self, found: Array) -> None:
        """Add what pairs of directions do to the variances `found` (rows, S) by single ones, in place."""
        rows, left = self._rows, self._sum**2 - 2.0 * self._squares
        for some in (slice(rows.of_torques), slice(rows.of_torques, None)):
            more = found[rows.first[some]] * found[rows.second[some]] + left[some]
            found[rows.products[some]] += np.maximum(more, 0.0)
