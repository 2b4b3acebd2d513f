"""Joints of an SDFormat model: those of the tree, and those that close loops and become constraints."""

from collections.abc import Iterable, Iterator
from dataclasses import asdict, dataclass
from xml.etree.ElementTree import Element

from linkwise.errors import LinkwiseError
from linkwise.robot import transforms
from linkwise.robot.description import IDENTITY, Anchor, AnchoredTie, Connection, Mimic
from linkwise.robot.joint_types import SINGLE
from linkwise.robot.notes import Omission
from linkwise.robot.readers.sdf.poses import (
    MODEL,
    WORLD,
    ModelPoses,
    Pose,
    is_true,
    numbers_in,
    numbers_of,
    place_of,
    text_of,
)
from linkwise.robot.robot import NOTHING, UNLIMITED, Limits, Passive, Rotation, Scalar, TieKind

TIES: dict[str, TieKind] = {"ball": "point", "revolute": "hinge", "continuous": "hinge", "fixed": "frame"}
"""Constraint that replaces a joint that is cut, by the joint's type."""
DYNAMICS = {
    "stiffness": "spring_stiffness",
    "rest": "spring_reference",
    "damping": "damping",
    "friction": "friction",
}
IN_MODEL = "use_parent_model_frame"
"""Switch, before version 1.7, for an axis given in the model's axes."""
ENDLESS = 1e16
"""Number by which SDFormat means no limit."""


@dataclass(frozen=True)
class SdfJoint:
    """A joint, with its own pose, the poses of its two links and its axis, all in the model at q = 0."""

    element: Element
    parent: str
    child: str
    of_parent: Pose
    of_child: Pose
    here: Pose
    axis: tuple[float, float, float]

    @property
    def name(self) -> str:
        """Name of the joint."""
        return self.element.get("name", "")

    @property
    def type(self) -> str:
        """Type of the joint in the file."""
        return self.element.get("type", "")

    @property
    def in_parent(self) -> Pose:
        """Pose of the joint in the parent link."""
        return self.of_parent.inverse().times(self.here)

    @property
    def in_child(self) -> Pose:
        """Pose of the joint in the child link."""
        return self.of_child.inverse().times(self.here)

    def connection(self) -> Connection:
        """Return the joint as one of the tree."""
        return Connection(
            self.name,
            self.type,
            self.parent,
            self.child,
            self.of_parent.inverse().times(self.of_child).rotation,
            self.in_parent.translation,
            _numbers(transforms.rotate(transforms.transpose(self.of_child.rotation), self.axis)),
            self._mimic(),
            passive=Passive(**self._dynamics()) if self.type in SINGLE else NOTHING,
            limits=self._limits() if self.type in SINGLE else UNLIMITED,
        )

    def tie(self) -> AnchoredTie:
        """Return the joint as a constraint; raises LinkwiseError for one that no constraint can replace."""
        if self.type not in TIES or self.element.find("axis/mimic") is not None:
            what = "mimics another" if self.type in TIES else f"is {self.type}"
            raise LinkwiseError(
                f"joint {self.name!r} closes a loop and {what}; such a joint may be {', '.join(TIES)},"
                " and follow none"
            )
        kind, links = TIES[self.type], (self.of_parent, self.of_child)
        first, second = (
            Anchor(body, self._axes_in(link, kind), inside.translation)
            for body, link, inside in zip(
                (self.parent, self.child), links, (self.in_parent, self.in_child), strict=True
            )
        )
        return AnchoredTie(self.name, kind, first, second)

    def losses(self, closes: bool) -> Iterator[Omission]:
        """Yield the passive properties of the joint that the torques leave out.

        These are all of them if the joint closes a loop or is not of one axis; else there are none.
        """
        if not closes and self.type in SINGLE:
            return
        why = "on a joint that closes a loop" if closes else f"on {self.type}"
        for what, number in self._dynamics().items():
            if number and what != "rest":
                yield Omission(what, self.name, f"{number!r} {why}", bodies=(self.parent, self.child))

    def _axes_in(self, link: Pose, kind: TieKind) -> Rotation:
        """Return the axes that a tie of this kind holds together, in those of a link: z is a hinge's."""
        back = transforms.transpose(link.rotation)
        if kind == "point":
            return IDENTITY
        if kind == "frame":
            return transforms.compose(back, self.here.rotation)
        axis = transforms.unit(self.axis)
        if axis is None:
            raise LinkwiseError(f"joint {self.name!r} has a zero axis; give its direction, such as 0 0 1")
        return transforms.compose(back, transforms.align_z(axis))

    def _dynamics(self) -> dict[str, float]:
        place = place_of(self.element)
        return {
            what: numbers_in(self.element, f"axis/dynamics/{tag}", 0.0, place)
            for what, tag in DYNAMICS.items()
        }

    def _limits(self) -> Limits:
        """Return the limits; numbers of 1e16 and beyond, and efforts and velocities below 0, mean none."""
        place = place_of(self.element)
        lower, upper, velocity, effort = (
            numbers_in(self.element, f"axis/limit/{what}", usual, place)
            for what, usual in asdict(UNLIMITED).items()
        )
        return Limits(
            lower if self.type != "continuous" and lower > -ENDLESS else UNLIMITED.lower,
            upper if self.type != "continuous" and upper < ENDLESS else UNLIMITED.upper,
            velocity if 0 <= velocity < ENDLESS else UNLIMITED.velocity,
            effort if 0 <= effort < ENDLESS else UNLIMITED.effort,
        )

    def _mimic(self) -> Mimic | None:
        """Return the mimic rule, None for none; SDFormat's is multiplier (q - reference) + offset."""
        mimic, place = self.element.find("axis/mimic"), place_of(self.element)
        if mimic is None:
            return None
        ratio = numbers_in(mimic, "multiplier", 1.0, place)
        offset = numbers_in(mimic, "offset", 0.0, place) - ratio * numbers_in(mimic, "reference", 0.0, place)
        return Mimic(mimic.get("joint", ""), ratio, offset)


