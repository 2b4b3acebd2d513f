"""What the calls answer: coefficients, propagation torques, packed values, accelerations by source, motions.

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
"""Inertial parameters of a link: m, mc_x, mc_y, mc_z, I_xx, I_xy, I_yy, I_xz, I_yz, I_zz."""


class Coefficients(NamedTuple, Generic[Array]):
    """Coefficients of the closing convention: tau_ij = sum_k c2_ijk qdd_k + sum_k c1_ijk qd_k + g_ij."""

    acceleration: Array
    """c2 (..., n, N, n): what accelerations weigh, link j's share of the mass matrix."""
    velocity: Array
    """c1 (..., n, N, n): what velocities weigh."""
    gravity: Array
    """g (..., n, N)."""


class Propagation(NamedTuple, Generic[Array]):
    """Motion propagation torques of the closing convention: over k and the orders they sum to tau_ij."""

    acceleration: Array
    """c2_ijk qdd_k (..., n, N, n)."""
    velocity: Array
    """c1_ijk qd_k (..., n, N, n)."""
    gravity: Array
    """g_ij (..., n, N)."""

    @property
    def convention(self) -> str:
        """Which c1 was taken."""
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
        """Which c1 was taken."""
        return "gradient"


class NaturalImpedance(NamedTuple, Generic[Array]):
    """How tau_ij changes with the motion of joint k, (..., n, N, n) each."""

    inertia: Array
    """c2_ijk, by acceleration."""
    damping: Array
    """2 c1_ijk - h1_ijk, by velocity."""
    stiffness: Array
    """c0_ijk, by position."""


class Energy(NamedTuple, Generic[Array]):
    """Energies of the links in J."""

    kinetic: Array
    """(..., N)."""
    potential: Array
    """(..., N); a rigid link's centre of mass at the height of the world's origin has none."""

    @property
    def total(self) -> Array:
        """Their sums (..., N)."""
        total: Array = self.kinetic + self.potential
        return total


class Power(NamedTuple, Generic[Array]):
    """P_ij = tau_ij qd_i in W, the power that joint i sends into link j, by whose motion, of which order.

    What is sent into a link is what its energy gains: sum_i P_ij = d(K_j + P_j)/dt. Where K has terms linear
    in the velocities or free of them, as on a moving base, qd . dK/dqd - K stands in its place.
    """

    acceleration: Array
    """c2_ijk qdd_k qd_i (..., n, N, n)."""
    velocity: Array
    """c1_ijk qd_k qd_i (..., n, N, n), of the closing convention."""
    gravity: Array
    """g_ij qd_i (..., n, N)."""

    @property
    def total(self) -> Array:
        """P_ij (..., n, N)."""
        total: Array = self.acceleration.sum(-1) + self.velocity.sum(-1) + self.gravity
        return total


class PassiveTorque(NamedTuple, Generic[Array]):
    """What joints take beside their links: the actuators give tau_i and `total`."""

    spring: Array
    """(..., n): stiffness times the way from rest."""
    damping: Array
    """(..., n): proportional to the velocity."""
    friction: Array
    """(..., n): Coulomb's, against the velocity; 0 at rest, where it may be anything up to its size."""
    armature: Array
    """(..., n): inertia of what turns behind gears, times the acceleration."""

    @property
    def total(self) -> Array:
        """Their sum, (..., n)."""
        total: Array = self.spring + self.damping + self.friction + self.armature
        return total


class ConstrainedMotion(NamedTuple, Generic[Array]):
    """How a robot with constraints moves, and what these bear."""

    qdd: Array
    """Of all joints, (..., n), in rad/s^2 or m/s^2."""
    forces: Array
    """lambda, (..., C), a number for each row of the constraints."""


class Packed(NamedTuple, Generic[Array]):
    """Full decomposition without its zeros: values (..., count) whose indices are the robot's `layout`."""

    acceleration: Array
    """c2, for i <= k only, as it is symmetric in i and k."""
    velocity: Array
    """c1 of the closing convention."""
    gravity: Array
    """g."""
    torque: Array
    """tau."""
    velocity_linear: Array
    """h1: the part of c1 from energy terms linear in the velocities; a robot of rigid links has none."""


