"""The joints, links, rigid bodies and energies of a manifest."""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

from linkwise_runtime.rule.joint_tree import TreeCoupling, TreeCurve, TreeFrame, TreeTie
from linkwise_runtime.structure import PassiveJoint

Row = tuple[float, float, float]

KernelKind = Literal["straight", "loops"]
"""Kernel of a package: closed forms in straight lines, or none, with C in loops over links and joints."""

PLACE = re.compile(
    r"(?:gravity|bodies\[(?P<body>\d+)\]\.(?:translation|com))\[[0-2]\]"
    r"|frames\[(?P<frame>\d+)\]\.translation\[[0-2]\]"
    r"|bodies\[(?P<whole>\d+)\]\.(?:mass|inertia\[[0-2]\]\[[0-2]\])"
)
"""Places of the numbers of a tree that may depend on parameters."""


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
class RuntimeEntry:
    """The version of linkwise_runtime that a package was made for, and whether it carries a copy."""

    version: str
    vendored: bool


@dataclass(frozen=True)
class CodeSize:
    """Bytes of code and constants of a package's C on a microcontroller, in double and float: an estimate."""

    float64: int
    float32: int


@dataclass(frozen=True)
class FollowerEntry:
    """A joint of the robot's file that is none here: it follows one, by index, on a curve, or is constant.

    Positions are in rad or m, as its unit says.
    """

    name: str
    unit: Literal["rad", "m"]
    joint: int | None
    curve: TreeCurve


@dataclass(frozen=True)
class FileJointEntry:
    """A moving joint of the robot's file, its joints here by their indices, and its place in Pinocchio.

    kind: as `FileJoint` in linkwise_runtime.file_joints has it
    """

    name: str
    kind: Literal["single", "continuous", "planar", "ball", "floating"]
    joints: tuple[int, ...]
    pinocchio: int


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
    curve: TreeCurve | None = None


@dataclass(frozen=True)
class RigidTree:
    """The rigid bodies, parents before children, the frames, and gravity in m/s² in the base's axes.

    passive: passive properties of the joints that have any

    ties, couplings: constraints beside the tree; independent: the joints whose motion then gives that of all
    others, by their indices in ascending order; closed_position: of all joints, in rad and m, one in which
    all constraints hold; the latter two are empty without constraints

    formulas: by its place, such as bodies[2].com[0], each number that depends on run-time parameters, as text
    in their symbols; the numbers themselves are those of the parameters' own values
    """

    gravity: Row
    bodies: tuple[BodyEntry, ...]
    frames: tuple[TreeFrame, ...]
    passive: tuple[PassiveJoint, ...]
    ties: tuple[TreeTie, ...]
    couplings: tuple[TreeCoupling, ...]
    independent: tuple[int, ...]
    closed_position: tuple[float, ...]
    formulas: Mapping[str, str]

    @property
    def tied(self) -> bool:
        """True if there are ties or couplings beside the joints."""
        return bool(self.ties or self.couplings)


@dataclass(frozen=True)
class ShareEntry:
    """Terms of a share with a name, as text, "0" for none; see `linkwise.symbolic.system.Share`.

    forces: by the names of joints
    """

    name: str
    potential: str
    motion: str
    dissipation: str
    forces: Mapping[str, str]


@dataclass(frozen=True)
class EnergyEntry:
    """Terms that a user wrote for a link: text in q_k and qd_k, k from 1, and parameters' symbols.

    degree: of the kinetic energy in the velocities
    """

    link: str
    kinetic: str
    degree: int
    shares: tuple[ShareEntry, ...]


@dataclass(frozen=True)
class EnergiesEntry:
    """Terms that a user wrote for all links; which of the parameters are time, empty for none, and inputs."""

    links: tuple[EnergyEntry, ...]
    time: str
    inputs: tuple[str, ...]
