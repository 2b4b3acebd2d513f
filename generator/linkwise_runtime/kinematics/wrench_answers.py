"""Wrenches that joints bear, as one back end answers them for motion that has been read."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from ..interface import Numbers
from ..rule.joint_tree import JointTree
from ..rule.kinematics import gather
from .frame_answers import LINKS, NONE, FrameAnswers, FrameRequest, Vectors, in_pieces
from .frame_arrays import FrameTables, forward_kinematics, frame_tables, rotate_vectors
from .joint_wrenches import (
    JointsAsked,
    JointTables,
    joint_tables,
    on_frames,
    placed_joints,
    shifts_to_joints,
)
from .link_wrenches import CauseTables, CauseWrenches, cause_tables, cause_wrenches, shifts_to_hinges

POINT = "point"
"""Name of the point about which moments are taken, among the vectors beside the motion."""


class OnFrame(NamedTuple):
    """Force and moment on a frame."""

    frame: int
    vectors: Mapping[str, str]
    """Names under which its vectors are read, by what they are: force, moment, point or at."""


class LoadTables(NamedTuple):
    """Constants of joints and of the frames on which loads act."""

    joints: JointTables
    frames: FrameTables
    carried: Numbers
    """(joints, frames, 1): ones where a joint carries a frame."""

    @property
    def moved(self) -> int:
        """Number of joints and frames, by which the memory of a call grows."""
        return self.joints.moved + self.frames.moved


class LoadedJoints(NamedTuple):
    """Joints whose wrenches are asked for, and frames on which loads act."""

    joints: JointsAsked
    frames: tuple[int, ...]


def carried_frames(tree: JointTree, joints: Sequence[int], frames: Sequence[int]) -> Numbers:
    """Return ones where a joint carries a frame, (joints, frames, 1)."""
    chains = [tree.chain(tree.frames[frame].joint) for frame in frames]
    return np.array([[float(f in chain) for chain in chains] for f in joints])[..., None]


class WrenchAnswers:
    """Wrenches of joints; tables are made when first needed, for each dtype and device."""

    def __init__(self, frames: FrameAnswers) -> None:
        self.frames, self.tree = frames, frames.tree
        self._tables: dict[object, JointTables] = {}
        self._loads = LoadedWrenches(self)
        self._links = WrenchesOfLinks(self)

    def of_links(self, q: Numbers, qd: Numbers) -> CauseWrenches:
        """Return the wrenches of links by cause, about the first hinges of their paths, (..., N, X, 6).

        q, qd: (..., n)
        """
        return self._links.answer(q, qd)

    def of_packed(self, q: Numbers, packed: Sequence[Numbers]) -> CauseWrenches:
        """Return the answer of `of_links` from the wrenches that C has, about the joints that move the links.

        packed: per acceleration and per velocity, (..., count, 6) in the order of `Layout.torque`, and of
        weights (..., N, 6)
        """
        return self._links.of_packed(q, packed)

    def at_joints(
        self, asked: JointsAsked, q: Numbers, point: Numbers | None, wrenches: Sequence[Numbers]
    ) -> list[Numbers]:
        """Return wrenches of links (..., N, X, 6), as `of_links` has them, as joints carry them.

        (..., joints, N, X, 6) each

        q: (..., n); point: (..., 3), about which moments are taken, in the axes of the answer
        """

        def answer(at: FrameRequest[JointTables]) -> Numbers:
            placed = placed_joints(at.xp, at.tables, at.numbers, at.motion[0], at.vectors.get(POINT))
            return shifts_to_joints(at.xp, at.tables, placed)

        vectors = NONE if point is None else {POINT: point}
        request = self.frames.asked(self._tables, asked, self._listed, [q], vectors)
        count, links = len(asked.joints), len(self.tree.links)
        each = count * len(request.tables.hinged) + 1
        flat = in_pieces(self.frames.backend, [q], request, answer, 36 * each)
        found = gather(flat.reshape(*q.shape[:-1], each, 6, 6), request.tables.shifts, -3)
        shifts = found.reshape(*q.shape[:-1], count, links, 6, 6)
        return [self.frames.backend.product(wrench[..., None, :, :, :], shifts) for wrench in wrenches]

    def of_loads(
        self,
        asked: JointsAsked,
        q: Numbers,
        point: Numbers | None,
        loads: Sequence[OnFrame],
        vectors: Vectors,
    ) -> Numbers:
        """Return the wrenches that loads on frames ask of the joints, (..., joints, loads, 6).

        vectors: those of the loads, (..., 3) each, by name
        """
        return self._loads.answer(asked, q, point, loads, vectors)

    def _listed(self, asked: object) -> JointTables:
        assert isinstance(asked, JointsAsked)
        return joint_tables(self.tree, asked)


class WrenchesOfLinks:
    """Wrenches of links by cause, which are the same for all joints that carry a link."""

    def __init__(self, owner: WrenchAnswers) -> None:
        self._frames, self._structure = owner.frames, owner.frames.backend.structure
        self._tables: dict[object, CauseTables] = {}

    def answer(self, q: Numbers, qd: Numbers) -> CauseWrenches:
        """Return the answer of `WrenchAnswers.of_links`."""
        n, links = self._structure.n, self._structure.N

        def answer(at: FrameRequest[CauseTables]) -> Numbers:
            found = at.xp.concat(cause_wrenches(at.xp, at.tables, at.numbers, *at.motion), 2)
            # (6, N, X, samples) -> (N X, 6, samples)
            return at.xp.swapaxes(found.reshape(6, links * (2 * n + 1), found.shape[3]), 0, 1)

        request = self._frames.asked(self._tables, LINKS, self._listed, [q, qd])
        shape = (links, 2 * n + 1, 6)
        flat = in_pieces(self._frames.backend, [q, qd], request, answer, int(np.prod(shape)))
        whole = flat.reshape(*q.shape[:-1], *shape)
        return CauseWrenches(whole[..., :n, :], whole[..., n : 2 * n, :], whole[..., 2 * n :, :])

    def of_packed(self, q: Numbers, packed: Sequence[Numbers]) -> CauseWrenches:
        """Return the answer of `WrenchAnswers.of_packed`."""
        xp, (c2, c1, g), links = self._frames.backend.xp, packed, self._structure.N

        def answer(at: FrameRequest[CauseTables]) -> Numbers:
            return shifts_to_hinges(at.xp, at.tables, at.numbers, at.motion[0])

        request = self._frames.asked(self._tables, LINKS, self._listed, [q])
        flat = in_pieces(self._frames.backend, [q], request, answer, 36 * links)
        shifts: Numbers = flat.reshape(*q.shape[:-1], links, 6, 6)

        def spread(rows: Numbers) -> Numbers:
            padded = xp.concat([rows, xp.zeros_like(rows[..., :1, :])], -2)
            every = gather(padded, request.tables.packed, -2)
            dense: Numbers = every.reshape(*q.shape[:-1], links, self._structure.n, 6)
            return dense @ shifts

        return CauseWrenches(spread(c2), spread(c1), g[..., None, :] @ shifts)

    def _listed(self, part: object) -> CauseTables:
        return cause_tables(self._frames.tree, self._structure.n, self._structure.layout.torque)


class LoadedWrenches:
    """Wrenches that loads ask of the joints."""

    def __init__(self, owner: WrenchAnswers) -> None:
        self._frames, self._owner = owner.frames, owner
        self._tables: dict[object, LoadTables] = {}

    def answer(
        self,
        asked: JointsAsked,
        q: Numbers,
        point: Numbers | None,
        loads: Sequence[OnFrame],
        vectors: Vectors,
    ) -> Numbers:
        """Return the answer of `WrenchAnswers.of_loads`."""

        def wrenches(at: FrameRequest[LoadTables]) -> Numbers:
            xp, own = at.xp, at.tables.frames
            found = forward_kinematics(xp, own, at.numbers, at.numbers.offsets, at.motion[0], True)
            places, forces = [], []
            for number, load in enumerate(loads):
                given = {what: at.vectors[name] for what, name in load.vectors.items()}
                here = slice(number, number + 1)
                place = found.places[:, here]
                if "point" in given:
                    place = place + rotate_vectors(found.axes[:, :, here], given["point"])
                places.append(given.get("at", place))
                force = given["force"]
                forces.append(xp.concat([given.get("moment", 0.0 * force), force], 0))
            placed = placed_joints(xp, at.tables.joints, at.numbers, at.motion[0], at.vectors.get(POINT))
            every = [xp.concat(parts, 1) for parts in (places, forces)]
            return on_frames(xp, placed, at.tables.carried, *every)

        shape = (len(asked.joints), len(loads), 6)
        part = LoadedJoints(asked, tuple(load.frame for load in loads))
        given = vectors if point is None else {**vectors, POINT: point}
        request = self._frames.asked(self._tables, part, self._listed, [q], given)
        flat = in_pieces(self._frames.backend, [q], request, wrenches, int(np.prod(shape)))
        found: Numbers = flat.reshape(*q.shape[:-1], *shape)
        return found

    def _listed(self, part: object) -> LoadTables:
        assert isinstance(part, LoadedJoints)
        tree, n = self._owner.tree, self._frames.backend.structure.n
        return LoadTables(
            joint_tables(tree, part.joints),
            frame_tables(tree, n, part.frames),
            carried_frames(tree, part.joints.joints, part.frames),
        )
