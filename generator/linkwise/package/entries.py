"""Entries of a manifest beside its tree: joints, links and energies."""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

from linkwise_runtime.rule.joint_tree import TreeCurve

KernelKind = Literal["straight", "loops"]
"""Kernel of a package: closed forms in straight lines, or none, with C in loops over links and joints."""

PLACE = re.compile(
    r"gravity\[[0-2]\]"
    r"|(?P<list>joints|frames)\[(?P<at>\d+)\]\.translation\[[0-2]\]"
    r"|links\[(?P<link>\d+)\]\.(?:mass|com\[[0-2]\]|inertia\[[0-2]\]\[[0-2]\])"
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
class ConstraintEntry:
    """A constraint that a user wrote, as text that is zero: of q_k, or, not holonomic, linear in qd_k."""

    name: str
    expression: str
    holonomic: bool


@dataclass(frozen=True)
class EnergiesEntry:
    """Terms that a user wrote for all links; which of the parameters are time, empty for none, and inputs.

    independent: joints that all others follow by the constraints; closed_position: of all joints, where these
    hold; both are empty without constraints
    """

    links: tuple[EnergyEntry, ...]
    time: str
    inputs: tuple[str, ...]
    constraints: tuple[ConstraintEntry, ...]
    independent: tuple[int, ...]
    closed_position: tuple[float, ...]
