"""Answer of `Dynamics.uncertainty`: standard deviations of shares, their sums and their powers."""

from typing import Generic, NamedTuple

from .interface import Array


class Uncertainty(NamedTuple, Generic[Array]):
    """Standard deviations of shares, about their means, in the shares' own units.

    They are of the closing convention; for the gradient convention, those of velocities count twice.
    """

    torque: Array
    """Deviation of tau_ij (..., n, N)."""
    c2: Array
    """Deviation of the coefficients c2_ijk (..., n, N, n)."""
    c1: Array
    """Deviation of the coefficients c1_ijk (..., n, N, n)."""
    acceleration: Array
    """Deviation of c2_ijk qdd_k (..., n, N, n)."""
    velocity: Array
    """Deviation of c1_ijk qd_k (..., n, N, n)."""
    gravity: Array
    """Deviation of g_ij (..., n, N)."""
    joint_torque: Array
    """Deviation of tau_i = sum_j tau_ij (..., n)."""
    joint_acceleration: Array
    """Deviation of sum_j c2_ijk qdd_k (..., n, n)."""
    joint_velocity: Array
    """Deviation of sum_j c1_ijk qd_k (..., n, n)."""
    joint_gravity: Array
    """Deviation of sum_j g_ij (..., n)."""
    power: Array
    """Deviation of tau_ij qd_i in W (..., n, N)."""
    joint_power: Array
    """Deviation of tau_i qd_i in W (..., n)."""
