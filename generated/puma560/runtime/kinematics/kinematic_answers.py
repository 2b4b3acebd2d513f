"""The calls of `Kinematics` behind its face: motion is checked, answers computed and put where `out` says."""

import math
from collections.abc import Callable, Iterable, Sequence
from typing import Any, NamedTuple

import numpy as np

from ..answers import MOTION
from ..arguments import check_numbers
from ..outputs import accepted
from ..rule.joint_tree import JointTree
from ..rule.rule_tables import converted
from ..rule.tree_arrays import TreeArrays, formula_sources, own_numbers
from ..structure import Structure
from .frame_arrays import (
    Carried,
    acceleration_of,
    carried,
    centre_jacobian,
    centre_jacobian_rate,
    centre_of_mass,
    homogeneous,
    jacobian,
    jacobian_rate,
    load_torque,
    moving,
    point_at,
    velocity_of,
)
from .frame_tables import frame_tables, link_tables
from .named_frames import frame_index

CACHE = 1 << 21
"""Bytes of the arrays of one piece of a batch, which are to stay in the processor's cache."""
NUMBERS = 60
"""Numbers that a joint or a frame has of one sample."""
ALL, LINKS = "all frames", "links"
VECTORS = {
    "point": "x, y, z in the frame, in m",
    "at": "x, y, z in the world, in m",
    "force": "x, y, z in the world, in N",
    "moment": "x, y, z in the world, in N m",
}
"""What may be given beside motion."""


class Asked(NamedTuple):
    """What a call computes with: array namespace, constants, the tree's numbers, motion (n, samples) each."""

    xp: Any
    tables: Any
    """`FrameTables`, or others that tell how much they move."""
    numbers: TreeArrays
    motion: list[Any]
    vectors: dict[str, Any]
    """Those of `VECTORS` that were given, (3, 1, samples) each."""

    def frame(self, from_world: bool = False) -> Carried:
        """The frame, or all of them."""
        q, offsets = self.motion[0], self.numbers.offsets
        return carried(self.xp, self.tables, self.numbers, offsets, q, from_world)

    def centres(self, from_world: bool = False) -> Carried:
        """Centres of mass of the links."""
        q, offsets = self.motion[0], self.numbers.centres
        return carried(self.xp, self.tables, self.numbers, offsets, q, from_world)

    def place(self, found: Carried) -> Any:
        """Where the point is, the frame's origin unless given."""
        return point_at(found, self.vectors.get("point"))

    def moving(self, found: Carried) -> Any:
        """Motion of the joints."""
        return moving(self.xp, self.tables, self.numbers, found, *self.motion[1:])

    def some(self, samples: slice) -> "Asked":
        """The same for some of the samples; of a number that all share there is one."""
        numbers = (a[..., samples] if a.shape[-1] > 1 else a for a in self.numbers)
        vectors = {name: a[..., samples] for name, a in self.vectors.items()}
        motion = [a[:, samples] for a in self.motion]
        return Asked(self.xp, self.tables, TreeArrays(*numbers), motion, vectors)


