"""From what a file says to a Robot: expand, cut, substitute, merge, and check."""

from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from typing import Literal

from linkwise.errors import LinkwiseError
from linkwise.robot.coordinates import check_couplings, movement
from linkwise.robot.description import Connection, Description, Loop
from linkwise.robot.joint_types import expand, expansion_notes
from linkwise.robot.links import moving_links
from linkwise.robot.mass import check_body
from linkwise.robot.notes import IMPOSSIBLE, Note
from linkwise.robot.parameters import numeric, promoted
from linkwise.robot.robot import Coordinate, Link, Robot, is_finite
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

    @property
    def given(self) -> tuple[str, ...]:
        """Names of the options that differ from their defaults."""
        usual = Options()
        return tuple(f.name for f in fields(self) if getattr(self, f.name) != getattr(usual, f.name))


def build(description: Description, options: Options) -> Robot:
    """Build the robot; raises LinkwiseError that names the link or joint and the mend."""
    description = cut(description, options.root, options.tip)
    plain = numeric(description)
    unphysical = _check_bodies(plain, options.allow_unphysical)
    if not all(is_finite(entry) for entry in plain.gravity):
        raise LinkwiseError("gravity has NaN or infinity in it; give three numbers")
    if options.parameters == "numeric":
        description = plain
    root, connections = depth_first(description)
    grounded = _on_the_ground(plain, root) if options.base == "fixed" else []
    if options.base == "floating":
        connections = (Connection("base", "floating", "", root), *connections)
    if not connections or all(c.type == "fixed" for c in connections):
        raise LinkwiseError(
            "no joint moves; give one a moving type, or let the base move with --base floating"
        )
    joints = [(connection, expand(connection)) for connection in connections]
    axes = tuple(axis for _, parts in joints for axis in parts)
    uncoupled = check_couplings(description.couplings, axes, options.lock, options.free_mimic)
    moving = movement(axes, connections, options.lock, options.free_mimic)
    assembly = moving_links(description.bodies, joints, moving.motion)
    check_loops(description.loops, assembly.carrier)
    idle = _check_motion(assembly.links, moving.coordinates, options.allow_unphysical)
    notes = [
        *description.notes,
        *unphysical,
        *grounded,
        *expansion_notes(connections),
        *uncoupled,
        *moving.notes,
        *assembly.notes,
        *idle,
        *_massless(description, assembly.links),
        *_as_read(connections),
    ]
    robot = Robot(
        description.name,
        moving.coordinates,
        assembly.links,
        description.gravity,
        description.parameters,
        tuple(notes),
    )
    return promoted(robot) if options.parameters == "symbolic" else replace(robot, parameters=())


def check_loops(loops: tuple[Loop, ...], carrier: Mapping[str, int | None]) -> None:
    """Refuse what ties bodies together outside the tree, unless both are cut away or move as one.

    `carrier` names the moving link of each body that is there, None for the ground.
    """
    for loop in loops:
        there = [carrier[body] for body in loop.bodies if body in carrier]
        gone = loop.bodies and not there
        rigid = len(there) == 2 and there[0] == there[1]
        if not (gone or rigid):
            raise LinkwiseError(f"{loop.what}; loops are not modelled yet: {loop.mend}")


def _check_bodies(description: Description, allow: bool) -> list[Note]:
    notes = []
    for body in description.bodies:
        fault = check_body(body)
        if fault and not (allow or body.unphysical):
            raise LinkwiseError(f"{fault}; correct it, or pass --allow-unphysical")
        if fault:
            notes.append(Note("unphysical", body.name, body.unphysical or fault, IMPOSSIBLE))
    return notes


def _on_the_ground(description: Description, root: str) -> list[Note]:
    return [
        Note("merged", body.name, f"into the ground, with its {body.mass:g} kg")
        for body in description.bodies
        if body.name == root and body.mass
    ]


def _check_motion(links: tuple[Link, ...], moving: tuple[Coordinate, ...], allow: bool) -> list[Note]:
    """Return a note for each coordinate whose joints carry no mass at all; refuse it unless `allow`."""
    carrying = {index for index, link in enumerate(links) if not link.massless}
    for index in sorted(carrying, reverse=True):
        at = links[index].parent
        while at is not None and at not in carrying:
            carrying.add(at)
            at = links[at].parent
    moved = {links[index].joint.coordinate for index in carrying}
    idle = [coordinate.name for k, coordinate in enumerate(moving) if k not in moved]
    if idle and not allow:
        raise LinkwiseError(
            f"joint {idle[0]!r} moves no mass at all; give a link beyond it mass, hold it with "
            f"--lock {idle[0]}=0, or pass --allow-unphysical"
        )
    return [Note("unphysical", name, "moves no mass; its torque is zero", IMPOSSIBLE) for name in idle]


def _massless(description: Description, links: tuple[Link, ...]) -> list[Note]:
    """Name the moving links of the file, not the reader's own, that carry no mass."""
    named = {body.name for body in description.bodies if not body.invented}
    return [Note("massless", link.name) for link in links if link.massless and link.name in named]


def _as_read(connections: tuple[Connection, ...]) -> list[Note]:
    """Rotations that reading rounded; damping and friction as the file has them, which no torque holds."""
    notes = [
        Note("snapped", c.name, "rotation entries within 1e-12 of -1, 0, 1") for c in connections if c.snapped
    ]
    for c in connections:
        angle = c.type != "prismatic"
        if c.damping:
            notes.append(Note("damping", c.name, f"{c.damping!r} {'N·m·s/rad' if angle else 'N·s/m'}"))
        if c.friction:
            notes.append(Note("friction", c.name, f"{c.friction!r} {'N·m' if angle else 'N'}"))
    return notes
