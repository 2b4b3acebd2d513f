"""Rows of ties, couplings and contacts for a motion as a user gives it."""

from collections.abc import Callable, Iterable
from typing import Any

from ..kinematics.kinematic_answers import Asked, KinematicAnswers
from ..structure import Structure
from .tie_arrays import ends, tie_jacobian, tie_jacobian_rate, violation
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
        tables: TieTables,
        count: int,
    ) -> None:
        super().__init__(structure, backend, check_finite, read_beside_motion)
        self._constants, self._count = tables, count

    def positions(self, q: Any) -> Any:
        """phi, without what contacts have, and A beside it: (..., C, 1 + n)."""

        def answer(at: Asked) -> Any:
            placed = _ends(at)
            own = violation(at.xp, at.tables, at.motion[0], placed, None)
            rows = tie_jacobian(at.xp, at.tables, at.motion[0], placed)
            return at.xp.concat([own[:, None], rows], 1)

        return self._rows("positions", (q,), answer, (self._count, 1 + self._structure.n))

    def violation(self, q: Any, held_at: Any) -> Any:
        """phi, (..., C), from where contacts took hold."""

        def answer(at: Asked) -> Any:
            held = ends(at.xp, at.tables, at.numbers, at.motion[1])
            return violation(at.xp, at.tables, at.motion[0], _ends(at), held)

        given = q, q if held_at is None else held_at
        return self._rows("violation", given, answer, (self._count,), ("q", "held_at"))

    def rates(self, q: Any, qd: Any) -> Any:
        """dA/dt, (..., C, n)."""

        def answer(at: Asked) -> Any:
            q, qd = at.motion
            return tie_jacobian_rate(at.xp, at.tables, at.numbers, q, qd, _ends(at))

        return self._rows("rates", (q, qd), answer, (self._count, self._structure.n))

    def _rows(self, call: str, given: Any, answer: Any, shape: Any, names: Any = ("q", "qd")) -> Any:
        return self._answer(call, given, ROWS_OF, {}, answer, shape, None, names)

    def _tables_of(self, part: Any) -> TieTables:
        return self._constants


def _ends(at: Asked) -> Any:
    return ends(at.xp, at.tables, at.numbers, at.motion[0])