def sdf_joints(
    elements: Iterable[Element], poses: ModelPoses, version: tuple[int, int]
) -> tuple[list[SdfJoint], list[SdfJoint]]:
    """Return the joints of the tree, and those that close loops, in the file's order.

    Among several joints with one child, the first that is not a ball carries it. Raises LinkwiseError for one
    without a parent or a child.
    """
    joints = [_joint(element, poses, version) for element in elements]
    carrying: dict[str, SdfJoint] = {}
    for joint in sorted(joints, key=lambda joint: joint.type == "ball"):
        carrying.setdefault(joint.child, joint)
    tree = [joint for joint in joints if carrying[joint.child] is joint]
    return tree, [joint for joint in joints if carrying[joint.child] is not joint]


def _joint(element: Element, poses: ModelPoses, version: tuple[int, int]) -> SdfJoint:
    place = place_of(element)
    ends = text_of(element, "parent"), text_of(element, "child")
    for role, name in zip(("parent", "child"), ends, strict=True):
        if not name:
            raise LinkwiseError(f"{place} has no <{role}>; name the link")
    if element.find("axis2") is not None:
        raise LinkwiseError(f"{place} has two axes; write it as two joints with a link between them")
    parent, child = (poses.link_of(name, place) for name in ends)
    if child == WORLD:
        raise LinkwiseError(f"{place} has the world for its child; make the world its parent")
    of_parent, of_child = (poses.named(name, place) for name in (parent, child))
    here = poses.of(element)
    axis = _axis(element, here.rotation, poses, version)
    return SdfJoint(element, parent, child, of_parent, of_child, here, axis)


def _axis(
    element: Element, own: Rotation, poses: ModelPoses, version: tuple[int, int]
) -> tuple[float, float, float]:
    """Return the axis of a joint in the model's axes; z without <xyz>.

    It is given in the joint's own axes, or as its version has it. Raises LinkwiseError for another version's
    way to name the frame.
    """
    axis, place = element.find("axis/xyz"), place_of(element)
    numbers = (0.0, 0.0, 1.0) if axis is None else numbers_of(axis, 3, place)
    seen_in = "" if axis is None else axis.get("expressed_in", "")
    in_model = is_true(text_of(element, f"axis/{IN_MODEL}"), f"<{IN_MODEL}>", place)
    if in_model and version >= (1, 7):
        raise LinkwiseError(
            f'{place}: <{IN_MODEL}> is no more from version 1.7 on; write <xyz expressed_in="{MODEL}">'
        )
    if seen_in and version < (1, 7):
        raise LinkwiseError(
            f"{place}: <xyz expressed_in={seen_in!r}> is not read in a file older than version 1.7; "
            "raise its version, or write the axis without it"
        )
    if version < (1, 5) or in_model:
        return _numbers(numbers)
    return _numbers(transforms.rotate(poses.named(seen_in, place).rotation if seen_in else own, numbers))


def _numbers(vector: Iterable[Scalar]) -> tuple[float, float, float]:
    x, y, z = map(float, vector)
    return x, y, z
