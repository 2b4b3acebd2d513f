"""Frames and points in motion, their Jacobians and the rates of these, on arrays with samples innermost.

Screws S_f = (z, s) of the joints and twists V = (omega, v) are those of `rule.kinematics`, about the first
hinge o of a path. For a point at x, seen from o,

    J_f = (z, s + z x x)      dJ_f/dt = (zd, sd + zd x x + z x xd)      xd = v + omega x x

and for the centre of mass, with m_f and h_f the sums of m_j / m and of m_j c_j / m over the links j that
joint f moves, J_f = m_f s + z x h_f and dJ_f/dt = m_f sd + zd x h_f + z x hd_f.

A force F and a moment M on a point require of joint f the torque -J_f^T (M, F) = -(z . M + (s + z x x) . F).
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from ..interface import Namespace, Numbers
from ..rule.joint_tree import JointTree
from ..rule.kinematics import (
    KinematicTables,
    Poses,
    Twists,
    cross,
    extend_xy,
    gather,
    joint_screws,
    kinematic_tables,
    poses,
    product,
    twists,
)
from ..rule.tree_arrays import TreeArrays


class CoordinateTables(Protocol):
    """Tables that say which joints each coordinate moves."""

    @property
    def columns(self) -> tuple[Numbers, ...]:
        """See `FrameTables`."""


class FrameTables(NamedTuple):
    """Constants of some frames and of the joints that carry them; the ground stands behind all joints."""

    joints: KinematicTables
    from_world: KinematicTables
    """Tables with places counted from the world's origin instead of the first hinge of a path."""
    chosen: Numbers
    """Indices of these joints among the tree's, and that of its ground."""
    carriers: Numbers
    """Index of the joint that moves each frame, among these."""
    frames: Numbers
    """Indices of these frames among the tree's."""
    rotations: Numbers
    """Rotations from the axes of each frame to those of its carrier, (3, 3, frames, 1)."""
    columns: tuple[Numbers, ...]
    """Joints of each coordinate, the first of each, then the second of each, ...; the ground where there is
    none."""
    moved_frames: Numbers
    """Matrix (joints, frames) with ones where a joint moves a frame."""

    @property
    def moved(self) -> int:
        """Number of joints and frames, by which the memory of a call grows."""
        return len(self.joints.parents) + len(self.carriers)


def frame_tables(tree: JointTree, n: int, frames: Sequence[int]) -> FrameTables:
    """Return the tables of some of a tree's frames, in float64."""
    some = [tree.frames[f] for f in frames]
    rotations = np.array([frame.rotation for frame in some])
    return _tables(tree, n, [frame.joint for frame in some], frames, rotations)


def link_tables(tree: JointTree, n: int) -> FrameTables:
    """Return the tables of all links, whose frames are those of their joints."""
    links = tree.links
    rotations = np.array([np.eye(3)] * len(links))
    return _tables(tree, n, [link.joint for link in links], range(len(links)), rotations)


def _tables(
    tree: JointTree,
    n: int,
    carriers: Sequence[int | None],
    frames: Sequence[int],
    rotations: NDArray[np.float64],
) -> FrameTables:
    chains = [tree.chain(carrier) for carrier in carriers]
    chosen = sorted({joint for chain in chains for joint in chain})
    at = {joint: position for position, joint in enumerate(chosen)}
    joints = tuple(
        replace(joint, parent=None if joint.parent is None else at[joint.parent])
        for joint in (tree.joints[f] for f in chosen)
    )
    part, ground = kinematic_tables(replace(tree, joints=joints)), len(chosen)
    moved_frames = np.zeros((ground + 1, len(carriers)))
    for frame, chain in enumerate(chains):
        moved_frames[[at[joint] for joint in chain], frame] = 1.0
    return FrameTables(
        part,
        part._replace(behind=np.ones_like(part.behind)),
        np.array([*chosen, len(tree.joints)]),
        np.array([ground if carrier is None else at[carrier] for carrier in carriers]),
        np.array(frames),
        rotations.transpose(1, 2, 0)[..., None],
        tuple(coordinate_columns([joint.coordinate for joint in joints], n)),
        moved_frames,
    )


