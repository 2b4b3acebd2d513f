"""Structure of a robot: names, units, paths, parameters, and the indices of its packed values.

Its joints may have springs, damping, friction and armature beside the links that they carry. Moving a joint
at p = ratio q requires stiffness (p - rest) + damping pd + friction sign(pd) + armature pdd, and moving its
coordinate ratio times as much; joints of one coordinate sum up:

    spring    sum r k (r q - rest)        damping   sum r^2 b  qd
    friction  sum |r| f  sign(qd)         armature  sum r^2 a  qdd
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .chosen_names import position_of
from .file_joints import FileJoint
from .interface import Library, Numbers
from .parameter_values import ParametricBody, checked_values
from .qpos_motion import Qpos

Indices = NDArray[np.intp]
GRAVITY = "gravity"
"""Name of the one share of rigid links that is not of motion."""
IMPOSED_MOTION = "imposed motion"
"""Name of the share of a kinetic energy that coordinates alone do not explain, as on a base that is moved."""


class Sizes(NamedTuple):
    """Number of packed values of one sample."""

    c2: int
    c1: int
    g: int
    tau: int
    h1: int


class Layout(NamedTuple):
    """Indices of packed values: rows (i, j, k), or rows (i, j) for gravity and torque; all counted from 0."""

    acceleration: Indices
    """c2: (i, j, k) with i <= k only, as c2 is symmetric in i and k."""
    velocity: Indices
    """c1, and c0 of the position gradient: (i, j, k)."""
    gravity: Indices
    """g: (i, j)."""
    torque: Indices
    """tau: (i, j)."""
    velocity_excess: Indices
    """h1: (i, j, k) of the links in `Structure.nonquadratic`."""


class JointLimits(NamedTuple):
    """Limits of the joints as in the robot's file, one number for each; infinite where the file has none.

    No call enforces them. Joints that follow another one are not listed.
    """

    lower: tuple[float, ...]
    """Lower limits of the position, in rad or m."""
    upper: tuple[float, ...]
    velocity: tuple[float, ...]
    """Limits of the speed in either direction, in rad/s or m/s."""
    effort: tuple[float, ...]
    """Limits of the torque or force in either direction, in N m or N."""


NO_LIMITS = JointLimits((), (), (), ())
"""Limits of a structure that was made without any."""


@dataclass(frozen=True)
class PassiveJoint:
    """Passive properties of a joint, at the position p = ratio q of a coordinate, in rad or m.

    To move it takes stiffness (p - rest) + damping p' + friction sign(p') + armature p'', in N m or N, beside
    its links' share.
    """

    joint: str
    coordinate: int
    """Index of the coordinate."""
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


@dataclass(frozen=True, eq=False)
class WrittenConstraints:
    """Constraints that a user wrote: phi(q) = 0, or a sum A(q) qd = 0 of velocities alone, whose phi is 0."""

    names: tuple[str, ...]
    holonomic: tuple[bool, ...]
    """True for each that is a phi(q)."""
    independent: tuple[int, ...]
    """Coordinates that the others follow, in order."""
    closed_position: tuple[float, ...]
    """Position where the constraints hold, at the parameters' own values."""
    positions: Callable[[Any, Any, Any], Sequence[Any]]
    """Function of xp, q and parameters: phi and A, row by row."""
    rates: Callable[[Any, Any, Any, Any], Sequence[Any]]
    """Function of xp, q, qd and parameters: dA/dt, row by row."""


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


