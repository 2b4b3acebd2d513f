"""How joints follow under ties and couplings, by the recursion's velocities of frames: an independent way.

With qd = e_k a row of A is what the ends of a tie, or a coupling's sum, then do against each other.
"""

import numpy as np

from linkwise.check.newton_euler import NewtonEuler
from linkwise.package.load import Array
from linkwise.package.manifest import RigidTree


def following_map(recursion: NewtonEuler, tree: RigidTree, q: Array) -> Array:
    """G (S, n, m) of qd = G yd, y the tree's independent joints, at q (S, n), in which ties close."""
    rows, own = constraint_rows(recursion, tree, q), list(tree.independent)
    others = [k for k in range(recursion.n) if k not in own]
    found = np.zeros((len(q), recursion.n, len(own)))
    found[:, own] = np.eye(len(own))
    found[:, others] = -np.linalg.pinv(rows[:, :, others]) @ rows[:, :, own]
    return found


def constraint_rows(recursion: NewtonEuler, tree: RigidTree, q: Array) -> Array:
    """A (S, C, n) of A qd = 0, the rows of each tie in the axes that suit it."""
    n, count = recursion.n, len(q)
    ends = [tree.frames[end] for tie in tree.ties for end in (tie.first, tie.second)]
    rows: list[Array] = []
    if ends:
        poses = recursion.poses(ends, q)
        at = np.repeat(q, n, 0)
        points = [(end.body, np.array(end.translation)) for end in ends]
        velocity, _ = recursion.points(points, at, np.tile(np.eye(n), (count, 1)), 0.0 * at)
        columns = np.moveaxis(velocity.reshape(count, n, len(ends), 6), 1, -1)  # (S, ends, 6, n)
        for t, tie in enumerate(tree.ties):
            apart = columns[:, 2 * t] - columns[:, 2 * t + 1]
            turned, moved = apart[:, :3], apart[:, 3:]
            if tie.kind == "distance":
                way = poses[:, 2 * t, :3, 3] - poses[:, 2 * t + 1, :3, 3]
                along = way / np.linalg.norm(way, axis=-1, keepdims=True)
                rows.append(np.einsum("sa,san->sn", along, moved)[:, None])
                continue
            if tie.kind == "hinge":
                rows.append(np.einsum("sab,san->sbn", poses[:, 2 * t, :3, :2], turned))
            if tie.kind == "frame":
                rows.append(turned)
            rows.append(moved)
    for coupling in tree.couplings:
        row = np.zeros((count, 1, n))
        for k, coefficients in coupling.terms:
            row[:, 0, k] = np.polynomial.Polynomial(coefficients).deriv()(q[:, k])
        rows.append(row)
    return np.concatenate(rows, axis=1)
