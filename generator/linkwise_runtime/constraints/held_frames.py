"""Frames that ties and contacts hold, row by row: as given, and as constants for `tie_arrays`."""

import math
from collections.abc import Iterable, Sequence
from typing import NamedTuple, cast

import numpy as np
from numpy.typing import NDArray

from ..arguments import refuse_gradient
from ..chosen_names import known_kind, short
from ..interface import Numbers
from ..kinematics.frame_answers import frame_index
from ..kinematics.frame_arrays import FrameTables, frame_tables
from ..quantities import Contact
from ..rule.joint_tree import JointTree, TreeCoupling, Triple

Floats = NDArray[np.float64]
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
"""Kinds of contacts, and the kind of tie that has the same rows."""


class Held(NamedTuple):
    """A frame that is held to another, or to the ground where it is."""

    name: str
    kind: str
    """Key of `ROWS`."""
    first: int
    """Index of the first frame in the tree."""
    second: int | None
    """Index of the second frame in the tree; None for the ground."""
    axes: NDArray[np.float64]
    """Axes of what is held, in the first frame, (3, 3); z is that of a hinge."""
    point: Triple = (0.0, 0.0, 0.0)
    """Point that is held, in the first frame."""
    length: float = 0.0
    arm: Triple = (0.0, 0.0, 0.0)
    """Vector from where a rolling body touches the ground to the point, in the world's axes."""

    @property
    def row_names(self) -> list[str]:
        """Names of the rows, which say what each holds."""
        return [f"{self.name} {row}" for row in ROWS[self.kind]]

    @property
    def row_units(self) -> list[str]:
        """Unit in which each row is open where the frames are apart: rad or m."""
        return ["rad" if row in TURNS else "m" for row in ROWS[self.kind]]


def held_by(tree: JointTree, contacts: object) -> list[Held]:
    """Return the ties of the tree, then the contacts; raises as `Dynamics.constrained` does."""
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


def _vector(given: object, where: str, is_direction: bool = False) -> Triple:
    refuse_gradient(where, given)
    try:
        x, y, z = (float(number) for number in cast(Iterable[float], given))
    except (TypeError, ValueError):
        raise ValueError(f"{where} is {short(given)}; give x, y, z") from None
    if not all(map(math.isfinite, (x, y, z))):
        raise ValueError(f"{where} is {short(given)}; give finite numbers")
    if is_direction and x == y == z == 0.0:
        raise ValueError(f"{where} is {short(given)}, which has no direction")
    return x, y, z


def ground_normal(contact: Contact, where: str, gravity: Triple) -> Triple:
    """Return the normal of the ground on which a contact rolls: its own, or against gravity."""
    if contact.normal is not None:
        return _vector(contact.normal, f"{where}.normal", True)
    if not any(gravity):
        raise ValueError(f"{where} has no normal, and no gravity tells one; give normal=(x, y, z)")
    return -gravity[0], -gravity[1], -gravity[2]


def axes_around(direction: Triple) -> NDArray[np.float64]:
    """Return axes (3, 3) whose z points in a direction."""
    z = np.array(direction) / math.hypot(*direction)
    x = np.cross(np.eye(3)[np.abs(z).argmin()], z)
    x /= np.linalg.norm(x)
    return np.stack([x, np.cross(z, x), z], 1)


def all_names(held: Sequence[Held], tree: JointTree) -> tuple[str, ...]:
    """Return the names of the ties, contacts and couplings, in the order of their rows."""
    return (*(one.name for one in held), *(coupling.name for coupling in tree.couplings))


