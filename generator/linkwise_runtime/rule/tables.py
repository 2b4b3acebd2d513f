"""Constants of the rigid-link rule for one robot, as each back end has them.

Constants of `spatial` are matrices, 6 x 6. Motions are ordered (s, z), linear before angular, and
wrenches (f, N), so that S . W is the part of wrench W on the joint of screw S. A frame turned by R and moved
by t has

    X = |R     0|     which brings its wrenches into the axes, and to the place, of what carries it,
        |[t]xR R|     and its spatial inertia too: X I X^T.

Samples of these matrices are outermost, and what all samples share has one.
"""

from collections.abc import Iterator, Sequence
from typing import NamedTuple, TypeVar, cast

import numpy as np
from numpy.typing import NDArray

from ..interface import Library, Namespace, Numbers
from .joint_tree import JointTree
from .kinematics import KinematicTables, Positions, doubling_ancestors, hinge_before, kinematic_tables
from .layout import RuleLayout, pair_layout
from .regressors import RegressorTables, regressor_tables
from .rigid import LinkNumbers, LinkTables, link_numbers
from .tree_arrays import TreeArrays, formula_sources, own_numbers

Table = TypeVar("Table")


class SpatialTables(NamedTuple):
    """Constants of a tree's joints. Frames are those of the joints, and one for the ground behind them."""

    coordinates: Numbers
    """Index of the coordinate of each frame."""
    own: Positions
    """Index of the coordinate of each joint."""
    turns: Numbers
    """Ratio of a revolute joint, 0 for others, (frames,)."""
    slides: Numbers | None
    """Ratio of a prismatic joint, 0 for others, (frames,); None where no joint slides."""
    turned: Numbers
    """X without t: the constant part, and those of cosine and sine; (3, 1, frames, 6, 6)."""
    axes: Numbers
    """(frames, 3): direction of the joint in its parent's axes; zeros before the first hinge."""
    behind: Numbers
    """(frames, 1): ones for the frames that have a hinge before them, whose translations count."""
    steps: tuple[Numbers, ...]
    """Frame that each one's X leads to so far, for each step of composition."""
    units: Numbers
    """(joints, 6, 1): (z, s) of each joint in its own frame, times its ratio."""
    chains: Numbers
    """(joints, joints): ones for the joints on each one's path, itself included."""
    joints: Positions
    """Index of the joint of each link."""
    swapped: Numbers
    """Positions that make (s, z) of (z, s)."""
    offset: Numbers
    """Table that places t in [0 0; [t]x 0], (3, 36)."""
    body: Numbers
    """Table that places mass and inertia in the matrix of a body about its centre, (10, 36)."""
    motion_cross: Numbers
    """Table that places (v, omega) in the matrix of V x, (6, 36)."""
    force_cross: Numbers
    """Table that places W = (f, N) in the matrix of S -> S x* W, (6, 36)."""


class SpatialNumbers(NamedTuple):
    """Numbers of a tree in matrices."""

    frames: Numbers
    """X of each frame: constant, and parts of cosine, sine and q; (3 or 4, samples, frames, 6, 6)."""
    inertias: Numbers
    """Spatial inertias in the axes of the links' frames, about their origins; (samples, N, 6, 6)."""
    gravity: Numbers
    """Gravity as an acceleration in the base's axes, (samples, 1, 6)."""


class RuleTables(NamedTuple):
    """Constants of a robot, of one dtype on one device."""

    frames: KinematicTables
    links: LinkTables
    own: TreeArrays
    numbers: LinkNumbers
    spatial: SpatialTables
    matrices: SpatialNumbers
    """Matrices of the tree's own numbers."""
    sources: Numbers
    groups: tuple[tuple[Positions, Positions], ...]
    """Links and path of each group."""
    positions: tuple[tuple[Numbers, ...], ...]
    """Positions of c2, c1, c0, g and tau in the answers, a table for each summand."""
    diagonal: Numbers
    """Position of the packed tau_i for each c0_ik with i = k; for others, that of a zero behind."""
    pairs: tuple[Numbers, Numbers]
    """Links and joints of the pairs of `PairLayout`."""
    entries: tuple[tuple[tuple[Numbers, Numbers], ...], ...]
    """Rows (e, wrench) of c2, c1 and c0; for g and tau rows of joint, and of kind and link."""
    regressors: RegressorTables