def coordinate_columns(coordinates: Sequence[int], n: int) -> Sequence[NDArray[np.intp]]:
    """Return the joints of each coordinate: the first of each, then the second of each, ...

    Where a coordinate has no more, it is the number of the ground, which stands behind all joints.
    """
    own = [[f for f, k in enumerate(coordinates) if k == wanted] for wanted in range(n)]
    most, ground = max(map(len, own)), len(coordinates)
    return [
        np.array([joints[r] if r < len(joints) else ground for joints in own]) for r in range(max(1, most))
    ]


class FramePoses(NamedTuple):
    """Poses of the joints, and of frames on them."""

    joints: Poses
    axes: Numbers
    """Axes of the frames, (3, 3, frames, samples): [component, axis]."""
    places: Numbers
    """Origins of the frames, (3, frames, samples)."""


def forward_kinematics(
    xp: Namespace,
    tables: FrameTables,
    numbers: TreeArrays,
    offsets: Numbers,
    q: Numbers,
    from_world: bool = False,
) -> FramePoses:
    """Return the poses of frames, by forward kinematics.

    offsets: those of all the tree's frames, or links, in the axes of their carriers, (3, count, samples); q:
    (n, samples); from_world: whether places are counted from the world's origin
    """
    joints = tables.from_world if from_world else tables.joints
    placed = poses(xp, joints, gather(numbers.translations, tables.chosen), gather(q, joints.coordinates))
    axes = gather(placed.axes, tables.carriers)
    places = gather(placed.places, tables.carriers) + rotate_vectors(axes, gather(offsets, tables.frames))
    return FramePoses(placed, product(axes, tables.rotations), places)


def point_at(found: FramePoses, point: Numbers | None) -> Numbers:
    """Return the places of points (3, frames, samples), which are given in the axes of the frames."""
    return found.places if point is None else found.places + rotate_vectors(found.axes, point)


def homogeneous(xp: Namespace, found: FramePoses) -> Numbers:
    """Return matrices (4, 4, frames, samples) from the frames' coordinates to the world's."""
    upper = xp.concat([found.axes, found.places[:, None]], 1)
    zero = xp.zeros_like(upper[:1, :1])
    return xp.concat([upper, xp.concat([zero, zero, zero, zero + 1.0], 1)], 0)


def jacobian(xp: Namespace, tables: FrameTables, found: FramePoses, x: Numbers) -> Numbers:
    """Return the Jacobian (6, n, samples) of a point at x (3, 1, samples) of one frame."""
    screws = joint_screws(xp, tables.joints, found.joints)
    z, s = screws[:, 0], screws[:, 1]
    return by_coordinate(tables, xp.concat([z[:3], s[:3] + cross(z, extend_xy(xp, x))], 0))


def load_torque(
    xp: Namespace, tables: FrameTables, found: FramePoses, x: Numbers, force: Numbers, moment: Numbers | None
) -> Numbers:
    """Return the torques (n, samples) that a load on a point at x of one frame requires of the coordinates.

    force, moment: (3, 1, samples) each, or None for no moment
    """
    screws = joint_screws(xp, tables.joints, found.joints)
    z, s = screws[:, 0], screws[:, 1]
    work = ((s[:3] + cross(z, extend_xy(xp, x))) * force).sum(0)
    if moment is not None:
        work = work + (z[:3] * moment).sum(0)
    return -by_coordinate(tables, work)


def moving(
    xp: Namespace,
    tables: FrameTables,
    numbers: TreeArrays,
    found: FramePoses,
    qd: Numbers,
    qdd: Numbers | None = None,
) -> Twists:
    """Return the screws and motion of the joints, without gravity; qd, qdd: (n, samples), no qdd for none."""
    joints = tables.joints
    velocity = gather(qd, joints.coordinates)
    acceleration = 0.0 * velocity if qdd is None else gather(qdd, joints.coordinates)
    return twists(xp, joints, found.joints, 0.0 * numbers.gravity, velocity, acceleration)


