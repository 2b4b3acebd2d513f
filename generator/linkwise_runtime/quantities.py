"""Answers of the calls: coefficients, propagation torques, packed values, accelerations by source, motions.

Index i is the joint that is loaded, j the link through which it is loaded, k the coordinate that moves.
Torques are in N m, or N where joint i is prismatic; a coefficient is in that unit over the unit of the motion
that it multiplies.
"""

import math
from typing import Any, Generic, NamedTuple, cast

from numpy.typing import ArrayLike

from .interface import Array, Numbers
from .robot_axes import PARAMETER_UNITS

PARAMETERS = len(PARAMETER_UNITS)
"""Number of inertial parameters of a link: m, mc_x, mc_y, mc_z, I_xx, I_xy, I_yy, I_xz, I_yz, I_zz."""


class Coefficients(NamedTuple, Generic[Array]):
    """Coefficients of the closing convention: tau_ij = sum_k c2_ijk qdd_k + sum_k c1_ijk qd_k + g_ij."""

    acceleration: Array
    """c2 (..., n, N, n): coefficients of accelerations, link j's share of the mass matrix."""
    velocity: Array
    """c1 (..., n, N, n): coefficients of velocities."""
    gravity: Array
    """g (..., n, N): torque of gravity, or of all shares with names (`Dynamics.named_shares`)."""


class Propagation(NamedTuple, Generic[Array]):
    """Motion propagation torques of the closing convention: summed over k and the orders they are tau_ij."""

    acceleration: Array
    """c2_ijk qdd_k (..., n, N, n)."""
    velocity: Array
    """c1_ijk qd_k (..., n, N, n)."""
    gravity: Array
    """g_ij (..., n, N)."""

    @property
    def convention(self) -> str:
        """Name of the convention of c1: "closing"."""
        return "closing"


class GradientPropagation(NamedTuple, Generic[Array]):
    """Motion propagation torques with c1 = d(tau_ij)/d(qd_k): velocities then count twice in their sum."""

    acceleration: Array
    """c2_ijk qdd_k (..., n, N, n)."""
    velocity: Array
    """c1_ijk qd_k (..., n, N, n)."""
    gravity: Array
    """g_ij (..., n, N)."""

    @property
    def convention(self) -> str:
        """Name of the convention of c1: "gradient"."""
        return "gradient"


class NaturalImpedance(NamedTuple, Generic[Array]):
    """Change of tau_ij with the motion of joint k, (..., n, N, n) each."""

    inertia: Array
    """c2_ijk, change with the acceleration."""
    damping: Array
    """2 c1_ijk - h1_ijk, change with the velocity."""
    stiffness: Array
    """c0_ijk, change with the position."""


class Energy(NamedTuple, Generic[Array]):
    """Energies of the links in J."""

    kinetic: Array
    """Kinetic energy (..., N)."""
    potential: Array
    """Potential energy (..., N); zero where a rigid link's centre of mass is level with the world's
    origin."""

    @property
    def total(self) -> Array:
        """Kinetic plus potential energy (..., N)."""
        total: Array = self.kinetic + self.potential
        return total


class Power(NamedTuple, Generic[Array]):
    """Power P_ij = tau_ij qd_i in W that joint i sends into link j, by the motion of k and its order.

    The energy of a link gains what is sent into it: sum_i P_ij = d(K_j + P_j)/dt, but for what dissipation,
    forces and imposed motions of links that were written by hand take.
    """

    acceleration: Array
    """c2_ijk qdd_k qd_i (..., n, N, n)."""
    velocity: Array
    """c1_ijk qd_k qd_i (..., n, N, n), of the closing convention."""
    gravity: Array
    """g_ij qd_i (..., n, N)."""

    @property
    def total(self) -> Array:
        """P_ij (..., n, N), summed over k and the orders."""
        total: Array = self.acceleration.sum(-1) + self.velocity.sum(-1) + self.gravity
        return total


class PassiveTorque(NamedTuple, Generic[Array]):
    """Torques that joints require for themselves, beside their links: the actuators give tau_i + `total`."""

    spring: Array
    """Torque of the spring (..., n): stiffness times the displacement from rest."""
    damping: Array
    """Torque of damping (..., n), proportional to the velocity."""
    friction: Array
    """Torque to overcome Coulomb friction (..., n), with the sign of the velocity; 0 at rest, where it may be
    anything up to its size."""
    armature: Array
    """Torque of armature (..., n): inertia of what turns behind gears, times the acceleration."""

    @property
    def total(self) -> Array:
        """Sum of the four torques, (..., n)."""
        total: Array = self.spring + self.damping + self.friction + self.armature
        return total


class ConstrainedMotion(NamedTuple, Generic[Array]):
    """Motion of a robot with constraints, and the constraint forces."""

    qdd: Array
    """Accelerations of all joints, (..., n), in rad/s^2 or m/s^2."""
    forces: Array
    """Constraint forces lambda, (..., C), one for each row of the constraints."""


class Packed(NamedTuple, Generic[Array]):
    """Full decomposition without its zeros: values (..., count) whose indices are in the robot's `layout`."""

    acceleration: Array
    """c2, for i <= k only, as it is symmetric in i and k."""
    velocity: Array
    """c1 of the closing convention."""
    gravity: Array
    """g, the torque of gravity, or of all shares with names."""
    torque: Array
    """tau, the partial torques."""
    velocity_excess: Array
    """h1 = 2 c1 - d(tau)/d(qd), of links with terms that are not quadratic in the velocities."""


