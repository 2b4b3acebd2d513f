"""Limits that a robot's file gives its joints, by the coordinates that these became."""

import math
from collections.abc import Sequence
from dataclasses import astuple

from linkwise.errors import LinkwiseError
from linkwise.robot.description import Connection
from linkwise.robot.joint_types import SINGLE
from linkwise.robot.robot import UNLIMITED, Coordinate, Limits


def coordinate_limits(
    connections: Sequence[Connection], coordinates: Sequence[Coordinate]
) -> tuple[Limits, ...]:
    """Limits of each coordinate: those of the joint of its name, none of one of several axes.

    A joint that follows another has limits of its own, which are not carried over: its file may give them for
    the sake of form, and how they bind the other is for who drives both. Raises LinkwiseError for a limit
    that is not a number.
    """
    own = {c.name: c for c in connections if c.type in SINGLE}
    for c in own.values():
        if any(map(math.isnan, astuple(c.limits))):
            raise LinkwiseError(f"joint {c.name!r} has NaN for a limit; give a number, or leave it out")
    known = {name: c.limits for name, c in own.items()}
    known |= {c.name: c.limits for connection in connections for c in connection.coordinates}
    found = tuple(known.get(c.name, UNLIMITED) for c in coordinates)
    return found if any(limits != UNLIMITED for limits in found) else ()