def jacobian_rate(xp: Namespace, tables: FrameTables, moved: Twists, x: Numbers) -> Numbers:
    """Return the rate of `jacobian`, (6, n, samples)."""
    zd, sd = moved.rates[:, 0], moved.rates[:, 1]
    xd = point_velocity(xp, of_frames(tables, moved.twists), x)
    linear = sd[:3] + cross(zd, extend_xy(xp, x)) + cross(moved.screws[:, 0], extend_xy(xp, xd))
    return by_coordinate(tables, xp.concat([zd[:3], linear], 0))


def velocity_of(xp: Namespace, tables: FrameTables, moved: Twists, x: Numbers) -> Numbers:
    """Return (omega, xd) of points, (6, frames, samples)."""
    twist = of_frames(tables, moved.twists)
    return xp.concat([twist[:3, 0], point_velocity(xp, twist, x)], 0)


def acceleration_of(xp: Namespace, tables: FrameTables, moved: Twists, x: Numbers) -> Numbers:
    """Return (alpha, xdd) of points, (6, frames, samples): xdd = a + alpha x x + omega x xd."""
    twist, change = (of_frames(tables, a) for a in (moved.twists, moved.accelerations))
    xd = extend_xy(xp, point_velocity(xp, twist, x))
    linear = change[:3, 1] + cross(change[:, 0], extend_xy(xp, x)) + cross(twist[:, 0], xd)
    return xp.concat([change[:3, 0], linear], 0)


def centre_of_mass(masses: Numbers, found: FramePoses) -> Numbers:
    """Return the centre of mass of all links, (3, samples)."""
    return (_shares(masses) * found.places).sum(1)


def centre_jacobian(xp: Namespace, tables: FrameTables, masses: Numbers, found: FramePoses) -> Numbers:
    """Return the Jacobian of the centre of mass, (3, n, samples)."""
    screws = joint_screws(xp, tables.joints, found.joints)
    mass, moment = _behind(tables, masses, found.places)
    return by_coordinate(tables, mass * screws[:3, 1] + cross(screws[:, 0], extend_xy(xp, moment)))


def centre_jacobian_rate(
    xp: Namespace, tables: FrameTables, masses: Numbers, found: FramePoses, moved: Twists
) -> Numbers:
    """Return the rate of `centre_jacobian`, (3, n, samples)."""
    speeds = point_velocity(xp, of_frames(tables, moved.twists), found.places)
    mass, moment = _behind(tables, masses, found.places)
    change = extend_xy(xp, _behind(tables, masses, speeds)[1])
    zd, sd = moved.rates[:, 0], moved.rates[:, 1]
    linear = mass * sd[:3] + cross(zd, extend_xy(xp, moment)) + cross(moved.screws[:, 0], change)
    return by_coordinate(tables, linear)


def _shares(masses: Numbers) -> Numbers:
    """Return the shares of the mass, m_j / m, (N, samples)."""
    return masses / masses.sum(0)


def _behind(tables: FrameTables, masses: Numbers, vectors: Numbers) -> tuple[Numbers, Numbers]:
    """Return sums over the links that each joint moves: of shares m_j / m, and of these times vectors."""
    shares = _shares(masses)
    return tables.moved_frames @ shares, tables.moved_frames @ (shares * vectors)


def of_frames(tables: FrameTables, twists: Numbers) -> Numbers:
    """Return the twists of the joints that carry the frames."""
    return gather(twists, tables.carriers)


def point_velocity(xp: Namespace, twist: Numbers, x: Numbers) -> Numbers:
    """Return the velocity of a point at x, v + omega x x."""
    return twist[:3, 1] + cross(twist[:, 0], extend_xy(xp, x))


def rotate_vectors(axes: Numbers, vector: Numbers) -> Numbers:
    """Return matrices (3, 3, ...) times vectors (3, ...)."""
    return axes[:, 0] * vector[0] + axes[:, 1] * vector[1] + axes[:, 2] * vector[2]


def by_coordinate(tables: CoordinateTables, columns: Numbers) -> Numbers:
    """Return columns (..., joints, samples) summed over the joints of each coordinate, (..., n, samples)."""
    first, *others = tables.columns
    total = gather(columns, first)
    for joints in others:
        total = total + gather(columns, joints)
    return total
