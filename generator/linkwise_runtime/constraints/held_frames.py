"""What ties and contacts hold, row by row: kinds of them, and contacts as they were given."""

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..chosen_names import known_kind, short
from ..kinematics.named_frames import frame_index
from ..robot_constraints import Contact
from ..rule.joint_tree import JointTree, Triple

TURNS = ("moment_x", "moment_y", "moment_z")
SHIFTS = ("force_x", "force_y", "force_z")
ROWS = {
    "point": SHIFTS,
    "hinge": (*TURNS[:2], *SHIFTS),
    "frame": (*TURNS, *SHIFTS),
    "distance": ("force",),
    "rolling": SHIFTS,
}
"""Names of the rows of each kind."""
CONTACTS = {"held": "frame", "hinged": "hinge", "point": "point", "rolling": "rolling"}
"""Kinds of contacts, and that of the same rows."""


class Held(NamedTuple):
    """A frame that is held to another, or to the ground where it is."""

    name: str
    kind: str
    """One of `ROWS`."""
    first: int
    """Index of the tree's frame."""
    second: int | None
    """The same; None for the ground."""
    axes: NDArray[Any]
    """In the first frame those of what is held, whose z is a hinge's, (3, 3)."""
    point: Triple = (0.0, 0.0, 0.0)
    """In the first frame."""
    length: float = 0.0
    arm: Triple = (0.0, 0.0, 0.0)
    """Of what rolls, from where it touches to the point, in the world."""

    @property
    def row_names(self) -> list[str]:
        """What each row holds."""
        return [f"{self.name} {row}" for row in ROWS[self.kind]]

    @property
    def row_units(self) -> list[str]:
        """In which each row is open where the frames are not together: rad or m."""
        return ["rad" if row in TURNS else "m" for row in ROWS[self.kind]]


def held_by(tree: JointTree, contacts: Any) -> list[Held]:
    """Ties of the tree, then contacts; raises as `Dynamics.constrained` does."""
    if isinstance(contacts, Contact) or not isinstance(contacts, list | tuple):
        raise TypeError(f"contacts is {known_kind(contacts, Contact)}; give a list of Contact")
    ties = [
        Held(tie.name, tie.kind, tie.first, tie.second, np.eye(3), length=tie.length) for tie in tree.ties
    ]
    frames = [frame.name for frame in tree.frames]
    taken = {tie.name for tie in tree.ties} | {coupling.name for coupling in tree.couplings}
    for number, contact in enumerate(contacts):
        where = f"contacts[{number}]"
        if not isinstance(contact, Contact):
            raise TypeError(f"{where} is {known_kind(contact, Contact)}; give a Contact")
        made = _held(contact, where, frames, tree.gravity)
        if tree.frames[made.first].joint is None:
            raise ValueError(f"{where}.frame is {short(contact.frame)}, which stands on the ground anyway")
        if made.name in taken:
            raise ValueError(f"{where} is called {short(made.name)}, as another is; give it a name=")
        taken.add(made.name)
        ties.append(made)
    return ties


def _held(contact: Contact, where: str, frames: Sequence[str], gravity: Triple) -> Held:
    if contact.kind not in CONTACTS:
        raise ValueError(f"{where}.kind is {short(contact.kind)}; choose {', '.join(CONTACTS)}")
    first = frame_index(contact.frame, frames)
    point = _vector(contact.point, f"{where}.point")
    arm, axes = (0.0, 0.0, 0.0), np.eye(3)
    if contact.kind == "hinged":
        axes = axes_around(_vector(contact.axis, f"{where}.axis", True))
    if contact.kind == "rolling":
        radius, normal = contact.radius, ground_normal(contact, where, gravity)
        if not (isinstance(radius, int | float) and 0.0 < radius < math.inf):
            raise ValueError(f"{where}.radius is {short(radius)}; what rolls has one above 0, in m")
        size = math.hypot(*normal)
        arm = (radius * normal[0] / size, radius * normal[1] / size, radius * normal[2] / size)
    name = contact.name or f"{frames[first]} {contact.kind}"
    return Held(name, CONTACTS[contact.kind], first, None, axes, point, arm=arm)


def _vector(given: Any, where: str, is_direction: bool = False) -> Triple:
    try:
        x, y, z = (float(number) for number in given)
    except (TypeError, ValueError):
        raise ValueError(f"{where} is {short(given)}; give x, y, z") from None
    if not all(map(math.isfinite, (x, y, z))):
        raise ValueError(f"{where} is {short(given)}; give finite numbers")
    if is_direction and x == y == z == 0.0:
        raise ValueError(f"{where} is {short(given)}, which has no direction")
    return x, y, z


def ground_normal(contact: Contact, where: str, gravity: Triple) -> Triple:
    """The normal of the ground on which it rolls: its own, or against gravity."""
    if contact.normal is not None:
        return _vector(contact.normal, f"{where}.normal", True)
    if not any(gravity):
        raise ValueError(f"{where} has no normal, and no gravity tells one; give normal=(x, y, z)")
    return -gravity[0], -gravity[1], -gravity[2]


def axes_around(direction: Triple) -> NDArray[Any]:
    """Axes whose z points in a direction."""
    z = np.array(direction) / math.hypot(*direction)
    x = np.cross(np.eye(3)[np.abs(z).argmin()], z)
    x /= np.linalg.norm(x)
    return np.stack([x, np.cross(z, x), z], 1)


def all_names(held: Sequence[Held], tree: JointTree) -> tuple[str, ...]:
    """Names of what has rows, in their order."""
    return (*(one.name for one in held), *(coupling.name for coupling in tree.couplings))
