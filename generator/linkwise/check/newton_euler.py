"""Recursive Newton–Euler over a package's rigid bodies: an oracle that shares nothing with the generator.

Plain vectors in the world's axes, forces at centres of mass, one link at a time; the textbook recursion. It
takes complex motion too, being but sums, products, sines and cosines: complex steps differentiate it to
the last digit (Squire and Trapp, SIAM Review 40(1), 1998).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from linkwise.check.curve_reference import displacement
from linkwise.package.load import Array
from linkwise.package.manifest import BodyEntry, FrameEntry, Manifest, RigidTree

Points = Sequence[tuple[int | None, Array]]
"""What carries each point, a body or None for the ground, and where it is in the axes of that, (3,)."""


@dataclass(frozen=True)
class _FrameMotion:
    """A frame in the world's axes: rotation (samples, 3, 3); origin, its velocity, ω, α, and a − gravity."""

    rotation: Array
    origin: Array
    v: Array
    omega: Array
    alpha: Array
    a: Array


@dataclass(frozen=True)
class _BodyMotion:
    """A body's frame, its joint's axis, and where its centre of mass is beside the frame's origin."""

    frame: _FrameMotion
    axis: Array
    lever: Array

    @property
    def com(self) -> Array:
        """Centre of mass."""
        return self.frame.origin + self.lever

    @property
    def v_com(self) -> Array:
        """Its velocity."""
        return self.frame.v + _cross(self.frame.omega, self.lever)

    @property
    def a_com(self) -> Array:
        """Its acceleration, less gravity."""
        turning = _cross(self.frame.omega, _cross(self.frame.omega, self.lever))
        return self.frame.a + _cross(self.frame.alpha, self.lever) + turning


class NewtonEuler:
    """Partial torques of the rigid bodies of a manifest, whose `tree` is given beside it."""

    def __init__(self, manifest: Manifest, tree: RigidTree) -> None:
        self.bodies: tuple[BodyEntry, ...] = tree.bodies
        self.gravity = np.array(tree.gravity)
        self.n = len(manifest.joints)
        index = {body.link: b for b, body in enumerate(self.bodies)}
        self.links = [index[link.name] for link in manifest.links]

    def partial_torque(self, q: Array, qd: Array, qdd: Array, gravity: bool = True) -> Array:
        """τ_ij, shape (samples, n, N), for inputs of shape (samples, n)."""
        motions = self._motions(q, qd, qdd, self.gravity if gravity else 0.0 * self.gravity)
        tau = np.zeros((len(q), self.n, len(self.links)), np.result_type(q, qd, qdd))
        for j, at in enumerate(self.links):
            body, motion = self.bodies[at], motions[at]
            omega, inertia = motion.frame.omega, _inertia(body, motion)
            force = body.mass * motion.a_com
            spin = _cross(omega, _applied(inertia, omega))
            moment = _applied(inertia, motion.frame.alpha) + spin
            back: int | None = at
            com = motion.com
            while back is not None:
                upper, joint = self.bodies[back], motions[back]
                lever = com - joint.frame.origin
                about = moment + _cross(lever, force) if upper.kind == "revolute" else force
                tau[:, upper.coordinate, j] += displacement(upper, q, 1)[:, 0] * _dot(joint.axis, about)
                back = upper.parent
        return tau

    def energies(self, q: Array, qd: Array) -> tuple[Array, Array]:
        """Kinetic and potential energy of each link in J, (samples, N); the base's origin is at height 0."""
        motions = self._motions(q, qd, 0.0 * qd, self.gravity)
        kinetic, potential = [], []
        for at in self.links:
            body, motion = self.bodies[at], motions[at]
            spin = _applied(_inertia(body, motion), motion.frame.omega)
            v_com = motion.v_com
            kinetic.append(0.5 * (body.mass * _dot(v_com, v_com) + _dot(motion.frame.omega, spin)))
            potential.append(-body.mass * motion.com @ self.gravity)
        return np.stack(kinetic, -1), np.stack(potential, -1)

    def poses(self, frames: Sequence[FrameEntry], q: Array) -> Array:
        """Homogeneous matrices from the coordinates of frames to the world's, (samples, frames, 4, 4)."""
        found = np.zeros((len(q), len(frames), 4, 4), q.dtype)
        found[..., 3, 3] = 1.0
        carriers = self._carriers([frame.body for frame in frames], q, 0.0 * q, 0.0 * q)
        for f, (frame, carrier) in enumerate(zip(frames, carriers, strict=True)):
            found[:, f, :3, :3] = carrier.rotation @ np.array(frame.rotation)
            found[:, f, :3, 3] = carrier.origin + carrier.rotation @ np.array(frame.translation)
        return found

    def places(self, points: Points, q: Array) -> Array:
        """Where points are in the world, (samples, points, 3)."""
        carriers = self._carriers([body for body, _ in points], q, 0.0 * q, 0.0 * q)
        found = (at.origin + at.rotation @ place for at, (_, place) in zip(carriers, points, strict=True))
        return np.stack(list(found), 1)

    def points(self, points: Points, q: Array, qd: Array, qdd: Array) -> tuple[Array, Array]:
        """(ω, v) and (α, a) of points and what carries them, (samples, points, 6) each; no gravity in a."""
        speeds, changes = [], []
        for at, (_, place) in zip(self._carriers([b for b, _ in points], q, qd, qdd), points, strict=True):
            arm = at.rotation @ place
            speed = _cross(at.omega, arm)
            change = _cross(at.alpha, arm) + _cross(at.omega, speed)
            speeds.append(np.concatenate([at.omega, at.v + speed], -1))
            changes.append(np.concatenate([at.alpha, at.a + change], -1))
        return np.stack(speeds, 1), np.stack(changes, 1)

    def _carriers(self, bodies: Sequence[int | None], q: Array, qd: Array, qdd: Array) -> list[_FrameMotion]:
        """Frames of some bodies, or of the ground, in motion without gravity."""
        motions = self._motions(q, qd, qdd, 0.0 * self.gravity)
        zero = np.zeros((len(q), 3))
        ground = _FrameMotion(np.broadcast_to(np.eye(3), (len(q), 3, 3)), zero, zero, zero, zero, zero)
        return [ground if body is None else motions[body].frame for body in bodies]

    def _motions(self, q: Array, qd: Array, qdd: Array, gravity: Array) -> list[_BodyMotion]:
        """Motion of each body, from the ground outwards."""
        zero = np.zeros((len(q), 3))
        upright = np.broadcast_to(np.eye(3), (len(q), 3, 3))
        ground = _FrameMotion(upright, zero, zero, zero, zero, zero - gravity)
        motions: list[_BodyMotion] = []
        for body in self.bodies:
            up = ground if body.parent is None else motions[body.parent].frame
            speed, push = (x[:, body.coordinate : body.coordinate + 1] for x in (qd, qdd))
            slope = displacement(body, q, 1)
            turn, rate = displacement(body, q), slope * speed
            change = slope * push + displacement(body, q, 2) * speed**2
            motions.append(_moved(body, up, turn, rate, change))
        return motions


