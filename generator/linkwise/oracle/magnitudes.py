"""Sizes of the numbers that a partial torque is summed from, by which its rounding is measured.

Spatial vectors about the base, with lengths for vectors: sums add magnitudes, products multiply them, so that
nothing cancels. Closed forms in a common frame add such numbers too, and lose what cancels among them. Along
a path of many joints they do so again and again, so sizes are larger there. A torque that is 0 by geometry
has no size of its own; rounding of its operands leaves some 1e-16 of them.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from linkwise_runtime.rule.joint_tree import JointTree, TreeJoint, TreeLink

from linkwise.arrays import Array
from linkwise.oracle.newton_euler import Points, displacement_bound, path_of
from linkwise.oracle.rounding import rounding_growth
from linkwise.package.manifest import Manifest


@dataclass(frozen=True)
class _Sizes:
    """Sizes of a frame: distance from the base; |ω|, |v|, |α|, |a − gravity| of its twist and its change.

    v and a are those of the point at the base's origin, moving with the frame.
    lost: how many times more than numbers of size 1 the angles before it are rounded, with sine and cosine
    """

    reach: Array
    omega: Array
    v: Array
    alpha: Array
    a: Array
    lost: Array


class Magnitudes:
    """Upper bounds for a manifest's rigid links; q, qd, qdd are magnitudes of shape (samples, n)."""

    def __init__(self, manifest: Manifest, tree: JointTree) -> None:
        self.joints, self.links = tree.joints, tree.links
        self.gravity = float(np.linalg.norm(tree.gravity))
        self.n = len(manifest.joints)

    def partial_torque(self, q: Array, qd: Array, qdd: Array, gravity: bool = True) -> Array:
        """Return bounds of |τ_ij|, shape (samples, n, N)."""
        return self.torques_of([[link] for link in self.links], q, qd, qdd, gravity)[..., 0]

    def torques_of(
        self, carried: Sequence[Sequence[TreeLink]], q: Array, qd: Array, qdd: Array, gravity: bool = True
    ) -> Array:
        """Return bounds of |τ_ij| (samples, n, N, X) where each link has the masses of X others in turn."""
        frames = self._frames(q, qd, qdd, self.gravity if gravity else 0.0)
        reaches = np.stack([frame.reach for frame in frames], 1)
        slopes = np.stack([displacement_bound(joint, q, 1) for joint in self.joints], 1)
        tau = np.zeros((len(q), self.n, len(self.links), len(carried[0])))
        for j, link in enumerate(self.links):
            path, frame = path_of(self.joints, link.joint), frames[link.joint]
            turns = np.array([self.joints[f].kind == "revolute" for f in path])
            coordinates = [self.joints[f].coordinate for f in path]
            for x, body in enumerate(carried[j]):
                force, moment = _needed(frame, body)
                about = moment[:, None] + reaches[:, path] * force[:, None]
                work = slopes[:, path] * np.where(turns, about, force[:, None]) * rounding_growth(len(path))
                work = work * frame.lost[:, None]
                for k, column in zip(coordinates, work.T, strict=True):
                    tau[:, k, j, x] += column
        return tau

    def wrenches(
        self, joints: Sequence[int | None], q: Array, qd: Array, qdd: Array, gravity: bool = True
    ) -> Array:
        """Return bounds of `NewtonEuler.wrenches`, (samples, joints, N, 6)."""
        frames = self._frames(q, qd, qdd, self.gravity if gravity else 0.0)
        found = np.zeros((len(q), len(joints), len(self.links), 6))
        for j, link in enumerate(self.links):
            frame, path = frames[link.joint], path_of(self.joints, link.joint)
            force, moment = _needed(frame, link)
            growth = rounding_growth(len(path)) * frame.lost
            for at, joint in enumerate(joints):
                own = link.joint if joint is None else joint
                if own in path:
                    found[:, at, j, :3] = ((moment + frames[own].reach * force) * growth)[:, None]
                    found[:, at, j, 3:] = (force * growth)[:, None]
        return found

    def lagrangian(self, q: Array, qd: Array) -> Array:
        """Return bounds of kinetic + |potential| energy of each link, shape (samples, N)."""
        frames = self._frames(q, qd, 0.0 * qd, 0.0)
        sizes = []
        for link in self.links:
            frame = frames[link.joint]
            reach = frame.reach + _length(link.com)
            speed = frame.v + frame.omega * reach
            spin = float(np.linalg.norm(link.inertia)) * frame.omega**2
            mass = abs(link.mass)
            sizes.append((0.5 * (mass * speed**2 + spin) + mass * self.gravity * reach) * frame.lost)
        return np.stack(sizes, -1)

    def poses(self, points: Points, q: Array) -> Array:
        """Return bounds of the matrices of frames whose origins are points, (samples, points, 4, 4)."""
        found = np.ones((len(q), len(points), 4, 4))
        for p, (frame, lever) in enumerate(self._carriers(points, q, 0.0 * q, 0.0 * q)):
            found[:, p, :3, 3] = (frame.reach + lever)[:, None]
            found[:, p] *= frame.lost[:, None, None]
        return found

    def points(self, points: Points, q: Array, qd: Array, qdd: Array) -> tuple[Array, Array]:
        """Return bounds of (ω, v) and (α, a) of points, (samples, points, 6) each."""
        speeds, changes = [], []
        for frame, lever in self._carriers(points, q, qd, qdd):
            reach, turning = frame.reach + lever, frame.alpha + frame.omega**2
            speed = frame.v + frame.omega * reach
            change = frame.a + frame.omega * frame.v + turning * reach
            speeds.append(np.stack([frame.omega] * 3 + [speed] * 3, -1) * frame.lost[:, None])
            changes.append(np.stack([turning] * 3 + [change] * 3, -1) * frame.lost[:, None])
        return np.stack(speeds, 1), np.stack(changes, 1)

    def _carriers(self, points: Points, q: Array, qd: Array, qdd: Array) -> Iterator[tuple[_Sizes, float]]:
        """Yield the sizes of the frame that carries each point, and the point's distance from its origin."""
        frames, zero = self._frames(q, qd, qdd, 0.0), np.zeros(len(q))
        ground = _Sizes(zero, zero, zero, zero, zero, zero + 1.0)
        for joint, place in points:
            yield ground if joint is None else frames[joint], float(np.linalg.norm(place))

    def _frames(self, q: Array, qd: Array, qdd: Array, gravity: float) -> list[_Sizes]:
        frames: list[_Sizes] = []
        zero = np.zeros(len(q))
        ground = _Sizes(zero, zero, zero, zero, zero + gravity, zero + 1.0)
        for joint in self.joints:
            up = ground if joint.parent is None else frames[joint.parent]
            turn, slope, bend = (displacement_bound(joint, q, derivative) for derivative in range(3))
            speed, push = qd[:, joint.coordinate], qdd[:, joint.coordinate]
            rate, change = slope * speed, slope * push + bend * speed**2
            frames.append(_carried(joint, up, turn, rate, change))
        return frames


