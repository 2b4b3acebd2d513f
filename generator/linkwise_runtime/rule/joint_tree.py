"""A robot's joints and what its links carry, as a package's tree.py lists them, and bodies in their place.

A joint moves a frame whose z axis lies on the joint's axis. With q its coordinate, a revolute joint places
the frame at `translation` in the frame of its parent, turned by `rotation` Rz(ratio q); a prismatic one at
`translation` + `rotation` z ratio q. Where the joint has a curve d, d(q) stands in place of q.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Generic, NamedTuple, TypeVar

from ..interface import Numbers

Own = TypeVar("Own", bound=Numbers, covariant=True)
Triple = tuple[float, float, float]
Formula = Callable[[Any, Mapping[str, Numbers]], Numbers]
"""A number's value, from the array namespace (numpy or torch) and the run-time parameters by name."""


class TreeCurve(NamedTuple):
    """A function of q: polynomials in q - start, each from its start on, the first before it too."""

    starts: tuple[float, ...]
    """Ascending; the first two may be the same."""
    pieces: tuple[tuple[float, ...], ...]
    """Coefficients of powers 0, 1, 2, ... for rad or m."""


class TreeJoint(NamedTuple):
    """A joint and the frame that it moves; joints that follow one coordinate share it, as mimic joints do."""

    parent: int | None
    """Index of the joint that carries it, None for the ground."""
    kind: str
    """revolute or prismatic."""
    coordinate: int
    """Index of q."""
    ratio: float
    rotation: tuple[Triple, Triple, Triple]
    translation: Triple
    """In m."""
    curve: TreeCurve | None = None
    """What the joint moves by, in place of q."""


class TreeLink(NamedTuple):
    """A rigid body, in the axes of the frame that its joint moves."""

    name: str
    joint: int
    """Index of the joint that moves it."""
    mass: float
    """In kg."""
    centre: Triple
    """Centre of mass in m."""
    inertia: tuple[Triple, Triple, Triple]
    """About the centre of mass, in kg m^2."""


class TreeFrame(NamedTuple):
    """A frame that has a name: a body of the file, also one without mass or merged away, or a site."""

    name: str
    joint: int | None
    """Index of the joint that moves it, None for the ground."""
    rotation: tuple[Triple, Triple, Triple]
    """From its axes to those of the frame that the joint moves, or of the world."""
    translation: Triple
    """Of its origin there, in m."""


class TreeTie(NamedTuple):
    """Two frames that are held together beside the tree, which closes a loop of joints.

    A qd = 0 with rows of J_first - J_second, J the Jacobian of a frame, whose moment rows stand first.
    """

    name: str
    kind: str
    """What is held, and how many rows that has:

    point     the origins coincide: 3, along the world's axes
    hinge     the z axes coincide too: 5, two turns about x and y of the first frame, then those 3
    frame     all axes coincide too: 6, three turns about the world's axes, then those 3
    distance  the origins are `length` apart: 1
    """
    first: int
    """Index of the tree's frame; forces of the tie are those on this one, and minus those on the second."""
    second: int
    length: float = 0.0
    """In m, above 0; of a distance only."""


class TreeCoupling(NamedTuple):
    """Coordinates that hang on each other: the sum over the terms of c_0 + c_1 q + c_2 q^2 + ... is 0."""

    name: str
    terms: tuple[tuple[int, tuple[float, ...]], ...]
    """Of each coordinate, by its index, c_0, c_1, ...; the sum is in the unit that these give it."""


@dataclass(frozen=True)
class JointTree:
    """Joints, parents first, links in the order of j, and gravity in m/s^2 in the axes of the base.

    The numbers are those of the parameters' own values; those that hang on parameters have formulas, by their
    place, such as links[2].mass or joints[0].translation[1].
    """

    gravity: Triple
    joints: tuple[TreeJoint, ...]
    links: tuple[TreeLink, ...]
    frames: tuple[TreeFrame, ...] = ()
    formulas: Mapping[str, Formula] = field(default_factory=dict)
    ties: tuple[TreeTie, ...] = ()
    """What closes loops, which the joints leave open."""
    couplings: tuple[TreeCoupling, ...] = ()
    independent: tuple[int, ...] = ()
    """Coordinates that the others follow by the ties and couplings, in order; none where none was chosen."""
    closed_position: tuple[float, ...] = ()
    """All coordinates where ties and couplings hold, at the tree's own numbers; none where nothing does."""

    @property
    def tied(self) -> bool:
        """Whether anything holds beside the joints."""
        return bool(self.ties or self.couplings)

    def chain(self, joint: int | None) -> tuple[int, ...]:
        """Indices of the joints from the ground to `joint`, itself included."""
        chain: list[int] = []
        while joint is not None:
            chain.append(joint)
            joint = self.joints[joint].parent
        return tuple(reversed(chain))


class Bodies(NamedTuple, Generic[Own]):
    """What the links carry, in the order of j; an axis of samples may stand before each shape.

    Axes and origin are those of the link's own frame, z on the axis of its joint, as tree.py has them.
    """

    masses: Own
    """In kg, (N,)."""
    centres: Own
    """Centres of mass in m, (N, 3)."""
    inertias: Own
    """About the centres of mass in kg m^2, (N, 3, 3); of each the symmetric part counts."""
