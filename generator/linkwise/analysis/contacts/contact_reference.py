"""Reference for the joint torques that contacts leave, computed from the velocities of the recursion."""

from typing import NamedTuple

import numpy as np

from linkwise.analysis.contacts.ground_contacts import GroundContacts
from linkwise.oracle.contacts import contact_rows
from linkwise.oracle.newton_euler import NewtonEuler
from linkwise.package.load import Array
from linkwise.package.manifest import RigidTree

RANK = 1e-11
"""Eigenvalues of B w B^T below this part of the largest are zero."""


class ContactReference(NamedTuple):
    """Contacts of a tree whose frames move as the recursion computes."""

    recursion: NewtonEuler
    tree: RigidTree
    contacts: GroundContacts

    def left(self, torque: Array, q: Array, shares: Array, mapped: Array | None) -> Array:
        """Return what contacts with shares (S, contacts) leave of torques (S, n, X), of that shape.

        mapped: G (S, n, m) from the m joints that do not follow others, at whose indices the torques stand to
        all joints; None if no joint follows
        """
        frames = {frame.name: frame for frame in self.tree.frames}
        each = [
            contact_rows(self.recursion, frames[str(contact.frame)], contact, q)
            for contact in self.contacts.contacts
        ]
        weights = np.concatenate(
            [np.repeat(shares[:, [c]], one.shape[1], 1) for c, one in enumerate(each)], 1
        )
        rows = np.concatenate(each, axis=1) * (weights > 0.0)[..., None]
        if mapped is not None:
            assert self.contacts.tied is not None
            own = list(self.contacts.tied.following.independent)
            projected = np.zeros_like(rows)
            projected[..., own] = rows @ mapped
            rows = projected
        base = list(self.contacts.unactuated)
        forces = _least(np.swapaxes(rows[..., base], 1, 2), weights, torque[:, base])
        left: Array = torque - np.swapaxes(rows, 1, 2) @ forces
        return left


def _least(equations: Array, weights: Array, torque: Array) -> Array:
    """Return lambda (S, C, X) with B lambda = tau and the least sum of lambda^2 / w.

    It is found from lambda = w B^T mu and (B w B^T) mu = tau.
    """
    scaled = weights[..., None] * np.swapaxes(equations, 1, 2)
    found: Array = scaled @ np.linalg.pinv(equations @ scaled, rcond=RANK, hermitian=True) @ torque
    return found
