"""Interface of the rows of constraints, wherever they come from: phi, A and dA/dt."""

from typing import Protocol

from ..answers.packed import TiedFunctions
from ..interface import Numbers


class RowsThere(Protocol):
    """Rows at some positions."""

    def positions(self) -> Numbers:
        """Return phi and A beside it, (..., C, 1 + n)."""

    def rates(self, qd: Numbers) -> Numbers:
        """Return dA/dt (..., C, n), for velocities (..., n) of the same samples."""


class ConstraintRows(Protocol):
    """Rows of constraints on one back end."""

    @property
    def unit_rows(self) -> bool:
        """True if all rows are divided by their largest slopes, by which a singular A_d is then measured."""

    @property
    def couplings(self) -> int:
        """Number of the last rows whose unit is their author's choice: they are divided by their slopes."""

    @property
    def functions(self) -> TiedFunctions | None:
        """Functions of the back end for all that follows from these rows; None without any."""

    def at(self, q: Numbers, held_at: Numbers | None = None) -> RowsThere:
        """Return the rows at positions (..., n); contacts are held as they are there, or as at `held_at`."""

    def violation(self, q: Numbers, held_at: Numbers) -> Numbers:
        """Return phi (..., C), from where contacts took hold."""

    def rates(self, q: Numbers, qd: Numbers) -> Numbers:
        """Return dA/dt (..., C, n)."""
