"""Frames and points in motion, their Jacobians and the rates of these, on arrays with samples innermost.

Screws S_f = (z, s) of the joints and twists V = (omega, v) are those of `rule.kinematics`, about the first
hinge o of a path. For a point at x, seen from o,

    J_f = (z, s + z x x)      dJ_f/dt = (zd, sd + zd x x + z x xd)      xd = v + omega x x

and of the centre of mass, with m_f and h_f the sums of m_j / m and of m_j c_j / m over the links j that joint
f moves, J_f = m_f s + z x h_f and dJ_f/dt = m_f sd + zd x h_f + z x hd_f.

A force F and a moment M on a point ask joint f for -J_f^T (M, F) = -(z . M + (s + z x x) . F).
"""

from typing import Any, NamedTuple

from ..rule.kinematics import Poses, Twists, around, cross, joint_screws, poses, product, taken, twists
from ..rule.tree_arrays import TreeArrays
from .frame_tables import FrameTables


class Carried(NamedTuple):
    """Joints where they are, and frames on them."""

    joints: Poses
    axes: Any
    """Of the frames, (3, 3, frames, samples): [component, axis]."""
    places: Any
    """Of their origins, (3, frames, samples)."""


def carried(
    xp: Any, tables: FrameTables, numbers: TreeArrays, offsets: Any, q: Any, from_world: bool = False
) -> Carried:
    """Forward kinematics of frames.

    offsets: of all the tree's frames, or links, in the axes of their carriers, (3, count, samples); q: (n,
    samples); from_world: whether places are counted from the world's origin
    """
    joints = tables.from_world if from_world else tables.joints
    placed = poses(xp, joints, taken(numbers.translations, tables.chosen), taken(q, joints.coordinates))
    axes = taken(placed.axes, tables.carriers)
    places = taken(placed.places, tables.carriers) + turned(axes, taken(offsets, tables.frames))
    return Carried(placed, product(axes, tables.rotations), places)


def point_at(found: Carried, point: Any) -> Any:
    """Where points (3, frames, samples) are, which are given in the axes of the frames."""
    return found.places if point is None else found.places + turned(found.axes, point)


def homogeneous(xp: Any, found: Carried) -> Any:
    """Matrices (4, 4, frames, samples) from the frames' coordinates to the world's."""
    upper = xp.concat([found.axes, found.places[:, None]], 1)
    zero = xp.zeros_like(upper[:1, :1])
    return xp.concat([upper, xp.concat([zero, zero, zero, zero + 1.0], 1)], 0)


def jacobian(xp: Any, tables: FrameTables, found: Carried, x: Any) -> Any:
    """Of a point at x (3, 1, samples) of one frame, (6, n, samples)."""
    screws = joint_screws(xp, tables.joints, found.joints)
    z, s = screws[:, 0], screws[:, 1]
    return by_coordinate(tables, xp.concat([z[:3], s[:3] + cross(z, around(xp, x))], 0))


def load_torque(xp: Any, tables: FrameTables, found: Carried, x: Any, force: Any, moment: Any) -> Any:
    """What a force, and a moment or None, (3, 1, samples) each, on a point at x ask of coordinates.

    Of one frame, (n, samples).
    """
    screws = joint_screws(xp, tables.joints, found.joints)
    z, s = screws[:, 0], screws[:, 1]
    work = ((s[:3] + cross(z, around(xp, x))) * force).sum(0)
    if moment is not None:
        work = work + (z[:3] * moment).sum(0)
    return -by_coordinate(tables, work)


def moving(
    xp: Any,
    tables: FrameTables,
    numbers: TreeArrays,
    found: Carried,
    qd: Any,
    qdd: Any = None,
    from_world: bool = False,
) -> Twists:
    """Screws and motion of the joints, without gravity; qd, qdd: (n, samples), no qdd for none."""
    joints = tables.from_world if from_world else tables.joints
    velocity = taken(qd, tables.joints.coordinates)
    acceleration = 0.0 * velocity if qdd is None else taken(qdd, tables.joints.coordinates)
    return twists(xp, joints, found.joints, 0.0 * numbers.gravity, velocity, acceleration)