@dataclass(frozen=True, eq=False)
class Structure:
    """A robot in names and numbers: n joint coordinates that move N links.

    Each instance equals itself alone: a package that was generated and imported again is another robot.
    """

    name: str
    """Name of the package."""
    joint_names: tuple[str, ...]
    joint_units: tuple[str, ...]
    """Units of the joints' positions: rad or m, one for each joint."""
    link_names: tuple[str, ...]
    paths: tuple[tuple[int, ...], ...]
    """Coordinates that move each link, ascending, counted from 0; tau_ij is zero off this path."""
    nonquadratic: tuple[int, ...]
    """Links with terms that are not quadratic in the velocities, whose d(tau)/d(qd) is not 2 c1."""
    parameters: Mapping[str, float]
    """Run-time parameters and their default values."""
    bodies: tuple[ParametricBody, ...] = ()
    """Links whose parameters are refused where no rigid body has such a mass and inertia."""
    passive: tuple[PassiveJoint, ...] = ()
    """Springs, damping, friction and armature of the joints."""
    joint_limits: JointLimits = NO_LIMITS
    """Limits of each joint, as in the robot's file."""
    file_joints: tuple[FileJoint, ...] = ()
    """Joints of the file, in the order of their coordinates; empty where each coordinate is one joint."""
    shares: tuple[tuple[str, ...], ...] = ()
    """Names of the shares of each link that are not of motion, where links were written by hand."""
    degrees: tuple[int, ...] = ()
    """Highest powers of the velocities in the kinetic energies of such links."""
    time: str = ""
    """Name of the parameter that is time; empty where nothing depends on it."""
    inputs: tuple[str, ...] = ()
    """Names of the parameters that are given from outside, sample by sample."""
    written: WrittenConstraints | None = None
    """Constraints that were written with the links; None without any."""

    @cached_property
    def n(self) -> int:
        """Number of joints."""
        return len(self.joint_names)

    @cached_property
    def N(self) -> int:
        """Number of links."""
        return len(self.link_names)

    @cached_property
    def layout(self) -> Layout:
        """Indices of the packed values, in their order: link by link, then i, then k."""
        pairs = [[(i, j, k) for i in path for k in path] for j, path in enumerate(self.paths)]
        every = [row for rows in pairs for row in rows]
        upper = [(i, j, k) for i, j, k in every if i <= k]
        uneven = [row for j in self.nonquadratic for row in pairs[j]]
        single = [(i, j) for j, path in enumerate(self.paths) for i in path]
        return Layout(
            _table(upper, 3), _table(every, 3), _table(single, 2), _table(single, 2), _table(uneven, 3)
        )

    @cached_property
    def share_names(self) -> tuple[str, ...]:
        """Names of the shares that are not of motion: gravity, or those of links written by hand."""
        if not self.shares:
            return (GRAVITY,)
        return tuple(dict.fromkeys(name for names in self.shares for name in names))

    @cached_property
    def share_rows(self) -> Indices:
        """Indices (i, j, m) of packed shares with names, m that of the name: link by link, then m, then i."""
        names = self.share_names
        rows = [
            (i, j, names.index(name))
            for j, (path, own) in enumerate(zip(self.paths, self.shares, strict=True))
            for name in own
            for i in path
        ]
        return _table(rows, 3)

    @cached_property
    def sizes(self) -> Sizes:
        """Number of packed values of one sample: c2, c1, g, tau, h1."""
        return Sizes(*map(len, self.layout))

    def qpos(self, order: object = "mujoco", names: Sequence[str] | None = None) -> Qpos:
        """Return the conversion from positions of MuJoCo or Pinocchio to q; raise as `Qpos` does."""
        single = (FileJoint(name, "single", (k,), k) for k, name in enumerate(self.joint_names))
        return Qpos(self.file_joints or tuple(single), order, names)

    def joint_index(self, given: int | str, argument: str = "joint") -> int:
        """Return index i or k of a joint, given by number from 0 or by name.

        Raises ValueError, with the argument's name, for what is neither.
        """
        return position_of(given, self.joint_names, "joint", argument)

    def link_index(self, given: int | str, argument: str = "link") -> int:
        """Return index j of a link, given by number from 0 or by name.

        Raises ValueError, with the argument's name, for what is neither.
        """
        return position_of(given, self.link_names, "link", argument)

    @cached_property
    def passive_sums(self) -> PassiveSums:
        """Passive properties of the joints, summed up for each coordinate."""
        return passive_sums(self.passive, self.n)

    @cached_property
    def armature_joints(self) -> tuple[int, ...]:
        """Joints that have armature, ascending."""
        return tuple(k for k, inertia in enumerate(self.passive_sums.armature) if inertia)

    def only(self, link: int) -> "Structure":
        """Return the robot as if it had this link alone, without parameters and passive torques."""
        return replace(
            self,
            link_names=self.link_names[link : link + 1],
            paths=self.paths[link : link + 1],
            nonquadratic=(0,) if link in self.nonquadratic else (),
            shares=self.shares[link : link + 1],
            degrees=self.degrees[link : link + 1],
            parameters={},
            bodies=(),
            passive=(),
        )

    def values(
        self, given: Mapping[str, object] | None, allow_unphysical: bool = False
    ) -> dict[str, float | Numbers]:
        """Return all parameters, those `given` in place of their own, checked as by the package's `load`."""
        return checked_values(self.parameters, given or {}, () if allow_unphysical else self.bodies)


def _table(rows: list[tuple[int, int]] | list[tuple[int, int, int]], width: int) -> Indices:
    table = np.array(rows, dtype=np.intp).reshape(-1, width)
    table.flags.writeable = False
    return table
