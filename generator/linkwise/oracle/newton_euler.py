"""Recursive Newton–Euler over a package's rigid bodies: an oracle that shares nothing with the generator.

Plain vectors in the world's axes, forces at centres of mass, one link at a time; the textbook recursion. It
accepts complex motion too, as it has only sums, products, sines and cosines: complex steps differentiate it
to the last digit (Squire and Trapp, SIAM Review 40(1), 1998).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from linkwise_runtime.rule.joint_tree import TreeFrame
from numpy.polynomial import Polynomial

from linkwise.arrays import Array, Index, Mask
from linkwise.oracle.rounding import NoisyTree
from linkwise.package.entries import BodyEntry, RigidTree
from linkwise.package.manifest import Manifest

Points = Sequence[tuple[int | None, Array]]
"""Carrier of each point, a body or None for the ground, and the point in the carrier's axes, (3,)."""


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


class _BodyMotion(NamedTuple):
    """Motion of a body's frame, and its joint's axis."""

    frame: _FrameMotion
    axis: Array


class NewtonEuler:
    """Partial torques of the rigid bodies of a manifest, whose `tree` is given beside it."""

    def __init__(self, manifest: Manifest, tree: RigidTree) -> None:
        self.bodies: tuple[BodyEntry, ...] = tree.bodies
        self.noise = tree.rounded if isinstance(tree, NoisyTree) else None
        self.gravity = np.array(tree.gravity)
        self.reach = max(
            float(np.linalg.norm(x)) for body in self.bodies for x in (body.com, body.translation)
        )
        self.n = len(manifest.joints)
        index = {body.link: b for b, body in enumerate(self.bodies)}
        self.links = [index[link.name] for link in manifest.links]
        self.paths = [_LinkPath.of(self.bodies, at) for at in self.links]
        self._placed = [(np.array(body.rotation), np.array(body.translation)) for body in self.bodies]

    def partial_torque(self, q: Array, qd: Array, qdd: Array, gravity: bool = True) -> Array:
        """Return τ_ij, shape (samples, n, N), for inputs of shape (samples, n)."""
        own = [[self.bodies[at]] for at in self.links]
        return self.torques_of(own, q, qd, qdd, gravity)[..., 0]

    def torques_of(
        self, carried: Sequence[Sequence[BodyEntry]], q: Array, qd: Array, qdd: Array, gravity: bool = True
    ) -> Array:
        """Return τ_ij (samples, n, N, X) where each link has the masses of X bodies in turn, not its own."""
        motions = self._motions(q, qd, qdd, self.gravity if gravity else 0.0 * self.gravity)
        axes, origins = (
            np.stack(parts, 1)[:, :, None]
            for parts in zip(*((motion.axis, motion.frame.origin) for motion in motions), strict=True)
        )
        slopes = np.stack([displacement(body, q, 1) for body in self.bodies], 1)
        shape = len(q), self.n, len(self.links), len(carried[0])
        tau = np.zeros(shape, np.result_type(q, qd, qdd))
        for j, (at, bodies, path) in enumerate(zip(self.links, carried, self.paths, strict=True)):
            force, moment, com = (part[:, None] for part in self._wrenches(bodies, motions[at].frame))
            # On a joint that turns, the moment about its origin; on one that slides, the force.
            about = moment + _cross(com - origins[:, path.bodies], force)
            share = np.where(path.turning[:, None, None], about, force)
            work = slopes[:, path.bodies] * (axes[:, path.bodies] * share).sum(-1)
            if len(set(path.coordinates)) == len(path.coordinates):
                tau[:, path.coordinates, j] = work
            else:  # several bodies move by one coordinate
                np.add.at(tau[:, :, j].swapaxes(0, 1), path.coordinates, work.swapaxes(0, 1))
        return tau

    def torque(self, q: Array, qd: Array, qdd: Array, gravity: bool = True) -> Array:
        """Return τ_i of all links together, (samples, n), by one pass inwards.

        Inputs are those of `partial_torque`.
        """
        motions = self._motions(q, qd, qdd, self.gravity if gravity else 0.0 * self.gravity)
        tau = np.zeros(q.shape, np.result_type(q, qd, qdd))
        forces, moments = np.zeros((2, len(self.bodies), len(q), 3), tau.dtype)
        for at in reversed(range(len(self.bodies))):
            body, (frame, axis) = self.bodies[at], motions[at]
            if at in self.links:
                force, moment, com = (part[:, 0] for part in self._wrenches([body], frame))
                forces[at] += force
                moments[at] += moment + _cross(com - frame.origin, force)
            share = moments[at] if body.kind == "revolute" else forces[at]
            tau[:, body.coordinate] += displacement(body, q, 1)[:, 0] * (axis * share).sum(-1)
            if body.parent is not None:
                arm = frame.origin - motions[body.parent].frame.origin
                forces[body.parent] += forces[at]
                moments[body.parent] += moments[at] + _cross(arm, forces[at])
        return tau

    def energies(self, q: Array, qd: Array) -> tuple[Array, Array]:
        """Return kinetic and potential energy of each link in J, (samples, N) each.

        The base's origin is at height 0.
        """
        motions = self._motions(q, qd, 0.0 * qd, self.gravity)
        kinetic, potential = [], []
        for at in self.links:
            body, frame = self.bodies[at], motions[at].frame
            lever = frame.rotation @ np.array(body.com)
            v_com = frame.v + _cross(frame.omega, lever)
            spin = _applied(_turned(np.array(body.inertia), frame.rotation), frame.omega)
            kinetic.append(0.5 * (body.mass * _dot(v_com, v_com) + _dot(frame.omega, spin)))
            potential.append(-body.mass * (frame.origin + lever) @ self.gravity)
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
        carriers = self._carriers([body for body, _ in points], q, 0.0 * q, 0.0 * q)
        found = (at.origin + at.rotation @ place for at, (_, place) in zip(carriers, points, strict=True))
        return np.stack(list(found), 1)

    def points(self, points: Points, q: Array, qd: Array, qdd: Array) -> tuple[Array, Array]:
        """Return (ω, v) and (α, a) of points on their carriers, (samples, points, 6) each.

        There is no gravity in a.
        """
        speeds, changes = [], []
        for at, (_, place) in zip(self._carriers([b for b, _ in points], q, qd, qdd), points, strict=True):
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

    def _wrenches(self, bodies: Sequence[BodyEntry], frame: _FrameMotion) -> tuple[Array, Array, Array]:
        """Return force at the centre of mass, moment about it, and its place, (samples, X, 3), of X bodies.

        Noise is of the size of what both are summed from about the base, as closed forms do in one frame.
        """
        mass, com, inertia = (
            np.array([getattr(body, name) for body in bodies]) for name in ("mass", "com", "inertia")
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

    def _carriers(self, bodies: Sequence[int | None], q: Array, qd: Array, qdd: Array) -> list[_FrameMotion]:
        """Return the frames of some bodies, or of the ground, in motion without gravity."""
        motions = self._motions(q, qd, qdd, 0.0 * self.gravity)
        zero = np.zeros((len(q), 3))
        ground = _FrameMotion(np.broadcast_to(np.eye(3), (len(q), 3, 3)), zero, zero, zero, zero, zero)
        return [ground if body is None else motions[body].frame for body in bodies]

    def _motions(self, q: Array, qd: Array, qdd: Array, gravity: Array) -> list[_BodyMotion]:
        """Return the motion of each body, from the ground outwards."""
        zero = np.zeros((len(q), 3))
        upright = np.broadcast_to(np.eye(3), (len(q), 3, 3))
        ground = _FrameMotion(upright, zero, zero, zero, zero, zero - gravity)
        motions: list[_BodyMotion] = []
        for body, placed in zip(self.bodies, self._placed, strict=True):
            up = ground if body.parent is None else motions[body.parent].frame
            speed, push = (x[:, body.coordinate : body.coordinate + 1] for x in (qd, qdd))
            slope = displacement(body, q, 1)
            turn, rate = displacement(body, q), slope * speed
            change = slope * push + displacement(body, q, 2) * speed**2
            motions.append(_moved(body.kind, placed, up, turn, rate, change))
        return motions


def _moved(
    kind: str, placed: tuple[Array, Array], up: _FrameMotion, turn: Array, rate: Array, change: Array
) -> _BodyMotion:
    """Return the motion of a body placed on `up`, its parent.

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
    return _BodyMotion(_FrameMotion(rotation, up.origin + arm, v, omega, alpha, a), axis)


@dataclass(frozen=True)
class _LinkPath:
    """Path of a link, from its body to the ground: bodies, whether each turns, and its coordinate."""

    bodies: Index
    turning: Mask
    coordinates: Index

    @classmethod
    def of(cls, bodies: Sequence[BodyEntry], at: int) -> "_LinkPath":
        """Return the path of the body at an index."""
        path = path_of(bodies, at)
        turning = np.array([bodies[b].kind == "revolute" for b in path])
        return cls(np.array(path), turning, np.array([bodies[b].coordinate for b in path]))


def path_of(bodies: Sequence[BodyEntry], at: int) -> list[int]:
    """Return the indices of a body, of its parent, and so on to the ground."""
    back, path = bodies[at].parent, [at]
    while back is not None:
        path.append(back)
        back = bodies[back].parent
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


def displacement(body: BodyEntry, q: Array, derivative: int = 0) -> Array:
    """Return the displacement of a body's joint, or a derivative by its coordinate, (samples, 1).

    q is (samples, n).
    """
    x = q[:, body.coordinate : body.coordinate + 1]
    if body.curve is None:
        return body.ratio * (
            x if derivative == 0 else np.ones_like(x) if derivative == 1 else np.zeros_like(x)
        )
    moved = np.zeros_like(x)
    ends = (*body.curve.starts[1:], np.inf)
    lower = -np.inf
    for start, upper, piece in zip(body.curve.starts, ends, body.curve.pieces, strict=True):
        of_piece = Polynomial(piece).deriv(derivative) if derivative else Polynomial(piece)
        within = (x.real >= lower) & (x.real < upper)
        moved = np.where(within, of_piece(x - start), moved)
        lower = upper
    return body.ratio * moved


def displacement_bound(body: BodyEntry, q: Array, derivative: int = 0) -> Array:
    """Return the magnitude of a joint's displacement, or of its derivative, (samples,).

    It is the larger one of coordinates of these magnitudes with either sign.
    """
    either = (np.abs(displacement(body, sign * q, derivative)[:, 0]) for sign in (1.0, -1.0))
    bound: Array = np.maximum(*either)
    return bound