class KinematicAnswers:
    """The calls on a back end; arguments as `Kinematics` says."""

    def __init__(
        self,
        structure: Structure,
        backend: Any,
        check_finite: bool,
        read_beside_motion: Callable[[], Iterable[Any]],
    ) -> None:
        """Raises ValueError for a robot without a tree of rigid links."""
        if backend.tree is None:
            raise ValueError(
                f"the links of {structure.name} are energies, which do not say where anything is; kinematics "
                "is there for rigid links"
            )
        self._structure, self._backend, self._check_finite = structure, backend, check_finite
        self._read_beside_motion = read_beside_motion
        self._tree: JointTree = backend.tree
        self.frames = tuple(frame.name for frame in self._tree.frames)
        self._listed: dict[Any, Any] = {}
        self._tables: dict[Any, Any] = {}

    def pose(self, q: Any, frame: Any, out: Any) -> Any:
        """See `Kinematics.pose`."""

        def answer(at: Asked) -> Any:
            return homogeneous(at.xp, at.frame(from_world=True))[:, :, 0]

        return self._answer("pose", (q,), self._index(frame), {}, answer, (4, 4), out)

    def poses(self, q: Any, out: Any) -> Any:
        """See `Kinematics.poses`."""

        def answer(at: Asked) -> Any:
            matrices = homogeneous(at.xp, at.frame(from_world=True))
            # (4, 4, F, samples) -> (F, 4, 4, samples)
            return at.xp.swapaxes(at.xp.swapaxes(matrices, 0, 2), 1, 2)

        return self._answer("poses", (q,), ALL, {}, answer, (len(self.frames), 4, 4), out)

    def jacobian(self, q: Any, frame: Any, point: Any, out: Any) -> Any:
        """See `Kinematics.jacobian`."""

        def answer(at: Asked) -> Any:
            found = at.frame()
            return jacobian(at.xp, at.tables, found, at.place(found))

        return self._answer(
            "jacobian", (q,), self._index(frame), {"point": point}, answer, (6, self._structure.n), out
        )

    def jacobian_rate(self, q: Any, qd: Any, frame: Any, point: Any, out: Any) -> Any:
        """See `Kinematics.jacobian_rate`."""
        shape = 6, self._structure.n
        return self._moving("jacobian_rate", (q, qd), frame, point, jacobian_rate, shape, out)

    def velocity(self, q: Any, qd: Any, frame: Any, point: Any, out: Any) -> Any:
        """See `Kinematics.velocity`."""
        return self._moving("velocity", (q, qd), frame, point, velocity_of, (6,), out)

    def acceleration(self, q: Any, qd: Any, qdd: Any, frame: Any, point: Any, out: Any) -> Any:
        """See `Kinematics.acceleration`."""
        return self._moving("acceleration", (q, qd, qdd), frame, point, acceleration_of, (6,), out)

    def load_torque(self, q: Any, frame: Any, force: Any, moment: Any, point: Any, at: Any, out: Any) -> Any:
        """See `Kinematics.load_torque`."""
        if force is None:
            raise TypeError(
                "force is None; give its x, y, z in the world's axes, in N, zeros for a moment alone"
            )
        if point is not None and at is not None:
            raise ValueError(
                "point and at both say where the force acts; give point in the frame, or at in the world"
            )

        def answer(asked: Asked) -> Any:
            given = asked.vectors
            found = asked.frame(from_world="at" in given)
            x = given["at"] if "at" in given else asked.place(found)
            return load_torque(asked.xp, asked.tables, found, x, given["force"], given.get("moment"))

        vectors = {"force": force, "moment": moment, "point": point, "at": at}
        return self._answer(
            "load_torque", (q,), self._index(frame), vectors, answer, (self._structure.n,), out
        )

    def centre_of_mass(self, q: Any, out: Any) -> Any:
        """See `Kinematics.centre_of_mass`."""

        def answer(at: Asked) -> Any:
            return centre_of_mass(at.numbers.masses, at.centres(from_world=True))

        return self._answer("centre_of_mass", (q,), LINKS, {}, answer, (3,), out)

    def centre_of_mass_jacobian(self, q: Any, out: Any) -> Any:
        """See `Kinematics.centre_of_mass_jacobian`."""

        def answer(at: Asked) -> Any:
            return centre_jacobian(at.xp, at.tables, at.numbers.masses, at.centres())

        return self._answer("centre_of_mass_jacobian", (q,), LINKS, {}, answer, (3, self._structure.n), out)

    def centre_of_mass_jacobian_rate(self, q: Any, qd: Any, out: Any) -> Any:
        """See `Kinematics.centre_of_mass_jacobian_rate`."""

        def answer(at: Asked) -> Any:
            found = at.centres()
            moved = at.moving(found)
            return centre_jacobian_rate(at.xp, at.tables, at.numbers.masses, found, moved)

        return self._answer(
            "centre_of_mass_jacobian_rate", (q, qd), LINKS, {}, answer, (3, self._structure.n), out
        )

    def _moving(
        self,
        call: str,
        given: Sequence[Any],
        frame: Any,
        point: Any,
        made: Any,
        shape: tuple[int, ...],
        out: Any,
    ) -> Any:
        """What `made` computes of a point's motion."""

        def answer(at: Asked) -> Any:
            found = at.frame()
            value = made(at.xp, at.tables, at.moving(found), at.place(found))
            return value if len(shape) > 1 else value[:, 0]

        return self._answer(call, given, self._index(frame), {"point": point}, answer, shape, out)

    def _index(self, frame: Any) -> int:
        return frame_index(frame, self.frames, self._structure.link_names)

    def _at_once(self, call: str, motion: Sequence[Any], part: Any, point: Any) -> Any:
        """What a back end answers without these arrays; None where it does not."""

    def _answer(
        self,
        call: str,
        given: Sequence[Any],
        part: Any,
        beside: dict[str, Any],
        answer: Callable[[Asked], Any],
        shape: tuple[int, ...],
        out: Any,
        names: Sequence[str] = MOTION,
    ) -> Any:
        """Answer (..., *shape) to a motion; `answer` gives it with the samples last.

        beside: some of `VECTORS`, None for those that were not given; names: those of the motion
        """
        named = dict(zip(names, given, strict=False))
        motion = list(self._backend.arrays(named, self._structure.n))
        if self._check_finite:
            check_numbers(named, self._structure.joint_names)
        own = self._backend.side(motion[0])
        motion, vectors = _with_vectors(own, motion, beside)
        if out is not None:
            read = dict(zip(names, motion, strict=False)) | vectors
            accepted(out, (), (shape,), read, self._read_beside_motion(), False)
        value = self._at_once(call, motion, part, vectors.get("point"))
        if value is None:
            at, count = self._asked(own, part, motion, vectors), math.prod(shape)
            value = in_pieces(own, motion, at, answer, count).reshape(*motion[0].shape[:-1], *shape)
        if out is None:  # its numbers side by side
            return np.ascontiguousarray(value) if isinstance(value, np.ndarray) else value.contiguous()
        out[...] = value
        return out

    def _asked(self, own: Any, part: Any, motion: Sequence[Any], vectors: dict[str, Any]) -> Asked:
        """Constants, numbers and motion with samples innermost; `part` is a frame, all of them or links."""
        q, xp = motion[0], own.xp
        key = xp.__name__, q.dtype, getattr(q, "device", None)
        if key not in self._listed:
            numbers = own_numbers(self._tree), formula_sources(self._tree)
            self._listed[key] = converted(numbers, own, q)
        if (part, key) not in self._tables:
            self._tables[part, key] = converted(self._tables_of(part), own, q)
        numbers = own.tree_numbers(self._listed[key], q)
        flat = [xp.swapaxes(a.reshape(-1, a.shape[-1]), 0, 1) for a in motion]
        placed = {name: xp.swapaxes(a.reshape(-1, 3), 0, 1)[:, None] for name, a in vectors.items()}
        return Asked(xp, self._tables[part, key], numbers, flat, placed)

    def _tables_of(self, part: Any) -> Any:
        if part == LINKS:
            return link_tables(self._tree, self._structure.n)
        frames = range(len(self.frames)) if part == ALL else [part]
        return frame_tables(self._tree, self._structure.n, frames)


