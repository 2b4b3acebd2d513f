"""Moving links made of a description's bodies and joints: frames on axes, fixed joints merged away."""

from dataclasses import dataclass, field, replace

from linkwise.robot import transforms
from linkwise.robot.coordinates import AxisRule
from linkwise.robot.description import IDENTITY, ZERO3, Body, Connection, Site
from linkwise.robot.joint_types import Axis
from linkwise.robot.mass import Placed, merge
from linkwise.robot.notes import Note
from linkwise.robot.parameters import Naming
from linkwise.robot.robot import Frame, Joint, Link, Rotation, Vec3


@dataclass(frozen=True)
class _Place:
    """Pose of a body's frame on the moving link that it belongs to (None: the ground)."""

    link: int | None
    rotation: Rotation = IDENTITY
    position: Vec3 = ZERO3


@dataclass
class _Moving:
    """A moving link while it gathers bodies, in axes of its own.

    `shift` and then `turn` lead from these to the link's frame, which has z on the joint's axis.
    """

    name: str
    parent: int | None
    joint: Joint
    turn: Rotation = IDENTITY
    shift: Vec3 = ZERO3
    members: list[Placed] = field(default_factory=list)

    def framed(self, position: Vec3) -> Vec3:
        """Return a place, given in the gathering axes, in the link's frame."""
        return transforms.rotate(self.turn, transforms.add(self.shift, position))

    def link(self, naming: Naming | None) -> Link:
        """Return the link with the bodies that it gathered; its numbers get names from `naming`, if any."""
        mass, com, inertia = merge(self.members)
        if naming:
            mass, com, inertia = naming.body(self.name, len(self.members) > 1, mass, com, inertia)
        inertia = transforms.rotate_inertia(self.turn, inertia)
        return Link(self.name, self.parent, self.joint, mass, self.framed(com), inertia)


@dataclass(frozen=True)
class Assembly:
    """Moving links of a robot; `carrier` is the index of each body's moving link, None for the ground."""

    links: tuple[Link, ...]
    carrier: dict[str, int | None]
    notes: tuple[Note, ...]
    frames: tuple[Frame, ...]


def moving_links(
    bodies: tuple[Body, ...],
    joints: list[tuple[Connection, tuple[Axis, ...]]],
    motion: dict[str, AxisRule],
    naming: Naming | None = None,
    sites: tuple[Site, ...] = (),
) -> Assembly:
    """Return the moving links, each with the bodies that are rigidly connected to it merged.

    `joints` come parents first; a link that no joint carries is on the ground. With `naming`, links gather
    their bodies in the file's own frames, where numbers get their names, and only then turn into linkwise's.
    """
    by_name = {body.name: body for body in bodies}
    between: dict[str, _Place] = {}
    moving: list[_Moving] = []
    places: dict[str, _Place] = {}
    notes: list[Note] = []
    for connection, axes in joints:
        before, child = places.get(connection.parent, _Place(None)), by_name[connection.child]
        start = connection.translation
        if naming:
            # A place on the ground shifts everything alike; that of a fixed joint is part of a merged body.
            moves = any(motion[axis.name].coordinate is not None for axis in axes)
            start = naming.place(connection, moves and before.link is not None)
        turn = transforms.compose(before.rotation, connection.rotation)
        shift = transforms.rotate(before.rotation, start)
        place = _Place(before.link, turn, transforms.add(before.position, shift))
        last = next((axis for axis in reversed(axes) if motion[axis.name].coordinate is not None), None)
        for axis in axes:
            place = _pass(place, axis, motion[axis.name], child, axis is last, moving, naming is not None)
            if place.link is not None:
                between.setdefault(moving[place.link].name, place)
        origin = transforms.rotate(place.rotation, child.origin)
        place = replace(place, position=transforms.add(place.position, origin))
        places[child.name] = place
        if place.link is not None:
            moving[place.link].members.append((child, place.rotation, place.position))
        if place.link == before.link:
            onto = "the ground" if place.link is None else moving[place.link].name
            notes.append(Note("merged", child.name, f"into {onto}"))
    links = tuple(link.link(naming) for link in moving)
    carrier = {body.name: places[body.name].link if body.name in places else None for body in bodies}
    of_file = {body.name: places.get(body.name, _Place(None)) for body in bodies if not body.invented}
    frames, doubles = _frames(between | of_file, sites, moving)
    return Assembly(links, carrier, (*notes, *doubles), frames)


def _frames(
    places: dict[str, _Place], sites: tuple[Site, ...], moving: list[_Moving]
) -> tuple[tuple[Frame, ...], list[Note]]:
    """Return the frames, those on the ground first, then link by link, and notes on sites left out.

    A site whose body is not there was cut away.
    """
    known, doubles = dict(places), list[Note]()
    for site in sites:
        if site.body not in places:
            continue
        if site.name in known:
            doubles.append(Note("ignored", site.name, "a site whose name another frame has"))
            continue
        body = places[site.body]
        at = transforms.add(body.position, transforms.rotate(body.rotation, site.translation))
        known[site.name] = _Place(body.link, transforms.compose(body.rotation, site.rotation), at)
    order = sorted(known.items(), key=lambda item: -1 if item[1].link is None else item[1].link)
    return tuple(_frame(name, place, moving) for name, place in order), doubles


def _frame(name: str, place: _Place, moving: list[_Moving]) -> Frame:
    if place.link is None:
        return Frame(name, None, place.rotation, place.position)
    link = moving[place.link]
    turned = transforms.compose(link.turn, place.rotation)
    return Frame(name, place.link, turned, link.framed(place.position))


def _pass(
    place: _Place,
    axis: Axis,
    motion: AxisRule,
    child: Body,
    last: bool,
    moving: list[_Moving],
    own_axes: bool,
) -> _Place:
    """Return the place behind one axis: on a new moving link, or displaced by a fixed amount.

    A new link is appended to `moving`, as the child's behind the `last` axis that moves. Its frame has z on
    the axis; an offset of the coordinate is folded into the fixed part. It gathers bodies in that frame or,
    with `own_axes`, in the child's axes.
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
    if place.link is not None:
        parent = moving[place.link]
        rotation, position = transforms.compose(parent.turn, rotation), parent.framed(position)
    joint = Joint(axis.name, axis.kind, motion.coordinate, rotation, position, motion.ratio, motion.curve)
    name, at = child.name if last else f"{child.name}_{axis.suffix}", len(moving)
    if not own_axes:
        moving.append(_Moving(name, place.link, joint))
        return _Place(at, back)
    origin = child.origin if last else ZERO3
    moving.append(_Moving(name, place.link, joint, back, origin))
    return _Place(at, IDENTITY, transforms.minus(origin))
