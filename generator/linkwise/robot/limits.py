"""Limits that a robot's file gives its joints, assigned to the coordinates of these joints."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import astuple

from linkwise.errors import LinkwiseError
from linkwise.robot.description import Connection
from linkwise.robot.joint_types import SINGLE
from linkwise.robot.robot import UNLIMITED, Coordinate, Limits

ROUNDING = 1e-6
"""Distance, in rad or m, by which a joint may stand past a limit that was rounded."""


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
