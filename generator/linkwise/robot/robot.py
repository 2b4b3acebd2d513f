"""A rigid-body robot: links moved by one-coordinate joints, checked once when it is built."""

import math
from collections import Counter
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import Any, Literal, TypeAlias

import sympy as sp
from linkwise_runtime.file_joints import FileJoint
from linkwise_runtime.rule.joint_tree import TreeTie
from linkwise_runtime.structure import PassiveJoint

from linkwise.errors import LinkwiseError
from linkwise.robot.coordinate_symbols import Acceleration, Position, Velocity
from linkwise.robot.curve import Curve
from linkwise.robot.display import description_table, link_table
from linkwise.robot.notes import Note

Scalar: TypeAlias = float | sp.Expr
"""A number, or a SymPy expression in named parameters."""

Vec3: TypeAlias = tuple[Scalar, Scalar, Scalar]
Mat3: TypeAlias = tuple[Vec3, Vec3, Vec3]
Rotation: TypeAlias = tuple[tuple[float, float, float], ...]


@dataclass(frozen=True)
class Coordinate:
    """A generalized coordinate: its name, and rad for an angle or m for a length.

    A `coupled` one turns no axis one to one; OpenSim's files then always have it in radians.
    """

    name: str
    unit: Literal["rad", "m"] = "rad"
    coupled: bool = False

    @property
    def q(self) -> sp.Symbol:
        """The coordinate as a SymPy symbol."""
        return Position(self.name, real=True)

    @property
    def qd(self) -> sp.Symbol:
        """Velocity of the coordinate as a SymPy symbol."""
        return Velocity(f"d({self.name})/dt", real=True)

    @property
    def qdd(self) -> sp.Symbol:
        """Acceleration of the coordinate as a SymPy symbol."""
        return Acceleration(f"d²({self.name})/dt²", real=True)


@dataclass(frozen=True)
class Follower:
    """A joint of the file that is no coordinate: a curve of one or, where `coordinate` is empty, a number."""

    name: str
    unit: Literal["rad", "m"]
    coordinate: str
    curve: Curve
    coupled: bool = False
    """See `Coordinate`."""


@dataclass(frozen=True)
class Joint:
    """One degree of freedom between a parent link's frame and a link's frame.

    The link's frame has its z axis on the joint's axis. With q the coordinate, a revolute joint places it
    at `translation`, turned by `rotation` · Rz(ratio·q); a prismatic one at `translation` + `rotation` z
    ratio·q. Where the joint follows a curve d, d(q) stands in place of q.
    """

    name: str
    kind: Literal["revolute", "prismatic"]
    coordinate: int
    """Index among the robot's coordinates; joints that follow one another share it."""
    rotation: Rotation
    """Rotation from the link's axes at q = 0 to the parent's axes."""
    translation: Vec3
    """Position of the link's origin, in m, in the parent's axes."""
    ratio: float = 1.0
    curve: Curve | None = None


@dataclass(frozen=True)
class Passive:
    """Passive properties of a joint of one axis, q being its position in rad or m.

    To move it takes stiffness (q − rest) + damping q̇ + friction sign(q̇) + armature q̈, beside its links'
    share.
    """

    stiffness: float = 0.0
    """Stiffness of a spring, in N·m/rad or N/m."""
    rest: float = 0.0
    damping: float = 0.0
    """Viscous damping, in N·m·s/rad or N·s/m."""
    friction: float = 0.0
    """Coulomb friction, in N·m or N."""
    armature: float = 0.0
    """Inertia of what turns behind a gear, as seen by the joint, in kg·m² or kg."""


NOTHING = Passive()


@dataclass(frozen=True)
class Limits:
    """Limits of a joint of one axis, as its file has them: infinite where it gives none.

    Nothing here enforces them; they are there for whoever drives the joint.
    """

    lower: float = -math.inf
    """Lower limit of the position, in rad or m."""
    upper: float = math.inf
    velocity: float = math.inf
    """Limit of the speed in either direction, in rad/s or m/s."""
    effort: float = math.inf
    """Limit of the torque or force in either direction, in N·m or N."""


UNLIMITED = Limits()
LIMITS = tuple(asdict(UNLIMITED))
"""Names of the kinds of limits."""


@dataclass(frozen=True)
class Link:
    """A rigid body in its own frame: mass in kg, centre of mass in m, inertia about it in kg·m²."""

    name: str
    parent: int | None
    """Index among the robot's links; None for the ground."""
    joint: Joint
    mass: Scalar
    com: Vec3
    inertia: Mat3

    def _repr_html_(self) -> str:
        """Return the HTML that a notebook shows: the link's mass, centre of mass, inertia and joint."""
        return link_table(self)

    @property
    def massless(self) -> bool:
        """True if the link carries neither mass nor inertia, and so has no Lagrangian."""
        return self.mass == 0 and all(entry == 0 for row in self.inertia for entry in row)


