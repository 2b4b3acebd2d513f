"""The kinematics of a robot's frames: where they are, how they move, and what moves the centre of mass."""

from collections.abc import Iterable, Mapping, Sequence
from operator import attrgetter
from typing import Any, Generic, Protocol

from ..call_table import CALLS
from ..door import Door, accepted
from ..interface import Array, Library, Numbers
from .frame_answers import ALL, LINKS, FrameAnswers, frame_index, vectors_beside


class FramesEngine(Library, Protocol):
    """A back end that answers for frames."""

    @property
    def frames(self) -> FrameAnswers:
        """Its answers; raises ValueError for links of energies."""

    def read_beside_motion(self) -> Iterable[object]:
        """Arrays or tensors that results hang on, beside the motion."""


class FramedRobot(Protocol):
    """What kinematics ask of a robot."""

    @property
    def door(self) -> Door[FramesEngine]:
        """Where motion comes in."""


class Kinematics(Generic[Array]):
    """Poses, Jacobians and their rates of a robot's frames; `Dynamics.kinematics` of any back end.

    A frame is a body of the robot's file, also one that was merged into another, stands on the ground or has
    no mass, or a site of it. It is given by its name, or by its number in `frames`, which is that of `poses`
    and of C too, and not a link's j; its axes are the file's.

    q, qd, qdd, batches and `out` are as for `Dynamics`. Answers are in the world's axes, which are those of
    the file's root with a fixed base, in m, rad and s, of the motion's kind and dtype. Gradients flow through
    motion, points, parameters and bodies.

    point: of the frame, in its axes and in m, shape (3,) or (..., 3); its origin unless given

    Every call raises ValueError for a frame that is not there, or a wrong shape, and TypeError for what
    cannot be taken without a doubt.
    """

    frames: tuple[str, ...]
    """Names of the frames, by number: those on the ground, then link by link."""

    def __init__(self, robot: FramedRobot, frames: tuple[str, ...]) -> None:
        self._robot, self.frames = robot, frames

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickled or copied, they are those of the robot, which is copied with them."""
        return attrgetter("kinematics"), (self._robot,)

    def __repr__(self) -> str:
        return f"<kinematics of {len(self.frames)} frames>"

    def pose(self, q: Array, frame: str | int, out: Array | None = None) -> Array:
        """Homogeneous matrix from the frame's coordinates to the world's, shape (..., 4, 4)."""
        pose: Array = self._answer("pose", (q,), self._index(frame), {}, out)
        return pose

    def poses(self, q: Array, out: Array | None = None) -> Array:
        """Those of all F frames, in the order of `frames`, shape (..., F, 4, 4)."""
        poses: Array = self._answer("poses", (q,), ALL, {}, out)
        return poses

    def jacobian(
        self, q: Array, frame: str | int, point: Array | None = None, out: Array | None = None
    ) -> Array:
        """J of shape (..., 6, n): J qd is the frame's angular velocity, then the point's velocity.

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
        """What a load adds to the torque that joints need, -J^T (moment, force), shape (..., n), N m (N).

        A force from below that bears the robot relieves its joints. Add it to `inverse_dynamics`.

        force, moment: on the frame, in the world's axes, N and N m, (3,) or (..., 3); no moment unless given
        point: where the force acts, in the frame; at: the same in the world, as of a centre of pressure
        """
        check_load(force, point, at)
        beside = {"force": force, "moment": moment, "point": point, "at": at}
        torque: Array = self._answer("load_torque", (q,), self._index(frame), beside, out)
        return torque

    def jacobian_rate(
        self, q: Array, qd: Array, frame: str | int, point: Array | None = None, out: Array | None = None
    ) -> Array:
        """Rate dJ/dt, of a point that stays where it is in the frame, shape (..., 6, n)."""
        rate: Array = self._answer("jacobian_rate", (q, qd), self._index(frame), {"point": point}, out)
        return rate

    def velocity(
        self, q: Array, qd: Array, frame: str | int, point: Array | None = None, out: Array | None = None
    ) -> Array:
        """Angular velocity of the frame in rad/s, then velocity of the point in m/s: J qd, shape (..., 6)."""
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
        """Their rates, J qdd + dJ/dt qd, without gravity, shape (..., 6)."""
        acceleration: Array = self._answer(
            "acceleration", (q, qd, qdd), self._index(frame), {"point": point}, out
        )
        return acceleration

    def centre_of_mass(self, q: Array, out: Array | None = None) -> Array:
        """Of all moving links, in the world, shape (..., 3)."""
        centre: Array = self._answer("centre_of_mass", (q,), LINKS, {}, out)
        return centre

    def centre_of_mass_jacobian(self, q: Array, out: Array | None = None) -> Array:
        """Its Jacobian, shape (..., 3, n)."""
        jacobian: Array = self._answer("centre_of_mass_jacobian", (q,), LINKS, {}, out)
        return jacobian

    def centre_of_mass_jacobian_rate(self, q: Array, qd: Array, out: Array | None = None) -> Array:
        """Rate of that, shape (..., 3, n)."""
        rate: Array = self._answer("centre_of_mass_jacobian_rate", (q, qd), LINKS, {}, out)
        return rate

    def _index(self, frame: object) -> int:
        return frame_index(frame, self.frames)

    def _answer(
        self, call: str, given: Sequence[object], part: object, beside: Mapping[str, object], out: object
    ) -> Any:
        names = CALLS[f"kinematics.{call}"].motion
        asked = vectors_beside(beside)
        engine, numbers = self._robot.door.read(dict(zip(names, given, strict=True)), beside=asked)
        motion, vectors = numbers[: len(names)], dict(zip(asked, numbers[len(names) :], strict=True))
        if out is None:
            return engine.frames.answer(call, motion, part, vectors)
        read: dict[str, Numbers] = dict(zip(names, motion, strict=True)) | vectors
        shapes = (engine.frames.shape(call),)
        (place,) = accepted(out, (), shapes, read, engine.read_beside_motion(), False)
        place[...] = engine.frames.answer(call, motion, part, vectors)
        return out


def check_load(force: object, point: object, at: object) -> None:
    """Raise TypeError for a load without a force, ValueError for one that acts in two places."""
    if force is None:
        raise TypeError("force is None; give its x, y, z in the world's axes, in N, zeros for a moment alone")
    if point is not None and at is not None:
        raise ValueError(
            "point and at both say where the force acts; give point in the frame, or at in the world"
        )
