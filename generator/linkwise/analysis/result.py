"""The result of an analysis as named arrays."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from linkwise.analysis.closure import Closure
from linkwise.analysis.columns import Column, Quantity
from linkwise.analysis.extras import extra
from linkwise.analysis.robot import Robot
from linkwise.analysis.settings import Processing, Reading
from linkwise.errors import LinkwiseError

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Totals:
    """Over every sample of the movement, a column each: mean of the magnitude, and its largest."""

    mean: Array
    peak: Array


@dataclass(frozen=True, eq=False)
class Analysis:
    """Who loads whom: S samples of every torque term, SI units; index order joint, link, cause.

    `values` (columns, S) holds what `columns` names; terms that are identically 0 have no column.
    With a `stride` above 1 only every stride-th of `total` samples is kept; `totals` and `closure`
    cover all of them.
    """

    robot: Robot
    reading: Reading
    processing: Processing
    source: str
    rate: float
    columns: tuple[Column, ...]
    values: Array
    totals: Totals
    closure: Closure
    ignored: tuple[str, ...]
    warnings: tuple[str, ...]
    total: int
    stride: int = 1

    def __getitem__(self, name: str) -> Array:
        """One column (S,) by its name, as in the Parquet file: "tau/joint1/link2"."""
        for at, column in enumerate(self.columns):
            if column.name == name:
                return self._row(at)
        raise LinkwiseError(f"no column {name!r}; there are {[c.name for c in self.columns]}")

    @property
    def time(self) -> Array:
        """Time (S,) in s."""
        return self._row(0)

    @property
    def q(self) -> Array:
        """Joint coordinates (S, n) in rad or m, after the filter."""
        return self._dense("q", 1)

    @property
    def qd(self) -> Array:
        """Joint velocities (S, n)."""
        return self._dense("qd", 1)

    @property
    def qdd(self) -> Array:
        """Joint accelerations (S, n)."""
        return self._dense("qdd", 1)

    @property
    def torque(self) -> Array:
        """τ_i (S, n) in N·m or N."""
        return self._dense("tau", 1)

    @property
    def partial_torque(self) -> Array:
        """τ_ij (S, n, N)."""
        return self._dense("tau_link", 2)

    @property
    def acceleration(self) -> Array:
        """τp_ij(q̈_k) (S, n, N, n)."""
        return self._dense("tau_qdd", 3)

    @property
    def velocity(self) -> Array:
        """τp_ij(q̇_k) (S, n, N, n), in the convention asked for."""
        return self._dense("tau_qd", 3)

    @property
    def gravity(self) -> Array:
        """g_ij (S, n, N)."""
        return self._dense("tau_gravity", 2)

    def figure(self, name: str = "paper") -> "Figure":
        """A matplotlib figure: "paper" (its five panels) or "shares"."""
        from linkwise.analysis.figures import draw

        extra("matplotlib.pyplot")  # switches on a notebook's display of figures
        return draw(self, name)

    def record(self) -> dict[str, Any]:
        """Everything but the samples, as plain data: choices, closure, columns and their totals."""
        from linkwise.analysis.summary import summary

        return summary(self)

    def _row(self, at: int) -> Array:
        row: Array = self.values[at]
        return row

    def _dense(self, quantity: Quantity, rank: int) -> Array:
        n, links = len(self.robot.joints), len(self.robot.links)
        out = np.zeros((len(self.time), n, links, n)[: rank + 1])
        for column, values in zip(self.columns, self.values, strict=True):
            if column.quantity == quantity:
                found = [x for x in (column.joint, column.link, column.cause) if x is not None]
                index: tuple[slice | int, ...] = (slice(None), *found)
                out[index] = values
        return out