def in_pieces(own: Any, motion: Sequence[Any], at: Asked, answer: Callable[[Asked], Any], count: int) -> Any:
    """Answers (samples, count), as many samples at once as the back end wants."""
    xp, samples = at.xp, at.motion[0].shape[1]
    size = own.chunk(motion, max(16, CACHE // (motion[0].itemsize * (NUMBERS * at.tables.moved + count))))
    if size is None or samples <= size:
        return xp.swapaxes(answer(at).reshape(count, samples), 0, 1)
    whole = xp.empty((samples, count), dtype=motion[0].dtype)
    for start in range(0, samples, size):
        piece = slice(start, min(start + size, samples))
        found = answer(at.some(piece)).reshape(count, piece.stop - start)
        whole[piece] = xp.swapaxes(found, 0, 1)
    return whole


def _with_vectors(
    own: Any, motion: Sequence[Any], beside: dict[str, Any]
) -> tuple[list[Any], dict[str, Any]]:
    """Motion and vectors in one shape of samples; raises ValueError for a vector that does not go with it."""
    q, samples = motion[0], tuple(motion[0].shape[:-1])
    batch = samples
    vectors = {name: own.weights(name, a, q) for name, a in beside.items() if a is not None}
    for name, a in vectors.items():
        if a.ndim == 0 or a.shape[-1] != 3:
            raise ValueError(f"{name} has shape {tuple(a.shape)}; its last axis must be 3: {VECTORS[name]}")
        try:
            batch = np.broadcast_shapes(batch, tuple(a.shape[:-1]))
        except ValueError:
            raise ValueError(
                f"{name} has shape {tuple(a.shape)}, the motion has samples of shape {samples}; "
                f"give one {name}, or one for each sample"
            ) from None
    if all(a.shape[:-1] == samples for a in vectors.values()):
        return list(motion), vectors
    motion = [own.xp.broadcast_to(a, (*batch, a.shape[-1])) for a in motion]
    return motion, {name: own.xp.broadcast_to(a, (*batch, 3)) for name, a in vectors.items()}
