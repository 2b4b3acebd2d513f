"""Joint types as chains of revolute and prismatic axes."""

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal

from linkwise.errors import LinkwiseError
from linkwise.escape import listed
from linkwise.robot import transforms
from linkwise.robot.curve import Curve
from linkwise.robot.description import Connection
from linkwise.robot.notes import FLOATS, TURNS, Note
from linkwise.robot.robot import Rotation, Vec3, unusable

X, Y, Z = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)
Vector = tuple[float, float, float]
Kind = Literal["revolute", "prismatic"]
SINGLE: dict[str, Kind] = {
    "revolute": "revolute",
    "continuous": "revolute",
    "hinge": "revolute",
    "prismatic": "prismatic",
}
Part = tuple[str, Kind, Vector]
BALL: tuple[Part, ...] = (("yaw", "revolute", Z), ("pitch", "revolute", Y), ("roll", "revolute", X))
FLOATING: tuple[Part, ...] = (("x", "prismatic", X), ("y", "prismatic", Y), ("z", "prismatic", Z), *BALL)
KNOWN = ("fixed", "revolute", "continuous", "prismatic", "planar", "floating", "ball")
EFFECTS = {"ball": TURNS, "floating": FLOATS}
"""Effect of a joint type's coordinates on the torques, in words."""


@dataclass(frozen=True)
class Axis:
    """One degree of freedom of a file's joint."""

    name: str
    suffix: str
    kind: Kind
    direction: Vector
    follows: tuple[str, Curve] | None = None
    """Name of the coordinate (empty: none) and curve of it, for an axis without a coordinate of its own."""

    @property
    def unit(self) -> Literal["rad", "m"]:
        """Unit of the axis's coordinate: rad or m."""
        return "rad" if self.kind == "revolute" else "m"


def expand(connection: Connection) -> tuple[Axis, ...]:
    """Return the axes of a joint, none for a fixed one; raises LinkwiseError for an unknown type.

    A floating joint has x, y, z of the joint's frame on the parent, then yaw, pitch, roll about the moved z,
    y, x: the order of rpy. A ball has the last three. A planar joint slides in the plane normal to its axis,
    then turns about it.
    """
    if connection.type == "fixed":
        return ()
    if connection.type == "curved":
        return tuple(
            Axis(axis.name, axis.suffix, axis.kind, axis.direction, (axis.coordinate, axis.curve))
            for axis in connection.axes
        )
    if connection.type in SINGLE:
        return (Axis(connection.name, "", SINGLE[connection.type], _unit(connection)),)
    return tuple(
        Axis(f"{connection.name}_{suffix}", suffix, kind, direction)
        for suffix, kind, direction in _parts(connection)
    )


def expansion_notes(connections: Iterable[Connection]) -> list[Note]:
    """Return a note for each joint that becomes several coordinates."""
    return [
        Note(
            "expanded",
            c.name,
            f"{c.type}: {', '.join(part[0] for part in _parts(c))}",
            EFFECTS.get(c.type, ""),
        )
        for c in connections
        if c.type not in ("fixed", "curved", *SINGLE)
    ]


def named_pose(joint: str, rotation: Rotation, translation: Vec3) -> str:
    """Return the coordinates of a floating joint at this pose, in words, in m and rad; zeros are left out."""
    yaw, roll = (
        math.atan2(float(a), float(b)) for a, b in ((rotation[1][0], rotation[0][0]), rotation[2][1:])
    )
    pitch = math.asin(max(-1.0, min(1.0, -float(rotation[2][0]))))
    values = [*map(float, translation), yaw, pitch, roll]
    found = [
        f"{joint}_{part[0]} = {value:.6g}" for part, value in zip(FLOATING, values, strict=True) if value
    ]
    return listed(found) or "at 0"


def _parts(connection: Connection) -> tuple[Part, ...]:
    if connection.type == "floating":
        return FLOATING
    if connection.type == "ball":
        return BALL
    if connection.type == "planar":
        x, y, z = transforms.transpose(transforms.align_z(_unit(connection)))
        return ("x", "prismatic", x), ("y", "prismatic", y), ("yaw", "revolute", z)
    raise LinkwiseError(
        f"joint {connection.name!r} has the unknown type {connection.type!r}; use one of {', '.join(KNOWN)}"
    )


def _unit(connection: Connection) -> Vector:
    if fault := unusable(*connection.axis):
        raise LinkwiseError(f"joint {connection.name!r} has {fault} in its axis; give numbers")
    axis = transforms.unit(connection.axis)
    if axis is None:
        raise LinkwiseError(f"joint {connection.name!r} has a zero axis; give its direction, such as 0 0 1")
    return axis
