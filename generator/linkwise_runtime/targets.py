"""What a controller is asked for: gains, the impedance of a frame, and where to go."""

from typing import NamedTuple

ROWS = ("rx", "ry", "rz", "x", "y", "z")
"""Of a frame: turns about the world's axes, then its point along them."""


class Natural(NamedTuple):
    """What is kept of the robot's own inertia or damping, and what is added."""

    scale: object = 1.0
    """alpha_ij, by which c2_ijk or c1_ijk is multiplied: a number, (n, N), or {link: number} or
    {(joint, link): number} for some, the others staying as they are."""
    plus: object = None
    """What is added to their sum over the links: a number for every joint, (n,) a diagonal, or (n, n)."""


class FrameImpedance(NamedTuple):
    """What a frame feels like to who pushes it, for `Dynamics.partial_impedance`.

    inertia, damping: Natural, of whose scale a number is taken, or the whole: a number, (r,), or (r, r), of r
    rows, in kg, kg m^2, and such times 1/s; stiffness likewise, without Natural, in N/m and N m/rad
    """

    frame: str | int
    """A frame by its name, or by its number in `kinematics.frames`."""
    inertia: object = Natural()
    damping: object = Natural()
    stiffness: object = 0.0
    rows: tuple[str, ...] = ROWS
    """Which of `ROWS`; a robot must be able to move the frame along each of them, whatever the others do."""
    point: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Of the frame, in its axes, in m."""


class Target(NamedTuple):
    """Where joints, or a frame, shall be, and how they shall move; at rest unless given."""

    q: object = None
    """Positions (..., n); not wanted without stiffness."""
    qd: object = None
    """(..., n)"""
    qdd: object = None
    """(..., n)"""
    pose: object = None
    """Of the frame, (..., 4, 4), as `kinematics.pose` has it; not wanted without stiffness."""
    velocity: object = None
    """Of the frame and its point, (..., 6), as `kinematics.velocity` has it."""
    acceleration: object = None
    """(..., 6)"""
