"""Recursive Newton–Euler over a package's rigid links: an oracle that shares nothing with the generator.

Plain vectors in the world's axes, forces at centres of mass, one link at a time; the textbook recursion. It
accepts complex motion too, as it has only sums, products, sines and cosines: complex steps differentiate it
to the last digit (Squire and Trapp, SIAM Review 40(1), 1998).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from linkwise_runtime.rule.joint_tree import JointTree, TreeFrame, TreeJoint, TreeLink
from numpy.polynomial import Polynomial

from linkwise.arrays import Array, Index, Mask
from linkwise.oracle.rounding import NoisyTree
from linkwise.package.manifest import Manifest

Points = Sequence[tuple[int | None, Array]]
"""Joint that moves each point, None for the ground, and the point in the axes behind it, (3,)."""


@dataclass(frozen=True)
class _FrameMotion:
    """Motion of a frame in the world's axes.

    It has the rotation (samples, 3, 3), the origin, its velocity, ω, α, and a − gravity.
    """

    rotation: Array
    origin: Array
    v: Array
    omega: Array
    alpha: Array
    a: Array


class _JointMotion(NamedTuple):
    """Motion of the frame that a joint moves, and its axis."""

    frame: _FrameMotion
    axis: Array


class NewtonEuler:
    """Partial torques of the rigid links of a manifest, whose `tree` is given beside it."""

    def __init__(self, manifest: Manifest, tree: JointTree) -> None:
        self.joints, self.links = tree.joints, tree.links
        self.noise = tree.rounded if isinstance(tree, NoisyTree) else None
        self.gravity = np.array(tree.gravity)
        places = (*(link.com for link in self.links), *(joint.translation for joint in self.joints))
        self.reach = max(float(np.linalg.norm(place)) for place in places)
        self.n = len(manifest.joints)
        self.paths = [_LinkPath.of(self.joints, link.joint) for link in self.links]
        self._placed = [(np.array(joint.rotation), np.array(joint.translation)) for joint in self.joints]

    def partial_torque(self, q: Array, qd: Array, qdd: Array, gravity: bool = True) -> Array:
        """Return τ_ij, shape (samples, n, N), for inputs of shape (samples, n)."""
        return self.torques_of([[link] for link in self.links], q, qd, qdd, gravity)[..., 0]

    def torques_of(
        self, carried: Sequence[Sequence[TreeLink]], q: Array, qd: Array, qdd: Array, gravity: bool = True
    ) -> Array:
        """Return τ_ij (samples, n, N, X) where each link has the masses of X others in turn, not its own."""
        motions = self._motions(q, qd, qdd, self.gravity if gravity else 0.0 * self.gravity)
        axes, origins = (
            np.stack(parts, 1)[:, :, None]
            for parts in zip(*((motion.axis, motion.frame.origin) for motion in motions), strict=True)
        )
        slopes = np.stack([displacement(joint, q, 1) for joint in self.joints], 1)
        shape = len(q), self.n, len(self.links), len(carried[0])
        tau = np.zeros(shape, np.result_type(q, qd, qdd))
        for j, (link, others, path) in enumerate(zip(self.links, carried, self.paths, strict=True)):
            wrenches = self._wrenches(others, motions[link.joint].frame)
            force, moment, com = (part[:, None] for part in wrenches)
            # On a joint that turns, the moment about its origin; on one that slides, the force.
            about = moment + _cross(com - origins[:, path.joints], force)
            share = np.where(path.turning[:, None, None], about, force)
            work = slopes[:, path.joints] * (axes[:, path.joints] * share).sum(-1)
            if len(set(path.coordinates)) == len(path.coordinates):
                tau[:, path.coordinates, j] = work
            else:  # several joints move by one coordinate
                np.add.at(tau[:, :, j].swapaxes(0, 1), path.coordinates, work.swapaxes(0, 1))
        return tau

    def wrenches(
        self, joints: Sequence[int | None], q: Array, qd: Array, qdd: Array, gravity: bool = True
    ) -> Array:
        """Return what joints of the tree carry of each link, (samples, joints, N, 6), in the world's axes.

        It is the moment about the joint's origin, then the force; zero for links that a joint does not carry.
        None in place of a joint stands for that which moves the link.
        """
        motions = self._motions(q, qd, qdd, self.gravity if gravity else 0.0 * self.gravity)
        found = np.zeros((len(q), len(joints), len(self.links), 6), np.result_type(q, qd, qdd))
        for j, (link, path) in enumerate(zip(self.links, self.paths, strict=True)):
            force, moment, com = (part[:, 0] for part in self._wrenches([link], motions[link.joint].frame))
            for at, joint in enumerate(joints):
                own = link.joint if joint is None else joint
                if own in path.joints:
                    found[:, at, j, :3] = moment + _cross(com - motions[own].frame.origin, force)
                    found[:, at, j, 3:] = force
        return found

    def torque(self, q: Array, qd: Array, qdd: Array, gravity: bool = True) -> Array:
        """Return τ_i of all links together, (samples, n), by one pass inwards.

        Inputs are those of `partial_torque`.
        """
        motions = self._motions(q, qd, qdd, self.gravity if gravity else 0.0 * self.gravity)
        tau = np.zeros(q.shape, np.result_type(q, qd, qdd))
        forces, moments = np.zeros((2, len(self.joints), len(q), 3), tau.dtype)
        for link in self.links:
            at, frame = link.joint, motions[link.joint].frame
            force, moment, com = (part[:, 0] for part in self._wrenches([link], frame))
            forces[at] += force
            moments[at] += moment + _cross(com - frame.origin, force)
        for at in reversed(range(len(self.joints))):
            joint, (frame, axis) = self.joints[at], motions[at]
            share = moments[at] if joint.kind == "revolute" else forces[at]
            tau[:, joint.coordinate] += displacement(joint, q, 1)[:, 0] * (axis * share).sum(-1)
            if joint.parent is not None:
                arm = frame.origin - motions[joint.parent].frame.origin
                forces[joint.parent] += forces[at]
                moments[joint.parent] += moments[at] + _cross(arm, forces[at])
        return tau

    def energies(self, q: Array, qd: Array) -> tuple[Array, Array]:
        """Return kinetic and potential energy of each link in J, (samples, N) each.

        The base's origin is at height 0.
        """
        motions = self._motions(q, qd, 0.0 * qd, self.gravity)
        kinetic, potential = [], []
        for link in self.links:
            frame = motions[link.joint].frame
            lever = frame.rotation @ np.array(link.com)
            v_com = frame.v + _cross(frame.omega, lever)
            spin = _applied(_turned(np.array(link.inertia), frame.rotation), frame.omega)
            kinetic.append(0.5 * (link.mass * _dot(v_com, v_com) + _dot(frame.omega, spin)))
            potential.append(-link.mass * (frame.origin + lever) @ self.gravity)
        return np.stack(kinetic, -1), np.stack(potential, -1)

    def poses(self, frames: Sequence[TreeFrame], q: Array) -> Array:
        """Return homogeneous matrices from frames' coordinates to the world's, (samples, frames, 4, 4)."""
        found = np.zeros((len(q), len(frames), 4, 4), q.dtype)
        found[..., 3, 3] = 1.0
        carriers = self._carriers([frame.joint for frame in frames], q, 0.0 * q, 0.0 * q)
        for f, (frame, carrier) in enumerate(zip(frames, carriers, strict=True)):
            found[:, f, :3, :3] = carrier.rotation @ np.array(frame.rotation)
            found[:, f, :3, 3] = carrier.origin + carrier.rotation @ np.array(frame.translation)
        return found

    def places(self, points: Points, q: Array) -> Array:
        """Return the places of points in the world, (samples, points, 3)."""
        carriers = self._carriers([at for at, _ in points], q, 0.0 * q, 0.0 * q)
        found = (at.origin + at.rotation @ place for at, (_, place) in zip(carriers, points, strict=True))
        return np.stack(list(found), 1)

    def points(self, points: Points, q: Array, qd: Array, qdd: Array) -> tuple[Array, Array]:
        """Return (ω, v) and (α, a) of points on their carriers, (samples, points, 6) each.

        There is no gravity in a.
        """
        speeds, changes = [], []
        for at, (_, place) in zip(
            self._carriers([joint for joint, _ in points], q, qd, qdd), points, strict=True
        ):
            arm = at.rotation @ place
            speed = _cross(at.omega, arm)
            change = _cross(at.alpha, arm) + _cross(at.omega, speed)
            shift = at.v + speed
            if self.noise and not np.iscomplexobj(q):  # in a complex step it would not be the slope's
                reach = _length(at.origin + arm)
                shift = self.noise(shift, _length(at.v) + _length(at.omega) * reach)
            speeds.append(np.concatenate([at.omega, shift], -1))
            changes.append(np.concatenate([at.alpha, at.a + change], -1))
        return np.stack(speeds, 1), np.stack(changes, 1)

    def _wrenches(self, links: Sequence[TreeLink], frame: _FrameMotion) -> tuple[Array, Array, Array]:
        """Return force at the centre of mass, moment about it, and its place, (samples, X, 3), of X links.

        Noise is of the size of what both are summed from about the base, as closed forms do in one frame.
        """
        mass, com, inertia = (
            np.array([getattr(link, name) for link in links]) for name in ("mass", "com", "inertia")
        )
        rotation, origin, omega, alpha, a = (
            part[:, None] for part in (frame.rotation, frame.origin, frame.omega, frame.alpha, frame.a)
        )
        lever, spun = _applied(rotation, com), _turned(inertia, rotation)
        turning = _cross(alpha, lever) + _cross(omega, _cross(omega, lever))
        force = mass[:, None] * (a + turning)
        moment = _applied(spun, alpha) + _cross(omega, _applied(spun, omega))
        if self.noise:
            reach, rates = _length(origin + lever), _length(alpha) + _length(omega) ** 2
            size = np.abs(mass)[:, None] * (_length(a) + rates * reach)
            force = self.noise(force, size)
            sizes = np.sqrt((inertia**2).sum((-2, -1)))[:, None]
            moment = self.noise(moment, reach * size + sizes * rates)
        return force, moment, origin + lever

    def _carriers(self, joints: Sequence[int | None], q: Array, qd: Array, qdd: Array) -> list[_FrameMotion]:
        """Return the frames that some joints move, or the ground, in motion without gravity."""
        motions = self._motions(q, qd, qdd, 0.0 * self.gravity)
        zero = np.zeros((len(q), 3))
        ground = _FrameMotion(np.broadcast_to(np.eye(3), (len(q), 3, 3)), zero, zero, zero, zero, zero)
        return [ground if joint is None else motions[joint].frame for joint in joints]

    def _motions(self, q: Array, qd: Array, qdd: Array, gravity: Array) -> list[_JointMotion]:
        """Return the motion of each joint's frame, from the ground outwards."""
        zero = np.zeros((len(q), 3))
        upright = np.broadcast_to(np.eye(3), (len(q), 3, 3))
        ground = _FrameMotion(upright, zero, zero, zero, zero, zero - gravity)
        motions: list[_JointMotion] = []
        for joint, placed in zip(self.joints, self._placed, strict=True):
            up = ground if joint.parent is None else motions[joint.parent].frame
            speed, push = (x[:, joint.coordinate : joint.coordinate + 1] for x in (qd, qdd))
            slope = displacement(joint, q, 1)
            turn, rate = displacement(joint, q), slope * speed
            change = slope * push + displacement(joint, q, 2) * speed**2
            motions.append(_moved(joint.kind, placed, up, turn, rate, change))
        return motions


