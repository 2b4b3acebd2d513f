"""What the ground bears at contacts, found by the equations of the joints that nothing drives.

A measured motion does not keep a contact to the last digit, so none of it is replaced. With the rows A of the
contacts that are on, and the unactuated joints b,

    A_b^T lambda^(j) = tau_bj        tau^_ij = tau_ij - (A^T lambda^(j))_i

says what the ground bears of link j, and what is left for the joints. It is the split of forces of closed
chains, by the joints b in place of the dependent ones.

Where contacts could bear it in several ways, as two feet can, that is taken for which the sum of
lambda^2 / w is least, in N and N m, with a share w of each contact: two that bear alike bear in proportion
to their shares. Where they cannot bear it, as a foot that only touches at a point cannot, what is left over
stays with the joints b: a residual.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from linkwise_runtime.constraints.held_frames import axes_around
from linkwise_runtime.dynamics import Dynamics
from linkwise_runtime.quantities import Contact

from linkwise.analysis.constrained_model import ConstrainedModel
from linkwise.package.load import Array

WRENCH = ("moment_x", "moment_y", "moment_z", "force_x", "force_y", "force_z")
BLIND = 1e-4
"""Part of the most that the least turn of a base moves: below it the base's torques do not tell a moment."""
RANK = 1e-6
"""Singular values of A_b below this part of the largest are zero."""


@dataclass(frozen=True, eq=False)
class GroundContacts:
    """Contacts of a robot, with C rows of forces in all."""

    names: tuple[str, ...]
    contacts: tuple[Contact, ...]
    constraints: tuple[Any, ...]
    """Of each contact the package's own, which may have rows of ties beside it."""
    unactuated: tuple[int, ...]
    joints: tuple[int, ...]
    """Those that contacts load, the unactuated ones too."""
    tied: ConstrainedModel | None
    """Of a robot whose joints are tied: the others follow."""

    @cached_property
    def rows(self) -> tuple[str, ...]:
        """What each row bears: "foot force_x", say."""
        return tuple(row for _, row in self._rows())

    @cached_property
    def owners(self) -> Array:
        """Contact of each row, (C,)."""
        return np.array([owner for owner, _ in self._rows()])

    def _rows(self) -> Iterator[tuple[int, str]]:
        for number, (name, constraints) in enumerate(zip(self.names, self.constraints, strict=True)):
            for row in constraints.rows:
                if row.rpartition(" ")[0] == name:
                    yield number, row

    @cached_property
    def wrench_rows(self) -> tuple[int | None, ...]:
        """Of each row its number in a wrench, moments then forces in the world; None along a body's axes."""
        held = [self.contacts[owner].kind == "held" for owner in self.owners]
        parts = [row.rpartition(" ")[2] for row in self.rows]
        return tuple(
            WRENCH.index(part) if turns or part.startswith("force") else None
            for turns, part in zip(held, parts, strict=True)
        )

    def wrench(self, number: int, model: Dynamics, q: Array, forces: Array) -> Array:
        """What a contact puts on its body, (S, 6): moment about its point, and force, in the world's axes.

        forces: of all rows, (S, C)
        """
        contact, own = self.contacts[number], forces[:, self.owners == number]
        force, moment = own[:, -3:], np.zeros((len(own), 3))
        match contact.kind:
            case "held":
                moment = own[:, :3]
            case "hinged":
                axes = np.asarray(model.kinematics.pose(q, contact.frame))[:, :3, :3] @ axes_around(
                    contact.axis
                )
                moment = np.einsum("sxa,sa->sx", axes[..., :2], own[:, :2])
            case "rolling":
                moment = np.cross(self.touch(number), force)
        return np.concatenate([moment, force], axis=1)

    def touch(self, number: int) -> Array:
        """From a contact's point to where it touches, (3,): of what rolls down its radius."""
        contact = self.contacts[number]
        if contact.kind != "rolling" or contact.normal is None:
            return np.zeros(3)
        normal = np.array(contact.normal)
        down: Array = -contact.radius * normal / np.linalg.norm(normal)
        return down

    def record(self, joints: Sequence[str]) -> dict[str, Any]:
        """As plain data, to record in the outputs; m."""
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
        """Where in the world the point of each contact is, (S, 3), in m."""
        found = []
        for contact in self.contacts:
            pose = np.asarray(model.kinematics.pose(q, contact.frame))
            found.append(pose[:, :3, :3] @ np.array(contact.point) + pose[:, :3, 3])
        return found

    def blind(self, model: Dynamics, q: Array) -> int | None:
        """The first sample at which torques of the unactuated joints do not tell all that they ask for.

        A base's turns lose one where two of its joints turn about one axis: pitched by 90 degrees.
        """
        base = list(self.unactuated)
        for contact in self.contacts:
            moved = np.asarray(model.kinematics.jacobian(q, contact.frame))[..., base]
            moved[:, 3:] /= max(1.0, np.abs(moved[:, 3:]).max(initial=0.0))  # of far turns, beside turns
            moving = moved[..., np.abs(moved).max(axis=(0, 1), initial=0.0) > 0.0]
            values = np.linalg.svd(moving, compute_uv=False)
            lost = values[:, -1:] < BLIND * values[:, :1]
            if moving.shape[-1] <= len(WRENCH) and lost.any():
                return int(lost[:, 0].argmax())
        return None

    def standing(self, q: Array, shares: Array) -> "Standing":
        """How the ground holds the robot at q (S, n), by shares w (S, contacts), 0 of what is off."""
        found = []
        for name, constraints in zip(self.names, self.constraints, strict=True):
            own = [at for at, row in enumerate(constraints.rows) if row.rpartition(" ")[0] == name]
            found.append(np.asarray(constraints.jacobian(q))[:, own])
        weights = shares[:, self.owners]
        every = np.concatenate(found, axis=1) * (weights > 0.0)[..., None]
        moved = every
        if self.tied is not None:
            own = list(self.tied.following.independent)
            moved = np.zeros_like(every)
            moved[..., own] = every @ np.asarray(self.tied.constraints.velocity_map(q))
        return Standing(every, moved, weights, list(self.unactuated))


