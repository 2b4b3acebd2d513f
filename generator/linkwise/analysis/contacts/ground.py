"""Forces of the ground at contacts, found from the equations of the joints that nothing drives.

A measured motion does not keep a contact to the last digit, so no part of it is replaced. With the rows A of
the contacts that are on, and the unactuated joints b,

    A_b^T lambda^(j) = tau_bj        tau^_ij = tau_ij - (A^T lambda^(j))_i

gives the contact forces due to link j, and the torques that remain at the joints. It is the split of the
forces of closed chains, with the joints b in place of the dependent ones.

If contacts could carry the load in several ways, as two feet can, the solution is the one with the least sum
of lambda^2 / w, in N and N m, where each contact has a share w: two equivalent contacts carry in proportion
to their shares. If they cannot carry it, as a foot that touches at a single point cannot, the rest stays at
the joints b: a residual.
"""

from collections.abc import Iterator, Sequence
from copy import copy
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from linkwise_runtime.constraints.held_frames import axes_around
from linkwise_runtime.dynamics import Dynamics
from linkwise_runtime.quantities import Contact

from linkwise.analysis.constrained_model import ConstrainedModel
from linkwise.analysis.contacts.pressed import PRESSED, moment, rows_at
from linkwise.arrays import Array

WRENCH = ("moment_x", "moment_y", "moment_z", "force_x", "force_y", "force_z")
BLIND = 1e-4
"""Least ratio of singular values of a base's Jacobian; below it the base's torques leave moments unknown."""
RANK = 1e-6
"""Singular values of A_b below this part of the largest are zero."""


@dataclass(frozen=True, eq=False)
class GroundContacts:
    """Contacts of a robot, with C rows of constraint forces in all."""

    names: tuple[str, ...]
    contacts: tuple[Contact, ...]
    constraints: tuple[Any, ...]
    """The package's constraints for each contact; these may have rows of ties too."""
    unactuated: tuple[int, ...]
    joints: tuple[int, ...]
    """Index of the joints that contacts load, the unactuated ones included."""
    tied: ConstrainedModel | None
    """Model of a robot whose joints are tied, None for others; the dependent joints follow."""

    @cached_property
    def rows(self) -> tuple[str, ...]:
        """Names of the constraint force of each row: "foot force_x", for example."""
        return tuple(row for _, row in self._rows())

    @cached_property
    def owners(self) -> Array:
        """Contact of each row, (C,)."""
        return np.array([owner for owner, _ in self._rows()])

    def _rows(self) -> Iterator[tuple[int, str]]:
        for number, (name, contact) in enumerate(zip(self.names, self.contacts, strict=True)):
            rows = [self.constraints[number].rows[at] for at in self._own(number)]
            if contact.kind in PRESSED:
                rows = [f"{name} {part}" for part in PRESSED[contact.kind]]
            yield from ((number, row) for row in rows)

    def _own(self, number: int) -> list[int]:
        """Return the places of a contact's rows among those of its constraints, where ties may have some."""
        rows = self.constraints[number].rows
        return [at for at, row in enumerate(rows) if row.rpartition(" ")[0] == self.names[number]]

    @cached_property
    def wrench_rows(self) -> tuple[int | None, ...]:
        """Index of each row in a wrench, moments then forces in the world; None along a body's axes."""
        held = [self.contacts[owner].kind == "held" for owner in self.owners]
        parts = [row.rpartition(" ")[2] for row in self.rows]
        return tuple(
            WRENCH.index(part) if turns or part.startswith("force") else None
            for turns, part in zip(held, parts, strict=True)
        )

    def wrench(self, number: int, model: Dynamics, q: Array, forces: Array, press: Array) -> Array:
        """Return the wrench (S, 6) of a contact on its body, in the world's axes.

        It is the moment about the contact's point, then the force.

        forces: constraint forces of all rows, (S, C); press: where loads press in the world, (S, 3)
        """
        contact, own = self.contacts[number], forces[:, self.owners == number]
        force, turn = own[:, -3:], np.zeros((len(own), 3))
        match contact.kind:
            case "held":
                turn = own[:, :3]
            case "hinged":
                axes = np.asarray(model.kinematics.pose(q, contact.frame))[:, :3, :3] @ axes_around(
                    contact.axis
                )
                turn = np.einsum("sxa,sa->sx", axes[..., :2], own[:, :2])
            case "rolling":
                turn = np.cross(self.touch(number), force)
            case "pressed" | "pressed-point":
                arm = press - self.places(model, q)[number]
                turn = moment(contact.kind, own, arm, self._normal(number))
        return np.concatenate([turn, force], axis=1)

    def _normal(self, number: int) -> Array:
        """Return the unit normal (3,) of the ground under a contact; zeros where it has none."""
        normal = np.array(self.contacts[number].normal or (0.0, 0.0, 0.0))
        found: Array = normal / (np.linalg.norm(normal) or 1.0)
        return found

    def touch(self, number: int) -> Array:
        """Return the vector (3,) from a contact's point to where it touches: for rolling, down the radius."""
        contact = self.contacts[number]
        down: Array = -contact.radius * self._normal(number)
        return down if contact.kind == "rolling" else np.zeros(3)

    def record(self, joints: Sequence[str]) -> dict[str, Any]:
        """Return the contacts as plain data, to record in the outputs; lengths are in m."""
        held = [
            {
                "name": name,
                "frame": contact.frame,
                "kind": contact.kind,
                "point": list(contact.point),
                **({"axis": list(contact.axis)} if contact.kind == "hinged" else {}),
                **(
                    {"normal": list(contact.normal or ()), "radius": contact.radius}
                    if contact.kind == "rolling"
                    else {}
                ),
            }
            for name, contact in zip(self.names, self.contacts, strict=True)
        ]
        return {"held": held, "unactuated": [joints[i] for i in self.unactuated]}

    def places(self, model: Dynamics, q: Array) -> list[Array]:
        """Return the point of each contact in the world, (S, 3), in m."""
        found = []
        for contact in self.contacts:
            pose = np.asarray(model.kinematics.pose(q, contact.frame))
            found.append(pose[:, :3, :3] @ np.array(contact.point) + pose[:, :3, 3])
        return found

    def blind(self, model: Dynamics, q: Array) -> int | None:
        """Return the first sample at which torques of the unactuated joints do not give all forces.

        It is None where there is no such sample. A base loses a rotation where two of its joints rotate about
        one axis: at a pitch of 90 degrees.
        """
        base = list(self.unactuated)
        for contact in self.contacts:
            moved = np.asarray(model.kinematics.jacobian(q, contact.frame))[..., base]
            moved[:, 3:] /= max(1.0, np.abs(moved[:, 3:]).max(initial=0.0))  # lengths scaled to angles
            moving = moved[..., np.abs(moved).max(axis=(0, 1), initial=0.0) > 0.0]
            values = np.linalg.svd(moving, compute_uv=False)
            lost = values[:, -1:] < BLIND * values[:, :1]
            if moving.shape[-1] <= len(WRENCH) and lost.any():
                return int(lost[:, 0].argmax())
        return None

    def standing(self, model: Dynamics, q: Array, shares: Array, press: Array) -> "Standing":
        """Return how the ground holds the robot at q (S, n), by shares w (S, contacts), 0 if off.

        press: where loads press on each contact's body in the world, (S, contacts, 3); read for those kinds
        """
        found = []
        for c, (contact, constraints) in enumerate(zip(self.contacts, self.constraints, strict=True)):
            held = np.asarray(constraints.jacobian(q))[:, self._own(c)]
            if contact.kind in PRESSED:
                arm = press[:, c] - self.places(model, q)[c]
                held = rows_at(contact.kind, held, arm, self._normal(c))
            found.append(held)
        weights = shares[:, self.owners]
        every = np.concatenate(found, axis=1) * (weights > 0.0)[..., None]
        moved = every
        if self.tied is not None:
            own = list(self.tied.following.independent)
            moved = np.zeros_like(every)
            moved[..., own] = every @ np.asarray(self.tied.constraints.velocity_map(q))
        return Standing(every, moved, weights, list(self.unactuated))


