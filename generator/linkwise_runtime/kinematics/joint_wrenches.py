"""Wrenches of links by cause, and of forces on frames, as joints carry them; arrays have samples innermost.

The wrench (N, f) of link j is that of the rule for rigid links before any axis projects it (`rule.rigid`).
It is the same for every joint f on the path of j, but for the point x about which moments are taken:

    N_x = N - (x - o) x f        f_x = f

A joint also carries what acts on frames behind it: a wrench (M, F) there takes (-M, -F) off the joint.
"""

from typing import NamedTuple

import numpy as np

from ..interface import Namespace, Numbers
from ..rule.joint_tree import JointTree
from ..rule.kinematics import (
    KinematicTables,
    Poses,
    cross,
    extend_xy,
    gather,
    kinematic_tables,
    poses,
    product,
    twists,
)
from ..rule.rigid import (
    LinkMoments,
    LinkTables,
    inertial_wrench,
    link_numbers,
    link_states,
    turning,
)
from ..rule.tables import moving_links
from ..rule.tree_arrays import TreeArrays
from .frame_arrays import by_coordinate, coordinate_columns, rotate_vectors

WORLD = -1
"""Frame whose axes are the world's."""


class JointsAsked(NamedTuple):
    """Joints whose wrenches are asked for, and the axes of the answer."""

    joints: tuple[int, ...]
    """Indices in the tree."""
    frame: int | None = None
    """Frame of the tree whose axes count, or WORLD; None for the axes of each joint."""


class JointTables(NamedTuple):
    """Constants of a tree, and of the joints that are asked for."""

    frames: KinematicTables
    """Tables of all joints."""
    from_world: KinematicTables
    """Tables with places counted from the world's origin instead of the first hinge of a path."""
    links: LinkTables
    columns: tuple[Numbers, ...]
    """Joints of each coordinate, see `FrameTables`."""
    paths: Numbers
    """(N, frames, 1): ones where a joint moves a link."""
    joints: Numbers
    """Indices of the joints that are asked for."""
    carried: Numbers
    """(joints, N, 1, 1): ones where a joint carries a link."""
    unhinged: Numbers
    """(joints, 1, 1): ones for joints without a hinge on their path, themselves included."""
    carriers: Numbers
    """Index of the joint that moves the axes of the answer, for each joint; the ground for the world's."""
    rotations: Numbers
    """(3, 3, 1, 1): rotation from the axes of the answer to those of their carrier."""
    origin: Numbers | None
    """Index (1,) of the frame from whose origin points are counted; None for the carrier's own."""

    @property
    def moved(self) -> int:
        """Number of frames, by which the memory of a call grows beside that of its answer."""
        return len(self.frames.parents)


def joint_tables(tree: JointTree, n: int, asked: JointsAsked) -> JointTables:
    """Return the tables, in float64."""
    frames, joints, ground = kinematic_tables(tree), asked.joints, len(tree.joints)
    paths = [tree.chain(link.joint) for link in tree.links]
    hinges = [joint.kind == "revolute" for joint in tree.joints]
    carriers, rotation, origin = list(joints), np.eye(3), None
    if asked.frame is not None:
        carriers = [ground] * len(joints)
        if asked.frame != WORLD:
            frame = tree.frames[asked.frame]
            carriers = [ground if frame.joint is None else frame.joint] * len(joints)
            rotation, origin = np.array(frame.rotation), np.array([asked.frame])
    return JointTables(
        frames,
        frames._replace(behind=np.ones_like(frames.behind)),
        moving_links(tree),
        tuple(coordinate_columns([joint.coordinate for joint in tree.joints], n)),
        np.array([[float(f in path) for f in range(ground + 1)] for path in paths])[..., None],
        np.array(joints, dtype=np.intp),
        np.array([[float(f in path) for path in paths] for f in joints])[..., None, None],
        np.array([float(not any(hinges[e] for e in tree.chain(f))) for f in joints])[:, None, None],
        np.array(carriers, dtype=np.intp),
        rotation[:, :, None, None],
        origin,
    )


class PlacedJoints(NamedTuple):
    """Joints at a position, the points about which their moments are taken, and the axes of the answer."""

    poses: Poses
    """All joints, with places from the first hinge of each path."""
    from_world: Numbers
    """Places of all joints from the world's origin, (3, frames, samples)."""
    points: Numbers
    """Points of the joints that are asked for, from the world's origin, (3, joints, samples)."""
    offsets: Numbers
    """These points from the joints' origins, (3, joints, samples)."""
    axes: Numbers
    """Axes of the answer, (3, 3, joints, samples): [component, axis]."""


