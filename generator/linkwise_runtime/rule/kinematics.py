"""Places and motion of the frames of a tree of joints, all joints at once.

`xp` is the array namespace, numpy or torch. Arrays have their samples innermost and their joints (or links)
before them: a vector is (3, joints, samples), and what all samples share has one. The number of array
operations grows with the logarithm of the tree's depth alone: frames are composed over one joint, then two,
four, eight, and sums along a chain of joints likewise.

Vectors are in the base's axes. Moments and linear velocities are about an origin o at rest, which at the
instant is in the first hinge of each path; places are counted from there, so that what is far from the base,
or from another arm, loses no digits. The screw of joint f, times its ratio, is S_f = (z, s): s = (p - o) x z
for a hinge at p, and z = 0, s = axis for a slide, wherever it is.

With d(q) the curve of a joint whose screw is sigma at a ratio of 1, all formulas stay as they are for its
screw S = d' sigma, whose rates have more terms:

    Sd  = V x S  + d'' qd sigma
    Sdd = A x S + V x Sd + d'' qd V x sigma + (d''' qd^2 + d'' qdd) sigma

The position gradient c0_ik has one more term, for a joint's screw itself: d'' sigma . W, with the wrench W of
tau.
"""

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..interface import Namespace, Numbers
from .joint_tree import JointTree, TreeCurve

LINE = TreeCurve((0.0,), ((0.0, 1.0),))
"""Curve d(q) = q of a joint that has none; the ratio is applied to it as to any other."""
Positions = slice | Numbers
"""Entries to take of an axis: a slice, or a table of positions."""
Slopes = tuple[Numbers, Numbers, Numbers]
"""First three derivatives of all curves by q, (frames, samples) each."""


class CurveTables(NamedTuple):
    """Curves of all frames; each has as many pieces, and each piece as many powers, as the longest."""

    ends: Numbers
    """End of each piece, (pieces - 1, frames, 1); infinite where there is none."""
    first: Numbers
    """Index of each frame's first piece among all, (frames, 1)."""
    starts: Numbers
    """Starts of all pieces, (frames * pieces)."""
    powers: Numbers
    """Coefficients of the powers of the curve and its three derivatives, (4, powers, frames * pieces)."""


class KinematicTables(NamedTuple):
    """Tables of a tree for kinematics. Frames are those of the joints, and one for the ground behind them."""

    coordinates: Numbers
    """Index of the coordinate of each frame."""
    turns: Numbers
    """Ratio of a revolute joint, 0 for others, (frames, 1)."""
    slides: Numbers | None
    """Ratio of a prismatic joint, 0 for others, (frames, 1); None where no joint slides."""
    still: Numbers
    """(3, 3, frames, 1): axes of a frame in its parent's, without the two parts that follow."""
    cosine: Numbers
    """(3, 3, frames, 1): part of these axes that the cosine of the joint's angle multiplies."""
    sine: Numbers
    """(3, 3, frames, 1): part of these axes that the sine of the joint's angle multiplies."""
    axes: Numbers
    """(3, frames, 1): direction of the joint in its parent's axes."""
    parents: Numbers
    """Index of the frame that carries each one."""
    steps: tuple[Numbers, ...]
    """Frame in whose axes each one is so far, for each step of composition."""
    behind: Numbers
    """(frames, 1): ones for the frames that have a hinge before them, whose steps count."""
    curves: CurveTables | None
    """Curves that joints follow; None where no joint follows one."""


class Poses(NamedTuple):
    """Frames of all joints in the base's axes, and of the ground behind them."""

    axes: Numbers
    """(3, 3, frames, samples): [component, axis x, y or z]."""
    places: Numbers
    """Places from the first hinge of the path, (3, frames, samples), in m; zero before it."""
    slopes: Slopes | None = None
    """Slopes of the joints' curves; None where no joint follows one."""


class Twists(NamedTuple):
    """Screws and motion about the first hinge of each path.

    Vectors end with their x and y once more, see `extend_xy`.
    """

    screws: Numbers
    """(5, 2, frames, samples): z and s of each joint times its ratio; zero for the ground."""
    rates: Numbers
    """(5, 2, frames, samples): zd and sd, the rates of the screws."""
    twists: Numbers
    """(5, 2, frames, samples): omega and v of each frame; V x S may use its carrier's too, as S x S = 0."""
    accelerations: Numbers
    """(5, 2, frames, samples): rates of omega and v, from minus gravity."""
    second: Numbers | None = None
    """(5, 2, frames, samples): terms of curves in the second rates of the screws; None without curves."""
    bends: Numbers | None = None
    """(5, 2, frames, samples): derivatives of the screws by their own coordinates; None without curves."""