@dataclass(frozen=True)
class Frame:
    """A named frame that a link carries: a body of the file, also one that was merged away, or a site.

    A point x in the frame is at `rotation` x + `translation` in the link's frame.
    """

    name: str
    link: int | None
    """Index among the robot's links; None for the ground, whose frame is the world's."""
    rotation: Rotation
    translation: Vec3
    """Position of the origin in the link's frame, in m."""


TieKind = Literal["point", "hinge", "frame", "distance"]


@dataclass(frozen=True)
class Coupling:
    """A constraint on coordinates: Σ c_0 + c_1 q_k + c_2 q_k² + … over its terms (k, (c_0, c_1, …)) is 0."""

    name: str
    terms: tuple[tuple[int, tuple[float, ...]], ...]
    follower: int | None = None
    """Coordinate that the others determine in every state: the file's first, where its term is c_1 q."""


@dataclass(frozen=True)
class Parameter:
    """A number that stays an argument: its value in the file, unit (empty: the file's own) and meaning."""

    name: str
    value: float
    unit: str = ""
    meaning: str = ""


@dataclass(frozen=True)
class Robot:
    """A tree of links, parents before children, moved by `coordinates`; gravity in m/s².

    `request` records the source that it was read from and the options, as manifests keep them. `frames` are
    those of the file, one for each link among them, or none.

    `ties` and `couplings` hold beside the tree. Under them the `independent` coordinates, in ascending order,
    determine all others, and `closed_position` is one in which they hold; before these are found,
    `requested_independent` are the names asked for as independent, and `driven` the coordinates that
    actuators drive.
    """

    name: str
    coordinates: tuple[Coordinate, ...]
    links: tuple[Link, ...]
    gravity: Vec3 = (0.0, 0.0, -9.81)
    parameters: tuple[Parameter, ...] = ()
    notes: tuple[Note, ...] = field(default=(), compare=False)
    request: Mapping[str, Any] = field(default_factory=dict, compare=False)
    frames: tuple[Frame, ...] = ()
    passive: tuple[PassiveJoint, ...] = ()
    ties: tuple[TreeTie, ...] = ()
    couplings: tuple[Coupling, ...] = ()
    requested_independent: tuple[str, ...] = ()
    driven: tuple[int, ...] = ()
    independent: tuple[int, ...] = ()
    closed_position: tuple[float, ...] = ()
    limits: tuple[Limits, ...] = ()
    """Limits of each coordinate, or empty; limits of joints that follow another do not limit that one."""
    followers: tuple[Follower, ...] = ()
    file_joints: tuple[FileJoint, ...] = ()

    def __post_init__(self) -> None:
        if not self.coordinates:
            raise LinkwiseError("no joint moves; free at least one")
        for index, link in enumerate(self.links):
            if link.parent is not None and not 0 <= link.parent < index:
                raise LinkwiseError(f"link {link.name!r} must follow its parent")
        for what, names in (
            ("joint", [c.name for c in self.coordinates]),
            ("link", [link.name for link in self.links]),
            ("frame", [frame.name for frame in self.frames]),
            ("constraint", [*(tie.name for tie in self.ties), *(c.name for c in self.couplings)]),
        ):
            for name, count in Counter(names).items():
                if not name.strip():
                    raise LinkwiseError(f"a {what} has an empty name; name it")
                if count > 1:
                    raise LinkwiseError(f"two {what}s are named {name!r}; rename one")

    def _repr_html_(self) -> str:
        """Return the HTML that a notebook shows: joints with unit and limits, links with mass and parent."""
        return description_table(self)

    @property
    def allow_unphysical(self) -> bool:
        """True if the robot's parameters may take values that no body has."""
        return bool(self.request.get("allow_unphysical"))

    @property
    def joint_limits(self) -> tuple[Limits, ...]:
        """Limits of each coordinate; unlimited for a robot that was given none."""
        return self.limits or (UNLIMITED,) * len(self.coordinates)

    @property
    def named_frames(self) -> tuple[Frame, ...]:
        """Frames of the robot; the frames of its links for a robot that was given none."""
        upright = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
        own = (Frame(link.name, at, upright, (0.0, 0.0, 0.0)) for at, link in enumerate(self.links))
        return self.frames or tuple(own)

    def chain(self, link: int) -> tuple[int, ...]:
        """Return the indices of the links from the root to `link`, itself included."""
        chain: list[int] = []
        at: int | None = link
        while at is not None:
            chain.append(at)
            at = self.links[at].parent
        return tuple(reversed(chain))


LARGEST = 1e12
"""Largest number of a description, in SI units: the product of three still fits single precision."""


def unusable(*values: Scalar) -> str:
    """Return the fault of numbers that no robot has, in words, or an empty string; expressions pass."""
    numbers = [value for value in values if isinstance(value, (int, float))]
    if not all(map(math.isfinite, numbers)):
        return "NaN or infinity"
    return f"a number beyond {LARGEST:g}" if any(abs(number) > LARGEST for number in numbers) else ""
