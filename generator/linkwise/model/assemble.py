"""From what a file says to a Robot: expand, cut, substitute, merge, and check."""

from dataclasses import dataclass, field, replace
from typing import Literal


from linkwise.errors import LinkwiseError
from linkwise.model import geometry as geo
from linkwise.model.description import IDENTITY, ZERO3, Connection, Description
from linkwise.model.expand import Axis, expand
from linkwise.model.mass import Placed, check_body, merge
from linkwise.model.parameters import evaluated, numeric, promoted
from linkwise.model.robot import Coordinate, Joint, Link, Note, Robot, Rotation, Vec3
from linkwise.model.tree import cut, depth_first


@dataclass(frozen=True)
class Options:
    """How a description becomes a robot; the command line's flags of the same names."""

    parameters: Literal["numeric", "symbolic"] = "numeric"
    lock: dict[str, float] = field(default_factory=dict)
    base: Literal["fixed", "floating"] = "fixed"
    root: str | None = None
    tip: str | None = None
    allow_unphysical: bool = False
    free_mimic: bool = False


@dataclass(frozen=True)
class Motion:
    """How an axis moves: ratio · q + offset of a coordinate; without one it stands at the offset."""

    coordinate: int | None
    ratio: float = 1.0
    offset: float = 0.0


@dataclass(frozen=True)
class _Place:
    """Where a body sits: the moving link it belongs to (None: the ground), and its pose in that link's frame."""

    link: int | None
    rotation: Rotation = IDENTITY
    position: Vec3 = ZERO3


def assemble(description: Description, options: Options) -> Robot:
    """Build the robot; raises LinkwiseError that names the link or joint and the mend."""
    notes = list(description.notes)
    description = cut(description, options.root, options.tip, notes)
    notes += _check_bodies(description, options.allow_unphysical)
    if options.parameters == "numeric":
        description = numeric(description)
    root, connections = depth_first(description)
    if options.base == "floating":
        connections = (Connection("base", "floating", "", root), *connections)
    if not connections or all(c.type == "fixed" for c in connections):
        raise LinkwiseError(
            "no joint moves; give one a moving type, or let the base move with --base floating"
        )
    axes = [axis for connection in connections for axis in expand(connection, notes)]
    coordinates, motion = _coordinates(axes, connections, options, notes)
    links = _links(description, root, connections, axes, motion, notes)
    _check_motion(links, coordinates, options.allow_unphysical, notes)
    notes += [Note("massless", link.name) for link in links if link.massless]
    robot = Robot(
        description.name,
        coordinates,
        links,
        description.gravity,
        description.parameters,
        tuple(notes),
    )
    if options.parameters == "symbolic":
        return promoted(robot)
    return replace(robot, parameters=())


def _check_bodies(description: Description, allow: bool) -> list[Note]:
    notes = []
    for body in description.bodies:
        fault = check_body(evaluated(body, description.parameters))
        if fault and not (allow or body.unphysical):
            raise LinkwiseError(f"{fault}; correct it, or pass --allow-unphysical")
        if fault:
            notes.append(Note("unphysical", body.name, body.unphysical or fault))
    return notes


def _coordinates(
    axes: list[Axis], connections: tuple[Connection, ...], options: Options, notes: list[Note]
) -> tuple[tuple[Coordinate, ...], dict[str, Motion]]:
    """Coordinates, and how each axis moves with them."""
    lock = options.lock
    known = {axis.name: axis for axis in axes}
    for name in lock:
        if name not in known:
            raise LinkwiseError(f"--lock names no moving joint {name!r}; the joints are {', '.join(known)}")
    mimics = {c.name: c.mimic for c in connections if c.mimic is not None and c.name in known}
    masterless = [name for name, mimic in mimics.items() if mimic.master not in known and name not in lock]
    if masterless and not options.free_mimic:
        name = masterless[0]
        raise LinkwiseError(
            f"joint {name!r} mimics {mimics[name].master!r}, which is no moving joint here"
            f"{f' ({len(masterless)} joints do so)' if len(masterless) > 1 else ''}; hold it with "
            f"--lock {name}=0, or let such joints move by themselves with --free-mimic"
        )
    for name in masterless:
        notes.append(
            Note("freed", name, f"mimics {mimics.pop(name).master!r}, which is no moving joint here")
        )
    motion: dict[str, Motion] = {}
    coordinates: list[Coordinate] = []
    for axis in axes:
        if axis.name in lock:
            motion[axis.name] = Motion(None, 0.0, lock[axis.name])
            notes.append(Note("locked", axis.name, f"at {lock[axis.name]:g} {axis.unit}"))
        elif axis.name not in mimics:
            motion[axis.name] = Motion(len(coordinates))
            coordinates.append(Coordinate(axis.name, axis.unit))
    for name, mimic in mimics.items():
        if name in lock:
            continue
        if mimic.master in mimics:
            raise LinkwiseError(
                f"joint {name!r} mimics {mimic.master!r}, which is "
                f"{'itself' if mimic.master == name else 'a mimic too'}; name the joint that moves, or hold "
                f"it with --lock {name}=0"
            )
        master = motion[mimic.master]
        offset = mimic.offset + mimic.ratio * master.offset
        motion[name] = Motion(master.coordinate, mimic.ratio, offset)
        notes.append(Note("mimic", name, f"= {mimic.ratio:g} {mimic.master} + {mimic.offset:g}"))
    return tuple(coordinates), motion


