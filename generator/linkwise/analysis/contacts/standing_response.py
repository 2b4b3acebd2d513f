"""How coordinates answer to forces while contacts hold frames of the robot.

With the rows A of the contacts that are on, and M the mass matrix by which the robot answers without them,

    q̈_x = P M⁻¹ F_x        P = 1 − K A        K = M⁻¹ Aᵀ (A M⁻¹ Aᵀ)⁺

is what a force does while what is held stays. A measured motion does not quite stay: K A q̈ is what the
contacts do themselves, as what they hold turns and slips, and with it all sources sum to q̈. Forces that
contacts could bear move nothing, so that it does not matter how they share them.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from linkwise.package.load import Array

RANK = 1e-11
"""Eigenvalues of A M⁻¹ Aᵀ below this part of the largest are zero."""


@dataclass(frozen=True)
class StandingResponse:
    """Of a robot at S samples; `free` is how it answers without contacts."""

    free: Any
    rows: Array
    """A (S, C, n)."""

    def accelerations(self, forces: Array) -> Array:
        """Of columns of forces (S, n, X)."""
        return self._kept(self.free.accelerations(forces))

    def of_velocities(self) -> Array:
        """Accelerations of the ties' own source, by cause (S, n, n)."""
        return self._kept(self.free.of_velocities())

    def of_contacts(self, qdd: Array, owners: Array, count: int) -> Array:
        """What each of `count` contacts does itself, (S, n, contacts); owners: contact of each row."""
        moved = np.einsum("scn,sn->sc", self.rows, qdd)
        each = np.zeros((*moved.shape, count))
        each[:, np.arange(len(owners)), owners] = moved
        found: Array = self._by_rows @ each
        return found

    def _kept(self, accelerations: Array) -> Array:
        kept: Array = accelerations - self._by_rows @ (self.rows @ accelerations)
        return kept

    @cached_property
    def _by_rows(self) -> Array:
        """K (S, n, C)."""
        answered = self.free.accelerations(np.swapaxes(self.rows, 1, 2))
        found: Array = answered @ np.linalg.pinv(self.rows @ answered, rcond=RANK, hermitian=True)
        return found
