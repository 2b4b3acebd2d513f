"""Joints of a robot's file that are no coordinates, and how they move; logs may contain all of them."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

from linkwise.robot.coordinates import Movement
from linkwise.robot.curve import Curve
from linkwise.robot.description import Connection
from linkwise.robot.joint_types import Axis
from linkwise.robot.robot import Follower


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