def _links(
    description: Description,
    root: str,
    connections: tuple[Connection, ...],
    axes: list[Axis],
    motion: dict[str, Motion],
    notes: list[Note],
) -> tuple[Link, ...]:
    """Moving links, each with the bodies that are rigidly connected to it merged."""
    bodies = {body.name: body for body in description.bodies}
    by_connection = {c.name: [axis for axis in axes if axis.connection == c.name] for c in connections}
    moving: list[tuple[str, int | None, Joint]] = []
    members: dict[int | None, list[Placed]] = {}
    places = {"": _Place(None), root: _Place(None)}
    if not connections or connections[0].parent:
        members[None] = [(bodies[root], IDENTITY, ZERO3)]
    for connection in connections:
        place = places[connection.parent]
        turn = geo.compose(place.rotation, connection.rotation)
        position = geo.add(place.position, geo.rotate(place.rotation, connection.translation))
        place = _Place(place.link, turn, position)
        for axis in by_connection[connection.name]:
            place = _step(place, axis, motion[axis.name], connection.child, moving)
        places[connection.child] = place
        member = (bodies[connection.child], place.rotation, place.position)
        members.setdefault(place.link, []).append(member)
        rigid = place.link == places[connection.parent].link
        if rigid:
            onto = "the ground" if place.link is None else moving[place.link][0]
            notes.append(Note("merged", connection.child, f"into {onto}"))
    return tuple(
        Link(name, parent, joint, *merge(members.get(index, [])))
        for index, (name, parent, joint) in enumerate(moving)
    )


def _step(
    place: _Place,
    axis: Axis,
    motion: Motion,
    child: str,
    moving: list[tuple[str, int | None, Joint]],
) -> _Place:
    """Pass one axis: a new moving link, or a fixed displacement when it is locked.

    The new link's frame has z on the axis; a mimic's offset is folded into the fixed part.
    """
    coordinate, ratio, offset = motion.coordinate, motion.ratio, motion.offset
    align = geo.align_z(axis.direction)
    rotation, position = geo.compose(place.rotation, align), place.position
    if axis.kind == "revolute" and offset:
        rotation = geo.compose(rotation, geo.about_z(offset))
    if axis.kind == "prismatic" and offset:
        slide = tuple(geo.times(offset, row[2]) for row in rotation)
        position = geo.add(position, slide)  # type: ignore[arg-type]
    back = geo.transpose(align)
    if coordinate is None:
        return _Place(place.link, geo.compose(rotation, back), position)
    joint = Joint(axis.name, axis.kind, coordinate, rotation, position, ratio)
    moving.append((child if axis.last else f"{child}_{axis.suffix}", place.link, joint))
    return _Place(len(moving) - 1, back)


def _check_motion(
    links: tuple[Link, ...], coordinates: tuple[Coordinate, ...], allow: bool, notes: list[Note]
) -> None:
    """Refuse a coordinate whose joints carry no mass at all."""
    carrying = {index for index, link in enumerate(links) if not link.massless}
    for index in sorted(carrying, reverse=True):
        at = links[index].parent
        while at is not None and at not in carrying:
            carrying.add(at)
            at = links[at].parent
    moved = {links[index].joint.coordinate for index in carrying}
    for k, coordinate in enumerate(coordinates):
        if k in moved:
            continue
        if not allow:
            raise LinkwiseError(
                f"joint {coordinate.name!r} moves no mass at all; give a link beyond it mass, hold it with "
                f"--lock {coordinate.name}=0, or pass --allow-unphysical"
            )
        notes.append(Note("unphysical", coordinate.name, "moves no mass; its torque is zero"))
