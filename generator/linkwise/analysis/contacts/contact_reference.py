"""What contacts leave of torques, by the recursion's own velocities: what a result is held against."""

from typing import NamedTuple

import numpy as np

from linkwise.analysis.contacts.ground_contacts import GroundContacts
from linkwise.check.contact_equations import contact_rows
from linkwise.check.newton_euler import NewtonEuler
from linkwise.package.load import Array
from linkwise.package.manifest import RigidTree

RANK = 1e-11
"""Eigenvalues of B w B^T below this part of the largest are zero."""


class ContactReference(NamedTuple):
    """Contacts of a tree whose frames move as the recursion says."""

    recursion: NewtonEuler
    tree: RigidTree
    contacts: GroundContacts

    def left(self, torque: Array, q: Array, shares: Array, mapped: Array | None) -> Array:
        """What contacts of shares (S, contacts) leave of torques (S, n, X).

        mapped: G (S, n, m) of the joints that do not follow, in whose places torques stand; None of all
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
    """lambda (S, C, X) of B lambda = tau, by its equations: lambda = w B^T mu, (B w B^T) mu = tau."""
    scaled = weights[..., None] * np.swapaxes(equations, 1, 2)
    found: Array = scaled @ np.linalg.pinv(equations @ scaled, rcond=RANK, hermitian=True) @ torque
    return found
