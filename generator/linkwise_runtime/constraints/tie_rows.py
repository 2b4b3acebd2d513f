"""Rows of ties, couplings and contacts for positions that have been read."""

from collections.abc import Callable, Sequence
from typing import NamedTuple, cast

import numpy as np
from numpy.typing import NDArray

from ..answers.packed import OneSample
from ..interface import Numbers, side_by_side
from ..kinematics.frame_answers import NONE, FrameAnswers, FrameRequest, in_pieces
from ..kinematics.frame_arrays import FramePoses
from ..kinematics.joint_wrenches import JointsAsked, JointTables, joint_tables, on_frames, placed_joints
from ..kinematics.wrench_answers import POINT, carried_frames
from ..rule.kinematics import Poses, gather
from .chosen_constraints import TreeConstraints
from .held_frames import TieTables
from .tie_arrays import (
    Changes,
    Ends,
    Pairs,
    ends,
    pair_changes,
    paired,
    pairs,
    second_ends,
    tie_jacobian,
    tie_jacobian_rate,
    violation,
)

OnTies = FrameRequest[TieTables]


class TieEnd(NamedTuple):
    """Frame of the tree, a point of it, and axes in it."""

    frame: int
    point: NDArray[np.float64]
    """(3,)"""
    axes: NDArray[np.float64]
    """(3, 3)"""


class BorneTies(NamedTuple):
    """Constants of joints, and of the ties and contacts whose forces they bear."""

    joints: JointTables
    ties: TieTables
    first: Numbers
    """(joints, rows, 1): ones where a joint carries the first frame of a row's pair."""
    second: Numbers
    """(joints, rows, 1): ones where a joint carries the second frame of a row's pair."""

    @property
    def moved(self) -> int:
        """Number of joints and frames, by which the memory of a call grows."""
        return self.joints.moved + self.ties.moved


class TieRows:
    """Rows of constraints on one back end: phi, A and dA/dt; arguments are as `Constraints` says."""

    unit_rows = False

    def __init__(self, frames: FrameAnswers, chosen: TreeConstraints) -> None:
        self._frames, self._constants, self.count = frames, chosen.tables, len(chosen.rows)
        self.couplings = chosen.couplings
        self._tables: dict[object, TieTables] = {}
        self._borne = BorneRows(frames, chosen)
        self._has_contacts = chosen.tables.ties < chosen.tables.pairs
        first = [TieEnd(one.first, np.array(one.point), one.axes) for one in chosen.held]
        seconds = [one.second for one in chosen.held if one.second is not None]
        self._ends = [*first, *(TieEnd(frame, np.zeros(3), np.eye(3)) for frame in seconds)]

    def at(self, q: Numbers, held_at: Numbers | None = None) -> "RowsAt":
        """Return the rows at positions (..., n); contacts are held as they are there, or as at `held_at`."""
        is_held = self._has_contacts and held_at is not None
        asked = self._asked([q, held_at] if is_held and held_at is not None else [q])
        one = self._frames.backend.one_sample
        if one is not None and isinstance(q, np.ndarray) and q.size == q.shape[-1] and self._ends:
            return RowsAtOne(self._frames, asked, q, self.count, self._ends, one)
        return RowsAt(self._frames, asked, q, self.count)

    def violation(self, q: Numbers, held_at: Numbers) -> Numbers:
        """Return phi (..., C), from where contacts took hold."""

        def answer(at: OnTies) -> Numbers:
            held = ends(at.xp, at.tables, at.numbers, at.motion[1]) if self._has_contacts else None
            return violation(at.xp, at.tables, at.motion[0], _pairs(at), held)

        motion = [q, held_at]
        values = in_pieces(self._frames.backend, motion, self._asked(motion), answer, self.count)
        return side_by_side(values.reshape(*q.shape[:-1], self.count))

    def rates(self, q: Numbers, qd: Numbers) -> Numbers:
        """Return dA/dt (..., C, n)."""
        return self.at(q).rates(qd)

    def on_joints(self, asked: JointsAsked, q: Numbers, point: Numbers | None) -> Numbers:
        """Return the wrenches of joints by unit forces of the rows of ties and contacts, (..., joints, C, 6).

        point: (..., 3), as for `WrenchAnswers.at_joints`
        """
        return self._borne.on_joints(asked, q, point)

    def _asked(self, motion: Sequence[Numbers]) -> OnTies:
        return self._frames.asked(self._tables, "rows", self._listed, motion)

    def _listed(self, part: object) -> TieTables:
        return self._constants


