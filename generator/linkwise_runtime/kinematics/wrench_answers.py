"""Wrenches that joints bear, as one back end answers them for motion that has been read."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from ..interface import Numbers
from ..rule.joint_tree import JointTree
from .frame_answers import NONE, FrameAnswers, FrameRequest, Vectors, in_pieces
from .frame_arrays import FrameTables, forward_kinematics, frame_tables, rotate_vectors
from .joint_wrenches import (
    JointsAsked,
    JointTables,
    at_joints,
    cause_wrenches,
    joint_tables,
    on_frames,
    placed_joints,
)

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
        self.frames, self.tree, self._n = frames, frames.tree, frames.backend.structure.n
        self._tables: dict[object, JointTables] = {}
        self._loads = LoadedWrenches(self)

    def by_cause(
        self, asked: JointsAsked, q: Numbers, qd: Numbers, point: Numbers | None
    ) -> tuple[Numbers, Numbers, Numbers]:
        """Return wrenches of links per acceleration, per velocity, and of gravity, (..., joints, N, X, 6).

        X counts coordinates, and is 1 for gravity; velocities are those of the closing convention.

        q, qd: (..., n); point: (..., 3), about which moments are taken, in the axes of the answer
        """
        n = self._n
        shape = (len(asked.joints), len(self.tree.links), 2 * n + 1, 6)

        def answer(at: FrameRequest[JointTables]) -> Numbers:
            placed = placed_joints(at.xp, at.tables, at.numbers, at.motion[0], at.vectors.get(POINT))
            found = cause_wrenches(at.xp, at.tables, at.numbers, placed, at.motion[1])
            return at_joints(at.xp, at.tables, placed, at.xp.concat(found, 2))

        vectors = NONE if point is None else {POINT: point}
        request = self.frames.asked(self._tables, asked, self._listed, [q, qd], vectors)
        flat = in_pieces(self.frames.backend, [q, qd], request, answer, int(np.prod(shape)))
        whole = flat.reshape(*q.shape[:-1], *shape)
        return whole[..., :n, :], whole[..., n : 2 * n, :], whole[..., 2 * n :, :]

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
        return joint_tables(self.tree, self._n, asked)


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
            joint_tables(tree, n, part.joints),
            frame_tables(tree, n, part.frames),
            carried_frames(tree, part.joints.joints, part.frames),
        )
