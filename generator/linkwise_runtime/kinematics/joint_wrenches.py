"""Wrenches of links, and of forces on frames, as joints carry them; arrays have samples innermost.

Wrenches (N, f) of links are those of `link_wrenches`, and joints carry them about points and in axes of
their own. A joint also carries what acts on frames behind it: a wrench (M, F) there takes (-M, -F) off the
joint.
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
    places_from_world,
    poses,
    product,
)
from ..rule.tree_arrays import TreeArrays
from .frame_arrays import rotate_vectors
from .link_wrenches import shift_matrices

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
    joints: Numbers
    """Indices of the joints that are asked for."""
    hinged: Numbers
    """Index of a joint for each point from which links count places: the first hinges of their paths."""
    shifts: Numbers
    """(joints N,): index in (joints, hinged) for each joint and link, behind them where it carries none."""
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


def joint_tables(tree: JointTree, asked: JointsAsked) -> JointTables:
    """Return the tables, in float64."""
    joints, ground = asked.joints, len(tree.joints)
    paths = [tree.chain(link.joint) for link in tree.links]
    hinges = [[e for e in tree.chain(f) if tree.joints[e].kind == "revolute"] for f in range(ground)]
    first = [(hinges[link.joint] or [link.joint])[0] for link in tree.links]
    every = sorted(set(first))
    shifts = [
        at * len(every) + every.index(hinge) if f in path else len(joints) * len(every)
        for at, f in enumerate(joints)
        for hinge, path in zip(first, paths, strict=True)
    ]
    carriers, rotation, origin = list(joints), np.eye(3), None
    if asked.frame is not None:
        carriers = [ground] * len(joints)
        if asked.frame != WORLD:
            frame = tree.frames[asked.frame]
            carriers = [ground if frame.joint is None else frame.joint] * len(joints)
            rotation, origin = np.array(frame.rotation), np.array([asked.frame])
    return JointTables(
        kinematic_tables(tree),
        np.array(joints, dtype=np.intp),
        np.array(every, dtype=np.intp),
        np.array(shifts, dtype=np.intp),
        np.array([float(not hinges[f]) for f in joints])[:, None, None],
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
    whole = places_from_world(tables.frames, numbers.translations, position, found.axes)
    turned = gather(found.axes, tables.carriers)
    axes, origins = product(turned, tables.rotations), gather(whole, tables.joints)
    if point is None:
        return PlacedJoints(found, whole, origins, 0.0 * origins, axes)
    offsets = gather(whole, tables.carriers) - origins + rotate_vectors(axes, point)
    if tables.origin is not None:
        offsets = offsets + rotate_vectors(turned, gather(numbers.offsets, tables.origin))
    return PlacedJoints(found, whole, origins + offsets, offsets, axes)


def shifts_to_joints(xp: Namespace, tables: JointTables, placed: PlacedJoints) -> Numbers:
    """Return matrices by which wrenches of links become those of joints, (joints hinged + 1, 6, 6, samples).

    The last one is zero, for links that a joint does not carry.
    """
    places, whole = placed.poses.places, placed.from_world
    own = gather(places, tables.joints)[:, :, None]
    # Places count from the first hinge of a path: for joints before it, from where the link's path has it.
    hinges = gather(whole, tables.hinged) - gather(places, tables.hinged)
    before = gather(whole, tables.joints)[:, :, None] - hinges[:, None]
    arms = own + tables.unhinged * (before - own) + placed.offsets[:, :, None]
    axes = xp.broadcast_to(placed.axes[:, :, :, None], (3, *arms.shape))
    flat = (a.reshape(*a.shape[:-3], a.shape[-3] * a.shape[-2], a.shape[-1]) for a in (axes, arms))
    found = shift_matrices(xp, *flat)
    return xp.concat([found, xp.zeros_like(found[:1])], 0)


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
