"""Response of coordinates to forces while contacts hold frames of the robot.

With the rows A of the contacts that are on, and the mass matrix M of the response without contacts,

    q̈_x = P M⁻¹ F_x        P = 1 − K A        K = M⁻¹ Aᵀ (A M⁻¹ Aᵀ)⁺

is the acceleration due to a force while the held frames stay fixed. In a measured motion they are not quite
fixed: K A q̈ is the acceleration due to the contacts themselves, as the held frames turn and slip, and with
it all sources sum to q̈. Forces that contacts could carry move nothing, so that it does not matter how
contacts share them.
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
    """Response of a robot at S samples; `free` is its response without contacts."""

    free: Any
    rows: Array
    """Contact rows A (S, C, n)."""

    def accelerations(self, forces: Array) -> Array:
        """Return the accelerations (S, n, X) due to columns of forces (S, n, X)."""
        return self._kept(self.free.accelerations(forces))

    def of_velocities(self) -> Array:
        """Return the accelerations due to the velocity terms of ties, by cause (S, n, n)."""
        return self._kept(self.free.of_velocities())

    def of_contacts(self, qdd: Array, owners: Array, count: int) -> Array:
        """Return the accelerations (S, n, contacts) due to each contact itself.

        owners: contact of each row; count: number of contacts
        """
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
        """Matrix K (S, n, C)."""
        answered = self.free.accelerations(np.swapaxes(self.rows, 1, 2))
        found: Array = answered @ np.linalg.pinv(self.rows @ answered, rcond=RANK, hermitian=True)
        return found
