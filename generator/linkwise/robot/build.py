"""Building a Robot from the description of a file: cut, split into axes, give coordinates, merge, check."""

from dataclasses import replace

import sympy as sp

from linkwise.errors import LinkwiseError
from linkwise.robot.constraints import check_constraints, remaining_constraints
from linkwise.robot.coordinates import AxisRule, check_joints, movement
from linkwise.robot.description import Connection, Description
from linkwise.robot.joint_types import Axis, expand, expansion_notes, named_pose
from linkwise.robot.joints import (
    check_locks,
    checked_passive,
    coordinate_limits,
    followers,
    moving_joints,
    passive_axes,
    passive_notes,
)
from linkwise.robot.links import moving_links
from linkwise.robot.mass import check_bodies
from linkwise.robot.mass_matrix import check_mass_matrix
from linkwise.robot.notes import FREE, Note
from linkwise.robot.options import Options
from linkwise.robot.parameters import Named, Naming, numeric
from linkwise.robot.robot import Frame, Link, Parameter, Robot, Scalar, unusable
from linkwise.robot.ties import anchor_frames, tied_places
from linkwise.robot.tree import check_loops, cut, depth_first


def build(description: Description, options: Options) -> Robot:
    """Build the robot; raises LinkwiseError that names the link or joint and the remedy."""
    whole, description = description, cut(description, options.root, options.tip)
    check_constraints(numeric(whole))
    plain = numeric(description)
    takes = description.takes_impossible
    unphysical = check_bodies(plain.bodies, options.allow_unphysical, takes)
    if fault := unusable(*plain.gravity):
        raise LinkwiseError(f"gravity has {fault} in it; give three numbers, in m/s²")
    naming = _naming(description, options)
    if naming is None:
        description = plain
    root, connections = _connections(description, options)
    joints = [(connection, expand(connection)) for connection in connections]
    axes = tuple(axis for _, parts in joints for axis in parts)
    moving = movement(axes, connections, options.lock, options.free_mimic)
    check_joints(
        sum(rule.coordinate is not None for rule in moving.motion.values()),
        "hold some by --lock, or leave some out by --root and --tip",
    )
    check_locks(connections, options.lock)
    checked_passive(connections, options.allow_unphysical)
    passive = passive_axes(connections, moving.motion)
    sites, ends = anchor_frames(
        description, (f"{c.child}_{axis.suffix}" for c, axes in joints for axis in axes)
    )
    assembly = moving_links(description.bodies, joints, moving.motion, naming, sites)
    check_loops(description.loops, assembly.carrier)
    numbers = assembly.links if naming is None else _links(plain, options, moving.motion)
    named = {body.name for body in plain.bodies if not body.invented}
    freedom = options.lock, options.free_mimic, options.independent
    held = remaining_constraints(description, ends, assembly.frames, moving, *freedom)
    if numbers and all(link.massless for link in numbers):
        which = "moving link" if any(body.mass for body in plain.bodies) else "link"
        raise LinkwiseError(f"no {which} has mass, so no torque is to be had; give one mass and inertia")
    made = description.massless
    singular = check_mass_matrix(numbers, moving.coordinates, named, options.allow_unphysical, takes, made)
    notes = (
        *description.notes,
        *unphysical,
        *_of_root(plain, root, connections, options),
        *expansion_notes(connections),
        *held.notes,
        *moving.notes,
        *assembly.notes,
        *singular,
        *_massless(description, assembly.links),
        *_as_read(connections),
        *passive_notes(connections, passive),
        *_left_out(description, joints, moving.motion, assembly.carrier),
    )
    places = tied_places(held.ties, assembly.frames)
    parameters = naming.parameters(assembly.links, description.gravity, places) if naming else ()
    return Robot(
        description.name,
        moving.coordinates,
        assembly.links,
        description.gravity,
        parameters,
        (*notes, *naming.notes()) if naming else notes,
        options.request() | ({"allow_unphysical": True} if singular or made else {}),
        _with_known(assembly.frames, parameters, dict(description.parameters)),
        passive,
        held.ties,
        held.couplings,
        held.requested_independent,
        held.driven,
        limits=coordinate_limits(connections, moving.coordinates),
        followers=tuple(followers(axes, connections, moving, options.lock)),
        file_joints=moving_joints(joints, moving, description.ordered),
    )