def kinematic_tables(tree: JointTree) -> KinematicTables:
    """Return the tables of a tree, in float64."""
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
        tuple(doubling_ancestors(parents)),
        np.array([*hinge_before(tree), False])[:, None].astype(float),
        curve_tables(tree),
    )


def curve_tables(tree: JointTree) -> CurveTables | None:
    """Return the tables of a tree's curves, in float64; None where no joint follows a curve."""
    if not any(joint.curve for joint in tree.joints):
        return None
    curves = [*(joint.curve or LINE for joint in tree.joints), LINE]
    pieces = max(len(curve.starts) for curve in curves)
    size = max(len(piece) for curve in curves for piece in curve.pieces)
    starts = np.zeros((len(curves), pieces))
    ends = np.full((pieces - 1, len(curves), 1), np.inf)
    powers = np.zeros((4, size, len(curves), pieces))
    for f, curve in enumerate(curves):
        starts[f, : len(curve.starts)] = curve.starts
        ends[: len(curve.starts) - 1, f, 0] = curve.starts[1:]
        for at, piece in enumerate(curve.pieces):
            powers[0, : len(piece), f, at] = piece
    for order in range(3):
        scaled = powers[order] * np.arange(size)[:, None, None]
        powers[order + 1, :-1] = scaled[1:]
    first = np.arange(len(curves))[:, None] * pieces
    return CurveTables(ends, first, starts.reshape(-1), powers.reshape(4, size, -1))


def hinge_before(tree: JointTree) -> list[bool]:
    """Return whether each joint's path has a hinge before it."""
    hinges = [joint.kind == "revolute" for joint in tree.joints]
    return [any(hinges[f] for f in tree.chain(joint.parent)) for joint in tree.joints]


def doubling_ancestors(parents: NDArray[np.intp]) -> Iterator[NDArray[np.intp]]:
    """Yield the frames 1, 2, 4, ... joints before each; the ground, the last one, stays where it is."""
    while (parents != len(parents) - 1).any():
        yield parents
        parents = parents[parents]


def curve_displacement(tables: CurveTables, position: Numbers) -> tuple[Numbers, Slopes]:
    """Return d, which each joint's ratio multiplies, and its slopes, for q of every frame's coordinate."""
    piece = tables.first + (position >= tables.ends).sum(0)
    at = position - tables.starts[piece]
    coefficients = tables.powers[:, :, piece]
    value = coefficients[:, -1]
    for power in range(coefficients.shape[1] - 2, -1, -1):
        value = value * at + coefficients[:, power]
    return value[0], (value[1], value[2], value[3])


def poses(xp: Namespace, tables: KinematicTables, translations: Numbers, position: Numbers) -> Poses:
    """Return the poses of all frames of the tree, by forward kinematics.

    translations: of every frame in its parent's axes, (3, frames, samples); position: q of every frame's
    coordinate, (frames, samples)
    """
    way, slopes = _way(tables, position)
    angle = tables.turns * way
    # Stacked, so that a compiler keeps them; else it computes them again for every entry of the axes.
    cosine, sine = xp.stack([xp.cos(angle), xp.sin(angle)], 0)
    axes = tables.still + tables.cosine * cosine + tables.sine * sine
    for parents in tables.steps:
        axes = product(gather(axes, parents), axes)
    return Poses(axes, _summed(tables, tables.behind * _steps(tables, translations, way, axes)), slopes)


def places_from_world(
    tables: KinematicTables, translations: Numbers, position: Numbers, axes: Numbers
) -> Numbers:
    """Return the places of all frames from the world's origin, (3, frames, samples), in m.

    axes: of the frames, as `poses` has them; the others are as there
    """
    return _summed(tables, _steps(tables, translations, _way(tables, position)[0], axes))


def _way(tables: KinematicTables, position: Numbers) -> tuple[Numbers, Slopes | None]:
    """Return what each joint's ratio multiplies, and its slopes where joints follow curves."""
    return (position, None) if tables.curves is None else curve_displacement(tables.curves, position)


