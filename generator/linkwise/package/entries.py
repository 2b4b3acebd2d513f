"""The joints, links, rigid bodies and energies of a manifest, and what must hold among them."""

import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

Row = tuple[float, float, float]

KernelKind = Literal["straight", "loops"]
"""Closed forms in straight lines, or loops over links and joints."""

ROUNDING = 1e-6
"""Largest error of an entry of a rotation times its transpose."""

PLACE = re.compile(
    r"(?:gravity|bodies\[(?P<body>\d+)\]\.(?:translation|com))\[[0-2]\]"
    r"|frames\[(?P<frame>\d+)\]\.translation\[[0-2]\]"
    r"|bodies\[(?P<whole>\d+)\]\.(?:mass|inertia\[[0-2]\]\[[0-2]\])"
)
"""Numbers of a tree that may hang on parameters."""


@dataclass(frozen=True)
class JointEntry:
    """A coordinate's name and unit, and its limits in the file, as `Limits` in robot.robot; None for none."""

    name: str
    unit: Literal["rad", "m"]
    lower: float | None = None
    upper: float | None = None
    velocity: float | None = None
    effort: float | None = None


@dataclass(frozen=True)
class LinkEntry:
    """A link's name, the coordinates that move it (counted from 0), and its decomposition's operations."""

    name: str
    path: tuple[int, ...]
    operations: int


@dataclass(frozen=True)
class CodeSize:
    """Bytes of code and constants of a package's C on a microcontroller, in double and float: an estimate."""

    float64: int
    float32: int


@dataclass(frozen=True)
class CurveEntry:
    """Polynomials in q − start, each from its start on, as `Curve` in robot.curve says."""

    starts: tuple[float, ...]
    pieces: tuple[tuple[float, ...], ...]


@dataclass(frozen=True)
class BodyEntry:
    """A moving frame on its parent's, as `linkwise.robot.robot.Joint` places it, and the mass it carries.

    parent: index of an earlier body, None for the ground; coordinate: index of a joint of the manifest
    translation, com in m, mass in kg, inertia about the centre of mass in kg·m², in the body's own axes
    """

    link: str
    parent: int | None
    joint: str
    kind: Literal["revolute", "prismatic"]
    coordinate: int
    ratio: float
    rotation: tuple[Row, Row, Row]
    translation: Row
    mass: float
    com: Row
    inertia: tuple[Row, Row, Row]
    curve: CurveEntry | None = None


@dataclass(frozen=True)
class FrameEntry:
    """A named frame that a body carries, or the ground where `body` is None: a body of the file, or a site.

    rotation, translation (in m): from its coordinates to those of the body's frame, or of the world
    """

    name: str
    body: int | None
    rotation: tuple[Row, Row, Row]
    translation: Row


@dataclass(frozen=True)
class PassiveEntry:
    """What a body's joint has of its own, p = ratio · q of a coordinate being its position, in rad or m.

    It takes stiffness (p − rest) + damping ṗ + friction sign(ṗ) + armature p̈ to move it, in N·m or N.
    """

    joint: str
    coordinate: int
    ratio: float
    stiffness: float
    rest: float
    damping: float
    friction: float
    armature: float


@dataclass(frozen=True)
class TieEntry:
    """Two frames, by their indices, that are held together as `Tie` in robot.robot says; length in m."""

    name: str
    kind: Literal["point", "hinge", "frame", "distance"]
    first: int
    second: int
    length: float


@dataclass(frozen=True)
class CouplingEntry:
    """Joints of the manifest, by their indices, whose sum of c_0 + c_1 q + c_2 q² + … is 0."""

    name: str
    terms: tuple[tuple[int, tuple[float, ...]], ...]


@dataclass(frozen=True)
class RigidTree:
    """The rigid bodies, parents before children, the frames, and gravity in m/s² in the base's axes.

    passive: what joints have of their own, those that have anything

    ties, couplings: what holds beside the tree; independent: the joints whose motion gives that of all others
    then, by their indices in ascending order, none where nothing holds

    formulas: by its place, such as bodies[2].com[0], each number that hangs on run-time parameters, as text
    in their symbols; the numbers themselves are those of the parameters' own values
    """

    gravity: Row
    bodies: tuple[BodyEntry, ...]
    frames: tuple[FrameEntry, ...]
    passive: tuple[PassiveEntry, ...]
    ties: tuple[TieEntry, ...]
    couplings: tuple[CouplingEntry, ...]
    independent: tuple[int, ...]
    formulas: Mapping[str, str]

    @property
    def tied(self) -> bool:
        """Whether anything holds beside the joints."""
        return bool(self.ties or self.couplings)


@dataclass(frozen=True)
class EnergyEntry:
    """Energies in J that a user wrote for a link: text in q_k and qd_k, k from 1, and parameters' symbols."""

    link: str
    kinetic: str
    potential: str


