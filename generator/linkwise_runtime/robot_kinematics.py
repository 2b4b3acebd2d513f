"""The kinematics of a robot's frames: where they are, how they move, and what moves the centre of mass."""

from typing import Any, Generic

from .interface import Array


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

    def __init__(self, answers: Any) -> None:
        self._answers = answers

    def __repr__(self) -> str:
        return f"<kinematics of {len(self.frames)} frames>"

    @property
    def frames(self) -> tuple[str, ...]:
        """Names of the frames, by number: those on the ground, then link by link."""
        names: tuple[str, ...] = self._answers.frames
        return names

    def pose(self, q: Array, frame: str | int, out: Array | None = None) -> Array:
        """Homogeneous matrix from the frame's coordinates to the world's, shape (..., 4, 4)."""
        pose: Array = self._answers.pose(q, frame, out)
        return pose

    def poses(self, q: Array, out: Array | None = None) -> Array:
        """Those of all F frames, in the order of `frames`, shape (..., F, 4, 4)."""
        poses: Array = self._answers.poses(q, out)
        return poses

    def jacobian(
        self, q: Array, frame: str | int, point: Array | None = None, out: Array | None = None
    ) -> Array:
        """J of shape (..., 6, n): J qd is the frame's angular velocity, then the point's velocity.

        A moment n and a force f on the point, in the world's axes, load the joints with J^T (n, f).
        """
        jacobian: Array = self._answers.jacobian(q, frame, point, out)
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
        torque: Array = self._answers.load_torque(q, frame, force, moment, point, at, out)
        return torque

    def jacobian_rate(
        self, q: Array, qd: Array, frame: str | int, point: Array | None = None, out: Array | None = None
    ) -> Array:
        """Rate dJ/dt, of a point that stays where it is in the frame, shape (..., 6, n)."""
        rate: Array = self._answers.jacobian_rate(q, qd, frame, point, out)
        return rate

    def velocity(
        self, q: Array, qd: Array, frame: str | int, point: Array | None = None, out: Array | None = None
    ) -> Array:
        """Angular velocity of the frame in rad/s, then velocity of the point in m/s: J qd, shape (..., 6)."""
        velocity: Array = self._answers.velocity(q, qd, frame, point, out)
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
        acceleration: Array = self._answers.acceleration(q, qd, qdd, frame, point, out)
        return acceleration

    def centre_of_mass(self, q: Array, out: Array | None = None) -> Array:
        """Of all moving links, in the world, shape (..., 3)."""
        centre: Array = self._answers.centre_of_mass(q, out)
        return centre

    def centre_of_mass_jacobian(self, q: Array, out: Array | None = None) -> Array:
        """Its Jacobian, shape (..., 3, n)."""
        jacobian: Array = self._answers.centre_of_mass_jacobian(q, out)
        return jacobian

    def centre_of_mass_jacobian_rate(self, q: Array, qd: Array, out: Array | None = None) -> Array:
        """Rate of that, shape (..., 3, n)."""
        rate: Array = self._answers.centre_of_mass_jacobian_rate(q, qd, out)
        return rate
