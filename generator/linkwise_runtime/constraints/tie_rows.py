"""Rows of ties, couplings and contacts for positions that have been read."""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from ..answers.packed import TiedFunctions
from ..interface import Numbers, namespace, side_by_side
from ..kinematics.frame_answers import NONE, FrameAnswers, FrameRequest, in_pieces
from ..kinematics.joint_wrenches import JointsAsked, JointTables, joint_tables, on_frames, placed_joints
from ..kinematics.wrench_answers import POINT, carried_frames
from ..rule.kinematics import gather
from .chosen_constraints import TreeConstraints
from .held_frames import TieTables
from .rows import RowsThere
from .tie_arrays import (
    Changes,
    Pairs,
    ends,
    pair_changes,
    pairs,
    second_ends,
    tie_jacobian,
    tie_jacobian_rate,
    violation,
)

OnTies = FrameRequest[TieTables]


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

    def __init__(
        self, frames: FrameAnswers, chosen: TreeConstraints, functions: TiedFunctions | None = None
    ) -> None:
        self._frames, self._constants, self.count = frames, chosen.tables, len(chosen.rows)
        self.couplings = chosen.couplings
        self._tables: dict[object, TieTables] = {}
        self._borne = BorneRows(frames, chosen)
        self._has_contacts = chosen.tables.ties < chosen.tables.pairs
        self.functions = functions

    def at(self, q: Numbers, held_at: Numbers | None = None) -> RowsThere:
        """Return the rows at positions (..., n); contacts are held as they are there, or as at `held_at`."""
        held = held_at if self._has_contacts else None

        def of_arrays() -> RowsAt:
            asked = self._asked([q] if held is None else [q, held])
            return RowsAt(self._frames, asked, q, self.count)

        functions = self.functions if isinstance(q, np.ndarray) else None
        return of_arrays() if functions is None else FunctionRowsAt(functions, q, held, of_arrays)

    def violation(self, q: Numbers, held_at: Numbers) -> Numbers:
        """Return phi (..., C), from where contacts took hold."""
        found = None if self.functions is None else self.functions.answer("violation", [q], held_at)
        if found is not None:
            return found[0]

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


class FunctionRowsAt:
    """Rows at some positions, by a back end's functions; `else_at` makes those of arrays where these fail."""

    def __init__(
        self, functions: TiedFunctions, q: Numbers, held_at: Numbers | None, else_at: Callable[[], RowsAt]
    ) -> None:
        self._functions, self._q, self._held_at, self._else_at = functions, q, held_at, else_at

    def positions(self) -> Numbers:
        """Return phi and A beside it, (..., C, 1 + n)."""
        found = self._functions.answer("positions", [self._q], self._held_at)
        if found is None:
            return self._else_at().positions()
        return namespace(self._q).concat([found[0][..., None], found[1]], -1)

    def rates(self, qd: Numbers) -> Numbers:
        """Return dA/dt (..., C, n), for velocities (..., n) of the same samples."""
        found = self._functions.answer("jacobian_rate", [self._q, qd])
        return self._else_at().rates(qd) if found is None else found[0]


def _pairs(at: OnTies) -> Pairs | None:
    return pairs(at.xp, at.tables, at.numbers, at.motion[0])