class TieTables(NamedTuple):
    """Constants of P pairs of frames, of which T are ties and the others contacts, and of their C rows.

    Frames are in this order: first frames of ties, frames of contacts, second frames of ties.
    """

    frames: FrameTables | None
    """Tables of the frames; None without ties and contacts."""
    ties: int
    pairs: int
    points: Numbers
    """Point of each frame, in its axes, (3, frames, 1)."""
    first: Numbers
    """Ones where a joint moves the first frame of a pair, (P, joints, 1)."""
    second: Numbers
    """Ones where a joint moves the second frame of a pair, (P, joints, 1); zeros for a contact."""
    moved_apart: Numbers
    """Difference of `first` and `second`."""
    all_axes: Numbers | None
    """1 for a pair whose axes are all held, 0 where at most z is, (P, 1); None where no pair holds any."""
    apart: Numbers
    """Length that each row holds, 0 for rows that hold none, (C, 1)."""
    is_apart: Numbers
    """1 for a pair that holds a length, 0 for others, (P, 1)."""
    row_pairs: Numbers
    """Index of each row's pair."""
    fixed: Numbers
    """(6, C, 1): factors of each row on the turn and the shift of its pair, along the world's axes."""
    turning: Numbers | None
    """(3, C, 1): factors of each row on the turn, along the axes of the first frame; None if all are zero."""
    along: Numbers | None
    """(C, 1): factors of each row on the shift, along the line between the frames; None if all are zero."""
    placed: Numbers
    """(C, 1): ones for rows that a position can violate; zeros for rolling."""
    polynomials: tuple[tuple[Numbers, ...], ...]
    """Coefficients c_0, c_1, ... of couplings' sums, their first and second derivatives, (K, n, 1) each."""

    @property
    def moved(self) -> int:
        """Number of joints, times one more than the number of pairs: the memory of a call grows with it."""
        return 1 if self.frames is None else len(self.frames.joints.parents) * (1 + self.pairs)


def tie_tables(tree: JointTree, n: int, held: Sequence[Held]) -> TieTables:
    """Return the tables in float64."""
    ties = sum(one.second is not None for one in held)
    seconds = [one.second for one in held[:ties] if one.second is not None]
    frames, points = None, np.zeros((3, 0, 1))
    first: Floats = np.zeros(0)
    second: Floats = np.zeros(0)
    if held:
        frames = frame_tables(tree, n, [*(one.first for one in held), *seconds])
        axes = np.stack([*(one.axes for one in held), *[np.eye(3)] * ties], -1)[..., None]
        rotations = (frames.rotations[:, :, None] * axes[None]).sum(1)
        frames = frames._replace(rotations=rotations)
        # Points are wanted in these axes, and so are turned like them.
        own = np.array([*(one.axes.T @ one.point for one in held), *[np.zeros(3)] * ties])
        points = own.T[..., None]
        moved = np.asarray(frames.moved_frames).T[..., None]
        first, second = moved[: len(held)], np.zeros_like(moved[: len(held)])
        second[:ties] = moved[len(held) :]
    every = np.array([[float(one.kind == "frame")] for one in held])
    return TieTables(
        frames,
        ties,
        len(held),
        points,
        first,
        second,
        first - second,
        every if {"frame", "hinge"} & {one.kind for one in held} else None,
        np.array([[one.length] for one in held for _ in ROWS[one.kind]]),
        np.array([[float(one.kind == "distance")] for one in held]),
        np.array([p for p, one in enumerate(held) for _ in ROWS[one.kind]], dtype=np.intp),
        *_rows(held),
        np.array([[float(one.kind != "rolling")] for one in held for _ in ROWS[one.kind]]),
        _polynomials(tree.couplings, n),
    )


def _rows(held: Sequence[Held]) -> tuple[Floats, Floats | None, Floats | None]:
    """Return the tables `fixed`, `turning` and `along`."""
    count = sum(len(ROWS[one.kind]) for one in held)
    fixed, turning, along = (np.zeros((size, count, 1)) for size in (6, 3, 1))
    along = along[0]
    at, eye = 0, np.eye(3)
    for one in held:
        size = len(ROWS[one.kind])
        if one.kind == "distance":
            along[at] = 1.0
        else:
            fixed[3:, at + size - 3 : at + size, 0] = eye
        if one.kind == "hinge":
            turning[:, at : at + 2, 0] = eye[:, :2]
        if one.kind == "frame":
            fixed[:3, at : at + 3, 0] = eye
        if one.kind == "rolling":  # v + omega x -arm is the velocity where it touches
            fixed[:3, at : at + 3, 0] = np.cross(eye, np.array(one.arm)).T
        at += size
    return fixed, turning if turning.any() else None, along if along.any() else None


def _polynomials(couplings: Sequence[TreeCoupling], n: int) -> tuple[tuple[Floats, ...], ...]:
    if not couplings:
        return ()
    most = max(len(factors) for coupling in couplings for _, factors in coupling.terms)
    listed = np.zeros((max(3, most), len(couplings), n, 1))
    for c, coupling in enumerate(couplings):
        for k, factors in coupling.terms:
            listed[: len(factors), c, k, 0] += factors
    powers = np.arange(len(listed))[:, None, None, None]
    slopes = (powers * listed)[1:]
    return tuple(listed), tuple(slopes), tuple((powers[:-1] * slopes)[1:])
