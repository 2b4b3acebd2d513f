"""Joints of an OpenSim model, each in two frames, one on each body, as chains of axes."""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Literal
from xml.etree.ElementTree import Element

from linkwise.errors import LinkwiseError
from linkwise.robot import transforms
from linkwise.robot.description import Connection, CurvedAxis, CurvedCoordinate
from linkwise.robot.notes import Note
from linkwise.robot.readers.osim.axes import Kind, MovedAxis, axes_of, carrier
from linkwise.robot.readers.osim.constraints import Rule, limits_of
from linkwise.robot.readers.osim.document import name_of
from linkwise.robot.readers.osim.frames import GROUND, Placed
from linkwise.robot.robot import Follower

IN_RADIANS = "in radians in every log, as in OpenSim's files whose other angles are in degrees"
SUFFIXES = {"prismatic": "t", "revolute": "r"}
UNITS: dict[Kind, Literal["rad", "m"]] = {"prismatic": "m", "revolute": "rad"}


def from_ground(joints: Iterable["OsimJoint"]) -> tuple[tuple["OsimJoint", ...], tuple["OsimJoint", ...]]:
    """Return the joints in an order that leads away from ground, some of them turned round, and those beside.

    A joint beside leads to a body that another has reached, and so closes a loop.

    Raises LinkwiseError for a body that no joints connect to ground.
    """
    found: list[OsimJoint] = []
    beside: list[OsimJoint] = []
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
        if joint.parent.body == joint.child.body:
            raise LinkwiseError(
                f"joint {joint.name!r} leads from {joint.child.body!r} to itself; let it lead to another body"
            )
        waiting = [other for other in waiting if other.element is not joint.element]
        joint = joint.turned if joint.child.body == GROUND else joint
        (beside if joint.child.body in reached else found).append(joint)
        reached.add(joint.child.body)
    return tuple(found), tuple(beside)


@dataclass(frozen=True)
class OsimJoint:
    """A joint, its frames on both bodies, and the elements of its coordinates.

    If it is `reversed`, its coordinates describe the parent's pose relative to the child.
    """

    element: Element
    parent: Placed
    child: Placed
    coordinates: tuple[Element, ...]
    reversed: bool = False

    @property
    def name(self) -> str:
        """Name of the joint."""
        return name_of(self.element)

    def idle(self) -> tuple[Element, ...]:
        """Return the elements of the coordinates that move no axis."""
        axes = tuple(self._axes())
        return tuple(one for one in self.coordinates if carrier(axes, name_of(one)) is None)

    def connection(self, rules: Mapping[str, Rule]) -> Connection:
        """Return the joint as a Connection, with the rules of its coordinates.

        Raises LinkwiseError for a free coordinate that moves no axis.
        """
        turn = transforms.transpose(self.child.rotation)
        axes = tuple(self._axes())
        carriers = {name: carrier(axes, name) for name in map(name_of, self.coordinates)}
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
                CurvedCoordinate(name_of(c), UNITS[axes[at].kind], limits_of(c), axes[at].in_radians)
                for c in free
                if (at := carriers[name_of(c)]) is not None
            ),
            followers=tuple(
                Follower(
                    name,
                    "rad" if at is None else UNITS[axes[at].kind],
                    rules[name].free,
                    rules[name].curve,
                    at is not None and axes[at].in_radians,
                )
                for name, at in carriers.items()
                if rules[name].free != name
            ),
        )

    def notes(self, rules: Mapping[str, Rule]) -> Iterator[Note]:
        """Yield a note on each free coordinate that OpenSim calls coupled, and keeps in radians."""
        axes = tuple(self._axes())
        for name in map(name_of, self.coordinates):
            at = carrier(axes, name) if rules[name].free == name else None
            if at is not None and axes[at].in_radians:
                yield Note("warned", name, "", IN_RADIANS)

    @property
    def turned(self) -> "OsimJoint":
        """Joint turned round, leading from its child to its parent."""
        return replace(self, parent=self.child, child=self.parent, reversed=not self.reversed)

    def _axes(self) -> Iterator[MovedAxis]:
        """Yield the axes from the parent on; those of a reversed joint in reverse order and direction."""
        axes = tuple(axes_of(self.element, list(map(name_of, self.coordinates))))
        if not self.reversed:
            yield from axes
        for axis in axes[::-1] if self.reversed else ():
            yield replace(axis, direction=transforms.minus(axis.direction))
