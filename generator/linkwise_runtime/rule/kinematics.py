"""Where the frames of a tree of joints are and how they move, all joints at once.

`xp` is the array namespace, numpy or torch. Arrays have their samples innermost and their joints (or links)
before them: a vector is (3, joints, samples), and what all samples share has one. The number of array
operations grows with the logarithm of the tree's depth alone: frames are composed over one joint, then two,
four, eight, and so is what adds up along a chain of joints.

Vectors are in the base's axes, and moments and linear velocities about an origin o at rest: at the instant
it is in the first hinge of each path, and places are counted from there, so that what is far from the base,
or from another arm, loses no digits. The screw of joint f, times its ratio, is S_f = (z, s): s = (p - o) x z
for a hinge at p, and z = 0, s = axis for a slide, wherever it is. Where joints follow curves of their
coordinates, the slopes of these are factors of the screws too, see `joint_curves`.
"""

from typing import Any, NamedTuple

import numpy as np

from .joint_curves import CurveTables, curve_tables, displaced
from .joint_tree import JointTree


class KinematicTables(NamedTuple):
    """What kinematics needs of a tree. Frames are those of the joints, and one for the ground behind them."""

    coordinates: Any
    """Index of the coordinate of each frame."""
    turns: Any
    """Ratio of a revolute joint, 0 of another, (frames, 1)."""
    slides: Any
    """Ratio of a prismatic joint, 0 of another, (frames, 1); None where no joint slides."""
    still: Any
    """(3, 3, frames, 1): axes of a frame in its parent's, without what follows."""
    cosine: Any
    """The same: what its joint's cosine multiplies."""
    sine: Any
    """The same: what its joint's sine multiplies."""
    axes: Any
    """(3, frames, 1): direction of the joint in its parent's axes."""
    parents: Any
    """Frame that carries each one."""
    steps: tuple[Any, ...]
    """For each step of composition the frame that each one's axes are in so far."""
    behind: Any
    """(frames, 1): ones for the frames that have a hinge before them, whose steps count."""
    curves: CurveTables | None
    """What joints follow; None where none does."""


class Poses(NamedTuple):
    """Frames of all joints in the base's axes, and of the ground behind them."""

    axes: Any
    """(3, 3, frames, samples): [component, axis x, y or z]."""
    places: Any
    """From the first hinge of the path, (3, frames, samples), in m; zero before it."""
    moved: Any = None
    """`Displacement` of the joints."""


class Twists(NamedTuple):
    """Screws and motion about the first hinge of each path.

    Vectors end with their x and y once more, see `around`.
    """

    screws: Any
    """(5, 2, frames, samples): z and s of each joint times its ratio; none for the ground."""
    rates: Any
    """The same of their rates, zd and sd."""
    twists: Any
    """The same: omega and v of each frame; V x S is also that of what carries the joint, as S x S = 0."""
    accelerations: Any
    """The same: their rates, from minus gravity."""
    second: Any = None
    """The same: what curves add to the second rates of the screws; None where no joint follows one."""
    bends: Any = None
    """The same: how the screws change by their own coordinates; None likewise."""


def kinematic_tables(tree: JointTree) -> KinematicTables:
    """Tables of a tree, in float64."""
    joints = tree.joints
    rotation = np.array([*(j.rotation for j in joints), np.eye(3)]).transpose(1, 2, 0)[..., None]
    ratio = np.array([*(j.ratio for j in joints), 0.0])[:, None]
    hinge = np.array([*(j.kind == "revolute" for j in joints), True])[:, None]
    x, y, z = rotation[:, 0], rotation[:, 1], rotation[:, 2]
    none, ground = np.zeros_like(x), len(joints)
    parents = np.array([*(ground if j.parent is None else j.parent for j in joints), ground])
    return KinematicTables(
        np.array([*(j.coordinate for j in joints), 0]),
        np.where(hinge, ratio, 0.0),
        None if hinge.all() else np.where(hinge, 0.0, ratio),
        # R Rz(a) = [x cos a + y sin a, y cos a - x sin a, z]
        np.stack([none, none, z], 1),
        np.stack([x, y, none], 1),
        np.stack([y, -x, none], 1),
        z,
        parents,
        tuple(doubled(parents)),
        np.array([*hinge_before(tree), False])[:, None].astype(float),
        curve_tables(tree),
    )


def hinge_before(tree: JointTree) -> list[bool]:
    """Whether each joint's path has a hinge before it."""
    hinges = [joint.kind == "revolute" for joint in tree.joints]
    return [any(hinges[f] for f in tree.chain(joint.parent)) for joint in tree.joints]


