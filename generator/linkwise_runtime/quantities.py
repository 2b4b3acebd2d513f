"""What the calls answer: coefficients, propagation torques, packed values.

Index i is the joint that is loaded, j the link through which it is loaded, k the coordinate that moves.
Torques are in N m, or N where joint i is prismatic; a coefficient is in that unit over the unit of the motion
that it multiplies.
"""

from typing import Generic, NamedTuple

from .interface import Array
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
