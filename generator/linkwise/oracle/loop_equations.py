"""Equations phi(q) = 0 of a package's ties and couplings, from the recursion's frames, and where they hold.

Rows of A are velocities of frames for one unit velocity after the other, and their complex step is dA/dt. A
coupling's row is divided by the largest of its factors, `units`: its unit is the file's choice, and without
this the rows of ties, or the row itself, would be lost beside the other.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from linkwise_runtime.rule.joint_tree import JointTree, TreeFrame
from numpy.polynomial.polynomial import polyder, polyval

from linkwise.arrays import Array
from linkwise.oracle.newton_euler import NewtonEuler
from linkwise.oracle.reference import COMPLEX_STEP

TURNS_AND_SHIFTS = {"frame": (3, 3), "hinge": (2, 3), "point": (0, 3), "distance": (0, 1)}
"""Rows of each kind of tie that hold rotations, and of those after them that hold translations."""
STEPS = 60
LONGEST = 0.5
"""Longest step towards closing, in rad and m."""
CLOSED = 1e-4
"""Accuracy of closing, in m, rad and units of couplings, as a package has it: numbers of files are rounded,
and loops that hold something twice then close to some micrometres only."""
SETTLED = 1e-9
"""Size of the last step, in rad and m, below which nothing can be closed further."""
RANK = 1e-5
"""Singular values below this part of the largest are zero: numbers of files are rounded."""


class LoopEquations(NamedTuple):
    """Equations of the ties and couplings of a tree."""

    recursion: NewtonEuler
    tree: JointTree

    @property
    def _ends(self) -> list[TreeFrame]:
        """Frames of the ties, the first and the second of each."""
        return [self.tree.frames[f] for tie in self.tree.ties for f in (tie.first, tie.second)]

    @property
    def units(self) -> Array:
        """Divisor of each row of phi and A, (C,)."""
        ties = [1.0] * sum(sum(TURNS_AND_SHIFTS[tie.kind]) for tie in self.tree.ties)
        factors = ([f for _, own in coupling.terms for f in own[1:]] for coupling in self.tree.couplings)
        largest = (max(map(abs, own), default=0.0) or 1.0 for own in factors)
        return np.array([*ties, *largest])

    def violation(self, q: Array) -> Array:
        """Return phi (samples, C); of small turns about axes, the sines."""
        found: list[Array] = []
        poses = self.recursion.poses(self._ends, q)
        for at, tie in enumerate(self.tree.ties):
            first, second = poses[:, 2 * at], poses[:, 2 * at + 1]
            gap = first[:, :3, 3] - second[:, :3, 3]
            # R1 R2^T = 1 + [turn]x, to first order
            turn = np.cross(second[:, :3, :3], first[:, :3, :3], axis=1).sum(-1) / 2
            x, y = first[:, :3, 0], first[:, :3, 1]
            across = [(y * second[:, :3, 2]).sum(-1), -(x * second[:, :3, 2]).sum(-1)]
            match tie.kind:
                case "point":
                    parts = [gap]
                case "hinge":
                    parts = [np.stack(across, -1), gap]
                case "frame":
                    parts = [turn, gap]
                case "distance":
                    parts = [np.sqrt((gap * gap).sum(-1))[:, None] - tie.length]
            found += parts
        for coupling in self.tree.couplings:
            total = np.zeros(len(q), q.dtype)
            for k, factors in coupling.terms:
                total += polyval(q[:, k], factors)
            found.append(total[:, None])
        return np.concatenate(found, -1) / self.units

    def rows(self, q: Array) -> Array:
        """Return A (samples, C, n)."""
        samples, n = q.shape
        units, many = np.tile(np.eye(n), (samples, 1)), np.repeat(q, n, 0)
        found = []
        poses, speeds = self.recursion.poses(self._ends, q), np.zeros((samples, n, 0, 6))
        if self.tree.ties:
            places = [(frame.joint, np.array(frame.translation)) for frame in self._ends]
            moving = self.recursion.points(places, many, units, 0.0 * units)[0]
            speeds = moving.reshape(samples, n, len(places), 6)
        for at, tie in enumerate(self.tree.ties):
            moved = np.swapaxes(speeds[:, :, 2 * at] - speeds[:, :, 2 * at + 1], -1, -2)
            own = poses[:, 2 * at]
            gap = own[:, :3, 3] - poses[:, 2 * at + 1, :3, 3]
            match tie.kind:
                case "point":
                    parts = [moved[:, 3:]]
                case "hinge":
                    across = np.swapaxes(own[:, :3, :2], -1, -2)
                    parts = [across @ moved[:, :3], moved[:, 3:]]
                case "frame":
                    parts = [moved]
                case "distance":
                    way = gap / np.sqrt((gap * gap).sum(-1))[:, None]
                    parts = [way[:, None] @ moved[:, 3:]]
            found += parts
        for coupling in self.tree.couplings:
            row = np.zeros((samples, 1, n), q.dtype)
            for k, factors in coupling.terms:
                row[:, 0, k] += polyval(q[:, k], polyder(factors))
            found.append(row)
        return np.concatenate(found, 1) / self.units[:, None]

    def velocity_map(self, q: Array) -> Array:
        """Return G (samples, n, m) of qd = G yd, y the tree's independent joints, by least squares."""
        return following(self.rows(q), self.tree.independent)

    def basis(self, q: Array) -> Array:
        """Return orthonormal columns (samples, C, d) that span what dependent joints move of the rows.

        Where loops close, no joint moves anything else; where they are open a little, only this is held.
        """
        rest = [k for k in range(q.shape[1]) if k not in self.tree.independent]
        basis: Array = np.linalg.svd(self.rows(q)[..., rest])[0][..., : len(rest)]
        return basis

    def rates(self, q: Array, qd: Array) -> Array:
        """Return dA/dt (samples, C, n)."""
        rate: Array = self.rows(q + 1j * COMPLEX_STEP * qd).imag / COMPLEX_STEP
        return rate

    def closed_near(self, q: Array) -> Array:
        """Return the closed positions to which steps of least norm of all joints lead from some positions.

        They are closed but for what rounded numbers of a file leave; starts that lead to none are left out.
        """
        q, size = q.copy(), np.full(len(q), np.inf)
        for _ in range(STEPS):
            moving = np.flatnonzero(size >= SETTLED)
            if not len(moving):
                break
            at = q[moving]
            step = -(np.linalg.pinv(self.rows(at), rcond=RANK) @ self.violation(at)[..., None])[..., 0]
            size[moving] = np.abs(step).max(-1)
            q[moving] += step * (LONGEST / np.maximum(size[moving], LONGEST))[:, None]
        closed: Array = q[(np.abs(self.violation(q) * self.units).max(-1) < CLOSED) & (size < SETTLED)]
        return closed


def following(rows: Array, own: Sequence[int]) -> Array:
    """Return G (samples, n, m) of qd = G yd under rows A (samples, C, n), by least squares.

    y are the joints `own`.
    """
    samples, _, n = rows.shape
    rest = [k for k in range(n) if k not in own]
    found = np.zeros((samples, n, len(own)))
    found[:, own] = np.eye(len(own))
    found[:, rest] = -np.linalg.pinv(rows[..., rest], rcond=RANK**2) @ rows[..., own]
    return found