def _moved(
    kind: str, placed: tuple[Array, Array], up: _FrameMotion, turn: Array, rate: Array, change: Array
) -> _JointMotion:
    """Return the motion of the frame of a joint placed on `up`, its parent's.

    turn, rate and change of its joint are (samples, 1).
    """
    rotation, omega, alpha = up.rotation @ placed[0], up.omega, up.alpha
    axis, arm = rotation[:, :, 2], up.rotation @ placed[1]
    if kind == "prismatic":
        arm = arm + turn * axis
    speed = _cross(omega, arm)
    v = up.v + speed
    a = up.a + _cross(alpha, arm) + _cross(omega, speed)
    if kind == "prismatic":
        v = v + rate * axis
        a = a + 2 * _cross(omega, rate * axis) + change * axis
    else:
        alpha = alpha + change * axis + _cross(omega, rate * axis)
        omega = omega + rate * axis
        rotation = rotation @ _about_z(turn[:, 0])
    return _JointMotion(_FrameMotion(rotation, up.origin + arm, v, omega, alpha, a), axis)


@dataclass(frozen=True)
class _LinkPath:
    """Path of a link to the ground: its joints, whether each turns, and the coordinate of each."""

    joints: Index
    turning: Mask
    coordinates: Index

    @classmethod
    def of(cls, joints: Sequence[TreeJoint], at: int) -> "_LinkPath":
        """Return the path of the link that the joint at an index moves."""
        path = path_of(joints, at)
        turning = np.array([joints[f].kind == "revolute" for f in path])
        return cls(np.array(path), turning, np.array([joints[f].coordinate for f in path]))