def weighted_inverse(equations: Array, weights: Array) -> Array:
    """B^+ (S, C, b) of B (S, b, C) for which the sum of x^2 / w is least: R (B R)^+ with R^2 = w (S, C)."""
    roots = np.sqrt(weights)
    found: Array = roots[..., None] * np.linalg.pinv(equations * roots[:, None], rcond=RANK)
    return found


class Standing:
    """Rows of the contacts that are on at S samples, those of others zero."""

    def __init__(self, every: Array, moved: Array, weights: Array, unactuated: list[int]) -> None:
        """Rows (S, C, n) by all joints' motion, and by that of the joints which do not follow others."""
        self.every, self.moved, self._unactuated = every, moved, unactuated
        self._solved = weighted_inverse(np.swapaxes(moved[..., unactuated], 1, 2), weights)

    def reactions(self, torque: Array) -> Array:
        """lambda (S, C, X) of torques (S, n, X)."""
        found: Array = self._solved @ torque[:, self._unactuated]
        return found

    @cached_property
    def transfer(self) -> Array:
        """T (S, n, b): torques tau leave the joints with tau - T tau_b.

        Where contacts bear all that the unactuated joints ask for, its rows of these are those of 1, without
        rounding: of what they are left with, nothing is there to be seen.
        """
        found: Array = np.swapaxes(self.moved, 1, 2) @ self._solved
        own = found[:, self._unactuated]
        count = len(self._unactuated)
        whole = np.trace(own, axis1=1, axis2=2) > count - 0.5  # a projection's trace is its rank
        found[:, self._unactuated] = np.where(whole[:, None, None], np.eye(count), own)
        return found

    def left(self, torque: Array) -> Array:
        """What torques (S, n, ...) leave to the joints, of that shape."""
        flat = torque.reshape(*torque.shape[:2], -1)
        return (flat - self.transfer @ flat[:, self._unactuated]).reshape(torque.shape)

    def loads(self, reactions: Array) -> Array:
        """Torques (S, n, X) that reactions (S, C, X) take from all joints, followers too."""
        return np.swapaxes(self.every, 1, 2) @ reactions

    def fed(self, qd: Array, reactions: Array, owners: Array, count: int) -> Array:
        """Power (S, contacts, X) that contacts give as they slip, of reactions (S, C, X)."""
        power = self.slip(qd)[..., None] * reactions
        return np.stack([power[:, owners == c].sum(1) for c in range(count)], axis=1)

    def slip(self, qd: Array) -> Array:
        """A q̇ (S, C): how the motion moves what is held, in m/s and rad/s."""
        found: Array = np.einsum("scn,sn->sc", self.every, qd)
        return found
