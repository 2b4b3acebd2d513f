"""Targets of a controller: gains, the impedance of a frame, and the motion to follow."""

from typing import NamedTuple

ROWS = ("rx", "ry", "rz", "x", "y", "z")
"""Rows of a frame: rotations about the world's axes, then translations of its point along them."""


class Natural(NamedTuple):
    """Part of the robot's own inertia or damping that is kept, and what is added to it."""

    scale: object = 1.0
    """Factor alpha_ij of c2_ijk or c1_ijk: a number, (n, N), or {link: number} or {(joint, link): number} for
    some, the others staying as they are."""
    plus: object = None
    """Amount added to the sum over the links: a number for every joint, (n,) a diagonal, or (n, n)."""


class FrameImpedance(NamedTuple):
    """Impedance with which a frame resists whoever pushes it, for `Dynamics.partial_impedance`.

    inertia, damping: for r rows, in kg, kg m^2, and these times 1/s: `Natural`, with one number as its scale,
    or the whole: a number, (r,) or (r, r)
    stiffness: likewise without `Natural`, in N/m and N m/rad
    """

    frame: str | int
    """A frame by its name, or by its number in `kinematics.frames`."""
    inertia: object = Natural()
    damping: object = Natural()
    stiffness: object = 0.0
    rows: tuple[str, ...] = ROWS
    """Controlled rows, some of `ROWS`; a robot must be able to move the frame along each of them, whatever
    the others do."""
    point: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Point of the frame, in its axes, in m."""


class Grip(NamedTuple):
    """Limits of what the ground bears at a contact: it pushes, and friction holds up to a share of that.

    At each point where the frame touches the force keeps within a cone, ``|f_t| <= friction f_n``.
    """

    contact: str
    """Name of a contact of `Dynamics.constrained`: held, a point, or rolling."""
    friction: float
    """Coefficient of friction, 0 or above."""
    corners: tuple[tuple[float, float, float], ...] = ()
    """Points of the frame where what is held touches the ground, in m, not all in one line: the wrench is
    what forces at these give. A point, and what rolls, touch at one place, and have none."""
    normal: tuple[float, float, float] | None = None
    """Normal of the ground, in the world, away from the ground; against gravity unless given."""


class Target(NamedTuple):
    """Motion that joints, or a frame, are to follow; at rest unless given."""

    q: object = None
    """Positions (..., n); needed only with stiffness."""
    qd: object = None
    """Velocities (..., n)."""
    qdd: object = None
    """Accelerations (..., n)."""
    pose: object = None
    """Pose of the frame, (..., 4, 4), as from `kinematics.pose`; needed only with stiffness."""
    velocity: object = None
    """Velocity of the frame and its point, (..., 6), as from `kinematics.velocity`."""
    acceleration: object = None
    """Acceleration of the frame and its point, (..., 6), as from `kinematics.acceleration`."""