def doubled(parents: Any) -> Any:
    """Frames 1, 2, 4, ... joints before each; the ground, the last one, stays where it is."""
    while (parents != len(parents) - 1).any():
        yield parents
        parents = parents[parents]


def poses(xp: Any, tables: KinematicTables, translations: Any, position: Any) -> Poses:
    """Forward kinematics of the whole tree.

    translations: of every frame in its parent's axes, (3, frames, samples); position: q of every frame's
    coordinate, (frames, samples)
    """
    moved = displaced(xp, tables.curves, position)
    angle = tables.turns * moved.value
    # Stacked, as a compiler then keeps them; else it works them out again for every entry of the axes.
    cosine, sine = xp.stack([xp.cos(angle), xp.sin(angle)], 0)
    axes = tables.still + tables.cosine * cosine + tables.sine * sine
    for parents in tables.steps:
        axes = product(taken(axes, parents), axes)
    # Each joint is so far from the one before: p_f - p_parent = R_parent t, and it all adds up.
    step = translations
    if tables.slides is not None:
        step = step + tables.axes * (tables.slides * moved.value)
    before = taken(axes, tables.parents)
    step = before[:, 0] * step[0] + before[:, 1] * step[1] + before[:, 2] * step[2]
    return Poses(axes, _summed(tables, tables.behind * step), moved)


def joint_screws(xp: Any, tables: KinematicTables, poses: Poses) -> Any:
    """z and s of each joint times its ratio and slope, (5, 2, frames, samples); none for the ground."""
    screws = _straight_screws(xp, tables, poses)
    return screws if tables.curves is None else screws * poses.moved.slope


def _straight_screws(xp: Any, tables: KinematicTables, poses: Poses) -> Any:
    """The same without slopes."""
    axis = poses.axes[:, 2]
    z = axis * tables.turns
    s = cross(around(xp, poses.places), around(xp, z))
    if tables.slides is not None:
        s = s + axis * tables.slides
    return around(xp, xp.stack([z, s], 1))


def twists(
    xp: Any, tables: KinematicTables, poses: Poses, gravity: Any, velocity: Any, acceleration: Any
) -> Twists:
    """Screws and motion of the tree.

    velocity, acceleration: qd and qdd of every frame's coordinate, (frames, samples); gravity: (3, 1,
    samples)
    """
    screws = straight = _straight_screws(xp, tables, poses)
    if tables.curves is not None:
        screws = straight * poses.moved.slope
    # V = sum of S qd, Sd = V x S, A = -gravity + sum of S qdd + Sd qd, over the joints of the path.
    moved = _summed(tables, screws * velocity)
    rates = motion_cross(xp, moved, screws)
    second = bends = None
    if tables.curves is not None:
        bends = straight * poses.moved.bend
        own = poses.moved.jerk * velocity * velocity + poses.moved.bend * acceleration
        second = motion_cross(xp, moved, bends) * velocity + straight * own
        rates = rates + bends * velocity
    change = _summed(tables, screws * acceleration + rates * velocity)
    weight = around(xp, xp.stack([0.0 * gravity, gravity], 1))
    return Twists(screws, rates, moved, change - weight, second, bends)


def _summed(tables: KinematicTables, a: Any) -> Any:
    """Sums over the path of each frame, itself included; of (..., frames, samples), zero for the ground."""
    for parents in tables.steps:
        a = a + taken(a, parents)
    return a


def taken(a: Any, index: Any, axis: int = -2) -> Any:
    """Some entries of an axis, counted from the end: -2 is that of the joints in (..., joints, samples).

    index: a slice, or a table of positions
    """
    if isinstance(index, slice):
        return a[(..., index) + (slice(None),) * (-1 - axis)]
    return a.take(index, axis) if isinstance(a, np.ndarray) else a.index_select(axis, index)


def product(a: Any, b: Any) -> Any:
    """Products of matrices (3, 3, ...)."""
    return a[:, 0:1] * b[0:1] + a[:, 1:2] * b[1:2] + a[:, 2:3] * b[2:3]


def around(xp: Any, a: Any) -> Any:
    """A vector with its x and y once more, (5, ...), for `cross`."""
    return xp.concat([a, a[:2]], 0)


def cross(a: Any, b: Any) -> Any:
    """a x b of vectors (5, ...), as a vector (3, ...)."""
    return a[1:4] * b[2:5] - a[2:5] * b[1:4]


def motion_cross(xp: Any, a: Any, b: Any) -> Any:
    """(omega, v) x (z, s) = (omega x z, omega x s + v x z) of pairs of vectors (5, 2, ...)."""
    both = cross(a[:, 0:1], b)
    return around(xp, xp.stack([both[:, 0], both[:, 1] + cross(a[:, 1], b[:, 0])], 1))
