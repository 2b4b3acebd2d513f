"""Recursive Newton–Euler over a package's rigid bodies: an oracle that shares nothing with the generator.

Plain vectors in the world's axes, forces at centres of mass, one link at a time; the textbook recursion.
"""

import numpy as np

from linkwise.package.load import Array
from linkwise.package.manifest import BodyEntry, Manifest, RigidTree


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
        samples = len(q)
        motion = self._forward(q, qd, qdd, self.gravity if gravity else 0.0 * self.gravity)
        tau = np.zeros((samples, self.n, len(self.links)))
        for j, at in enumerate(self.links):
            body, (rotation, _, omega, alpha, com, a_com, _) = self.bodies[at], motion[at]
            inertia = rotation @ np.array(body.inertia) @ rotation.transpose(0, 2, 1)
            force = body.mass * a_com
            moment = (inertia @ alpha[..., None])[..., 0] + np.cross(
                omega, (inertia @ omega[..., None])[..., 0]
            )
            back: int | None = at
            while back is not None:
                upper, (_, origin, _, _, _, _, axis) = self.bodies[back], motion[back]
                turns = upper.kind == "revolute"
                about = moment + np.cross(com - origin, force) if turns else force
                tau[:, upper.coordinate, j] += upper.ratio * np.einsum("si,si->s", axis, about)
                back = upper.parent
        return tau

    def _forward(self, q: Array, qd: Array, qdd: Array, gravity: Array) -> list[tuple[Array, ...]]:
        """For each body: rotation, origin, ω, α, centre of mass, its acceleration − gravity, joint axis."""
        samples = len(q)
        zero = np.zeros((samples, 3))
        ground = (np.broadcast_to(np.eye(3), (samples, 3, 3)), zero, zero, zero, zero - gravity)
        origins: list[tuple[Array, ...]] = []
        motion: list[tuple[Array, ...]] = []
        for body in self.bodies:
            up = ground if body.parent is None else origins[body.parent]
            rotation, position, omega, alpha, a = up
            k, ratio = body.coordinate, body.ratio
            turn, rate, change = (ratio * x[:, k : k + 1] for x in (q, qd, qdd))
            arm = rotation @ np.array(body.translation)
            rotation = rotation @ np.array(body.rotation)
            axis = rotation[:, :, 2]
            slide, slide_rate, slide_change = zero, zero, zero
            if body.kind == "prismatic":
                slide, slide_rate, slide_change = turn * axis, rate * axis, change * axis
            arm = arm + slide
            a = a + np.cross(alpha, arm) + np.cross(omega, np.cross(omega, arm))
            a = a + 2 * np.cross(omega, slide_rate) + slide_change
            position = position + arm
            if body.kind == "revolute":
                alpha = alpha + change * axis + np.cross(omega, rate * axis)
                omega = omega + rate * axis
                rotation = rotation @ _about_z(turn[:, 0])
            origins.append((rotation, position, omega, alpha, a))
            lever = rotation @ np.array(body.com)
            a_com = a + np.cross(alpha, lever) + np.cross(omega, np.cross(omega, lever))
            motion.append((rotation, position, omega, alpha, position + lever, a_com, axis))
        return motion


def _about_z(angle: Array) -> Array:
    c, s, o, i = np.cos(angle), np.sin(angle), np.zeros_like(angle), np.ones_like(angle)
    return np.moveaxis(np.array([[c, -s, o], [s, c, o], [o, o, i]]), -1, 0)
