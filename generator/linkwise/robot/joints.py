"""Content of a robot's file about its joints beside their axes, assigned to the coordinates of these joints.

That is their limits; their springs, damping, friction and rotors; how joints move that are no coordinates,
since logs may contain all of them; and the moving joints in the file's order and in Pinocchio's.
"""

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import astuple, replace
from typing import Literal

from linkwise_runtime.file_joints import FileJoint
from linkwise_runtime.structure import PassiveJoint

from linkwise.errors import LinkwiseError
from linkwise.robot.coordinates import AxisRule, Movement
from linkwise.robot.curve import Curve
from linkwise.robot.description import Connection
from linkwise.robot.joint_types import SINGLE, Axis
from linkwise.robot.notes import APART, Note
from linkwise.robot.robot import (
    NOTHING,
    UNLIMITED,
    Coordinate,
    Follower,
    Limits,
    unusable,
)

ROUNDING = 1e-6
"""Distance, in rad or m, by which a joint may stand past a limit that was rounded."""

SHARES: dict[str, tuple[str, tuple[str, str]]] = {
    "spring": ("stiffness", ("N·m/rad", "N/m")),
    "damping": ("damping", ("N·m·s/rad", "N·s/m")),
    "friction": ("friction", ("N·m", "N")),
    "armature": ("armature", ("kg·m²", "kg")),
}
"""Properties by name: the field of `Passive` that shows one, and its units about an axis and along it."""

NEVER_NEGATIVE = ("damping", "friction", "armature")
"""Properties that may not be negative, as they would then give energy without end.

A spring may be: it then pushes away from its rest.
"""

KINDS: Mapping[str, Literal["continuous", "planar", "ball", "floating"]] = {
    "continuous": "continuous",
    "planar": "planar",
    "ball": "ball",
    "floating": "floating",
}
"""Kinds of moving joints, by the types of the file's; all other types are single."""


def coordinate_limits(
    connections: Sequence[Connection], coordinates: Sequence[Coordinate]
) -> tuple[Limits, ...]:
    """Return the limits of each coordinate: those of the joint of its name, none if it has several axes.

    The result is empty if no coordinate has limits. A joint that follows another has limits of its own, which
    are not carried over: its file may give them only for the sake of form, and how they bind the other is up
    to whoever drives both. Raises LinkwiseError for a limit that is not a number.
    """
    known = _known(connections)
    for name, limits in known.items():
        if any(map(math.isnan, astuple(limits))):
            raise LinkwiseError(f"joint {name!r} has NaN for a limit; give a number, or leave it out")
    found = tuple(known.get(c.name, UNLIMITED) for c in coordinates)
    return found if any(limits != UNLIMITED for limits in found) else ()


def check_locks(connections: Sequence[Connection], lock: Mapping[str, float]) -> None:
    """Raise LinkwiseError for a joint locked outside of its limits, as happens with a number in degrees."""
    known = _known(connections)
    for name, at in lock.items():
        limits = known.get(name, UNLIMITED)
        if at < limits.lower - ROUNDING or at > limits.upper + ROUNDING:
            raise LinkwiseError(
                f"--lock {name}={at:g} is outside of the joint's limits, {limits.lower:g} to"
                f" {limits.upper:g}; give rad or m, or change the limits in the file"
            )


def _known(connections: Sequence[Connection]) -> dict[str, Limits]:
    """Return the limits of the file's joints of one axis, and of coordinates that axes follow, by name."""
    known = {c.name: c.limits for c in connections if c.type in SINGLE}
    return known | {c.name: c.limits for connection in connections for c in connection.coordinates}


def checked_passive(connections: Iterable[Connection], allow_unphysical: bool) -> None:
    """Raise LinkwiseError, which names the joint, for a passive value that no joint has."""
    for c in connections:
        if fault := unusable(*astuple(c.passive)):
            raise LinkwiseError(f"joint {c.name!r} has {fault} among its springs and losses; give numbers")
        for what in NEVER_NEGATIVE:
            if (number := getattr(c.passive, what)) < 0 and not allow_unphysical:
                raise LinkwiseError(
                    f"joint {c.name!r} has a {what} of {number:g}, below 0; correct it, or pass "
                    "--allow-unphysical"
                )


