"""The dynamics of an MJCF file, through MuJoCo's own compiler; what is not rigid bodies is noted as ignored.

A hinge's or slide's coordinate is its qpos. Where MuJoCo has a quaternion, a ball turns by yaw, pitch, roll,
and a free joint by those after x, y, z of the world.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from linkwise.errors import LinkwiseError
from linkwise.robot import transforms as geo
from linkwise.robot.description import IDENTITY, ZERO3, Body, Connection, Coupling, Description
from linkwise.robot.readers.mjcf_unmodelled import unused
from linkwise.robot.robot import Mat3, Note, Rotation, Vec3

TYPES = ("floating", "ball", "prismatic", "revolute")
"""Joint types in the order of MuJoCo's mjtJoint: free, ball, slide, hinge."""

EQUALITY_OF_JOINTS = 2
"""mjEQ_JOINT of MuJoCo's mjtEq."""


def read_mjcf(path: Path) -> Description:
    """Read a robot; raises LinkwiseError with MuJoCo's own words, or when MuJoCo is missing."""
    try:
        import mujoco
    except ImportError:
        raise LinkwiseError("MuJoCo reads MJCF files and is missing; pip install linkwise[mjcf]") from None
    try:
        model = mujoco.MjModel.from_xml_path(str(path))
    except ValueError as error:
        raise LinkwiseError(f"MuJoCo cannot compile it: {error}") from None
    notes: list[Note] = []
    bodies, connections = [Body("world")], list[Connection]()
    anchors: list[Vec3] = [ZERO3]
    for number in range(1, model.nbody):
        chain, body, anchor = _body(model, number, anchors, notes)
        connections += chain
        bodies += [Body(c.child, invented=True) for c in chain[:-1]] + [body]
        anchors.append(anchor)
    name = model.names.split(b"\0")[0].decode()
    x, y, z = map(float, model.opt.gravity)
    return Description(
        path.stem if name in ("", "MuJoCo Model") else name,
        tuple(bodies),
        tuple(connections),
        (x, y, z),
        notes=(*notes, *unused(model)),
        couplings=_couplings(model, [c.name for c in connections if c.type != "fixed"]),
    )


def _couplings(model: Any, joints: list[str]) -> tuple[Coupling, ...]:
    """Return which joint follows which by an active equality; -1 stands for a constant."""
    return tuple(
        Coupling(joints[int(one)], joints[int(other)] if other >= 0 else "")
        for kind, active, one, other in zip(
            model.eq_type, model.eq_active0, model.eq_obj1id, model.eq_obj2id, strict=True
        )
        if active and int(kind) == EQUALITY_OF_JOINTS
    )


@dataclass(frozen=True)
class _Joint:
    """One joint of a body: where its anchor is in the body's frame, and at which q the body rests."""

    name: str
    type: str
    axis: tuple[float, float, float] = (0.0, 0.0, 1.0)
    anchor: Vec3 = ZERO3
    rest: float = 0.0
    damping: float = 0.0
    friction: float = 0.0


def _body(
    model: Any, number: int, anchors: list[Vec3], notes: list[Note]
) -> tuple[list[Connection], Body, Vec3]:
    """Return a body behind the chain of its joints, massless bodies between them, and its frame's place.

    The frame sits on the last joint's anchor, which the chain leaves nothing to undo.
    """
    name, parent = _name(model, number), int(model.body_parentid[number])
    turn = _rotation(model.body_quat[number], name, notes)
    position = geo.add(_vector(model.body_pos[number]), _minus(anchors[parent]))
    chain: list[Connection] = []
    joints, last, start = _joints(model, number, name), ZERO3, _name(model, parent)
    for joint in joints:
        if joint.type == "floating":
            turn, position = IDENTITY, ZERO3
        x, y, z = joint.axis
        shift = geo.add(joint.anchor, _minus(last))
        if joint.type == "prismatic":
            shift = geo.add(shift, (-joint.rest * x, -joint.rest * y, -joint.rest * z))
        position = geo.add(position, geo.rotate(turn, shift))
        if joint.type == "revolute" and joint.rest:
            turn = geo.compose(turn, _about(joint.axis, -joint.rest))
        child = name if joint is joints[-1] else f"{name}_{joint.name}"
        ends, losses = (start, child), (joint.damping, joint.friction)
        chain.append(Connection(joint.name, joint.type, *ends, turn, position, joint.axis, None, *losses))
        turn, position, last, start = IDENTITY, ZERO3, joint.anchor, child
    com = geo.add(_vector(model.body_ipos[number]), _minus(last))
    return chain, Body(name, float(model.body_mass[number]), com, _inertia(model, number)), last


def _joints(model: Any, number: int, body: str) -> list[_Joint]:
    """Return the joints of a body, a fixed one if it has none."""
    first, count = int(model.body_jntadr[number]), int(model.body_jntnum[number])
    if not count:
        return [_Joint(f"{body}_weld", "fixed")]
    joints = []
    for index in range(first, first + count):
        kind, dof = TYPES[int(model.jnt_type[index])], int(model.jnt_dofadr[index])
        single = kind in ("prismatic", "revolute")
        x, y, z = map(float, model.jnt_axis[index])
        joints.append(
            _Joint(
                model.joint(index).name or f"{body}_joint{index - first + 1 if count > 1 else ''}",
                kind,
                (x, y, z),
                _vector(model.jnt_pos[index]),
                float(model.qpos0[model.jnt_qposadr[index]]) if single else 0.0,
                float(model.dof_damping[dof]),
                float(model.dof_frictionloss[dof]),
            )
        )
    return joints


def _name(model: Any, number: int) -> str:
    return model.body(number).name or f"body{number}"


def _vector(a: Any) -> Vec3:
    x, y, z = map(float, a)
    return x, y, z


def _minus(a: Vec3) -> Vec3:
    x, y, z = (geo.times(-1.0, e) for e in a)
    return x, y, z


def _about(axis: tuple[float, float, float], angle: float) -> Rotation:
    align = geo.align_z(axis)
    return geo.compose(geo.compose(align, geo.about_z(angle)), geo.transpose(align))


def _rotation(quaternion: Any, name: str, notes: list[Note]) -> Rotation:
    raw = geo.from_quaternion(*map(float, quaternion))
    rotation = geo.snap(raw)
    if rotation != tuple(map(tuple, raw)):
        notes.append(Note("snapped", name, "rotation entries within 1e-12 of -1, 0, 1"))
    return rotation


def _inertia(model: Any, number: int) -> Mat3:
    x, y, z = map(float, model.body_inertia[number])
    frame = geo.snap(geo.from_quaternion(*map(float, model.body_iquat[number])))
    return geo.rotate_inertia(frame, ((x, 0.0, 0.0), (0.0, y, 0.0), (0.0, 0.0, z)))
