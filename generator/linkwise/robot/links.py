"""Moving links from the bodies and joints of a description: frames on axes, fixed joints merged away."""

from dataclasses import dataclass, field

from linkwise.robot import transforms as geo
from linkwise.robot.coordinates import Motion
from linkwise.robot.description import IDENTITY, ZERO3, Body, Connection
from linkwise.robot.joint_types import Axis
from linkwise.robot.mass import Placed, merge
from linkwise.robot.robot import Joint, Link, Note, Rotation, Vec3


@dataclass(frozen=True)
class _Place:
    """Where a body sits: the moving link it belongs to (None: the ground), and its pose in that frame."""

    link: int | None
    rotation: Rotation = IDENTITY
    position: Vec3 = ZERO3


@dataclass
class _Moving:
    """A moving link while it gathers bodies."""

    name: str
    parent: int | None
    joint: Joint
    members: list[Placed] = field(default_factory=list)


def moving_links(
    bodies: tuple[Body, ...],
    joints: list[tuple[Connection, list[Axis]]],
    motion: dict[str, Motion],
    notes: list[Note],
) -> tuple[Link, ...]:
    """Return the moving links, each with the bodies that are rigidly connected to it merged.

    `joints` come parents first; a link that no joint carries is on the ground.
    """
    by_name = {body.name: body for body in bodies}
    moving: list[_Moving] = []
    places: dict[str, _Place] = {}
    for connection, axes in joints:
        before = places.get(connection.parent, _Place(None))
        turn = geo.compose(before.rotation, connection.rotation)
        position = geo.add(before.position, geo.rotate(before.rotation, connection.translation))
        place = _Place(before.link, turn, position)
        for axis in axes:
            place = _pass(place, axis, motion[axis.name], connection.child, moving)
        places[connection.child] = place
        if place.link is not None:
            member = by_name[connection.child], place.rotation, place.position
            moving[place.link].members.append(member)
        if place.link == before.link:
            onto = "the ground" if place.link is None else moving[place.link].name
            notes.append(Note("merged", connection.child, f"into {onto}"))
    return tuple(Link(link.name, link.parent, link.joint, *merge(link.members)) for link in moving)


def _pass(place: _Place, axis: Axis, motion: Motion, child: str, moving: list[_Moving]) -> _Place:
    """Pass one axis: a new moving link, or a fixed displacement when it is locked.

    The new link's frame has z on the axis; an offset of the coordinate is folded into the fixed part.
    """
    align = geo.align_z(axis.direction)
    rotation, position = geo.compose(place.rotation, align), place.position
    if axis.kind == "revolute" and motion.offset:
        rotation = geo.compose(rotation, geo.about_z(motion.offset))
    if axis.kind == "prismatic" and motion.offset:
        x, y, z = (geo.times(motion.offset, row[2]) for row in rotation)
        position = geo.add(position, (x, y, z))
    back = geo.transpose(align)
    if motion.coordinate is None:
        return _Place(place.link, geo.compose(rotation, back), position)
    joint = Joint(axis.name, axis.kind, motion.coordinate, rotation, position, motion.ratio)
    moving.append(_Moving(child if axis.last else f"{child}_{axis.suffix}", place.link, joint))
    return _Place(len(moving) - 1, back)
