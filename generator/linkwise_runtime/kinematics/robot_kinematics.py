"""Kinematics of a robot's frames: poses, velocities and accelerations, and those of the centre of mass."""

from collections.abc import Iterable, Mapping, Sequence
from operator import attrgetter
from typing import Any, Generic, Protocol

from ..call_table import CALLS
from ..door import Door
from ..interface import Array, Library, Numbers, Unscripted
from ..out_argument import accepted
from .frame_answers import ALL, LINKS, FrameAnswers, frame_index, vectors_beside


class FramesBackend(Library, Protocol):
    """A back end that answers calls on frames."""

    @property
    def frames(self) -> FrameAnswers:
        """Answers of the calls on frames; raises ValueError for links given by energies."""

    def read_beside_motion(self) -> Iterable[object]:
        """Return the arrays or tensors, beside the motion, that results depend on."""


class FramedRobot(Protocol):
    """Part of a robot that `Kinematics` needs."""

    @property
    def door(self) -> Door[FramesBackend]:
        """Entry at which motion is read."""


class Kinematics(Unscripted, Generic[Array]):
    """Poses, Jacobians and their rates of a robot's frames; `Dynamics.kinematics` of any back end.

    A frame is a body of the robot's file, also one that was merged into another, stands on the ground or has
    no mass, or a site in it. It is given by its name, or by its number in `frames`, which is that of `poses`
    and of C too, and not a link's j; its axes are the file's.

    q, qd, qdd, batches and `out` are as for `Dynamics`. Answers are in the world's axes, which are those of
    the file's root with a fixed base, in m, rad and s, of the motion's kind and dtype. Gradients flow through
    motion, points, parameters and bodies.

    point: point of the frame, in its axes and in m, shape (3,) or (..., 3); its origin unless given

    Every call raises ValueError for a frame that does not exist, or a wrong shape, and TypeError for an
    argument that cannot be read without ambiguity.
    """

    frames: tuple[str, ...]
    """Names of the frames, by number: those on the ground, then link by link."""

    def __init__(self, robot: FramedRobot, frames: tuple[str, ...]) -> None:
        self._robot, self.frames = robot, frames

    def __reduce__(self) -> tuple[Any, ...]:
        """Return what gets these kinematics again from the robot, which is copied with them."""
        return attrgetter("kinematics"), (self._robot,)

    def __repr__(self) -> str:
        return f"<kinematics of {len(self.frames)} frames>"

    def pose(self, q: Array, frame: str | int, out: Array | None = None) -> Array:
        """Return the homogeneous matrix from the frame's coordinates to the world's, shape (..., 4, 4)."""
        pose: Array = self._answer("pose", (q,), self._index(frame), {}, out)
        return pose

    def poses(self, q: Array, out: Array | None = None) -> Array:
        """Return the matrices `pose` of all F frames, in the order of `frames`, shape (..., F, 4, 4)."""
        poses: Array = self._answer("poses", (q,), ALL, {}, out)
        return poses

    def jacobian(
        self, q: Array, frame: str | int, point: Array | None = None, out: Array | None = None
    ) -> Array:
        """Return J of shape (..., 6, n): J qd is the frame's angular velocity, then the point's velocity.

        A moment n and a force f on the point, in the world's axes, load the joints with J^T (n, f).
        """
        jacobian: Array = self._answer("jacobian", (q,), self._index(frame), {"point": point}, out)
        return jacobian

    def load_torque(
        self,
        q: Array,
        frame: str | int,
        force: Array,
        moment: Array | None = None,
        point: Array | None = None,
        at: Array | None = None,
        out: Array | None = None,
    ) -> Array:
        """Return the torque that a load adds to that of the joints, -J^T (moment, force), (..., n), N m (N).

        A force from below that supports the robot relieves its joints. Add the torque to `inverse_dynamics`.

        force, moment: on the frame, in the world's axes, N and N m, (3,) or (..., 3); no moment unless given
        point: where the force acts, in the frame; at: where it acts in the world, such as a centre of
        pressure
        """
        check_load(force, point, at)
        beside = {"force": force, "moment": moment, "point": point, "at": at}
        torque: Array = self._answer("load_torque", (q,), self._index(frame), beside, out)
        return torque

    def jacobian_rate(
        self, q: Array, qd: Array, frame: str | int, point: Array | None = None, out: Array | None = None
    ) -> Array:
        """Return the rate dJ/dt, for a point that is fixed in the frame, shape (..., 6, n)."""
        rate: Array = self._answer("jacobian_rate", (q, qd), self._index(frame), {"point": point}, out)
        return rate

    def velocity(
        self, q: Array, qd: Array, frame: str | int, point: Array | None = None, out: Array | None = None
    ) -> Array:
        """Return J qd (..., 6): the frame's angular velocity in rad/s, then the point's velocity in m/s."""
        velocity: Array = self._answer("velocity", (q, qd), self._index(frame), {"point": point}, out)
        return velocity

    def acceleration(
        self,
        q: Array,
        qd: Array,
        qdd: Array,
        frame: str | int,
        point: Array | None = None,
        out: Array | None = None,
    ) -> Array:
        """Return J qdd + dJ/dt qd (..., 6), the rate of `velocity` without gravity, in rad/s^2 and m/s^2."""
        acceleration: Array = self._answer(
            "acceleration", (q, qd, qdd), self._index(frame), {"point": point}, out
        )
        return acceleration

    def centre_of_mass(self, q: Array, out: Array | None = None) -> Array:
        """Return the centre of mass of all moving links, in the world, shape (..., 3), in m."""
        centre: Array = self._answer("centre_of_mass", (q,), LINKS, {}, out)
        return centre

    def centre_of_mass_jacobian(self, q: Array, out: Array | None = None) -> Array:
        """Return the Jacobian of the centre of mass, shape (..., 3, n)."""
        jacobian: Array = self._answer("centre_of_mass_jacobian", (q,), LINKS, {}, out)
        return jacobian

    def centre_of_mass_jacobian_rate(self, q: Array, qd: Array, out: Array | None = None) -> Array:
        """Return the rate of the centre of mass's Jacobian, shape (..., 3, n)."""
        rate: Array = self._answer("centre_of_mass_jacobian_rate", (q, qd), LINKS, {}, out)
        return rate

    def _index(self, frame: object) -> int:
        return frame_index(frame, self.frames)

    def _answer(
        self, call: str, given: Sequence[object], part: object, beside: Mapping[str, object], out: object
    ) -> Any:
        names = CALLS[f"kinematics.{call}"].motion
        asked = vectors_beside(beside)
        backend, numbers = self._robot.door.read(dict(zip(names, given, strict=True)), beside=asked)
        motion, vectors = numbers[: len(names)], dict(zip(asked, numbers[len(names) :], strict=True))
        if out is None:
            return backend.frames.answer(call, motion, part, vectors)
        read: dict[str, Numbers] = dict(zip(names, motion, strict=True)) | vectors
        shapes = (backend.frames.shape(call),)
        (place,) = accepted(out, (), shapes, read, backend.read_beside_motion(), False)
        place[...] = backend.frames.answer(call, motion, part, vectors)
        return out


def check_load(force: object, point: object, at: object) -> None:
    """Raise TypeError for a load without a force, ValueError for one that acts in two places."""
    if force is None:
        raise TypeError("force is None; give its x, y, z in the world's axes, in N, zeros for a moment alone")
    if point is not None and at is not None:
        raise ValueError(
            "point and at both say where the force acts; give point in the frame, or at in the world"
        )
