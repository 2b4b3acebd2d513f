"""Joints of an OpenSim model as chains of axes that follow coordinates, whose axes may be functions of these.

A joint stands in two frames, one on each body. From that on the parent lead first what slides, along axes of
that frame, then what turns, each axis turned by those before it; a UniversalJoint, say, turns about x and y.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal
from xml.etree.ElementTree import Element

from linkwise.errors import LinkwiseError
from linkwise.escape import listed
from linkwise.robot import transforms
from linkwise.robot.curve import Curve
from linkwise.robot.description import Connection, CurvedAxis, CurvedCoordinate
from linkwise.robot.joint_types import X, Y, Z
from linkwise.robot.notes import Note
from linkwise.robot.readers.osim_coordinates import Rule, limits_of
from linkwise.robot.readers.osim_elements import name_of, numbers_of, text_of
from linkwise.robot.readers.osim_frames import GROUND, Placed
from linkwise.robot.readers.osim_functions import IDENTITY, constant, function_of

Kind = Literal["revolute", "prismatic"]
Part = tuple[Kind, tuple[float, float, float], int]
"""An axis, and which of the joint's coordinates moves it."""

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
IN_RADIANS = "in radians in OpenSim's files, also where these are in degrees: it turns no axis one to one"
SUFFIXES = {"prismatic": "t", "revolute": "r"}
UNITS: dict[Kind, Literal["rad", "m"]] = {"prismatic": "m", "revolute": "rad"}


@dataclass(frozen=True)
class _Moved:
    """An axis, in the joint's frame, and the function of one of the joint's coordinates by which it moves."""

    kind: Kind
    direction: tuple[float, float, float]
    coordinate: str = ""
    curve: Curve = IDENTITY

    @property
    def one_to_one(self) -> bool:
        """Whether it moves as far as its coordinate, there or back."""
        return self.curve.line is not None and abs(self.curve.line[1]) == 1.0

    def rule(self, rules: Mapping[str, Rule]) -> Rule:
        """How it moves by what is free."""
        if not self.coordinate:
            return Rule("", self.curve)
        return rules[self.coordinate].of(self.curve)


def _carrier(axes: Sequence[_Moved], coordinate: str) -> int | None:
    """Index of the axis that stands for a coordinate: what it moves one to one, or by a line, if any."""

    def remoteness(at: int) -> tuple[bool, bool, bool, bool]:
        axis, curve = axes[at], axes[at].curve
        return not axis.one_to_one, curve.line is None, axis.kind != "revolute", curve != IDENTITY

    own = (at for at, axis in enumerate(axes) if axis.coordinate == coordinate)
    return min(own, key=remoteness, default=None)


def from_ground(joints: Iterable["OsimJoint"]) -> tuple["OsimJoint", ...]:
    """The joints as they lead away from ground, some of them turned; raises LinkwiseError for a loop."""
    found: list[OsimJoint] = []
    reached, waiting = {GROUND}, list(joints)
    while waiting:
        ahead = [joint for joint in waiting if joint.parent.body in reached]
        behind = [joint.turned for joint in waiting if joint.child.body in reached]
        (joint,) = (*ahead, *behind)[:1] or (None,)
        if joint is None:
            raise LinkwiseError(
                f"no joints lead from ground to {waiting[0].parent.body!r}, on which joint "
                f"{waiting[0].name!r} stands; give it one, a FreeJoint say"
            )
        if joint.child.body in reached:
            raise LinkwiseError(
                f"joint {joint.name!r} leads to {joint.child.body!r}, to which another one leads; have a "
                "PointConstraint or a WeldConstraint close the loop in its place"
            )
        waiting = [other for other in waiting if other.element is not joint.element]
        reached.add(joint.child.body)
        found.append(joint)
    return tuple(found)


