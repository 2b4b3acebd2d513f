"""Work: the integral of power over a movement, with what was given and what was taken back apart."""

from dataclasses import dataclass

import numpy as np

from linkwise.analysis.result_quantities import POWER
from linkwise.analysis.result_rows import ResultRows
from linkwise.package.load import Array


@dataclass(frozen=True, eq=False)
class Work:
    """Energy in J that joints gave, ∫ max(P, 0) dt, and took back, ∫ max(-P, 0) dt: arrays of one shape."""

    given: Array
    taken: Array

    @property
    def net(self) -> Array:
        """∫ P dt in J: what was given less what was taken back."""
        net: Array = self.given - self.taken
        return net


class WorkSum:
    """Adds up the work of the rows of power, block by block, by the trapezoidal rule.

    Samples are evenly spaced: with Δt between them ∫ P dt = Δt (Σ_s P_s - (P_first + P_last)/2), so that
    blocks join without knowing of each other.
    """

    def __init__(self, rows: ResultRows) -> None:
        self._rows, self._power = rows, rows.numbers(*POWER, "power_contact")
        self._sums = np.zeros((2, len(self._power)))
        self._first: Array | None = None
        self._last = self._sums

    def __call__(self, block: Array) -> None:
        """Add a block (rows, samples)."""
        power = block[self._power]
        parts = np.stack([np.maximum(power, 0.0), np.maximum(-power, 0.0)])
        self._sums += parts.sum(axis=-1)
        if self._first is None:
            self._first = parts[..., 0].copy()
        self._last = parts[..., -1].copy()

    def work(self, step: float) -> tuple[Work, Work, Work, Work]:
        """Return the work in J into each link (n, N), into all together (n,), against each load (n, loads).

        The last of the four is what contacts fed into links (N, contacts). Samples are `step` s apart.
        """
        first = self._last if self._first is None else self._first
        energy = np.zeros((2, len(self._rows), 1))
        energy[:, self._power, 0] = step * (self._sums - 0.5 * (first + self._last))
        names = ("power_link", "power", "power_load", "power_contact")
        whole, joint, load, contact = (
            Work(*(self._rows.dense(name, way)[0] for way in energy)) for name in names
        )
        return whole, joint, load, contact
