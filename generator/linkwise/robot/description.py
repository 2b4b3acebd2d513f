"""What a robot file says, before fixed joints are merged and frames are chosen."""

from dataclasses import dataclass, field
from typing import Literal

from linkwise.robot.curve import Curve
from linkwise.robot.notes import Note, Omission
from linkwise.robot.robot import (
    NOTHING,
    UNLIMITED,
    Follower,
    Limits,
    Mat3,
    Passive,
    Rotation,
    Scalar,
    TieKind,
    Vec3,
)

ZERO3: Vec3 = (0.0, 0.0, 0.0)
ZERO33: Mat3 = (ZERO3, ZERO3, ZERO3)
IDENTITY: Rotation = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


@dataclass(frozen=True)
class Body:
    """A link as the file has it; com and inertia about it in the link's frame.

    `origin` is where that frame's origin is from the place of the link's joint, in the same axes.
    `unphysical` holds the file's own reason for an inertia that no rigid body has (empty: none); `invented`
    says that the reader made the body up, between two axes of one joint.
    """

    name: str
    mass: Scalar = 0.0
    com: Vec3 = ZERO3
    inertia: Mat3 = ZERO33
    unphysical: str = ""
    invented: bool = False
    origin: Vec3 = ZERO3


@dataclass(frozen=True)
class Site:
    """A named place on a body, and its axes there, in the body's frame."""

    name: str
    body: str
    rotation: Rotation
    translation: Vec3


@dataclass(frozen=True)
class Mimic:
    """q = ratio · q_master + offset."""

    master: str
    ratio: float = 1.0
    offset: float = 0.0


@dataclass(frozen=True)
class Anchor:
    """An end of a tie: a place on a body, and axes there, in the body's frame."""

    body: str
    rotation: Rotation = IDENTITY
    translation: Vec3 = ZERO3


@dataclass(frozen=True)
class AnchoredTie:
    """A constraint between two bodies beside the tree, as the file has it; see `Tie` for its kinds."""

    name: str
    kind: TieKind
    first: Anchor
    second: Anchor
    length: Scalar = 0.0
    """In m, of a distance only."""


@dataclass(frozen=True)
class JointCoupling:
    """Positions of joints that a sum ties together: Σ c_0 + c_1 q + c_2 q² + … over its `terms` is 0.

    The first of its joints follows the others. An `equality` of MJCF may be let go with --free-mimic.
    """

    name: str
    terms: tuple[tuple[str, tuple[float, ...]], ...]
    equality: bool = False

    @property
    def rule(self) -> str:
        """What it does to its first joint, in words."""
        others = [repr(joint) for joint, _ in self.terms[1:]]
        return f"coupled to {' and '.join(others)}" if others else "held"


@dataclass(frozen=True)
class Loop:
    """A constraint that is not modelled, on pairs of bodies; none where it ties others.

    `what` names it in a sentence, `remedy` says how to do without it. A tie `of_joints` is gone with either
    body of its pair; any other still loads the one that is left.
    """

    what: str
    remedy: str
    pairs: tuple[tuple[str, str], ...] = ()
    of_joints: bool = False


@dataclass(frozen=True)
class CurvedAxis:
    """One axis of a `curved` joint: it moves by a curve of a coordinate.

    name: its own; of one axis for each coordinate the coordinate's name
    suffix: what tells the joint's other axes' bodies from its child; direction: in the child's axes at the
    place where all axes of the joint stand at 0
    """

    name: str
    suffix: str
    kind: Literal["revolute", "prismatic"]
    direction: tuple[float, float, float]
    coordinate: str
    """Empty where the axis stands still."""
    curve: Curve


@dataclass(frozen=True)
class CurvedCoordinate:
    """A coordinate that axes of a joint follow by curves."""

    name: str
    unit: Literal["rad", "m"]
    limits: Limits = UNLIMITED
    coupled: bool = False
    """See `Coordinate`."""


@dataclass(frozen=True)
class FreeRoot:
    """Where the file shows a root in the world that no joint holds: it falls, unless it is held there."""

    rotation: Rotation
    translation: Vec3


@dataclass(frozen=True)
class Connection:
    """A joint as the file has it: any type, any axis; its place in the parent's frame, its axis in its own.

    `snapped` says that entries of the rotation were rounded to −1, 0 or 1; only a joint of one axis has
    anything `passive`, and limits. A `curved` joint has `axes`, from the parent on, the coordinates that they
    follow, and `followers` that are coordinates in the file only.
    """

    name: str
    type: str
    parent: str
    child: str
    rotation: Rotation = IDENTITY
    translation: Vec3 = ZERO3
    axis: tuple[float, float, float] = (0.0, 0.0, 1.0)
    mimic: Mimic | None = None
    snapped: bool = False
    passive: Passive = NOTHING
    limits: Limits = UNLIMITED
    axes: tuple[CurvedAxis, ...] = ()
    coordinates: tuple[CurvedCoordinate, ...] = ()
    followers: tuple[Follower, ...] = ()


@dataclass(frozen=True)
class Description:
    """A robot as its file has it.

    With `only_named` nothing but its own parameters may be varied: its numbers say what it is, say planar.
    """

    name: str
    bodies: tuple[Body, ...]
    connections: tuple[Connection, ...]
    gravity: Vec3 = (0.0, 0.0, -9.81)
    parameters: tuple[tuple[str, float], ...] = ()
    notes: tuple[Note, ...] = field(default=())
    ties: tuple[AnchoredTie, ...] = ()
    couplings: tuple[JointCoupling, ...] = ()
    loops: tuple[Loop, ...] = ()
    only_named: bool = False
    sites: tuple[Site, ...] = ()
    omissions: tuple[Omission, ...] = ()
    driven: tuple[str, ...] = ()
    """Joints that actuators of the file drive."""
    independent: tuple[str, ...] = ()
    """Joints whose motion is to give that of all others under the constraints; none: to be chosen."""
    ground: str = ""
    """The body that is the world itself, where the file has one."""
    free: FreeRoot | None = None
    """None where the file holds the root, or its format says nothing of that."""
    ordered: bool = False
    """Whether Pinocchio has siblings in the file's order, and not in that of their joints' names."""
