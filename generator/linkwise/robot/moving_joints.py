"""Moving joints of a file, by their coordinates, in the file's order and in Pinocchio's."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Literal

from linkwise.robot.coordinates import Movement
from linkwise.robot.description import Connection
from linkwise.robot.joint_types import Axis
from linkwise.robot.robot import MovingJoint

KINDS: Mapping[str, Literal["continuous", "planar", "ball", "floating"]] = {
    "continuous": "continuous",
    "planar": "planar",
    "ball": "ball",
    "floating": "floating",
}


def moving_joints(
    joints: Sequence[tuple[Connection, tuple[Axis, ...]]], moving: Movement, ordered: bool
) -> tuple[MovingJoint, ...]:
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
        MovingJoint(name, KINDS.get(connection.type, "single"), own, before.index(name))
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