class Contact(NamedTuple):
    """A frame that the ground holds where it is now, for `Dynamics.constrained`.

    kind: what is held, and how many rows that has:
        held      all of the frame: 6, turns about the world's axes, then the point along them
        hinged    all but turns about `axis`: 5, two turns across the axis, then the point
        point     the point: 3
        rolling   a ball, or an upright wheel, of `radius` about the point rolls without slip: 3, the velocity
                  where it touches
    """

    frame: str | int
    """A frame by its name, or by its number in `kinematics.frames`."""
    kind: str = "held"
    point: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """In the frame, in m; of a ball its centre."""
    axis: tuple[float, float, float] = (0.0, 0.0, 1.0)
    """Of `hinged`, in the frame."""
    normal: tuple[float, float, float] | None = None
    """Of `rolling`: the ground's, in the world, away from it; against gravity unless given."""
    radius: float = 0.0
    """Of `rolling`, in m."""
    name: str | None = None
    """That of its rows; the frame's and the kind unless given."""


class AppliedLoad(NamedTuple):
    """A force, and a moment if there is one, on a frame; all as `robot.kinematics.load_torque` takes it."""

    frame: str | int
    """A frame by its name, or by its number in `kinematics.frames`."""
    force: ArrayLike | Numbers
    """On the frame, in the world's axes, in N, (3,) or (..., 3)."""
    moment: ArrayLike | Numbers | None = None
    """Likewise, in N m; none unless given."""
    point: ArrayLike | Numbers | None = None
    """Where the force acts, in the frame, in m; its origin unless given."""
    at: ArrayLike | Numbers | None = None
    """The same in the world, in m, as of a centre of pressure; in place of `point`."""


class InducedAccelerations(NamedTuple, Generic[Array]):
    """Shares of an acceleration by source: M qdd = u - h - g + ... is linear in them, so that they sum to it.

    The first axis r after the samples is what accelerates: coordinates in rad/s^2 or m/s^2, the six rows of
    a frame (rad/s^2, then m/s^2 of its point), or the centre of mass; of reactions, rows of constraints.
    """

    actuators: Array
    """(..., r, n): by the torque of joint i alone."""
    velocity: Array
    """(..., r, N, n): by velocity forces on link j, whose cause is the velocity of s (closing convention)."""
    gravity: Array
    """(..., r, N): by the weight of link j, and its other potentials."""
    passive: Array
    """(..., r, 3, n): by spring, damping and friction of joint i; zeros where `passive` is False."""
    loads: Array
    """(..., r, L): by each load."""
    constraints: Array
    """(..., r, n): by constraints that turn as the robot moves, by the velocity of s: A qdd = -dA/dt qd."""
    kinematic: Array
    """(..., r, n): dJ/dt qd of a point, by the velocity of s; zeros for coordinates and reactions."""

    @property
    def total(self) -> Array:
        """Their sum, (..., r)."""
        one = self.actuators, self.gravity, self.loads, self.constraints, self.kinematic
        two = self.velocity, self.passive
        return cast(Array, sum(share.sum(-1) for share in one) + sum(share.sum((-2, -1)) for share in two))

    # Any: in a NamedTuple mypy refuses a method whose arguments are of the same kind as `self`.
    def residual(self: "InducedAccelerations[Any]", acceleration: Array) -> Array:
        """What the sum exceeds an acceleration (..., r) by, such as a measured one."""
        residual: Array = self.total - acceleration
        return residual

    def mapped(
        self: "InducedAccelerations[Any]", jacobian: Array, jacobian_rate: Array, qd: Array
    ) -> "InducedAccelerations[Array]":
        """Shares of J qdd + dJ/dt qd, for those of the coordinates: whatever has a velocity J qd.

        jacobian, jacobian_rate: (..., r, n), as `robot.kinematics` has them
        """
        moved: list[Array] = [_product(jacobian, share) for share in self[:-1]]
        moved.append(jacobian_rate * qd[..., None, :])
        return InducedAccelerations(*moved)


class Trajectory(NamedTuple, Generic[Array]):
    """A motion over T instants, from a start of shape (..., n), or many of them at once."""

    time: Array
    """(T,), in s."""
    q: Array
    """(T, ..., n)."""
    qd: Array
    """(T, ..., n)."""
    tau: Array
    """(T, ..., n): what the actuators gave."""
    energy: Array
    """(T, ...): kinetic and potential energy of links, springs and armature, in J."""
    work: Array
    """(T, ...): done since the start by actuators and loads, less what damping and friction took, in J."""

    @property
    def energy_drift(self) -> Array:
        """Energy that came from nowhere since the start, (T, ...): the error of the integration, in J."""
        drift: Array = self.energy - self.energy[:1] - self.work
        return drift


def _product(jacobian: Array, share: Array) -> Array:
    """J times a share (..., n, *tail)."""
    axes = jacobian.ndim - 2
    tail = tuple(share.shape[axes + 1 :])
    columns = share.reshape(*share.shape[: axes + 1], math.prod(tail))
    found = jacobian @ columns
    product: Array = found.reshape(*found.shape[:-1], *tail)
    return product