def listed_tables(tree: JointTree, layout: RuleLayout) -> RuleTables:
    """Return all constants as NumPy's arrays, in float64."""
    xp = cast("Namespace", np)
    own, links = own_numbers(tree), moving_links(tree)
    spatial = spatial_tables(tree, links.joints, _span([joint.coordinate for joint in tree.joints]))
    coefficients = [layout.acceleration, layout.velocity, layout.position_gradient]
    pairs = pair_layout(layout, coefficients, len(tree.joints))
    # c2 and c1 have wrenches of one kind each.
    count = len(pairs.links)
    each = (tuple((e, row % count) for e, row in table) for table in pairs.entries[:2])
    # The position for no entry is that of the ground, which has no screw.
    width = 2 * len(tree.links)
    singles = (tuple((row // width, row % width) for row in t) for t in (layout.gravity, layout.torque))
    fields = ("acceleration", "velocity", "position_gradient", "gravity", "torque")
    return RuleTables(
        kinematic_tables(tree),
        links,
        own,
        link_numbers(xp, links.eye, *own.bodies),
        spatial,
        spatial_numbers(xp, spatial, own),
        formula_sources(tree),
        tuple((_span(group.links), _span(group.path)) for group in layout.groups),
        tuple(tuple(getattr(layout, field)) for field in fields),
        layout.diagonal,
        (pairs.links, pairs.joints),
        (*each, *pairs.entries[2:], *singles),
        regressor_tables(tree),
    )


def moving_links(tree: JointTree) -> LinkTables:
    """Return the constants of the links, in float64."""
    # (a, -a, 0)
    skew = np.array([6, 5, 1, 2, 6, 3, 4, 0, 6])
    return LinkTables(_span([link.joint for link in tree.links]), np.eye(3)[:, :, None, None], skew)


def converted(table: Table, library: Library, like: Numbers) -> Table:
    """Return a table, with what it holds, for a dtype and device."""
    if isinstance(table, np.ndarray):
        made = library.index if table.dtype.kind == "i" else library.constant
        return cast("Table", made(table, like))
    if isinstance(table, tuple):
        entries = [converted(entry, library, like) for entry in table]
        return cast("Table", type(table)(*entries) if hasattr(table, "_fields") else tuple(entries))
    return table


def _span(positions: Sequence[int]) -> Positions:
    """Return positions in a row as a slice, which makes no copy; others as an array."""
    first, count = positions[0], len(positions)
    if list(positions) == list(range(first, first + count)):
        return slice(first, first + count)
    return np.array(positions, dtype=np.intp)


def spatial_tables(tree: JointTree, joints: Positions, own: Positions) -> SpatialTables:
    """Return the tables of a tree, in float64; joints: of the links; own: coordinates of the joints."""
    moved, count = tree.joints, len(tree.joints)
    hinge = np.array([*(joint.kind == "revolute" for joint in moved), True])
    ratio = np.array([*(joint.ratio for joint in moved), 0.0])
    rotation = np.array([*(joint.rotation for joint in moved), np.eye(3)])
    behind = np.array([*hinge_before(tree), False])[:, None].astype(float)
    parents = np.array([*(count if j.parent is None else j.parent for j in moved), count])
    chains = np.zeros((count, count))
    units = np.zeros((count, 6, 1))
    for f in range(count):
        chains[f, list(tree.chain(f))] = 1.0
        units[f, 2 if hinge[f] else 5] = ratio[f]
    return SpatialTables(
        np.array([*(joint.coordinate for joint in moved), 0]),
        own,
        np.where(hinge, ratio, 0.0),
        None if hinge.all() else np.where(hinge, 0.0, ratio),
        np.array([_twice(part) for part in _turned(rotation)])[:, None],
        rotation[:, :, 2] * behind,
        behind,
        tuple(doubling_ancestors(parents)),
        units,
        chains,
        joints,
        np.array([3, 4, 5, 0, 1, 2]),
        *_places(),
    )


def spatial_numbers(xp: Namespace, tables: SpatialTables, numbers: TreeArrays) -> SpatialNumbers:
    """Return the numbers of a tree in matrices, from those with samples innermost."""
    gravity, translations, masses, centres, inertias, _ = (xp.moveaxis(a, -1, 0) for a in numbers)
    # X = (1 + [0 0; [t]x 0]) diag(R, R)
    offset = as_matrices(xp.swapaxes(translations, 1, 2) * tables.behind, tables.offset)
    frames = tables.turned + offset @ tables.turned
    if tables.slides is not None:
        slide = as_matrices(tables.axes, tables.offset) @ (tables.turned[0, 0] + tables.turned[1, 0])
        frames = xp.concat([frames, xp.broadcast_to(slide, frames[:1].shape)], 0)
    # (1 + [0 0; [c]x 0]) diag(m 1, J) (1 + [0 0; [c]x 0])^T
    flat = xp.moveaxis(inertias.reshape(inertias.shape[0], 9, inertias.shape[3]), 1, 2)
    count = len(flat) if len(masses) == 1 else len(masses)
    parts = [xp.broadcast_to(a, (count, *a.shape[1:])) for a in (masses[..., None], flat)]
    body = as_matrices(xp.concat(parts, -1), tables.body)
    away = as_matrices(xp.swapaxes(centres, 1, 2), tables.offset)
    body = body + away @ body
    gravity = gravity[..., 0][:, None]
    return SpatialNumbers(
        frames, body + body @ xp.swapaxes(away, -1, -2), xp.concat([gravity, 0.0 * gravity], -1)
    )


def as_matrices(entries: Numbers, places: Numbers) -> Numbers:
    """Return matrices (..., 6, 6) whose entries are numbers (..., m) at their places, (m, 36)."""
    flat = entries @ places
    matrices: Numbers = flat.reshape(*flat.shape[:-1], 6, 6)
    return matrices


def _turned(rotation: NDArray[np.float64]) -> Iterator[NDArray[np.float64]]:
    """Yield the constant part, and those of cosine and sine, of R Rz(a).

    R Rz(a) = [x cos a + y sin a, y cos a - x sin a, z]
    """
    x, y, z = (rotation[:, :, i] for i in range(3))
    none = np.zeros_like(x)
    for columns in ((none, none, z), (x, y, none), (y, -x, none)):
        yield np.stack(columns, -1)


def _twice(part: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return diag(R, R)."""
    none = np.zeros_like(part)
    return np.block([[part, none], [none, part]])


def _places() -> Iterator[NDArray[np.float64]]:
    """Yield the tables `offset`, `body`, `motion_cross` and `force_cross`."""
    eye = np.eye(3)
    skew = np.cross(eye[:, None], eye).swapaxes(1, 2)
    none = np.zeros((3, 3, 3))
    offset = np.block([[none, none], [skew, none]])
    body = np.zeros((10, 6, 6))
    body[0, :3, :3] = eye
    for i in range(3):
        for k in range(3):  # of an inertia the symmetric part counts
            body[1 + 3 * i + k, 3 + i, 3 + k] += 0.5
            body[1 + 3 * i + k, 3 + k, 3 + i] += 0.5
    motion = np.concatenate([np.block([[none, skew], [none, none]]), np.block([[skew, none], [none, skew]])])
    # (s, z) x* (f, N) = (z x f, s x f + z x N)
    force = -np.concatenate([np.block([[none, skew], [skew, none]]), np.block([[none, none], [none, skew]])])
    yield from (table.reshape(len(table), -1) for table in (offset, body, motion, force))