def path_of(joints: Sequence[TreeJoint], at: int) -> list[int]:
    """Return the indices of a joint, of its parent, and so on to the ground."""
    back, path = joints[at].parent, [at]
    while back is not None:
        path.append(back)
        back = joints[back].parent
    return path


def _turned(inertia: Array, rotation: Array) -> Array:
    """Return the inertia about the centre of mass, in the world's axes."""
    turned: Array = rotation @ inertia @ rotation.swapaxes(-1, -2)
    return turned


def _cross(a: Array, b: Array) -> Array:
    """Return the vector product of each pair (..., 3), as np.cross gives it in ten times the time."""
    (a0, a1, a2), (b0, b1, b2) = ([x[..., k] for k in range(3)] for x in (a, b))
    product = np.empty(np.broadcast_shapes(a.shape, b.shape), np.result_type(a, b))
    product[..., 0] = a1 * b2 - a2 * b1
    product[..., 1] = a2 * b0 - a0 * b2
    product[..., 2] = a0 * b1 - a1 * b0
    return product


def _length(vectors: Array) -> Array:
    """Return the length (..., 1) of each vector (..., 3)."""
    length: Array = np.sqrt((np.abs(vectors) ** 2).sum(-1, keepdims=True))
    return length


def _dot(a: Array, b: Array) -> Array:
    """Return the scalar product of each pair; nothing is conjugated."""
    product: Array = np.einsum("si,si->s", a, b)
    return product


