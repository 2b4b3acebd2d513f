"""Calls on frames as one back end answers them, for motion that has been read, with samples innermost."""

import math
from collections.abc import Callable, Mapping, Sequence
from types import MethodType
from typing import Any, Generic, NamedTuple, Protocol, TypeVar, cast

from ..answers.answers import answer_shapes
from ..answers.packed import PackedBackend
from ..arguments import Beside
from ..chosen_names import choice, known_as, short, whole_number
from ..interface import Dtype, Namespace, Numbers, TableKind, side_by_side
from ..rule.joint_tree import JointTree
from ..rule.kinematics import Twists
from ..rule.tables import converted
from ..rule.tree_arrays import TreeArrays, formula_sources, own_numbers
from .frame_arrays import (
    FramePoses,
    FrameTables,
    acceleration_of,
    centre_jacobian,
    centre_jacobian_rate,
    centre_of_mass,
    forward_kinematics,
    frame_tables,
    homogeneous,
    jacobian,
    jacobian_rate,
    link_tables,
    load_torque,
    moving,
    point_at,
    velocity_of,
)

ALL, LINKS = "all frames", "links"
"""Parts of a robot that a call may be for, where it is not one frame by its number."""
CACHE = 1 << 21
"""Size in bytes of the arrays of one piece of a batch, which are to stay in the processor's cache."""
NUMBERS = 60
"""Count of numbers that a joint or a frame has for one sample."""
VECTORS = {
    "point": "x, y, z in the frame, in m",
    "at": "x, y, z in the world, in m",
    "force": "x, y, z in the world, in N",
    "moment": "x, y, z in the world, in N m",
}
"""Arguments that may be given beside the motion."""

Vectors = Mapping[str, Numbers]
"""Vectors given beside the motion, by name."""
NONE: Vectors = {}


class Moved(Protocol):
    """Tables that say by how much the memory of a call grows."""

    @property
    def moved(self) -> int:
        """Number of joints and frames."""


Tables = TypeVar("Tables", bound=Moved)


OwnNumbers = tuple[TreeArrays, Numbers]
"""Numbers of a tree, and the place of each among these and those of formulas."""


class FrameRequest(NamedTuple, Generic[Tables]):
    """Data that a call computes with: constants, the tree's numbers, motion (n, samples) each."""

    xp: Namespace
    tables: Tables
    numbers: TreeArrays
    motion: Sequence[Numbers]
    vectors: Vectors
    """Vectors beside the motion, (3, 1, samples) each."""

    def some(self, samples: slice) -> "FrameRequest[Tables]":
        """Return the data for some of the samples; numbers that all samples share are kept."""
        numbers = (a[..., samples] if a.shape[-1] > 1 else a for a in self.numbers)
        vectors = {name: a[..., samples] for name, a in self.vectors.items()}
        motion = [a[:, samples] for a in self.motion]
        return FrameRequest(self.xp, self.tables, TreeArrays(*numbers), motion, vectors)


OnFrames = FrameRequest[FrameTables]


def _frame(at: OnFrames, from_world: bool = False) -> FramePoses:
    """Return the place of the frame asked for, or of all frames."""
    return forward_kinematics(at.xp, at.tables, at.numbers, at.numbers.offsets, at.motion[0], from_world)


def _centres(at: OnFrames, from_world: bool = False) -> FramePoses:
    """Return the places of the links' centres of mass."""
    return forward_kinematics(at.xp, at.tables, at.numbers, at.numbers.centres, at.motion[0], from_world)


def _place(at: OnFrames, found: FramePoses) -> Numbers:
    """Return the place of the point, the frame's origin unless given."""
    return point_at(found, at.vectors.get("point"))


def _moving(at: OnFrames, found: FramePoses) -> Twists:
    """Return the motion of the joints."""
    qd, *qdd = at.motion[1:]
    return moving(at.xp, at.tables, at.numbers, found, qd, qdd[0] if qdd else None)


def _pose(at: OnFrames) -> Numbers:
    return homogeneous(at.xp, _frame(at, from_world=True))[:, :, 0]


