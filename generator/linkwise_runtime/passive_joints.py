"""Passive properties of joints, beside the links that they carry: springs, damping, friction, armature.

Moving a joint at p = ratio q requires stiffness (p - rest) + damping pd + friction sign(pd) + armature pdd,
and moving its coordinate ratio times as much; joints of one coordinate sum up:

    spring    sum r k (r q - rest)        damping   sum r^2 b  qd
    friction  sum |r| f  sign(qd)         armature  sum r^2 a  qdd
"""

from collections.abc import Callable, Sequence
from typing import NamedTuple

from .interface import Library, Numbers


class PassiveJoint(NamedTuple):
    """A joint on a coordinate, counted from 0; rest is the p at which its spring is without load."""

    joint: str
    coordinate: int
    ratio: float
    """dp/dq; not 1 where the joint follows another one."""
    stiffness: float = 0.0
    """Stiffness of the spring in N m/rad or N/m."""
    rest: float = 0.0
    """Rest position of the spring in rad or m."""
    damping: float = 0.0
    """Damping in N m s/rad or N s/m."""
    friction: float = 0.0
    """Coulomb friction in N m or N."""
    armature: float = 0.0
    """Inertia of what turns behind a gear, as seen by the joint, in kg m^2 or kg."""


class PassiveSums(NamedTuple):
    """Passive properties summed up by coordinate, n numbers each."""

    stiffness: tuple[float, ...]
    pull: tuple[float, ...]
    """Torques or forces of the springs at q = 0, with the sign of `passive_torques`."""
    damping: tuple[float, ...]
    friction: tuple[float, ...]
    armature: tuple[float, ...]


def passive_sums(joints: Sequence[PassiveJoint], n: int) -> PassiveSums:
    """Return the properties of the joints, summed up for each of n coordinates."""

    def summed(of: Callable[[PassiveJoint], float]) -> tuple[float, ...]:
        return tuple(sum((of(joint) for joint in joints if joint.coordinate == k), 0.0) for k in range(n))

    return PassiveSums(
        summed(lambda j: j.ratio**2 * j.stiffness),
        summed(lambda j: -j.ratio * j.stiffness * j.rest),
        summed(lambda j: j.ratio**2 * j.damping),
        summed(lambda j: abs(j.ratio) * j.friction),
        summed(lambda j: j.ratio**2 * j.armature),
    )


def passive_torques(
    library: Library, sums: PassiveSums, q: Numbers, qd: Numbers, qdd: Numbers
) -> tuple[Numbers, Numbers, Numbers, Numbers]:
    """Return the torques for spring, damping, friction and armature, (..., n) each."""
    stiffness, pull, damping, friction, armature = (library.constant(numbers, q) for numbers in sums)
    return stiffness * q + pull, damping * qd, friction * library.xp.sign(qd), armature * qdd


def smooth_friction(library: Library, sums: PassiveSums, qd: Numbers, width: float) -> Numbers:
    """Return friction tanh(qd / width), (..., n): for controllers, whose torque must not jump at rest."""
    return library.constant(sums.friction, qd) * library.xp.tanh(qd / width)