def passive_axes(
    connections: Iterable[Connection], motion: Mapping[str, AxisRule]
) -> tuple[PassiveJoint, ...]:
    """Return the moving joints of one axis that have passive properties, with their coordinates.

    The rest of a joint at ratio · q + offset is counted from the offset.
    """
    found = []
    for c in connections:
        rule = motion.get(c.name)
        if c.passive != NOTHING and c.type in SINGLE and rule and rule.coordinate is not None:
            own = replace(c.passive, rest=c.passive.rest - rule.offset if c.passive.stiffness else 0.0)
            found.append(PassiveJoint(c.name, rule.coordinate, rule.ratio, *astuple(own)))
    return tuple(found)


def passive_notes(connections: Iterable[Connection], axes: Iterable[PassiveJoint]) -> Iterator[Note]:
    """Yield a note on each passive property of each joint, kind by kind, with the file's numbers."""
    moving = {axis.joint for axis in axes}
    there = [c for c in connections if c.name in moving]
    for what, (name, units) in SHARES.items():
        for c in there:
            if number := getattr(c.passive, name):
                slides = SINGLE[c.type] == "prismatic"
                at = f", at rest at {c.passive.rest:g} {'m' if slides else 'rad'}"
                rest = at if what == "spring" and c.passive.rest else ""
                detail = f"{number:g} {units[slides]}{rest}"
                yield Note("passive", c.name, detail, f"{what} {APART}")


def followers(
    axes: Sequence[Axis], connections: Sequence[Connection], moving: Movement, lock: Mapping[str, float]
) -> Iterator[Follower]:
    """Yield a Follower for each joint that follows another or is locked, by its axes or by its file."""
    names = [c.name for c in moving.coordinates]
    for axis in axes:
        rule = moving.motion[axis.name]
        if axis.follows is None and rule.coordinate is None:
            yield Follower(axis.name, axis.unit, "", Curve.straight(rule.offset))
        elif axis.follows is None and rule.coordinate is not None and names[rule.coordinate] != axis.name:
            line = Curve.straight(rule.offset, rule.ratio)
            yield Follower(axis.name, axis.unit, names[rule.coordinate], line)
    for connection in connections:
        for c in connection.coordinates:
            if c.name in lock:
                yield Follower(c.name, c.unit, "", Curve.straight(lock[c.name]), c.coupled)
        for one in connection.followers:
            if one.coordinate in lock:
                yield replace(one, coordinate="", curve=Curve.straight(one.curve(lock[one.coordinate])))
            elif one.coordinate in ("", *names):
                yield one


def moving_joints(
    joints: Sequence[tuple[Connection, tuple[Axis, ...]]], moving: Movement, ordered: bool
) -> tuple[FileJoint, ...]:
    """Return the joints that have coordinates, in the order of these.

    ordered: whether Pinocchio has siblings in the file's order, and not in that of their joints' names, fixed
    ones among them
    """
    names = {coordinate.name: k for k, coordinate in enumerate(moving.coordinates)}
    found: dict[str, tuple[Connection, tuple[int, ...]]] = {}
    for connection, axes in joints:
        own = tuple(names[axis.name] for axis in axes if axis.follows is None and axis.name in names)
        if connection.type == "curved":
            found |= {
                c.name: (connection, (names[c.name],)) for c in connection.coordinates if c.name in names
            }
        elif own:
            found[connection.name] = connection, own
    walked = [c.name for c, _ in joints] if ordered else list(_by_name([c for c, _ in joints]))
    places = {name: at for at, name in enumerate(walked)}
    before = sorted(found, key=lambda name: (places[found[name][0].name], found[name][1]))
    return tuple(
        FileJoint(name, KINDS.get(connection.type, "single"), own, before.index(name))
        for name, (connection, own) in sorted(found.items(), key=lambda item: item[1][1])
    )


def _by_name(connections: Sequence[Connection]) -> Iterator[str]:
    """Yield the names of joints depth first, siblings in the order of their names."""
    below: dict[str, list[Connection]] = {}
    for connection in sorted(connections, key=lambda c: c.name, reverse=True):
        below.setdefault(connection.parent, []).append(connection)
    children = {c.child for c in connections}
    waiting = [c for parent in below if parent not in children for c in below[parent]]
    while waiting:
        connection = waiting.pop()
        yield connection.name
        waiting += below.get(connection.child, [])