def _poses(at: OnFrames) -> Numbers:
    matrices = homogeneous(at.xp, _frame(at, from_world=True))
    # (4, 4, F, samples) -> (F, 4, 4, samples)
    return at.xp.swapaxes(at.xp.swapaxes(matrices, 0, 2), 1, 2)


def _jacobian(at: OnFrames) -> Numbers:
    found = _frame(at)
    return jacobian(at.xp, at.tables, found, _place(at, found))


def _jacobian_rate(at: OnFrames) -> Numbers:
    found = _frame(at)
    return jacobian_rate(at.xp, at.tables, _moving(at, found), _place(at, found))


def _velocity(at: OnFrames) -> Numbers:
    found = _frame(at)
    return velocity_of(at.xp, at.tables, _moving(at, found), _place(at, found))[:, 0]


def _acceleration(at: OnFrames) -> Numbers:
    found = _frame(at)
    return acceleration_of(at.xp, at.tables, _moving(at, found), _place(at, found))[:, 0]


def _load_torque(at: OnFrames) -> Numbers:
    given = at.vectors
    found = _frame(at, from_world="at" in given)
    x = given["at"] if "at" in given else _place(at, found)
    return load_torque(at.xp, at.tables, found, x, given["force"], given.get("moment"))


def _centre_of_mass(at: OnFrames) -> Numbers:
    return centre_of_mass(at.numbers.masses, _centres(at, from_world=True))


def _centre_jacobian(at: OnFrames) -> Numbers:
    return centre_jacobian(at.xp, at.tables, at.numbers.masses, _centres(at))


def _centre_jacobian_rate(at: OnFrames) -> Numbers:
    found = _centres(at)
    return centre_jacobian_rate(at.xp, at.tables, at.numbers.masses, found, _moving(at, found))


ANSWERS: Mapping[str, Callable[[OnFrames], Numbers]] = {
    "pose": _pose,
    "poses": _poses,
    "jacobian": _jacobian,
    "jacobian_rate": _jacobian_rate,
    "velocity": _velocity,
    "acceleration": _acceleration,
    "load_torque": _load_torque,
    "centre_of_mass": _centre_of_mass,
    "centre_of_mass_jacobian": _centre_jacobian,
    "centre_of_mass_jacobian_rate": _centre_jacobian_rate,
}
"""Functions for the rows of the table by their names; samples are the last axis."""


def make_frame_tables(
    answers: "FrameAnswers", owner: Any, part: object, dtype: Dtype, device: object
) -> None:
    """Make the tree's numbers, and the table of a part that `owner` lists and keeps, unless they are there.

    Compilers run this while they compile, do not follow it, and then find both made.
    """
    key, like = (dtype, device), cast("Numbers", TableKind(dtype, device))
    if key not in answers._own:
        own: OwnNumbers = own_numbers(answers.tree), formula_sources(answers.tree)
        answers._own[key] = converted(own, answers.backend, like)
    if (part, key) not in owner._tables:
        owner._tables[part, key] = converted(owner._listed(part), answers.backend, like)