def _moved(body: BodyEntry, up: _FrameMotion, turn: Array, rate: Array, change: Array) -> _BodyMotion:
    """Motion of a body on its parent `up`; turn, rate and change are those of its joint (samples, 1)."""
    rotation, omega, alpha = up.rotation @ np.array(body.rotation), up.omega, up.alpha
    axis, arm = rotation[:, :, 2], up.rotation @ np.array(body.translation)
    if body.kind == "prismatic":
        arm = arm + turn * axis
    v = up.v + _cross(omega, arm)
    a = up.a + _cross(alpha, arm) + _cross(omega, _cross(omega, arm))
    if body.kind == "prismatic":
        v = v + rate * axis
        a = a + 2 * _cross(omega, rate * axis) + change * axis
    else:
        alpha = alpha + change * axis + _cross(omega, rate * axis)
        omega = omega + rate * axis
        rotation = rotation @ _about_z(turn[:, 0])
    origin, lever = up.origin + arm, rotation @ np.array(body.com)
    frame = _FrameMotion(rotation, origin, v, omega, alpha, a)
    return _BodyMotion(frame, axis, lever)


def _inertia(body: BodyEntry, motion: _BodyMotion) -> Array:
    """Inertia about the centre of mass, in the world's axes."""
    turn = motion.frame.rotation
    inertia: Array = turn @ np.array(body.inertia) @ turn.transpose(0, 2, 1)
    return inertia


def _cross(a: Array, b: Array) -> Array:
    """Vector product of each pair, as np.cross gives it in ten times the time."""
    return np.stack([a[:, i] * b[:, j] - a[:, j] * b[:, i] for i, j in ((1, 2), (2, 0), (0, 1))], -1)


def _dot(a: Array, b: Array) -> Array:
    """Scalar product of each pair; nothing is conjugated."""
    product: Array = np.einsum("si,si->s", a, b)
    return product


def _applied(matrices: Array, vectors: Array) -> Array:
    """Each matrix times its vector."""
    product: Array = np.einsum("sab,sb->sa", matrices, vectors)
    return product


def _about_z(angle: Array) -> Array:
    c, s, o, i = np.cos(angle), np.sin(angle), np.zeros_like(angle), np.ones_like(angle)
    return np.moveaxis(np.array([[c, -s, o], [s, c, o], [o, o, i]]), -1, 0)