def jacobian_rate(xp: Any, tables: FrameTables, moved: Twists, x: Any) -> Any:
    """Rate of `jacobian`, (6, n, samples)."""
    zd, sd = moved.rates[:, 0], moved.rates[:, 1]
    xd = point_velocity(xp, of_frames(tables, moved.twists), x)
    linear = sd[:3] + cross(zd, around(xp, x)) + cross(moved.screws[:, 0], around(xp, xd))
    return by_coordinate(tables, xp.concat([zd[:3], linear], 0))


def velocity_of(xp: Any, tables: FrameTables, moved: Twists, x: Any) -> Any:
    """(omega, xd) of points, (6, frames, samples)."""
    twist = of_frames(tables, moved.twists)
    return xp.concat([twist[:3, 0], point_velocity(xp, twist, x)], 0)


def acceleration_of(xp: Any, tables: FrameTables, moved: Twists, x: Any) -> Any:
    """(alpha, xdd) of points, (6, frames, samples): xdd = a + alpha x x + omega x xd."""
    twist, change = (of_frames(tables, a) for a in (moved.twists, moved.accelerations))
    xd = around(xp, point_velocity(xp, twist, x))
    linear = change[:3, 1] + cross(change[:, 0], around(xp, x)) + cross(twist[:, 0], xd)
    return xp.concat([change[:3, 0], linear], 0)


def centre_of_mass(masses: Any, found: Carried) -> Any:
    """Of all links, (3, samples)."""
    return (_shares(masses) * found.places).sum(1)


def centre_jacobian(xp: Any, tables: FrameTables, masses: Any, found: Carried) -> Any:
    """Jacobian of the centre of mass, (3, n, samples)."""
    screws = joint_screws(xp, tables.joints, found.joints)
    mass, moment = _behind(tables, masses, found.places)
    return by_coordinate(tables, mass * screws[:3, 1] + cross(screws[:, 0], around(xp, moment)))


def centre_jacobian_rate(xp: Any, tables: FrameTables, masses: Any, found: Carried, moved: Twists) -> Any:
    """Its rate, (3, n, samples)."""
    speeds = point_velocity(xp, of_frames(tables, moved.twists), found.places)
    mass, moment = _behind(tables, masses, found.places)
    change = around(xp, _behind(tables, masses, speeds)[1])
    zd, sd = moved.rates[:, 0], moved.rates[:, 1]
    linear = mass * sd[:3] + cross(zd, around(xp, moment)) + cross(moved.screws[:, 0], change)
    return by_coordinate(tables, linear)


def _shares(masses: Any) -> Any:
    """m_j / m, (N, samples)."""
    return masses / masses.sum(0)


def _behind(tables: FrameTables, masses: Any, vectors: Any) -> tuple[Any, Any]:
    """Sums over the links that each joint moves: of their shares m_j / m, and of these times vectors."""
    shares = _shares(masses)
    return tables.carried @ shares, tables.carried @ (shares * vectors)


def of_frames(tables: FrameTables, twists: Any) -> Any:
    """Those of the joints that carry the frames."""
    return taken(twists, tables.carriers)


def point_velocity(xp: Any, twist: Any, x: Any) -> Any:
    """v + omega x x."""
    return twist[:3, 1] + cross(twist[:, 0], around(xp, x))


def turned(axes: Any, vector: Any) -> Any:
    """Matrices (3, 3, ...) times vectors (3, ...)."""
    return axes[:, 0] * vector[0] + axes[:, 1] * vector[1] + axes[:, 2] * vector[2]


def by_coordinate(tables: FrameTables, columns: Any) -> Any:
    """Columns (..., joints, samples) summed over the joints of each coordinate, (..., n, samples)."""
    first, *others = tables.columns
    total = taken(columns, first)
    for joints in others:
        total = total + taken(columns, joints)
    return total