@dataclass(frozen=True)
class OsimJoint:
    """A joint, its frames on both bodies, and its coordinates' elements.

    Where it is `reversed`, its coordinates say where the parent is from the child on.
    """

    element: Element
    parent: Placed
    child: Placed
    coordinates: tuple[Element, ...]
    reversed: bool = False

    @property
    def name(self) -> str:
        """Its name."""
        return name_of(self.element)

    def connection(self, rules: Mapping[str, Rule]) -> Connection:
        """The joint, with what its coordinates are."""
        turn = transforms.transpose(self.child.rotation)
        axes = tuple(self._axes())
        carriers = {name: _carrier(axes, name) for name in map(name_of, self.coordinates)}
        free = [c for c in self.coordinates if rules[name_of(c)].free == name_of(c)]
        for name in map(name_of, free):
            if carriers[name] is None:
                raise LinkwiseError(f"coordinate {name!r} moves no axis of its joint {self.name!r}; lock it")
        names = {at: name for name, at in carriers.items() if rules[name].free}
        return Connection(
            self.name,
            "curved" if axes else "fixed",
            self.parent.body,
            self.child.body,
            transforms.compose(self.parent.rotation, turn),
            self.parent.translation,
            axes=tuple(
                CurvedAxis(
                    names.get(at, f"{self.name}_{SUFFIXES[axis.kind]}{at + 1}"),
                    f"{SUFFIXES[axis.kind]}{at + 1}",
                    axis.kind,
                    transforms.rotate(self.child.rotation, axis.direction),
                    rule.free,
                    rule.curve,
                )
                for at, axis in enumerate(axes)
                for rule in (axis.rule(rules),)
            ),
            coordinates=tuple(
                CurvedCoordinate(name_of(c), UNITS[axes[at].kind], limits_of(c))
                for c in free
                if (at := carriers[name_of(c)]) is not None
            ),
        )

    def notes(self, rules: Mapping[str, Rule]) -> Iterator[Note]:
        """Say which free coordinates OpenSim calls coupled, and keeps in radians."""
        axes = tuple(self._axes())
        for name in map(name_of, self.coordinates):
            at = _carrier(axes, name) if rules[name].free == name else None
            if at is not None and axes[at].kind == "revolute" and not axes[at].one_to_one:
                yield Note("warned", name, "", IN_RADIANS)

    @property
    def turned(self) -> "OsimJoint":
        """The same joint as it leads from its child to its parent."""
        return replace(self, parent=self.child, child=self.parent, reversed=not self.reversed)

    def _axes(self) -> Iterator[_Moved]:
        """Axes from the parent on: of a reversed joint the last one first, and each the other way."""
        axes = tuple(self._own_axes())
        if not self.reversed:
            yield from axes
        for axis in axes[::-1] if self.reversed else ():
            yield replace(axis, direction=transforms.minus(axis.direction))

    def _own_axes(self) -> Iterator[_Moved]:
        if self.element.tag == CUSTOM:
            yield from self._custom()
            return
        parts = TYPES.get(self.element.tag)
        if parts is None:
            raise LinkwiseError(
                f"joint {self.name!r} is of type {self.element.tag}, which is not modelled; make it one of "
                f"{listed([CUSTOM, *TYPES])}"
            )
        names = [name_of(coordinate) for coordinate in self.coordinates]
        if len(names) != len(parts):
            raise LinkwiseError(
                f"joint {self.name!r} is a {self.element.tag} with {len(names)} coordinates; give it "
                f"{len(parts)}"
            )
        for kind, direction, number in parts:
            yield _Moved(kind, direction, names[number])

    def _custom(self) -> Iterator[_Moved]:
        """Axes of a SpatialTransform: what slides first, for in the file it stands last."""
        transform = self.element.find("SpatialTransform")
        given = {name_of(axis): axis for axis in (transform if transform is not None else ())}
        kinds: tuple[tuple[Kind, str], ...] = (("prismatic", "translation"), ("revolute", "rotation"))
        for kind, word in kinds:
            for number, usual in enumerate((X, Y, Z), 1):
                axis = given.get(f"{word}{number}")
                if axis is None:
                    continue
                place = f"joint {self.name!r}, {word}{number}"
                coordinate, curve = self._displacement(axis, place)
                if not coordinate and curve(0.0) == 0.0:
                    continue
                direction = transforms.unit(numbers_of(axis, "axis", " ".join(map(str, usual)), place, 3))
                if direction is None:
                    raise LinkwiseError(f"{place} has a zero axis; give its direction, such as 0 0 1")
                yield _Moved(kind, direction, coordinate, curve)

    def _displacement(self, axis: Element, place: str) -> tuple[str, Curve]:
        """The coordinate of an axis, empty for none, and its function of that."""
        names = text_of(axis, "coordinates").split()
        if len(names) > 1:
            raise LinkwiseError(
                f"{place} is a function of {len(names)} coordinates; only functions of one are modelled"
            )
        curve = function_of(axis, "function", place)
        if not names:
            return "", curve or constant(0.0)
        own = list(map(name_of, self.coordinates))
        if names[0] not in own:
            raise LinkwiseError(
                f"{place} names {names[0]!r}, which is not a coordinate of the joint; it has {listed(own)}"
            )
        return names[0], curve or constant(0.0)
