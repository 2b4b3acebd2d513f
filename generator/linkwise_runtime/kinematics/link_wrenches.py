"""Wrenches of links by cause, before any joint carries them; arrays have samples innermost.

The wrench (N, f) of link j is that of the rule for rigid links before any axis projects it (`rule.rigid`).
It is the same for every joint on the path of j, but for the point about which moments are taken. With
a = x - o, from a point o to another one x, and R the axes of the answer, rows (N, f) about o times a matrix
are those about x in these axes:

    (N, f) |R           0|        N_x = N - a x f        f_x = f
           |[a]x R      R|
"""

from typing import NamedTuple

import numpy as np

from ..interface import Namespace, Numbers
from ..rule.joint_tree import JointTree
from ..rule.kinematics import KinematicTables, cross, extend_xy, gather, kinematic_tables, poses, twists
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
from ..structure import Indices
from .frame_arrays import by_coordinate, coordinate_columns


class CauseTables(NamedTuple):
    """Constants of a tree for the wrenches of its links by cause."""

    frames: KinematicTables
    """Tables of all joints."""
    links: LinkTables
    columns: tuple[Numbers, ...]
    """Joints of each coordinate, see `FrameTables`."""
    paths: Numbers
    """(N, frames, 1): ones where a joint moves a link."""
    packed: Numbers
    """(N n,): index of each link and coordinate in the order of `Layout.torque`, behind them where it is none
    of the link's path."""

    @property
    def moved(self) -> int:
        """Number of frames, by which the memory of a call grows beside that of its answer."""
        return len(self.frames.parents)


def cause_tables(tree: JointTree, n: int, rows: Indices) -> CauseTables:
    """Return the tables, in float64; rows: `Layout.torque`."""
    packed = np.full((len(tree.links), n), len(rows))
    packed[rows[:, 1], rows[:, 0]] = range(len(rows))
    paths = [tree.chain(link.joint) for link in tree.links]
    return CauseTables(
        kinematic_tables(tree),
        moving_links(tree),
        tuple(coordinate_columns([joint.coordinate for joint in tree.joints], n)),
        np.array([[float(f in path) for f in range(len(tree.joints) + 1)] for path in paths])[..., None],
        packed.reshape(-1),
    )


class CauseWrenches(NamedTuple):
    """Wrenches of links by cause, about the first hinge of each path, in the base's axes.

    Shapes are (6, N, X, samples), or (..., N, X, 6) as back ends answer.
    """

    acceleration: Numbers
    """Wrenches per acceleration of coordinate k, X = n."""
    velocity: Numbers
    """Wrenches per velocity of coordinate k, in the closing convention, X = n."""
    gravity: Numbers
    """Wrenches of weights, X = 1."""


def cause_wrenches(
    xp: Namespace, tables: CauseTables, numbers: TreeArrays, q: Numbers, qd: Numbers
) -> CauseWrenches:
    """Return the wrenches of the links at q and qd (n, samples)."""
    position, velocity = (gather(a, tables.frames.coordinates) for a in (q, qd))
    found = poses(xp, tables.frames, numbers.translations, position)
    moved = twists(xp, tables.frames, found, numbers.gravity, velocity, 0.0 * velocity)
    own = link_numbers(xp, tables.links.eye, *numbers.bodies)
    states = link_states(xp, tables.links, own, found, moved, numbers.gravity)
    # Links before joints: (..., N, frames, samples).
    link = LinkMoments(*(a[..., None, :] for a in states.moments))
    (z, s), (zd, sd) = ((a[:, 0, None], a[:, 1, None]) for a in (moved.screws, moved.rates))
    both = (
        inertial_wrench(xp, link, z, s),
        inertial_wrench(xp, link, zd, sd) + turning(xp, link, z),
    )
    c2, c1 = (by_coordinate(tables, tables.paths * wrench) for wrench in both)
    return CauseWrenches(c2, c1, states.wrenches[:, 1, :, None])


def shifts_to_hinges(xp: Namespace, tables: CauseTables, numbers: TreeArrays, q: Numbers) -> Numbers:
    """Return matrices that move wrenches from the joints that move the links to the first hinges of paths.

    (N, 6, 6, samples), for q (n, samples)
    """
    position = gather(q, tables.frames.coordinates)
    places = gather(poses(xp, tables.frames, numbers.translations, position).places, tables.links.joints)
    return shift_matrices(xp, xp.broadcast_to(tables.links.eye, (3, *places.shape)), -places)


def shift_matrices(xp: Namespace, axes: Numbers, arms: Numbers) -> Numbers:
    """Return matrices (X, 6, 6, samples) by which rows (N, f) are multiplied, see above.

    axes: of the answer, (3, 3, X, samples): [component, axis]; arms: (3, X, samples), from the points about
    which moments are taken to those about which they are to be
    """
    turned = cross(extend_xy(xp, arms)[:, None], extend_xy(xp, axes))
    rows = xp.concat([axes, xp.zeros_like(axes)], 1), xp.concat([turned, axes], 1)
    return xp.swapaxes(xp.swapaxes(xp.concat(rows, 0), 0, 2), 1, 2)
