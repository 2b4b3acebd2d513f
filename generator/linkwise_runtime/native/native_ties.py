"""Rows of ties and contacts at one sample, whose frames C answers for."""

from collections.abc import Callable, Iterable
from typing import Any, NamedTuple

import numpy as np

from ..constraints.chosen_constraints import ChosenConstraints
from ..constraints.tie_arrays import Changes, Ends, Pairs, paired
from ..constraints.tie_rows import RowsAt, TieRows
from ..kinematics.asked_samples import Asked
from ..kinematics.frame_arrays import Carried
from ..rule.kinematics import Poses
from ..structure import Structure
from .native_control import ControlCalls
from .native_library import NumberArray


class TieEnd(NamedTuple):
    """A frame of the tree, a point of it, and axes in it."""

    frame: int
    point: Any
    """(3,)"""
    axes: Any
    """(3, 3)"""


class NativeTieRows(TieRows):
    """Rows whose frames C answers for where there is one sample, arrays and tensors else."""

    def __init__(
        self,
        structure: Structure,
        backend: Any,
        check_finite: bool,
        read_beside_motion: Callable[[], Iterable[Any]],
        chosen: ChosenConstraints,
        control: ControlCalls,
    ) -> None:
        super().__init__(structure, backend, check_finite, read_beside_motion, chosen)
        held = chosen.held
        first = [TieEnd(one.first, np.array(one.point), one.axes) for one in held]
        second = [TieEnd(one.second, np.zeros(3), np.eye(3)) for one in held if one.second is not None]
        self._ends, self._control = [*first, *second], control

    def at(self, q: Any, held_at: Any = None) -> RowsAt:
        """Rows at positions that have been read, (..., n); contacts are held as they are, or at others."""
        if not (type(q) is np.ndarray and q.size == q.shape[-1] and self._ends):
            return super().at(q, held_at)
        asked = self._asked_at(self._backend.side(q), q, held_at)
        return NativeRowsAt(self._backend, asked, q, self._count, self._ends, self._control)


class NativeRowsAt(RowsAt):
    """Rows at one sample."""

    def __init__(
        self, own: Any, asked: Asked, q: NumberArray, count: int, ends: list[TieEnd], control: ControlCalls
    ) -> None:
        super().__init__(own, asked, tuple(q.shape), count)
        self._q, self._ends, self._control = q, ends, control
        self._jacobians: Any = None

    def _pairs(self, at: Asked) -> Pairs | None:
        poses, jacobians = self._of_ends("pose", (self._q,)), self._of_ends("jacobian", (self._q,))
        if poses is None or jacobians is None:
            return super()._pairs(at)
        self._jacobians = jacobians
        turns, kind = poses[:, :3, :3], poses.dtype
        points = np.array([end.point for end in self._ends], kind)[..., None]
        places = poses[:, :3, 3] + (turns @ points)[..., 0]
        axes = (turns @ np.array([end.axes for end in self._ends], kind)).transpose(1, 2, 0)[..., None]
        found = Ends(Carried(Poses(None, None), axes, None), places.T[..., None])
        return paired(np, at.tables, found, self._apart(at, jacobians))

    def _changes(self, at: Asked, placed: Pairs | None) -> Changes | None:
        qd = at.motion[1][:, 0]
        rates = None if self._jacobians is None else self._of_ends("jacobian_rate", (self._q, qd))
        if rates is None:
            return super()._changes(at, placed)
        speeds = (self._jacobians @ qd).T[..., None]
        return Changes(self._apart(at, rates), speeds[:3, : at.tables.pairs], speeds[3:])

    def _of_ends(self, call: str, motion: Any) -> Any:
        """Answers of C for all frames; None where it has none."""
        kind, found = self._q.dtype, []
        for end in self._ends:
            point = end.point.astype(kind) if call != "pose" and end.point.any() else None
            answer = self._control.answer(call, motion, end.frame, point)
            if answer is None:
                return None
            found.append(answer.reshape(answer.shape[-2:]))
        return np.array(found)

    def _apart(self, at: Asked, jacobians: Any) -> Any:
        """What the first frames of the pairs have less than the second ones, (6, P, n, 1)."""
        ties, pairs = at.tables.ties, at.tables.pairs
        moves = jacobians[:pairs].copy()
        moves[:ties] -= jacobians[pairs:]
        return moves.transpose(1, 0, 2)[..., None]