class Contact(NamedTuple):
    """A frame that the ground holds where it is now, for `Dynamics.constrained`.

    kind: what is held, and the number of constraint rows:
        held      all of the frame: 6, rotations about the world's axes, then the point along them
        hinged    all but rotations about `axis`: 5, two rotations across the axis, then the point
        point     the point: 3
        rolling   a ball, or an upright wheel, of `radius` about the point rolls without slip: 3, the velocity
                  where it touches
    """

    frame: str | int
    """A frame by its name, or by its number in `kinematics.frames`."""
    kind: str = "held"
    point: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Point in the frame, in m; for rolling, the centre of the ball."""
    axis: tuple[float, float, float] = (0.0, 0.0, 1.0)
    """Axis of `hinged`, in the frame."""
    normal: tuple[float, float, float] | None = None
    """Normal of the ground for `rolling`, in the world, away from the ground; against gravity unless
    given."""
    radius: float = 0.0
    """Radius for `rolling`, in m."""
    name: str | None = None
    """Name of the contact's rows; the frame's name and the kind unless given."""


class AppliedLoad(NamedTuple):
    """Force, and a moment if there is one, on a frame; all as for `robot.kinematics.load_torque`."""

    frame: str | int
    """A frame by its name, or by its number in `kinematics.frames`."""
    force: ArrayLike | Numbers
    """Force on the frame, in the world's axes, in N, (3,) or (..., 3)."""
    moment: ArrayLike | Numbers | None = None
    """Moment on the frame, in the world's axes, in N m, (3,) or (..., 3); none unless given."""
    point: ArrayLike | Numbers | None = None
    """Point where the force acts, in the frame, in m; the frame's origin unless given."""
    at: ArrayLike | Numbers | None = None
    """Point where the force acts, in the world, in m, such as a centre of pressure; in place of `point`."""


class InducedAccelerations(NamedTuple, Generic[Array]):
    """Shares of an acceleration by source: M qdd = u - h - g + ... is linear in them, so that they sum to it.

    The first axis r after the samples is what is accelerated: coordinates in rad/s^2 or m/s^2, the six rows
    of a frame (rad/s^2, then m/s^2 of its point), or the centre of mass; for reactions, rows of constraints.
    Index s is the coordinate whose velocity is the cause.
    """

    actuators: Array
    """Shares of the actuators (..., r, n): by the torque of joint i alone."""
    velocity: Array
    """Shares of velocity forces (..., r, N, n): on link j, by the velocity of s (closing convention)."""
    gravity: Array
    """Shares of gravity (..., r, N): by the weight of link j, or all of its shares with names."""
    passive: Array
    """Shares of spring, damping and friction of joint i (..., r, 3, n); zeros where `passive` is False."""
    loads: Array
    """Shares of the loads (..., r, L): by each load."""
    constraints: Array
    """Shares of constraints that turn as the robot moves (..., r, n), by the velocity of s: A qdd = -dA/dt
    qd."""
    kinematic: Array
    """Shares dJ/dt qd of a point (..., r, n): by the velocity of s; zeros for coordinates and reactions."""

    @property
    def total(self) -> Array:
        """Sum of all shares, (..., r)."""
        one = self.actuators, self.gravity, self.loads, self.constraints, self.kinematic
        two = self.velocity, self.passive
        return cast(Array, sum(share.sum(-1) for share in one) + sum(share.sum((-2, -1)) for share in two))

    # Any: in a NamedTuple mypy refuses a method whose arguments are of the same kind as `self`.
    def residual(self: "InducedAccelerations[Any]", acceleration: Array) -> Array:
        """Return by how much the sum exceeds an acceleration (..., r), such as a measured one."""
        residual: Array = self.total - acceleration
        return residual

    def mapped(
        self: "InducedAccelerations[Any]", jacobian: Array, jacobian_rate: Array, qd: Array
    ) -> "InducedAccelerations[Array]":
        """Return the shares of J qdd + dJ/dt qd, made of those of the coordinates, for any velocity J qd.

        jacobian, jacobian_rate: (..., r, n), as from `robot.kinematics`
        """
        moved: list[Array] = [_product(jacobian, share) for share in self[:-1]]
        moved.append(jacobian_rate * qd[..., None, :])
        return InducedAccelerations(*moved)


class Trajectory(NamedTuple, Generic[Array]):
    """A motion over T instants, from a start of shape (..., n), or many of them at once."""

    time: Array
    """Instants (T,), in s."""
    q: Array
    """Positions (T, ..., n), in rad or m."""
    qd: Array
    """Velocities (T, ..., n), in rad/s or m/s."""
    tau: Array
    """Torques of the actuators (T, ..., n), in N m or N."""
    energy: Array
    """Kinetic and potential energy of links, springs and armature (T, ...), in J."""
    work: Array
    """Work since the start by actuators and loads, less losses by damping and friction (T, ...), in J."""

    @property
    def energy_drift(self) -> Array:
        """Error of the integration (T, ...), in J: energy gained since the start without any work."""
        drift: Array = self.energy - self.energy[:1] - self.work
        return drift


def _product(jacobian: Array, share: Array) -> Array:
    """Return J times a share (..., n, *tail)."""
    axes = jacobian.ndim - 2
    tail = tuple(share.shape[axes + 1 :])
    columns = share.reshape(*share.shape[: axes + 1], math.prod(tail))
    found = jacobian @ columns
    product: Array = found.reshape(*found.shape[:-1], *tail)
    return product
