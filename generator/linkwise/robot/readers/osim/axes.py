"""Axes of an OpenSim joint, in its frame on the parent: the coordinate and the function that move each.

Translations come first, along axes of that frame, then rotations, each axis turned by those before it; a
UniversalJoint, for example, turns about x and y.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal
from xml.etree.ElementTree import Element

from linkwise.errors import LinkwiseError
from linkwise.escape import listed
from linkwise.robot import transforms
from linkwise.robot.curve import Curve
from linkwise.robot.joint_types import X, Y, Z
from linkwise.robot.readers.osim.constraints import Rule
from linkwise.robot.readers.osim.document import name_of, numbers_of, text_of
from linkwise.robot.readers.osim.functions import IDENTITY, LINEAR, function_of, written_function

Kind = Literal["revolute", "prismatic"]
Part = tuple[Kind, tuple[float, float, float], int]
"""An axis: its kind, direction, and the index of the joint's coordinate that moves it."""

TURNING: tuple[Part, ...] = (("revolute", X, 0), ("revolute", Y, 1), ("revolute", Z, 2))
TYPES: dict[str, tuple[Part, ...]] = {
    "WeldJoint": (),
    "PinJoint": (("revolute", Z, 0),),
    "SliderJoint": (("prismatic", X, 0),),
    "UniversalJoint": TURNING[:2],
    "GimbalJoint": TURNING,
    "BallJoint": TURNING,
    "FreeJoint": (("prismatic", X, 3), ("prismatic", Y, 4), ("prismatic", Z, 5), *TURNING),
    "PlanarJoint": (("prismatic", X, 1), ("prismatic", Y, 2), ("revolute", Z, 0)),
}
CUSTOM = "CustomJoint"
KINDS: tuple[tuple[Kind, str], ...] = (("prismatic", "translation"), ("revolute", "rotation"))
"""Kinds of axes of a SpatialTransform; translations come first, though in the file they stand last."""


@dataclass(frozen=True)
class MovedAxis:
    """An axis, in the joint's frame, and the function of one of the joint's coordinates by which it moves."""

    kind: Kind
    direction: tuple[float, float, float]
    coordinate: str = ""
    curve: Curve = IDENTITY
    written: str = LINEAR
    """Name of the function in the file."""

    @property
    def one_to_one(self) -> bool:
        """True if OpenSim takes it to move as far as its coordinate: there or back, by a LinearFunction."""
        line = self.curve.line if self.written == LINEAR else None
        return line is not None and abs(line[1]) == 1.0

    @property
    def in_radians(self) -> bool:
        """True if OpenSim's files have its coordinate in radians even where others are in degrees."""
        return self.kind == "revolute" and not self.one_to_one

    def rule(self, rules: Mapping[str, Rule]) -> Rule:
        """Return the rule by which the axis moves with a free coordinate."""
        if not self.coordinate:
            return Rule("", self.curve)
        return rules[self.coordinate].of(self.curve)


def carrier(axes: Sequence[MovedAxis], coordinate: str) -> int | None:
    """Return the index of the axis that stands for a coordinate: moved one to one, or by a line, if any.

    Among axes moved one to one, OpenSim takes one that slides; among others, one that turns is taken here.
    None if the coordinate moves no axis.
    """

    def remoteness(at: int) -> tuple[bool, bool, bool, bool]:
        axis, curve = axes[at], axes[at].curve
        turns = axis.kind == "revolute"
        return not axis.one_to_one, curve.line is None, turns == axis.one_to_one, curve != IDENTITY

    own = (at for at, axis in enumerate(axes) if axis.coordinate == coordinate)
    return min(own, key=remoteness, default=None)


def axes_of(joint: Element, coordinates: Sequence[str]) -> Iterator[MovedAxis]:
    """Yield the axes of a joint with coordinates of these names; raises LinkwiseError for unmodelled ones."""
    place = f"joint {name_of(joint)!r}"
    if joint.tag == CUSTOM:
        yield from _custom(joint, coordinates, place)
        return
    parts = TYPES.get(joint.tag)
    if parts is None:
        raise LinkwiseError(
            f"{place} is of type {joint.tag}, which is not modelled; make it one of "
            f"{listed([CUSTOM, *TYPES])}"
        )
    if len(coordinates) != len(parts):
        raise LinkwiseError(
            f"{place} is a {joint.tag} with {len(coordinates)} coordinates; give it {len(parts)}"
        )
    for kind, direction, number in parts:
        yield MovedAxis(kind, direction, coordinates[number])


def _custom(joint: Element, coordinates: Sequence[str], place: str) -> Iterator[MovedAxis]:
    transform = joint.find("SpatialTransform")
    given = {name_of(axis): axis for axis in (transform if transform is not None else ())}
    for kind, word in KINDS:
        for number, usual in enumerate((X, Y, Z), 1):
            name = f"{word}{number}"
            if name in given:
                yield from _axis(given[name], kind, usual, coordinates, f"{place}, {name}")


def _axis(
    axis: Element, kind: Kind, usual: tuple[float, float, float], coordinates: Sequence[str], place: str
) -> Iterator[MovedAxis]:
    """Yield the axis, or nothing where it stands still at 0."""
    coordinate, curve = _displacement(axis, coordinates, place)
    if not coordinate and curve(0.0) == 0.0:
        return
    direction = transforms.unit(numbers_of(axis, "axis", " ".join(map(str, usual)), place, 3))
    if direction is None:
        raise LinkwiseError(f"{place} has a zero axis; give its direction, such as 0 0 1")
    written = written_function(axis, "function")
    yield MovedAxis(kind, direction, coordinate, curve, "" if written is None else written.tag)


def _displacement(axis: Element, coordinates: Sequence[str], place: str) -> tuple[str, Curve]:
    """Return the coordinate of an axis, empty where it stands still, and the axis's function of it."""
    names = text_of(axis, "coordinates").split()
    if len(names) > 1:
        raise LinkwiseError(
            f"{place} is a function of {len(names)} coordinates; only functions of one are modelled"
        )
    if names and names[0] not in coordinates:
        raise LinkwiseError(
            f"{place} names {names[0]!r}, which is not a coordinate of the joint; it has "
            f"{listed(coordinates)}"
        )
    curve = function_of(axis, "function", place) or Curve.straight(0.0)
    if not names or (curve.line is not None and curve.line[1] == 0.0):
        return "", Curve.straight(curve(0.0))
    return names[0], curve