def _applied(matrices: Array, vectors: Array) -> Array:
    """Return each matrix times its vector."""
    product: Array = (matrices @ vectors[..., None])[..., 0]
    return product


def _about_z(angle: Array) -> Array:
    c, s, o, i = np.cos(angle), np.sin(angle), np.zeros_like(angle), np.ones_like(angle)
    return np.moveaxis(np.array([[c, -s, o], [s, c, o], [o, o, i]]), -1, 0)


def displacement(joint: TreeJoint, q: Array, derivative: int = 0) -> Array:
    """Return the displacement of a joint, or a derivative by its coordinate, (samples, 1).

    q is (samples, n).
    """
    x = q[:, joint.coordinate : joint.coordinate + 1]
    if joint.curve is None:
        return joint.ratio * (
            x if derivative == 0 else np.ones_like(x) if derivative == 1 else np.zeros_like(x)
        )
    moved = np.zeros_like(x)
    ends = (*joint.curve.starts[1:], np.inf)
    lower = -np.inf
    for start, upper, piece in zip(joint.curve.starts, ends, joint.curve.pieces, strict=True):
        of_piece = Polynomial(piece).deriv(derivative) if derivative else Polynomial(piece)
        within = (x.real >= lower) & (x.real < upper)
        moved = np.where(within, of_piece(x - start), moved)
        lower = upper
    return joint.ratio * moved


def displacement_bound(joint: TreeJoint, q: Array, derivative: int = 0) -> Array:
    """Return the magnitude of a joint's displacement, or of its derivative, (samples,).

    It is the larger one of coordinates of these magnitudes with either sign.
    """
    either = (np.abs(displacement(joint, sign * q, derivative)[:, 0]) for sign in (1.0, -1.0))
    bound: Array = np.maximum(*either)
    return bound
