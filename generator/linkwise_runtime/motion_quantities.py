"""Loads that act on a robot from outside, what accelerates it, source by source, and how it then moves."""

import math
from typing import Any, Generic, NamedTuple

from .interface import Array

PASSIVE = ("spring", "damping", "friction")
"""Kinds of passive torque, in the order of `InducedAccelerations.passive`."""


class AppliedLoad(NamedTuple):
    """A force, and a moment if there is one, on a frame; all as `robot.kinematics.load_torque` takes it."""

    frame: str | int
    """A frame by its name, or by its number in `kinematics.frames`."""
    force: Any
    """On the frame, in the world's axes, in N, (3,) or (..., 3)."""
    moment: Any = None
    """Likewise, in N m; none unless given."""
    point: Any = None
    """Where the force acts, in the frame, in m; its origin unless given."""
    at: Any = None
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
        one: list[Any] = [self.actuators, self.gravity, self.loads, self.constraints, self.kinematic]
        two: list[Any] = [self.velocity, self.passive]
        total: Array = sum(share.sum(-1) for share in one) + sum(share.sum((-2, -1)) for share in two)
        return total

    def residual(self: Any, acceleration: Any) -> Any:
        """What the sum exceeds an acceleration (..., r) by, such as a measured one."""
        return self.total - acceleration

    def mapped(self: Any, jacobian: Any, jacobian_rate: Any, qd: Any) -> Any:
        """Shares of J qdd + dJ/dt qd, for those of the coordinates: whatever has a velocity J qd.

        jacobian, jacobian_rate: (..., r, n), as `robot.kinematics` has them
        """
        moved: list[Any] = [_product(jacobian, share) for share in self[:-1]]
        return InducedAccelerations(*[*moved, jacobian_rate * qd[..., None, :]])


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


def _product(jacobian: Any, share: Any) -> Any:
    """J times a share (..., n, *tail)."""
    axes = jacobian.ndim - 2
    tail = tuple(share.shape[axes + 1 :])
    columns = share.reshape(*share.shape[: axes + 1], math.prod(tail))
    found = jacobian @ columns
    return found.reshape(*found.shape[:-1], *tail)
