"""The constants of the rigid-link rule in spatial matrices, and a robot's numbers in them.

Matrices are 6 x 6. Motions are ordered (s, z), linear before angular, and wrenches (f, N), so that S . W is
the part of wrench W on the joint of screw S. A frame turned by R and moved by t has

    X = |R     0|     which brings its wrenches into the axes, and to the place, of what carries it,
        |[t]xR R|     and its spatial inertia too: X I X^T.

Arrays have their samples outermost, and what all samples share has one.
"""

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .joint_tree import JointTree
from .kinematics import doubled, hinge_before
from .tree_arrays import TreeArrays


class SpatialTables(NamedTuple):
    """What a tree's joints are. Frames are those of the joints, and one for the ground behind them."""

    coordinates: Any
    """Index of the coordinate of each frame."""
    own: Any
    """The same of each joint."""
    turns: Any
    """Ratio of a revolute joint, 0 of another, (frames,)."""
    slides: Any
    """Ratio of a prismatic joint, 0 of another, (frames,); None where no joint slides."""
    turned: Any
    """X without t: still, and what cosine and sine multiply; (3, 1, frames, 6, 6)."""
    axes: Any
    """(frames, 3): direction of the joint in its parent's axes; zeros before the first hinge."""
    behind: Any
    """(frames, 1): ones for the frames that have a hinge before them, whose translations count."""
    steps: tuple[Any, ...]
    """For each step of composition the frame that each one's X leads to so far."""
    units: Any
    """(joints, 6, 1): (z, s) of each joint in its own frame, times its ratio."""
    chains: Any
    """(joints, joints): ones for the joints on each one's path, itself included."""
    joints: Any
    """Joint of each link."""
    swapped: Any
    """(s, z) of (z, s)."""
    offset: Any
    """Where t stands in [0 0; [t]x 0], (3, 36)."""
    body: Any
    """Where mass and inertia stand in those of a body about its centre, (10, 36)."""
    motion_cross: Any
    """Where (v, omega) stands in the matrix of V x, (6, 36)."""
    force_cross: Any
    """Where W = (f, N) stands in the matrix of S -> S x* W, (6, 36)."""


class SpatialNumbers(NamedTuple):
    """The numbers of a tree in matrices."""

    frames: Any
    """X of each frame: still, and what cosine, sine and q multiply; (3 or 4, samples, frames, 6, 6)."""
    inertias: Any
    """In the axes of the links' frames, about their origins; (samples, N, 6, 6)."""
    gravity: Any
    """(samples, 1, 6), as an acceleration of the base's axes."""


def spatial_tables(tree: JointTree, joints: Any, own: Any) -> SpatialTables:
    """Tables of a tree, in float64; joints of the links and coordinates of the joints as given."""
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
        tuple(doubled(parents)),
        units,
        chains,
        joints,
        np.array([3, 4, 5, 0, 1, 2]),
        *_places(),
    )


def spatial_numbers(xp: Any, tables: SpatialTables, numbers: TreeArrays) -> SpatialNumbers:
    """The numbers of a tree in matrices, from those with their samples innermost."""
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


def as_matrices(entries: Any, places: Any) -> Any:
    """Matrices whose entries are numbers (..., m) at their places, (m, 36)."""
    flat = entries @ places
    return flat.reshape(*flat.shape[:-1], 6, 6)


def _turned(rotation: NDArray[np.float64]) -> Iterator[NDArray[np.float64]]:
    """R Rz(a) = [x cos a + y sin a, y cos a - x sin a, z]: what stands still, and of cosine and sine."""
    x, y, z = (rotation[:, :, i] for i in range(3))
    none = np.zeros_like(x)
    for columns in ((none, none, z), (x, y, none), (y, -x, none)):
        yield np.stack(columns, -1)


def _twice(part: NDArray[np.float64]) -> NDArray[np.float64]:
    """diag(R, R)"""
    none = np.zeros_like(part)
    return np.block([[part, none], [none, part]])


def _places() -> Iterator[NDArray[np.float64]]:
    """The tables `offset`, `body`, `motion_cross` and `force_cross`."""
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