def weighted_inverse(equations: Array, weights: Array) -> Array:
    """Return the inverse B^+ (S, C, b) of B (S, b, C) for which the sum of x^2 / w is least.

    It is R (B R)^+ with R^2 = w (S, C).
    """
    roots = np.sqrt(weights)
    found: Array = roots[..., None] * np.linalg.pinv(equations * roots[:, None], rcond=RANK)
    return found


class Standing:
    """Index of the contacts that are on at S samples; the rows of other contacts are zero."""

    def __init__(self, every: Array, moved: Array, weights: Array, unactuated: list[int]) -> None:
        """Take rows (S, C, n) by all joints' motion, and by that of joints which do not follow others."""
        self.every, self.moved, self._unactuated = every, moved, unactuated
        self._solved = weighted_inverse(np.swapaxes(moved[..., unactuated], 1, 2), weights)

    def some(self, samples: slice) -> "Standing":
        """Return this for some of the samples."""
        made = copy(self)
        vars(made).pop("transfer", None)
        made.every, made.moved, made._solved = self.every[samples], self.moved[samples], self._solved[samples]
        return made

    def reactions(self, torque: Array) -> Array:
        """Return the contact forces lambda (S, C, X) due to torques (S, n, X)."""
        found: Array = self._solved @ torque[:, self._unactuated]
        return found

    @cached_property
    def transfer(self) -> Array:
        """Matrix T (S, n, b) by which contacts change torques: tau - T tau_b remains at the joints.

        Where contacts carry the whole load of the unactuated joints, the rows of T for these joints are
        exactly the identity, without rounding, so that no residual appears where there is none.
        """
        found: Array = np.swapaxes(self.moved, 1, 2) @ self._solved
        own = found[:, self._unactuated]
        count = len(self._unactuated)
        whole = np.trace(own, axis1=1, axis2=2) > count - 0.5  # a projection's trace is its rank
        found[:, self._unactuated] = np.where(whole[:, None, None], np.eye(count), own)
        return found

    def left(self, torque: Array) -> Array:
        """Return the torques that contacts leave of torques (S, n, ...), of the same shape."""
        flat = torque.reshape(*torque.shape[:2], -1)
        return (flat - self.transfer @ flat[:, self._unactuated]).reshape(torque.shape)

    def loads(self, reactions: Array) -> Array:
        """Return the torques (S, n, X) that contact forces (S, C, X) take from all joints, followers too."""
        return np.swapaxes(self.every, 1, 2) @ reactions

    def fed(self, qd: Array, reactions: Array, owners: Array, count: int) -> Array:
        """Return the power (S, contacts, X) that contacts supply as they slip, from forces (S, C, X)."""
        power = self.slip(qd)[..., None] * reactions
        return np.stack([power[:, owners == c].sum(1) for c in range(count)], axis=1)

    def slip(self, qd: Array) -> Array:
        """Return A q̇ (S, C), the velocity of what contacts hold, in m/s and rad/s."""
        found: Array = np.einsum("scn,sn->sc", self.every, qd)
        return found
