"""Constraint rows of a frame that the ground holds, from the recursion's own velocities."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from linkwise_runtime.quantities import Contact
from linkwise_runtime.rule.joint_tree import TreeFrame

from linkwise.arrays import Array, Index
from linkwise.oracle.loop_equations import RANK, TURNS_AND_SHIFTS, LoopEquations
from linkwise.oracle.newton_euler import NewtonEuler
from linkwise.oracle.reference import COMPLEX_STEP

POINT = np.array([0.1, -0.2, 0.15])
AXIS = np.array([0.3, 0.5, -0.8])
NORMAL = np.array([0.2, -0.1, 0.9])
RADIUS = 0.07
SPACIOUS = 20.0
"""Contacts lie nearer on robots that reach less than 1 / this, in m."""
KINDS = {"held": "frame", "hinged": "hinge", "point": "point", "rolling": "point"}
"""Kinds of contacts, and the kind of tie that has as many rows."""


@dataclass(frozen=True)
class ContactEquations:
    """Equations of a contact, together with the robot's ties if it has some."""

    recursion: NewtonEuler
    ties: LoopEquations | None
    frame: TreeFrame
    kind: str

    @property
    def arguments(self) -> dict[str, Any]:
        """Arguments of the contact, as a package accepts them."""
        length = min(1.0, SPACIOUS * self.recursion.reach) or 1.0  # no reach: the whole robot is in one point
        given: dict[str, Any] = {"frame": self.frame.name, "kind": self.kind, "point": tuple(length * POINT)}
        if self.kind == "hinged":
            given["axis"] = tuple(AXIS)
        if self.kind == "rolling":
            given |= {"normal": tuple(NORMAL), "radius": length * RADIUS}
        return given

    def own(self, rows: Any) -> slice:
        """Return the slice of the contact's rows among all rows, of which those of couplings are last."""
        end = rows.shape[1] - (0 if self.ties is None else len(self.ties.tree.couplings))
        return slice(end - sum(TURNS_AND_SHIFTS[KINDS[self.kind]]), end)

    def rows(self, q: Array) -> Array:
        """Return A (samples, C, n)."""
        own = contact_rows(self.recursion, self.frame, Contact(**self.arguments), q)
        if self.ties is None:
            return own
        rows = self.ties.rows(q)
        before = rows.shape[1] - len(self.ties.tree.couplings)
        return np.concatenate([rows[:, :before], own, rows[:, before:]], 1)

    def freedoms(self, q: Array) -> Index:
        """Return how many joints may move by themselves, (samples,); metres are scaled by a robot's size."""
        size, rows = self.recursion.reach or 1.0, self.rows(q)
        kinds = [*(tie.kind for tie in (self.ties.tree.ties if self.ties else ())), KINDS[self.kind]]
        units = [unit for kind in kinds for unit in np.repeat([1.0, size], TURNS_AND_SHIFTS[kind])]
        units += [1.0] * (rows.shape[1] - len(units))
        slides = [joint.coordinate for joint in self.recursion.joints if joint.kind == "prismatic"]
        rows = rows / np.array(units)[:, None] * np.where(np.isin(np.arange(q.shape[1]), slides), size, 1.0)
        sizes = np.linalg.svd(rows, compute_uv=False)
        found: Index = q.shape[1] - (sizes > RANK * np.maximum(sizes[:, :1], 1.0)).sum(-1)
        return found

    def rates(self, q: Array, qd: Array) -> Array:
        """Return dA/dt (samples, C, n)."""
        rate: Array = self.rows(q + 1j * COMPLEX_STEP * qd).imag / COMPLEX_STEP
        return rate


def contact_rows(
    recursion: NewtonEuler, frame: TreeFrame, contact: Contact, q: Array, press: Array | None = None
) -> Array:
    """Return A of a contact on a frame, (samples, rows, n).

    press: where measured loads press in the world, (samples, 3), for the kinds that are held there
    """
    samples, n = q.shape
    units, many = np.tile(np.eye(n), (samples, 1)), np.repeat(q, n, 0)
    place = np.array(frame.translation) + np.array(frame.rotation) @ np.array(contact.point)
    speed = recursion.points([(frame.joint, place)], many, units, 0.0 * units)[0]
    moved = np.swapaxes(speed.reshape(samples, n, 6), -1, -2)
    turn, shift = moved[:, :3], moved[:, 3:]
    normal: Array
    match contact.kind:
        case "held":
            parts = [turn, shift]
        case "hinged":
            across = np.linalg.svd(np.array(contact.axis)[None])[2][1:]
            axes = recursion.poses([frame], q)[:, 0, :3, :3]
            parts = [across @ np.swapaxes(axes, -1, -2) @ turn, shift]
        case "point":
            parts = [shift]
        case "pressed" | "pressed-point":  # the point of the body that is now where loads press is at rest
            assert press is not None
            arm = press - recursion.places([(frame.joint, place)], q)[:, 0]
            parts = [shift + np.cross(turn, arm[..., None], axis=1)]
            if contact.kind == "pressed":
                normal = np.array(contact.normal)
                parts.insert(0, np.tensordot(normal / np.linalg.norm(normal), turn, (0, 1))[:, None])
        case _:  # a rolling ball: the point one radius below its centre is at rest
            normal = np.array(contact.normal)
            down = -contact.radius * normal / np.linalg.norm(normal)
            parts = [shift + np.cross(turn, down[None, :, None], axis=1)]
    return np.concatenate(parts, 1)
