"""Work: the integral of power over a movement, with what was given and what was taken back apart."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from linkwise.analysis.result_columns import Column
from linkwise.analysis.result_quantities import POWER, Quantity
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
    """Adds up the work of the power columns, block by block, by the trapezoidal rule.

    Samples are evenly spaced: with Δt between them ∫ P dt = Δt (Σ_s P_s - (P_first + P_last)/2), so that
    blocks join without knowing of each other.
    """

    def __init__(self, columns: Sequence[Column]) -> None:
        self._columns = columns
        self._rows = [at for at, c in enumerate(columns) if c.quantity in (*POWER, "power_contact")]
        self._sums = np.zeros((2, len(self._rows)))
        self._first: Array | None = None
        self._last = self._sums

    def __call__(self, block: Array) -> None:
        """Add a block (columns, samples)."""
        power = block[self._rows]
        parts = np.stack([np.maximum(power, 0.0), np.maximum(-power, 0.0)])
        self._sums += parts.sum(axis=-1)
        if self._first is None:
            self._first = parts[..., 0].copy()
        self._last = parts[..., -1].copy()

    def work(
        self, step: float, joints: int, links: int, loads: int, contacts: int
    ) -> tuple[Work, Work, Work, Work]:
        """Return the work in J into each link (n, N), into all together (n,), against each load (n, loads).

        The last of the four is what contacts fed into links (N, contacts). Samples are `step` s apart.
        """
        first = self._last if self._first is None else self._first
        energy = step * (self._sums - 0.5 * (first + self._last))
        return (
            self._work("power_link", energy, (joints, links)),
            self._work("power", energy, (joints,)),
            self._work("power_load", energy, (joints, loads)),
            self._work("power_contact", energy, (links, contacts)),
        )

    def _work(self, quantity: Quantity, energy: Array, shape: tuple[int, ...]) -> Work:
        out = np.zeros((2, *shape))
        for row, parts in zip(self._rows, energy.T, strict=True):
            column = self._columns[row]
            if column.quantity == quantity:
                place = tuple(at for at in (column.joint, column.link, column.cause) if at is not None)
                out[0][place], out[1][place] = parts
        return Work(*out)
