"""Joints of a robot and what its links carry, as a package's tree.py lists them, and bodies in their place.

A joint moves a frame whose z axis lies on the joint's axis. With q its coordinate, a revolute joint places
the frame at `translation` in the frame of its parent, turned by `rotation` Rz(ratio q); a prismatic one at
`translation` + `rotation` z ratio q. Where the joint has a curve d, d(q) replaces q.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Generic, Literal, NamedTuple, TypeVar

from ..interface import Numbers

Own = TypeVar("Own", bound=Numbers, covariant=True)
Triple = tuple[float, float, float]
Formula = Callable[[Any, Mapping[str, Numbers]], Numbers]
"""Function of the array namespace (numpy or torch) and the run-time parameters by name: a number's value."""


@dataclass(frozen=True)
class TreeCurve:
    """Function of q: polynomials in q - start, each from its start on, the first before it too."""

    starts: tuple[float, ...]
    """Start of each piece, ascending; the first two may be the same."""
    pieces: tuple[tuple[float, ...], ...]
    """Coefficients of each piece, of powers 0, 1, 2, ..., for rad or m."""


@dataclass(frozen=True)
class TreeJoint:
    """Joint and the frame that it moves; joints that follow one coordinate share it, as mimic joints do."""

    name: str
    link: str
    """Name of the link that it moves, which may have no mass."""
    parent: int | None
    """Index of the joint that carries it, None for the ground."""
    kind: Literal["revolute", "prismatic"]
    coordinate: int
    """Index of the coordinate in q."""
    ratio: float
    rotation: tuple[Triple, Triple, Triple]
    translation: Triple
    """Translation in m."""
    curve: TreeCurve | None = None
    """Curve d of the joint: it moves by d(q) in place of q."""


@dataclass(frozen=True)
class TreeLink:
    """Rigid body, in the axes of the frame that its joint moves."""

    joint: int
    """Index of the joint that moves it."""
    mass: float
    """Mass in kg."""
    com: Triple
    """Centre of mass in m."""
    inertia: tuple[Triple, Triple, Triple]
    """Inertia about the centre of mass, in kg m^2."""


@dataclass(frozen=True)
class TreeFrame:
    """Frame that has a name: a body of the file, also one without mass or merged away, or a site."""

    name: str
    joint: int | None
    """Index of the joint that moves it, None for the ground."""
    rotation: tuple[Triple, Triple, Triple]
    """Rotation from its axes to those of the frame that the joint moves, or of the world."""
    translation: Triple
    """Place of its origin in those axes, in m."""


@dataclass(frozen=True)
class TreeTie:
    """Two frames that are held together in addition to the tree, which closes a loop of joints.

    A qd = 0 has rows of J_first - J_second, with J the Jacobian of a frame, whose moment rows stand first.
    """

    name: str
    kind: Literal["point", "hinge", "frame", "distance"]
    """Kind of tie: what is held, and how many rows that has:

    point     the origins coincide: 3, along the world's axes
    hinge     the z axes coincide too: 5, two turns about x and y of the first frame, then those 3
    frame     all axes coincide too: 6, three turns about the world's axes, then those 3
    distance  the origins are `length` apart: 1
    """
    first: int
    """Index of the tree's frame; forces of the tie act on this one, with the opposite sign on the second."""
    second: int
    length: float = 0.0
    """Length of a distance in m, above 0; of no other kind."""


@dataclass(frozen=True)
class TreeCoupling:
    """Coordinates that depend on each other: the sum over the terms of c_0 + c_1 q + c_2 q^2 + ... is 0."""

    name: str
    terms: tuple[tuple[int, tuple[float, ...]], ...]
    """Index of each coordinate, with its c_0, c_1, ...; the sum is in the unit that these give it."""


@dataclass(frozen=True)
class JointTree:
    """Joints, parents first, links in the order of j, and gravity in m/s^2 in the axes of the base.

    The numbers are those of the run-time parameters' own values.
    """

    gravity: Triple
    joints: tuple[TreeJoint, ...]
    links: tuple[TreeLink, ...]
    frames: tuple[TreeFrame, ...] = ()
    ties: tuple[TreeTie, ...] = ()
    """Ties that close loops, which the joints leave open."""
    couplings: tuple[TreeCoupling, ...] = ()
    independent: tuple[int, ...] = ()
    """Coordinates that the others follow by the ties and couplings, in order; empty where none was chosen."""
    closed_position: tuple[float, ...] = ()
    """Position where ties and couplings hold, at the tree's own numbers; empty without any."""

    def link_name(self, j: int) -> str:
        """Return the name of link j."""
        return self.joints[self.links[j].joint].link

    @property
    def tied(self) -> bool:
        """True if there are ties or couplings beside the joints."""
        return bool(self.ties or self.couplings)

    def chain(self, joint: int | None) -> tuple[int, ...]:
        """Return the indices of the joints from the ground to `joint`, itself included."""
        chain: list[int] = []
        while joint is not None:
            chain.append(joint)
            joint = self.joints[joint].parent
        return tuple(reversed(chain))


@dataclass(frozen=True, kw_only=True)
class ParametricTree(JointTree):
    """Tree some of whose numbers depend on run-time parameters."""

    formulas: Mapping[str, Formula]
    """Formulas of these numbers, by their place, such as links[2].mass or joints[0].translation[1]."""


def formulas_of(tree: JointTree) -> Mapping[str, Formula]:
    """Return the formulas of a tree's numbers, by their place; none where no number has one."""
    return tree.formulas if isinstance(tree, ParametricTree) else {}


class Bodies(NamedTuple, Generic[Own]):
    """Masses, centres and inertias of the links, in the order of j; axes of samples may stand in front.

    Axes and origin are those of the link's own frame, z on the axis of its joint, as in tree.py.
    """

    masses: Own
    """Masses in kg, (N,)."""
    centres: Own
    """Centres of mass in m, (N, 3)."""
    inertias: Own
    """Inertias about the centres of mass in kg m^2, (N, 3, 3); the symmetric part of each counts."""
