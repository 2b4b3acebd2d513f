"""What joints have of their own, beside the links that they carry: springs, damping, friction, armature.

A joint at p = ratio q takes stiffness (p - rest) + damping pd + friction sign(pd) + armature pdd to move, and
its coordinate ratio times as much; joints of one coordinate sum up:

    spring    sum r k (r q - rest)        damping   sum r^2 b  qd
    friction  sum |r| f  sign(qd)         armature  sum r^2 a  qdd
"""

from collections.abc import Callable, Sequence
from typing import NamedTuple

from .interface import Library, Numbers


class PassiveJoint(NamedTuple):
    """A joint on a coordinate, which is counted from 0; rest is the p at which its spring gives nothing."""

    joint: str
    coordinate: int
    ratio: float
    """dp/dq; other than 1 where the joint follows another one."""
    stiffness: float = 0.0
    """In N m/rad or N/m."""
    rest: float = 0.0
    """In rad or m."""
    damping: float = 0.0
    """In N m s/rad or N s/m."""
    friction: float = 0.0
    """Coulomb's, in N m or N."""
    armature: float = 0.0
    """Inertia of what turns behind a gear, as the joint feels it, in kg m^2 or kg."""


class PassiveSums(NamedTuple):
    """By coordinate, n numbers each."""

    stiffness: tuple[float, ...]
    pull: tuple[float, ...]
    """What springs give at q = 0."""
    damping: tuple[float, ...]
    friction: tuple[float, ...]
    armature: tuple[float, ...]


def passive_sums(joints: Sequence[PassiveJoint], n: int) -> PassiveSums:
    """The joints of each of n coordinates summed up."""

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
    """Spring, damping, friction, armature, (..., n) each."""
    stiffness, pull, damping, friction, armature = (library.constant(numbers, q) for numbers in sums)
    return stiffness * q + pull, damping * qd, friction * library.xp.sign(qd), armature * qdd


def smooth_friction(library: Library, sums: PassiveSums, qd: Numbers, width: float) -> Numbers:
    """Friction tanh(qd / width), (..., n): what a controller gives, which must not jump at rest."""
    return library.constant(sums.friction, qd) * library.xp.tanh(qd / width)