def _with_known(
    frames: tuple[Frame, ...], parameters: tuple[Parameter, ...], values: dict[str, float]
) -> tuple[Frame, ...]:
    """Return the frames in the robot's parameters.

    Parameters of the file that no torque depends on become numbers.
    """
    kept = {parameter.name for parameter in parameters}

    def known(value: Scalar) -> Scalar:
        if isinstance(value, (int, float)):
            return value
        numbers = {s: sp.Float(values[s.name]) for s in value.free_symbols if s.name not in kept}
        found = value.xreplace(numbers)
        return found if found.free_symbols else float(found)

    moved: list[Frame] = []
    for frame in frames:
        x, y, z = map(known, frame.translation)
        moved.append(replace(frame, translation=(x, y, z)))
    return tuple(moved)


def _naming(description: Description, options: Options) -> Naming | None:
    """Return the Naming that gives names to the numbers that may be varied; None where all stay numbers."""
    if options.parameters == "numeric":
        return None
    wanted: Named = "every" if options.parameters == "symbolic" else "nonzero"
    return Naming("none" if description.only_named else wanted, dict(description.parameters))


def _connections(description: Description, options: Options) -> tuple[str, tuple[Connection, ...]]:
    """Return the root link and the joints, parents first.

    The joint of the base is among them where the base floats or is held. Raises LinkwiseError where the world
    itself is to float, and where no joint moves.
    """
    root, connections = depth_first(description)
    free = description.free
    if options.base == "floating" or (free and options.base is None):
        if root == description.ground:
            raise LinkwiseError(
                f"{root!r} is the world, which cannot float, and the file has joints for what moves in it; "
                "leave --base floating out, or begin at a body by --root"
            )
        connections = (Connection("base", "floating", "", root), *connections)
    elif free:
        connections = (Connection("base", "fixed", "", root, free.rotation, free.translation), *connections)
    if all(c.type == "fixed" for c in connections):
        raise LinkwiseError(
            "no joint moves; give one a moving type, or let the base move with --base floating"
        )
    return root, connections


def _links(description: Description, options: Options, motion: dict[str, AxisRule]) -> tuple[Link, ...]:
    """Return the moving links of a description, with the numbers or the parameters that it has."""
    joints = [(connection, expand(connection)) for connection in _connections(description, options)[1]]
    return moving_links(description.bodies, joints, motion).links


def _of_root(
    description: Description, root: str, connections: tuple[Connection, ...], options: Options
) -> list[Note]:
    """Return notes on the root: merged into the ground, or free to fall though no option asked for it."""
    if free := description.free:
        shown = named_pose("base", free.rotation, free.translation)
        return [Note("free", root, f"in the file {shown}", FREE)] if options.base is None else []
    return [
        Note("merged", body.name, f"into the ground, with its {body.mass:g} kg")
        for body in description.bodies
        if body.name == root and body.mass and all(c.child != root for c in connections)
    ]


def _massless(description: Description, links: tuple[Link, ...]) -> list[Note]:
    """Return a note for each moving link of the file, not the reader's own, that carries no mass."""
    named = {body.name for body in description.bodies if not body.invented}
    return [Note("massless", link.name) for link in links if link.massless and link.name in named]


def _as_read(connections: tuple[Connection, ...]) -> list[Note]:
    """Return a note for each joint whose rotation was rounded on reading."""
    return [
        Note("snapped", c.name, "rotation entries within 1e-12 of -1, 0, 1") for c in connections if c.snapped
    ]


def _left_out(
    description: Description,
    joints: list[tuple[Connection, tuple[Axis, ...]]],
    motion: dict[str, AxisRule],
    carrier: dict[str, int | None],
) -> list[Note]:
    """Return a note for each force and inertia of moving joints and bodies that the torques leave out."""
    moving = {c.name for c, axes in joints if any(motion[axis.name].coordinate is not None for axis in axes)}
    carried = {body for body, link in carrier.items() if link is not None}
    return [omission.note() for omission in description.omissions if omission.acts(moving, carried)]
