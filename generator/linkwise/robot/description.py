"""Description of a robot as its file has it, before fixed joints are merged and frames are chosen."""

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
    """A link as the file has it; com, and the inertia about it, are in the link's frame.

    `origin` is the position of that frame's origin as seen from the place of the link's joint, in the same
    axes. `unphysical` holds the file's own reason for an inertia that no rigid body has (empty: none);
    `invented` says that the reader made the body up, between two axes of one joint.
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
    """A named place on a body, with axes, both in the body's frame."""

    name: str
    body: str
    rotation: Rotation
    translation: Vec3


@dataclass(frozen=True)
class Mimic:
    """Rule of a joint that follows another: q = ratio · q_master + offset."""

    master: str
    ratio: float = 1.0
    offset: float = 0.0


@dataclass(frozen=True)
class Anchor:
    """An end of a tie: a place on a body, with axes, both in the body's frame."""

    body: str
    rotation: Rotation = IDENTITY
    translation: Vec3 = ZERO3


@dataclass(frozen=True)
class AnchoredTie:
    """A constraint between two bodies beside the tree, as the file has it; see `TreeTie` for its kinds."""

    name: str
    kind: TieKind
    first: Anchor
    second: Anchor
    length: Scalar = 0.0
    """Length in m, for the kind distance only."""


@dataclass(frozen=True)
class JointCoupling:
    """Coupling of joint positions by a sum: Σ c_0 + c_1 q + c_2 q² + … over its `terms` is 0.

    The first of its joints follows the others. An `equality` of MJCF may be let go with --free-mimic.
    """

    name: str
    terms: tuple[tuple[str, tuple[float, ...]], ...]
    equality: bool = False

    @property
    def rule(self) -> str:
        """Effect of the coupling on its first joint, in words."""
        others = [repr(joint) for joint, _ in self.terms[1:]]
        return f"coupled to {' and '.join(others)}" if others else "held"


@dataclass(frozen=True)
class Loop:
    """A constraint that is not modelled, on `pairs` of bodies; empty where it ties anything else.

    `what` names it in a sentence, `remedy` says how to do without it. A constraint `of_joints` vanishes when
    either body of its pair is cut away; any other still loads the body that is left.
    """

    what: str
    remedy: str
    pairs: tuple[tuple[str, str], ...] = ()
    of_joints: bool = False


@dataclass(frozen=True)
class CurvedAxis:
    """One axis of a `curved` joint: it moves by a curve of a coordinate.

    name: the axis's own name; for one axis of each coordinate it is the coordinate's name
    suffix: added to the child's name for the bodies between the joint's axes; direction: in the child's axes,
    with all axes of the joint at 0
    """

    name: str
    suffix: str
    kind: Literal["revolute", "prismatic"]
    direction: tuple[float, float, float]
    coordinate: str
    """Name of the coordinate; empty where the axis stands still."""
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
    """Pose in the world of a root that no joint holds: it falls, unless it is held there."""

    rotation: Rotation
    translation: Vec3


@dataclass(frozen=True)
class Connection:
    """A joint as the file has it, of any type: its pose in the parent's frame, its axis in its own frame.

    `snapped` says that entries of the rotation were rounded to −1, 0 or 1; only a joint of one axis has
    `passive` values and limits. A `curved` joint has `axes`, from the parent on, the `coordinates` that they
    follow, and `followers`, which are coordinates in the file only.
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

    With `only_named`, only its own parameters may be varied: its numbers define what it is, for example
    planar.
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
    """Joints whose motion determines that of all others under the constraints; empty: to be chosen."""
    ground: str = ""
    """Name of the body that is the world itself, where the file has one."""
    free: FreeRoot | None = None
    """Pose of a free root; None where the file holds the root, or its format does not say."""
    takes_impossible: bool = False
    """True if the format's own program takes moments of inertia that break the triangle inequality, and
    joints that lack inertia of their own, though not mass; then they are taken here, with a warning."""
    massless: tuple[str, ...] = ()
    """Joints that the reader made up, and which move no mass."""
    ordered: bool = False
    """True if Pinocchio has siblings in the file's order, false if in the order of their joints' names."""