class FrameAnswers:
    """Calls on frames on one back end; tables are made when first needed, for each dtype and device."""

    def __init__(
        self, backend: PackedBackend, tree: JointTree, numbers: Callable[[OwnNumbers, Numbers], TreeArrays]
    ) -> None:
        """Set up the calls.

        numbers: returns the tree's numbers for the parameters and the bodies, to compute with some positions
        """
        self.backend, self.tree, self._numbers = backend, tree, numbers
        self.names = tuple(frame.name for frame in self.tree.frames)
        self._own: dict[object, OwnNumbers] = {}
        self._tables: dict[object, FrameTables] = {}
        self._shapes = answer_shapes(backend.structure, len(self.names))

    def shape(self, call: str) -> tuple[int, ...]:
        """Return the shape of a call's answer for one sample."""
        return self._shapes[f"kinematics.{call}"][0]

    def answer(
        self, call: str, motion: Sequence[Numbers], part: object = ALL, vectors: Vectors = NONE
    ) -> Numbers:
        """Return the answer (..., *shape) to motion and vectors in one shape of samples.

        part: a frame by its number, all of them, or the links
        """
        point, one = vectors.get("point"), self.backend.one_sample
        if one is not None and isinstance(part, int) and vectors.keys() <= {"point"}:
            found = one.answer(call, motion, part, point)
            if found is not None:
                return found
        batch = tuple(motion[0].shape[:-1])
        asked = self.asked(self._tables, part, self._listed, motion, vectors)
        shape = self.shape(call)
        values = in_pieces(self.backend, motion, asked, ANSWERS[call], math.prod(shape))
        return side_by_side(values.reshape(*batch, *shape))

    def asked(
        self,
        tables: dict[object, Tables],
        part: object,
        listed: Callable[[object], Tables],
        motion: Sequence[Numbers],
        vectors: Vectors = NONE,
    ) -> FrameRequest[Tables]:
        """Return the constants, numbers and motion of a call, with samples innermost.

        tables: those of parts, for each dtype and device; listed: method of their owner that makes the one of
        a part, in float64
        """
        q, xp = motion[0], self.backend.xp
        key = q.dtype, getattr(q, "device", None)
        make_frame_tables(self, cast(MethodType, listed).__self__, part, *key)
        numbers = self._numbers(self._own[key], q)
        flat = [xp.swapaxes(a.reshape(-1, a.shape[-1]), 0, 1) for a in motion]
        placed = {name: xp.swapaxes(a.reshape(-1, 3), 0, 1)[:, None] for name, a in vectors.items()}
        return FrameRequest(xp, tables[part, key], numbers, flat, placed)

    def _listed(self, part: object) -> FrameTables:
        n = self.backend.structure.n
        if part == LINKS:
            return link_tables(self.tree, n)
        return frame_tables(self.tree, n, [part] if isinstance(part, int) else range(len(self.names)))


def in_pieces(
    backend: PackedBackend,
    motion: Sequence[Numbers],
    at: FrameRequest[Tables],
    answer: Callable[[FrameRequest[Tables]], Numbers],
    count: int,
) -> Numbers:
    """Return answers (samples, count), computed for as many samples at once as the back end wants."""
    xp, samples = at.xp, at.motion[0].shape[1]
    size = backend.chunk(motion, max(16, CACHE // (motion[0].itemsize * (NUMBERS * at.tables.moved + count))))
    if size is None or samples <= size:
        return xp.swapaxes(answer(at).reshape(count, samples), 0, 1)
    whole = xp.empty((samples, count), dtype=motion[0].dtype)
    for start in range(0, samples, size):
        piece = slice(start, min(start + size, samples))
        found = answer(at.some(piece)).reshape(count, piece.stop - start)
        whole[piece] = xp.swapaxes(found, 0, 1)
    return whole


def vectors_beside(given: Mapping[str, object], prefix: str = "") -> dict[str, Beside]:
    """Return the vectors that are to be read beside motion, without those that are None.

    prefix: put before their names
    """
    return {prefix + name: Beside(a, (3,), VECTORS[name]) for name, a in given.items() if a is not None}


def frame_index(given: object, frames: Sequence[str]) -> int:
    """Return the index among `frames` of a frame given by its name, or by that index, as in C.

    Raises ValueError for one that does not exist, TypeError for what is neither a name nor a number.
    """
    if isinstance(given, str):
        if (name := known_as(given, frames)) is not None:
            return frames.index(name)
        known = choice(given, frames, "kinematics.frames")
        raise ValueError(f"frame is {short(given)}, which is not there; choose {known}")
    number = whole_number(given)
    if number is None:
        raise TypeError(
            f"frame is {short(given)}; give the name of a frame, or its number in kinematics.frames"
        )
    if not 0 <= number < len(frames):
        raise ValueError(
            f"frame is {number}, but frames are numbered 0..{len(frames) - 1}, in the order of "
            "kinematics.frames; or give a frame's name"
        )
    return number
