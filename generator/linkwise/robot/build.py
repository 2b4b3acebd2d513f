"""From what a file says to a Robot: expand, cut, substitute, merge, and check."""

from dataclasses import dataclass, field, replace
from typing import Literal

from linkwise.errors import LinkwiseError
from linkwise.robot.coordinates import check_couplings, coordinates
from linkwise.robot.description import Connection, Description
from linkwise.robot.joint_types import expand
from linkwise.robot.links import moving_links
from linkwise.robot.mass import check_body
from linkwise.robot.parameters import numeric, promoted
from linkwise.robot.robot import Coordinate, Link, Note, Robot, is_finite
from linkwise.robot.tree import cut, depth_first


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
    joint_friction: bool = False


def assemble(description: Description, options: Options) -> Robot:
    """Build the robot; raises LinkwiseError that names the link or joint and the mend."""
    notes = list(description.notes)
    description = cut(description, options.root, options.tip, notes)
    plain = numeric(description)
    notes += _check_bodies(plain, options.allow_unphysical)
    if not all(is_finite(entry) for entry in plain.gravity):
        raise LinkwiseError("gravity has NaN or infinity in it; give three numbers")
    if options.parameters == "numeric":
        description = plain
    root, connections = depth_first(description)
    if options.base == "fixed":
        notes += [
            Note("merged", body.name, f"into the ground, with its {body.mass:g} kg")
            for body in plain.bodies
            if body.name == root and body.mass
        ]
    else:
        connections = (Connection("base", "floating", "", root), *connections)
    if not connections or all(c.type == "fixed" for c in connections):
        raise LinkwiseError(
            "no joint moves; give one a moving type, or let the base move with --base floating"
        )
    joints = [(connection, expand(connection, notes)) for connection in connections]
    axes = tuple(axis for _, parts in joints for axis in parts)
    notes += check_couplings(description.couplings, axes, options.lock, options.free_mimic)
    moving, motion = coordinates(axes, connections, options.lock, options.free_mimic, notes)
    links = moving_links(description.bodies, joints, motion, notes)
    _check_motion(links, moving, options.allow_unphysical, notes)
    named = {body.name for body in description.bodies if not body.invented}
    notes += [Note("massless", link.name) for link in links if link.massless and link.name in named]
    if options.joint_friction:
        notes += _losses(connections)
    parameters = description.parameters
    robot = Robot(description.name, moving, links, description.gravity, parameters, tuple(notes))
    return promoted(robot) if options.parameters == "symbolic" else replace(robot, parameters=())


def _check_bodies(description: Description, allow: bool) -> list[Note]:
    notes = []
    for body in description.bodies:
        fault = check_body(body)
        if fault and not (allow or body.unphysical):
            raise LinkwiseError(f"{fault}; correct it, or pass --allow-unphysical")
        if fault:
            notes.append(Note("unphysical", body.name, body.unphysical or fault))
    return notes


def _check_motion(
    links: tuple[Link, ...], moving: tuple[Coordinate, ...], allow: bool, notes: list[Note]
) -> None:
    """Refuse a coordinate whose joints carry no mass at all."""
    carrying = {index for index, link in enumerate(links) if not link.massless}
    for index in sorted(carrying, reverse=True):
        at = links[index].parent
        while at is not None and at not in carrying:
            carrying.add(at)
            at = links[at].parent
    moved = {links[index].joint.coordinate for index in carrying}
    for k, coordinate in enumerate(moving):
        if k in moved:
            continue
        if not allow:
            raise LinkwiseError(
                f"joint {coordinate.name!r} moves no mass at all; give a link beyond it mass, hold it with "
                f"--lock {coordinate.name}=0, or pass --allow-unphysical"
            )
        notes.append(Note("unphysical", coordinate.name, "moves no mass; its torque is zero"))


def _losses(connections: tuple[Connection, ...]) -> list[Note]:
    """Damping and friction as the file has them; the torques hold neither."""
    notes = []
    for c in connections:
        angle = c.type != "prismatic"
        if c.damping:
            notes.append(Note("damping", c.name, f"{c.damping!r} {'N·m·s/rad' if angle else 'N·s/m'}"))
        if c.friction:
            notes.append(Note("friction", c.name, f"{c.friction!r} {'N·m' if angle else 'N'}"))
    return notes
