"""What contacts leave of torques, by the recursion's own velocities of frames: what a result is held against.

Of a hinge the turn across its axis is all of the turn less that about it, three rows of rank two.
"""

from typing import NamedTuple

import numpy as np

from linkwise.analysis.contacts.ground_contacts import GroundContacts
from linkwise.check.newton_euler import NewtonEuler
from linkwise.package.load import Array
from linkwise.package.manifest import RigidTree
from linkwise.runtime.robot_constraints import Contact

RANK = 1e-11
"""Eigenvalues of B w B^T below this part of the largest are zero."""


class ContactReference(NamedTuple):
    """Contacts of a tree whose frames move as the recursion says."""

    recursion: NewtonEuler
    tree: RigidTree
    contacts: GroundContacts

    def left(
        self, torque: Array, q: Array, qd: Array, shares: Array, mapped: Array | None
    ) -> tuple[Array, Array]:
        """What contacts of shares (S, contacts) leave of torques (S, n, X), and what power they give (S, X).

        mapped: G (S, n, m) of the joints that do not follow, in whose places torques stand; None of all
        """
        each = [self._rows(contact, q) for contact in self.contacts.contacts]
        weights = np.concatenate(
            [np.repeat(shares[:, [c]], one.shape[1], 1) for c, one in enumerate(each)], 1
        )
        rows = np.concatenate(each, axis=1) * (weights > 0.0)[..., None]
        slip = np.einsum("scn,sn->sc", rows, qd)
        if mapped is not None:
            assert self.contacts.tied is not None
            own = list(self.contacts.tied.following.independent)
            projected = np.zeros_like(rows)
            projected[..., own] = rows @ mapped
            rows = projected
        base = list(self.contacts.unactuated)
        forces = _least(np.swapaxes(rows[..., base], 1, 2), weights, torque[:, base])
        return torque - np.swapaxes(rows, 1, 2) @ forces, np.einsum("sc,scx->sx", slip, forces)

    def _rows(self, contact: Contact, q: Array) -> Array:
        """(S, rows, n)."""
        frame = next(one for one in self.tree.frames if one.name == contact.frame)
        place = np.array(frame.rotation) @ np.array(contact.point) + np.array(frame.translation)
        columns = [
            self.recursion.points([(frame.body, place)], q, unit + 0.0 * q, 0.0 * q)[0][:, 0]
            for unit in np.eye(q.shape[1])
        ]
        moved = np.stack(columns, axis=-1)
        turn, shift = moved[:, :3], moved[:, 3:]
        match contact.kind:
            case "held":
                return moved
            case "hinged":
                axis = self.recursion.poses([frame], q)[:, 0, :3, :3] @ np.array(contact.axis)
                axis /= np.linalg.norm(axis, axis=1, keepdims=True)
                across = turn - axis[:, :, None] * (axis[:, None] @ turn)
                return np.concatenate([across, shift], axis=1)
            case "rolling":
                normal = np.array(contact.normal) / np.linalg.norm(contact.normal)
                arm = -contact.radius * normal
                return shift + np.cross(turn, arm[None, :, None], axis=1)
        return shift


def _least(equations: Array, weights: Array, torque: Array) -> Array:
    """lambda (S, C, X) of B lambda = tau, by its equations: lambda = w B^T mu, (B w B^T) mu = tau."""
    scaled = weights[..., None] * np.swapaxes(equations, 1, 2)
    found: Array = scaled @ np.linalg.pinv(equations @ scaled, rcond=RANK, hermitian=True) @ torque
    return found