def _steps(tables: KinematicTables, translations: Numbers, way: Numbers, axes: Numbers) -> Numbers:
    """Return the place of each frame from that of its parent, (3, frames, samples)."""
    # Each joint is p_f - p_parent = R_parent t from the one before; along a path these add up.
    step = translations
    if tables.slides is not None:
        step = step + tables.axes * (tables.slides * way)
    before = gather(axes, tables.parents)
    return before[:, 0] * step[0] + before[:, 1] * step[1] + before[:, 2] * step[2]


def joint_screws(xp: Namespace, tables: KinematicTables, poses: Poses) -> Numbers:
    """Return z and s of joints times ratio and slope, (5, 2, frames, samples); zero for the ground."""
    screws = _straight_screws(xp, tables, poses)
    return screws if poses.slopes is None else screws * poses.slopes[0]


def _straight_screws(xp: Namespace, tables: KinematicTables, poses: Poses) -> Numbers:
    """Return z and s of each joint times its ratio, without slopes, (5, 2, frames, samples)."""
    axis = poses.axes[:, 2]
    z = axis * tables.turns
    s = cross(extend_xy(xp, poses.places), extend_xy(xp, z))
    if tables.slides is not None:
        s = s + axis * tables.slides
    return extend_xy(xp, xp.stack([z, s], 1))


def twists(
    xp: Namespace,
    tables: KinematicTables,
    poses: Poses,
    gravity: Numbers,
    velocity: Numbers,
    acceleration: Numbers,
) -> Twists:
    """Return the screws and the motion of the tree.

    velocity, acceleration: qd and qdd of every frame's coordinate, (frames, samples); gravity: (3, 1,
    samples)
    """
    screws = straight = _straight_screws(xp, tables, poses)
    if poses.slopes is not None:
        slope, bend, jerk = poses.slopes
        screws = straight * slope
    # V = sum of S qd, Sd = V x S, A = -gravity + sum of S qdd + Sd qd, over the joints of the path.
    moved = _summed(tables, screws * velocity)
    rates = motion_cross(xp, moved, screws)
    second = bends = None
    if poses.slopes is not None:
        bends = straight * bend
        own = jerk * velocity * velocity + bend * acceleration
        second = motion_cross(xp, moved, bends) * velocity + straight * own
        rates = rates + bends * velocity
    change = _summed(tables, screws * acceleration + rates * velocity)
    weight = extend_xy(xp, xp.stack([0.0 * gravity, gravity], 1))
    return Twists(screws, rates, moved, change - weight, second, bends)


def _summed(tables: KinematicTables, a: Numbers) -> Numbers:
    """Return sums over the path of each frame, itself included, of (..., frames, samples).

    The ground's entries must be zero.
    """
    for parents in tables.steps:
        a = a + gather(a, parents)
    return a


def gather(a: Numbers, index: Positions, axis: int = -2) -> Numbers:
    """Return some entries of an axis, counted from the end: -2 is joints in (..., joints, samples)."""
    if isinstance(index, slice):
        return a[(..., index) + (slice(None),) * (-1 - axis)]
    either: Any = a
    some: Numbers = (
        either.take(index, axis) if isinstance(a, np.ndarray) else either.index_select(axis, index)
    )
    return some


def product(a: Numbers, b: Numbers) -> Numbers:
    """Return the products of matrices (3, 3, ...)."""
    return a[:, 0:1] * b[0:1] + a[:, 1:2] * b[1:2] + a[:, 2:3] * b[2:3]


def extend_xy(xp: Namespace, a: Numbers) -> Numbers:
    """Return a vector with its x and y once more, (5, ...), for `cross`."""
    return xp.concat([a, a[:2]], 0)


def cross(a: Numbers, b: Numbers) -> Numbers:
    """Return a x b of vectors (5, ...), as a vector (3, ...)."""
    return a[1:4] * b[2:5] - a[2:5] * b[1:4]


def motion_cross(xp: Namespace, a: Numbers, b: Numbers) -> Numbers:
    """Return (omega, v) x (z, s) = (omega x z, omega x s + v x z) of pairs of vectors (5, 2, ...)."""
    both = cross(a[:, 0:1], b)
    return extend_xy(xp, xp.stack([both[:, 0], both[:, 1] + cross(a[:, 1], b[:, 0])], 1))
