"""Rows of constraints that a user wrote, from closed forms, and the choice of independent coordinates."""

from collections.abc import Callable, Sequence

import numpy as np

from ..arrays.backend import ArrayBackend
from ..interface import Numbers, side_by_side
from ..structure import Structure, WrittenConstraints
from .chosen_constraints import (
    SHORTEST,
    STEPS,
    ChosenConstraints,
    Closing,
    ClosingEquations,
    Floats,
)
from .independent_joints import RANK

LEAST = 1e-6
"""Smallest part of a step of Newton's."""


class WrittenEquations(ClosingEquations):
    """Equations phi(q) = 0 that a user wrote, and rows A of velocities alone, which have no phi."""

    def __init__(self, rows: Callable[[Floats], Floats]) -> None:
        """Keep a function of q (n,) that returns phi and A beside it, (C, 1 + n)."""
        self._rows = rows

    def at(self, q: Floats) -> Closing:
        """Return phi and A at q (n,)."""
        values = self._rows(q)
        if not np.isfinite(values).all():
            nothing = np.zeros((len(values), len(q)))
            return Closing(q, np.full(len(values), np.inf), nothing, nothing[:, 0], nothing)
        phi, rows = values[:, 0], values[:, 1:]
        slopes = np.abs(rows).max(-1, initial=0.0)
        sizes = np.where(slopes > 0.0, slopes, 1.0)
        comparable = rows / sizes[:, None]
        return Closing(q, phi / sizes, comparable, slopes, comparable)

    def closed_from(self, start: Floats) -> Closing:
        """Return the end of Newton's steps from q (n,), each halved until less is left open."""
        at = self.at(start)
        for _ in range(STEPS):
            if not np.isfinite(at.left).all():
                break
            step = np.linalg.lstsq(at.rows, -at.left, rcond=RANK)[0]
            if np.abs(step).max() < SHORTEST * (1.0 + np.abs(at.q).max()):
                break
            found, part = self.at(at.q + step), 1.0
            while not np.linalg.norm(found.left) < np.linalg.norm(at.left) and part > LEAST:
                part /= 2.0
                found = self.at(at.q + part * step)
            at = found
        return at


class WrittenChoice(ChosenConstraints):
    """Constraints that a user wrote, and independent coordinates."""

    def __init__(self, structure: Structure, independent: object, at: object) -> None:
        """Choose independent coordinates; raises as `Dynamics.constrained` does."""
        written = structure.written
        assert written is not None
        self._structure, self._written = structure, written
        self._own, self._own_position = written.independent, written.closed_position
        self.names = self.rows = self.row_names = written.names
        self.row_units = ("",) * len(written.names)
        self.of_positions = all(written.holonomic)
        self._choose(independent, at, loose=())

    def _closed(self) -> Closing:
        values = {name: float(value) for name, value in self._structure.parameters.items()}

        def rows(q: Floats) -> Floats:
            flat = np.array(self._written.positions(np, q, values), float)
            return flat.reshape(len(self.names), 1 + len(q))

        return self._best(WrittenEquations(rows))


class WrittenRows:
    """Rows that a user wrote on one back end; see `ConstraintRows`."""

    unit_rows = True
    functions = None

    def __init__(self, backend: ArrayBackend, written: WrittenConstraints) -> None:
        self.backend, self.written, self.couplings = backend, written, len(written.names)

    def at(self, q: Numbers, held_at: Numbers | None = None) -> "WrittenRowsAt":
        """Return the rows at positions (..., n)."""
        return WrittenRowsAt(self, q)

    def violation(self, q: Numbers, held_at: Numbers) -> Numbers:
        """Return phi (..., C), 0 for rows of velocities alone."""
        return self.at(q).positions()[..., 0]

    def rates(self, q: Numbers, qd: Numbers) -> Numbers:
        """Return dA/dt (..., C, n)."""
        return self.at(q).rates(qd)


class WrittenRowsAt:
    """Rows that a user wrote at some positions."""

    def __init__(self, rows: WrittenRows, q: Numbers) -> None:
        self._backend, self._written, self._q = rows.backend, rows.written, q

    def positions(self) -> Numbers:
        """Return phi and A beside it, (..., C, 1 + n)."""
        return self._shaped(self._written.positions, (self._q,), 1 + self._q.shape[-1])

    def rates(self, qd: Numbers) -> Numbers:
        """Return dA/dt (..., C, n), for velocities (..., n) of the same samples."""
        return self._shaped(self._written.rates, (self._q, qd), self._q.shape[-1])

    def _shaped(
        self, function: Callable[..., Sequence[object]], motion: tuple[Numbers, ...], width: int
    ) -> Numbers:
        count = len(self._written.names)
        flat = self._backend.evaluated(function, motion, count * width)
        return side_by_side(flat.reshape(*self._q.shape[:-1], count, width))