def _carried(joint: TreeJoint, up: _Sizes, turn: Array, rate: Array, change: Array) -> _Sizes:
    """Return the sizes of a frame on `up`: V + S q̇ and A + S q̈ + V × S q̇.

    S = (z, s), with |s| the distance of a hinge's axis.
    """
    sliding = joint.kind == "prismatic"
    reach = up.reach + _length(joint.translation) + (turn if sliding else 0.0)
    z, s = (0.0, np.ones_like(turn)) if sliding else (1.0, reach)
    return _Sizes(
        reach,
        up.omega + rate * z,
        up.v + rate * s,
        up.alpha + change * z + rate * up.omega * z,
        up.a + change * s + rate * (up.omega * s + up.v * z),
        up.lost if sliding else np.maximum(up.lost, turn / np.pi),
    )


def _needed(frame: _Sizes, body: TreeLink) -> tuple[Array, Array]:
    """Return bounds of the force and of the moment about the base that a body needs, (samples,) each."""
    reach = frame.reach + _length(body.com)
    turning = frame.alpha + frame.omega**2
    force = abs(body.mass) * (frame.a + frame.omega * frame.v + turning * reach)
    # v × p is 0, but differentiating ½ m v² sums it all the same.
    moment = reach * force + abs(body.mass) * (frame.v + frame.omega * reach) ** 2
    return force, moment + float(np.linalg.norm(body.inertia)) * turning


def _length(vector: tuple[float, float, float]) -> float:
    return float(np.linalg.norm(vector))