class BorneRows:
    """Rows of ties and contacts as joints bear them; couplings act within their joints."""

    def __init__(self, frames: FrameAnswers, chosen: TreeConstraints) -> None:
        self._frames, self._constants, self._held = frames, chosen.tables, chosen.held
        self._tables: dict[object, BorneTies] = {}

    def on_joints(self, asked: JointsAsked, q: Numbers, point: Numbers | None) -> Numbers:
        """Return the answer of `TieRows.on_joints`."""
        shape = (len(asked.joints), len(self._constants.row_pairs), 6)
        if not self._held:
            return self._frames.backend.zeros(q, 0).reshape(*q.shape[:-1], *shape)  # type: ignore[no-any-return]

        def answer(at: FrameRequest[BorneTies]) -> Numbers:
            xp, (joints, ties, first, second) = at.xp, at.tables
            found = pairs(xp, ties, at.numbers, at.motion[0])
            assert found is not None  # there are pairs
            placed = placed_joints(xp, joints, at.numbers, at.motion[0], at.vectors.get(POINT))
            places, rows = found.ends.places, ties.row_pairs
            others = gather(second_ends(xp, ties, places), rows)
            own = on_frames(xp, placed, first, gather(places[:, : ties.pairs], rows), found.weights)
            return own - on_frames(xp, placed, second, others, found.weights)

        given = NONE if point is None else {POINT: point}
        request = self._frames.asked(self._tables, asked, self._listed, [q], given)
        flat = in_pieces(self._frames.backend, [q], request, answer, int(np.prod(shape)))
        return flat.reshape(*q.shape[:-1], *shape)  # type: ignore[no-any-return]

    def _listed(self, asked: object) -> BorneTies:
        assert isinstance(asked, JointsAsked)
        tree, rows = self._frames.tree, self._constants.row_pairs
        first = carried_frames(tree, asked.joints, [one.first for one in self._held])
        # What is held to the ground has no other frame that a joint carries.
        others = [0 if one.second is None else one.second for one in self._held]
        apart = np.array([[float(one.second is not None)] for one in self._held])
        second = carried_frames(tree, asked.joints, others) * apart
        return BorneTies(joint_tables(tree, asked), self._constants, first[:, rows], second[:, rows])


class RowsAt:
    """Rows at some positions; for few samples, the pairs of frames are kept for the rates."""

    def __init__(self, frames: FrameAnswers, asked: OnTies, q: Numbers, count: int) -> None:
        self._frames, self._asked, self._count = frames, asked, count
        self._shape = tuple(q.shape)
        self._kept: Pairs | None = None

    def positions(self) -> Numbers:
        """Return phi and A beside it, (..., C, 1 + n)."""

        def answer(at: OnTies) -> Numbers:
            placed = self._pairs(at)
            if at is self._asked:
                self._kept = placed
            q, *held_at = at.motion
            held = ends(at.xp, at.tables, at.numbers, *held_at) if held_at else None
            phi = violation(at.xp, at.tables, q, placed, held)
            return at.xp.concat([phi[:, None], tie_jacobian(at.xp, at.tables, q, placed)], 1)

        return self._made(answer, self._asked, 1 + self._shape[-1])

    def rates(self, qd: Numbers) -> Numbers:
        """Return dA/dt (..., C, n), for velocities (..., n) of the same samples."""
        first = self._asked
        flat = first.xp.swapaxes(qd.reshape(-1, qd.shape[-1]), 0, 1)
        asked = first._replace(motion=[first.motion[0], flat])

        def answer(at: OnTies) -> Numbers:
            placed = self._kept if at is asked and self._kept is not None else self._pairs(at)
            q, moved = at.motion
            return tie_jacobian_rate(at.xp, at.tables, q, moved, placed, self._changes(at, placed))

        return self._made(answer, asked, self._shape[-1])

    def _pairs(self, at: OnTies) -> Pairs | None:
        """Return the pairs at these positions; None without ties and contacts."""
        return _pairs(at)

    def _changes(self, at: OnTies, placed: Pairs | None) -> Changes | None:
        """Return the rates of the pairs; None without ties and contacts."""
        return pair_changes(at.xp, at.tables, at.numbers, at.motion[1], placed)

    def _made(self, answer: Callable[[OnTies], Numbers], asked: OnTies, width: int) -> Numbers:
        flat = in_pieces(self._frames.backend, asked.motion, asked, answer, self._count * width)
        return side_by_side(flat.reshape(*self._shape[:-1], self._count, width))