def check_tree(tree: RigidTree, joints: Sequence[JointEntry], links: Sequence[LinkEntry]) -> None:
    """Raise ValueError where bodies contradict each other, the joints or the paths of the links."""
    paths: list[set[int]] = []
    for index, body in enumerate(tree.bodies):
        if not body.coordinate < len(joints):
            raise ValueError(f"body {index} of the tree hangs on no joint")
        if body.parent is not None and not body.parent < index:
            raise ValueError(f"the parent of body {index} of the tree is not an earlier body")
        paths.append({body.coordinate, *(() if body.parent is None else paths[body.parent])})
        inertia = np.array(body.inertia)
        if not _is_rotation(body.rotation):
            raise ValueError(f"the rotation of body {index} of the tree is not a rotation")
        if not np.array_equal(inertia, inertia.T):
            raise ValueError(f"the inertia of body {index} of the tree is not symmetric")
    by_link = {body.link: path for body, path in zip(tree.bodies, paths, strict=True)}
    for j, link in enumerate(links):
        if link.name not in by_link:
            raise ValueError(f"links[{j}].name is {link.name!r}, which is not in the tree")
        if set(link.path) != by_link[link.name]:
            raise ValueError(f"the path of link {link.name!r} is not that of the tree")
    _check_joints(tree, joints)
    _check_frames(tree, links)
    _check_passive(tree)
    _check_constraints(tree, len(joints))
    for place in tree.formulas:
        found = PLACE.fullmatch(place)
        known = found and (
            int(found["frame"]) < len(tree.frames)
            if found["frame"]
            else int(found["body"] or found["whole"] or 0) < len(tree.bodies)
        )
        if not known:
            raise ValueError(f"tree.formulas has {place[:80]!a}, which is not a place of the tree")


def _is_rotation(rows: tuple[Row, Row, Row]) -> bool:
    turn = np.array(rows)
    return np.allclose(turn @ turn.T, np.eye(3), rtol=0, atol=ROUNDING) and np.linalg.det(turn) > 0


def _check_frames(tree: RigidTree, links: Sequence[LinkEntry]) -> None:
    """Raise ValueError for a frame that nothing carries, or that is none, and for a link without one."""
    carriers: dict[str, int | None] = {}
    for index, frame in enumerate(tree.frames):
        if frame.body is not None and not frame.body < len(tree.bodies):
            raise ValueError(f"frame {index} of the tree is on a body that is not there")
        if frame.name in carriers:
            raise ValueError(f"tree.frames has {frame.name[:80]!a} twice")
        if not _is_rotation(frame.rotation):
            raise ValueError(f"the rotation of frame {index} of the tree is not a rotation")
        carriers[frame.name] = frame.body
    at = {body.link: b for b, body in enumerate(tree.bodies)}
    for link in links:
        if carriers.get(link.name) != at[link.name]:
            raise ValueError(f"tree.frames has no frame {link.name[:80]!a} on the body of that link")


def _check_passive(tree: RigidTree) -> None:
    """Raise ValueError for what is of no joint of the tree, or of one that moves otherwise."""
    moved = {body.joint: (body.coordinate, body.ratio) for body in tree.bodies}
    for index, entry in enumerate(tree.passive):
        if moved.get(entry.joint) != (entry.coordinate, entry.ratio):
            raise ValueError(f"passive entry {index} of the tree is not of a joint that moves so")


def _check_constraints(tree: RigidTree, count: int) -> None:
    """Raise ValueError for what ties no frames or joints, and for independent joints that cannot be."""
    names = Counter([tie.name for tie in tree.ties] + [coupling.name for coupling in tree.couplings])
    for name, times in names.items():
        if times > 1:
            raise ValueError(f"tree.ties and tree.couplings have {name[:80]!a} twice")
    for tie in tree.ties:
        if not max(tie.first, tie.second) < len(tree.frames) or tie.first == tie.second:
            raise ValueError(f"the tie {tie.name[:80]!a} of the tree is not between two of its frames")
        if (tie.length > 0) != (tie.kind == "distance"):
            raise ValueError(f"the tie {tie.name[:80]!a} of the tree has a length that it cannot have")
    for coupling in tree.couplings:
        found = [k for k, coefficients in coupling.terms if any(coefficients[1:])]
        if not found or len(found) < len(coupling.terms) or found != sorted(set(found)):
            raise ValueError(
                f"the coupling {coupling.name[:80]!a} of the tree does not couple joints in order"
            )
        if not found[-1] < count:
            raise ValueError(f"the coupling {coupling.name[:80]!a} of the tree has a joint that is not there")
    free = tree.independent
    if list(free) != sorted(set(free)) or not all(k < count for k in free):
        raise ValueError("tree.independent is not of joints, in ascending order")
    if bool(names) != bool(free) or (names and len(free) == count):
        raise ValueError("tree.independent is not of some joints where there are constraints, else of none")


def _check_joints(tree: RigidTree, joints: Sequence[JointEntry]) -> None:
    units = {"revolute": "rad", "prismatic": "m"}
    for k, joint in enumerate(joints):
        own = [body for body in tree.bodies if body.coordinate == k and body.joint == joint.name]
        if not own:
            raise ValueError(f"joints[{k}].name is {joint.name!r}, on which no body of the tree hangs")
        if all(units[body.kind] != joint.unit for body in own):
            raise ValueError(f"joints[{k}].unit is {joint.unit!r}, which is not that of its kind in the tree")
