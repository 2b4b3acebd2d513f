"""Moving links from the bodies and joints of a description: frames on axes, fixed joints merged away."""

from dataclasses import dataclass, field

from linkwise.robot import transforms
from linkwise.robot.coordinates import AxisRule
from linkwise.robot.description import IDENTITY, ZERO3, Body, Connection
from linkwise.robot.joint_types import Axis
from linkwise.robot.mass import Placed, merge
from linkwise.robot.notes import Note
from linkwise.robot.robot import Joint, Link, Rotation, Vec3


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


@dataclass(frozen=True)
class Assembly:
    """The moving links; `carrier` is the index of that which each body belongs to, None for the ground."""

    links: tuple[Link, ...]
    carrier: dict[str, int | None]
    notes: tuple[Note, ...]


def moving_links(
    bodies: tuple[Body, ...], joints: list[tuple[Connection, tuple[Axis, ...]]], motion: dict[str, AxisRule]
) -> Assembly:
    """Return the moving links, each with the bodies that are rigidly connected to it merged.

    `joints` come parents first; a link that no joint carries is on the ground.
    """
    by_name = {body.name: body for body in bodies}
    moving: list[_Moving] = []
    places: dict[str, _Place] = {}
    notes: list[Note] = []
    for connection, axes in joints:
        before = places.get(connection.parent, _Place(None))
        turn = transforms.compose(before.rotation, connection.rotation)
        shift = transforms.rotate(before.rotation, connection.translation)
        place = _Place(before.link, turn, transforms.add(before.position, shift))
        for axis in axes:
            place = _pass(place, axis, motion[axis.name], connection.child, moving)
        places[connection.child] = place
        if place.link is not None:
            member = by_name[connection.child], place.rotation, place.position
            moving[place.link].members.append(member)
        if place.link == before.link:
            onto = "the ground" if place.link is None else moving[place.link].name
            notes.append(Note("merged", connection.child, f"into {onto}"))
    links = tuple(Link(link.name, link.parent, link.joint, *merge(link.members)) for link in moving)
    carrier = {body.name: places[body.name].link if body.name in places else None for body in bodies}
    return Assembly(links, carrier, tuple(notes))


def _pass(place: _Place, axis: Axis, motion: AxisRule, child: str, moving: list[_Moving]) -> _Place:
    """Pass one axis: a new moving link, or a fixed displacement when it is locked.

    The new link's frame has z on the axis; an offset of the coordinate is folded into the fixed part.
    """
    align = transforms.align_z(axis.direction)
    rotation, position = transforms.compose(place.rotation, align), place.position
    if axis.kind == "revolute" and motion.offset:
        rotation = transforms.compose(rotation, transforms.about_z(motion.offset))
    if axis.kind == "prismatic" and motion.offset:
        x, y, z = (transforms.times(motion.offset, row[2]) for row in rotation)
        position = transforms.add(position, (x, y, z))
    back = transforms.transpose(align)
    if motion.coordinate is None:
        return _Place(place.link, transforms.compose(rotation, back), position)
    joint = Joint(axis.name, axis.kind, motion.coordinate, rotation, position, motion.ratio)
    moving.append(_Moving(child if axis.last else f"{child}_{axis.suffix}", place.link, joint))
    return _Place(len(moving) - 1, back)