def placed_joints(
    xp: Namespace, tables: JointTables, numbers: TreeArrays, q: Numbers, point: Numbers | None
) -> PlacedJoints:
    """Return the joints at q (n, samples).

    point: (3, 1, samples) in the axes of the answer, from their origin; None for the joints' origins
    """
    position = gather(q, tables.frames.coordinates)
    found = poses(xp, tables.frames, numbers.translations, position)
    whole = poses(xp, tables.from_world, numbers.translations, position).places
    turned = gather(found.axes, tables.carriers)
    axes, origins = product(turned, tables.rotations), gather(whole, tables.joints)
    if point is None:
        return PlacedJoints(found, whole, origins, 0.0 * origins, axes)
    offsets = gather(whole, tables.carriers) - origins + rotate_vectors(axes, point)
    if tables.origin is not None:
        offsets = offsets + rotate_vectors(turned, gather(numbers.offsets, tables.origin))
    return PlacedJoints(found, whole, origins + offsets, offsets, axes)


class CauseWrenches(NamedTuple):
    """Wrenches of links by cause, about the first hinge of each path, in the base's axes."""

    acceleration: Numbers
    """Wrenches per acceleration of coordinate k, (6, N, n, samples)."""
    velocity: Numbers
    """Wrenches per velocity of coordinate k, in the closing convention, (6, N, n, samples)."""
    gravity: Numbers
    """Wrenches of weights, (6, N, 1, samples)."""


def cause_wrenches(
    xp: Namespace, tables: JointTables, numbers: TreeArrays, placed: PlacedJoints, qd: Numbers
) -> CauseWrenches:
    """Return the wrenches of the links at qd (n, samples)."""
    velocity = gather(qd, tables.frames.coordinates)
    moved = twists(xp, tables.frames, placed.poses, numbers.gravity, velocity, 0.0 * velocity)
    own = link_numbers(xp, tables.links.eye, *numbers.bodies)
    states = link_states(xp, tables.links, own, placed.poses, moved, numbers.gravity)
    # Links before joints: (..., N, frames, samples).
    link = LinkMoments(*(a[..., None, :] for a in states.moments))
    (z, s), (zd, sd) = ((a[:, 0, None], a[:, 1, None]) for a in (moved.screws, moved.rates))
    both = (
        inertial_wrench(xp, link, z, s),
        inertial_wrench(xp, link, zd, sd) + turning(xp, link, z),
    )
    c2, c1 = (by_coordinate(tables, tables.paths * wrench) for wrench in both)
    return CauseWrenches(c2, c1, states.wrenches[:, 1, :, None])


def at_joints(xp: Namespace, tables: JointTables, placed: PlacedJoints, wrenches: Numbers) -> Numbers:
    """Return wrenches (6, N, X, samples) of links as the joints carry them, (joints, N, X, 6, samples)."""
    places, whole, carriers = placed.poses.places, placed.from_world, tables.links.joints
    own = gather(places, tables.joints)[:, :, None]
    # Places count from the first hinge of a path: for joints before it, from where the link's path has it.
    hinges = gather(whole, carriers) - gather(places, carriers)
    before = gather(whole, tables.joints)[:, :, None] - hinges[:, None]
    arms = own + tables.unhinged * (before - own) + placed.offsets[:, :, None]
    moved = moved_to(xp, arms[:, :, :, None], wrenches[:, None])
    return in_axes(xp, placed.axes, tables.carried * moved)


def on_frames(
    xp: Namespace, placed: PlacedJoints, carried: Numbers, places: Numbers, wrenches: Numbers
) -> Numbers:
    """Return what wrenches on frames leave for the joints to bear, (joints, X, 6, samples).

    carried: (joints, X, 1), ones where a joint carries the frame; places: where forces act, from the world's
    origin, (3, X, samples); wrenches: moments, and forces there, (6, X, samples)
    """
    arms = placed.points[:, :, None] - places[:, None]
    return in_axes(xp, placed.axes, -carried * moved_to(xp, arms, wrenches[:, None]))


def moved_to(xp: Namespace, arms: Numbers, wrenches: Numbers) -> Numbers:
    """Return wrenches (6, ...) about points that lie at arms (3, ...) from where they were taken."""
    moment = wrenches[:3] - cross(extend_xy(xp, arms), extend_xy(xp, wrenches[3:]))
    return xp.concat([moment, xp.broadcast_to(wrenches[3:], moment.shape)], 0)


def in_axes(xp: Namespace, axes: Numbers, wrenches: Numbers) -> Numbers:
    """Return wrenches (6, joints, ..., X, samples) in the joints' axes, (joints, ..., X, 6, samples)."""
    between = (1,) * (wrenches.ndim - 3)
    turned = axes.reshape(*axes.shape[:3], *between, axes.shape[3])
    parts = (wrenches[:3], wrenches[3:])
    entries = [(turned[:, axis] * part).sum(0) for part in parts for axis in range(3)]
    return xp.stack(entries, -2)