class RowsAtOne(RowsAt):
    """Rows at one sample, on a back end that has functions for its frames."""

    def __init__(
        self,
        frames: FrameAnswers,
        asked: OnTies,
        q: NDArray[np.floating],
        count: int,
        ends: Sequence[TieEnd],
        one: OneSample,
    ) -> None:
        super().__init__(frames, asked, q, count)
        self._q, self._ends, self._one = q, ends, one
        self._jacobians: NDArray[np.floating] | None = None

    def _pairs(self, at: OnTies) -> Pairs | None:
        poses, jacobians = self._of_ends("pose", [self._q]), self._of_ends("jacobian", [self._q])
        if poses is None or jacobians is None:
            return super()._pairs(at)
        self._jacobians = jacobians
        turns, kind = poses[:, :3, :3], poses.dtype
        points = np.array([end.point for end in self._ends], kind)[..., None]
        places = poses[:, :3, 3] + (turns @ points)[..., 0]
        axes = (turns @ np.array([end.axes for end in self._ends], kind)).transpose(1, 2, 0)[..., None]
        # Where the frames are known, their joints are not needed.
        found = Ends(FramePoses(cast(Poses, None), axes, cast(Numbers, None)), places.T[..., None])
        return paired(at.xp, at.tables, found, self._apart(at, jacobians))

    def _changes(self, at: OnTies, placed: Pairs | None) -> Changes | None:
        qd = cast("NDArray[np.floating]", at.motion[1])[:, 0]
        rates = None if self._jacobians is None else self._of_ends("jacobian_rate", [self._q, qd])
        if rates is None or self._jacobians is None:
            return super()._changes(at, placed)
        speeds = (self._jacobians @ qd).T[..., None]
        return Changes(self._apart(at, rates), speeds[:3, : at.tables.pairs], speeds[3:])

    def _of_ends(self, call: str, motion: Sequence[NDArray[np.floating]]) -> NDArray[np.floating] | None:
        """Return the answers for all frames; None where the back end has none."""
        kind, found = self._q.dtype, []
        for end in self._ends:
            point = end.point.astype(kind) if call != "pose" and end.point.any() else None
            answer = self._one.answer(call, motion, end.frame, point)
            if answer is None:
                return None
            found.append(answer.reshape(answer.shape[-2:]))
        return np.array(found)

    def _apart(self, at: OnTies, jacobians: NDArray[np.floating]) -> NDArray[np.floating]:
        """Return the part of the pairs' first frames minus that of the second ones, (6, P, n, 1)."""
        moves = jacobians[: at.tables.pairs].copy()
        moves[: at.tables.ties] -= jacobians[at.tables.pairs :]
        return moves.transpose(1, 0, 2)[..., None]


def _pairs(at: OnTies) -> Pairs | None:
    return pairs(at.xp, at.tables, at.numbers, at.motion[0])
