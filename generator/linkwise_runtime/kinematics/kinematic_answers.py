"""The calls of `Kinematics` behind its face: motion is checked, answers computed and put where `out` says."""

import math
from collections.abc import Callable, Iterable, Sequence
from typing import Any

import numpy as np

from ..answers import MOTION
from ..arguments import check_numbers
from ..outputs import accepted
from ..rule.joint_tree import JointTree
from ..rule.rule_tables import converted
from ..rule.tree_arrays import formula_sources, own_numbers
from ..structure import Structure
from .asked_samples import Asked, in_pieces, with_vectors
from .frame_arrays import (
    acceleration_of,
    centre_jacobian,
    centre_jacobian_rate,
    centre_of_mass,
    homogeneous,
    jacobian,
    jacobian_rate,
    load_torque,
    velocity_of,
)
from .frame_tables import frame_tables, link_tables
from .named_frames import frame_index

ALL, LINKS = "all frames", "links"


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
        return frame_index(frame, self.frames)

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
        motion, vectors = with_vectors(own, motion, beside)
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
