"""Rows of ties, couplings and contacts for positions as a user gives them."""

from collections.abc import Callable, Iterable
from typing import Any

import numpy as np

from ..kinematics.asked_samples import Asked, in_pieces
from ..kinematics.kinematic_answers import KinematicAnswers
from ..structure import Structure
from .chosen_constraints import ChosenConstraints
from .tie_arrays import Changes, Pairs, ends, pair_changes, pairs, tie_jacobian, tie_jacobian_rate, violation
from .tie_tables import TieTables

ROWS_OF = "rows"


class TieRows(KinematicAnswers):
    """phi, A and dA/dt; arguments as `Constraints` says."""

    def __init__(
        self,
        structure: Structure,
        backend: Any,
        check_finite: bool,
        read_beside_motion: Callable[[], Iterable[Any]],
        chosen: ChosenConstraints,
    ) -> None:
        super().__init__(structure, backend, check_finite, read_beside_motion)
        self._constants, self._count = chosen.tables, len(chosen.rows)
        self._has_contacts = chosen.tables.ties < chosen.tables.pairs

    def at(self, q: Any, held_at: Any = None) -> "RowsAt":
        """Rows at positions that have been read, (..., n); contacts are held as they are, or at others."""
        own = self._backend.side(q)
        return RowsAt(own, self._asked_at(own, q, held_at), tuple(q.shape), self._count)

    def _asked_at(self, own: Any, q: Any, held_at: Any) -> Asked:
        is_held = self._has_contacts and held_at is not None
        return self._asked(own, ROWS_OF, [q, held_at] if is_held else [q], {})

    def violation(self, q: Any, held_at: Any) -> Any:
        """phi, (..., C), from where contacts took hold."""

        def answer(at: Asked) -> Any:
            q, *held_at = at.motion
            held = ends(at.xp, at.tables, at.numbers, *held_at) if self._has_contacts else None
            return violation(at.xp, at.tables, q, _pairs(at), held)

        return self._rows("violation", (q, held_at), answer, (self._count,), ("q", "held_at"))

    def rates(self, q: Any, qd: Any) -> Any:
        """dA/dt, (..., C, n)."""

        def answer(at: Asked) -> Any:
            return _rates(at, placed := _pairs(at), _changes(at, placed))

        return self._rows("rates", (q, qd), answer, (self._count, self._structure.n))

    def _rows(self, call: str, given: Any, answer: Any, shape: Any, names: Any = ("q", "qd")) -> Any:
        return self._answer(call, given, ROWS_OF, {}, answer, shape, None, names)

    def _tables_of(self, part: Any) -> TieTables:
        return self._constants


class RowsAt:
    """Rows at some positions; of few samples, what they are made of is kept for their rates."""

    def __init__(self, own: Any, asked: Asked, shape: tuple[int, ...], count: int) -> None:
        self._own, self._asked, self._shape, self._count = own, asked, shape, count
        self._kept: Pairs | None = None

    def positions(self) -> Any:
        """phi and A beside it, (..., C, 1 + n)."""

        def answer(at: Asked) -> Any:
            placed = self._pairs(at)
            if at is self._asked:
                self._kept = placed
            q, *held_at = at.motion
            held = ends(at.xp, at.tables, at.numbers, *held_at) if held_at else None
            phi = violation(at.xp, at.tables, q, placed, held)
            return at.xp.concat([phi[:, None], tie_jacobian(at.xp, at.tables, q, placed)], 1)

        return self._made(answer, self._asked, 1 + self._shape[-1])

    def rates(self, qd: Any) -> Any:
        """dA/dt, (..., C, n), for velocities (..., n) of the same samples."""
        first = self._asked
        flat = first.xp.swapaxes(qd.reshape(-1, qd.shape[-1]), 0, 1)
        asked = first._replace(motion=[first.motion[0], flat])

        def answer(at: Asked) -> Any:
            placed = self._kept if at is asked and self._kept is not None else self._pairs(at)
            return _rates(at, placed, self._changes(at, placed))

        return self._made(answer, asked, self._shape[-1])

    def _pairs(self, at: Asked) -> Pairs | None:
        """Where pairs are."""
        return _pairs(at)

    def _changes(self, at: Asked, placed: Pairs | None) -> Changes | None:
        """How pairs change."""
        return _changes(at, placed)

    def _made(self, answer: Callable[[Asked], Any], asked: Asked, width: int) -> Any:
        flat = in_pieces(self._own, asked.motion, asked, answer, self._count * width)
        values = flat.reshape(*self._shape[:-1], self._count, width)
        return np.ascontiguousarray(values) if isinstance(values, np.ndarray) else values.contiguous()


def _pairs(at: Asked) -> Pairs | None:
    return pairs(at.xp, at.tables, at.numbers, at.motion[0])


def _changes(at: Asked, placed: Pairs | None) -> Changes | None:
    return pair_changes(at.xp, at.tables, at.numbers, at.motion[1], placed)


def _rates(at: Asked, placed: Pairs | None, changes: Changes | None) -> Any:
    q, qd = at.motion
    return tie_jacobian_rate(at.xp, at.tables, q, qd, placed, changes)
