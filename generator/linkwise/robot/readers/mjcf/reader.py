"""Reader of MJCF files, through MuJoCo's own compiler; what is not rigid bodies is noted as ignored.

A hinge's or slide's coordinate is its qpos. Where MuJoCo has a quaternion, a ball turns by yaw, pitch, roll,
and a free joint moves by x, y, z of the world and then turns like a ball.
"""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from linkwise.errors import LinkwiseError
from linkwise.extras import extra
from linkwise.own_process import Ended, OutOfTime, ProcessLimits, in_own_process
from linkwise.robot import transforms
from linkwise.robot.description import IDENTITY, ZERO3, Body, Connection, Description, Site
from linkwise.robot.notes import WARNED, Note
from linkwise.robot.readers.mjcf.equalities import equalities, joints_of
from linkwise.robot.readers.mjcf.files import compile_model, mjcf_files
from linkwise.robot.readers.mjcf.forces import limits_of, passive_of, switched_off
from linkwise.robot.readers.mjcf.unmodelled import omissions, unused
from linkwise.robot.robot import NOTHING, UNLIMITED, Limits, Mat3, Passive, Rotation, Vec3

TYPES = ("floating", "ball", "prismatic", "revolute")
"""Joint types in the order of MuJoCo's mjtJoint: free, ball, slide, hinge."""


LIMITS = ProcessLimits(seconds=15, memory=750 << 20)
"""Time and memory that MuJoCo may take for a file; the largest robots known take 1 s."""


def read_mjcf(path: Path, text: bytes | None = None) -> Description:
    """Return the description of a robot; `text`, if given, replaces the file's own text.

    Raises LinkwiseError with MuJoCo's own words, for a file that takes it too much time or memory, and where
    MuJoCo is missing.
    """
    mujoco, files = extra("mujoco"), mjcf_files(path)
    try:
        return in_own_process(lambda: _described(mujoco, path, *compile_model(mujoco, files, text)), LIMITS)
    except MemoryError:
        fault = f"takes more than {LIMITS.memory >> 20} MiB of memory"
    except OutOfTime:
        fault = f"takes more than {LIMITS.seconds} s of processor time"
    except Ended as end:
        fault = f"does not survive it: {end}"
    raise LinkwiseError(
        f"MuJoCo's compiler {fault}; repeat less, leave out what does not move, and give bodies an"
        " <inertial>, which spares their meshes"
    )


def _described(mujoco: Any, path: Path, model: Any, warnings: list[str]) -> Description:
    bodies, connections = [Body(_name(model, 0))], list[Connection]()
    for number in range(1, model.nbody):
        chain, body = _body(mujoco, model, number)
        connections += chain
        bodies += [Body(c.child, invented=True) for c in chain[:-1]] + [body]
    name = model.names.split(b"\0")[0].decode()
    x, y, z = map(float, model.opt.gravity)
    weightless = "gravity" in switched_off(mujoco, model)
    joints = [c.name for c in connections if c.type != "fixed"]
    links = [_name(model, number) for number in range(model.nbody)]
    equal = equalities(mujoco, model, joints, links)
    return Description(
        path.stem if name in ("", "MuJoCo Model") else name,
        tuple(bodies),
        tuple(connections),
        ZERO3 if weightless else (x, y, z),
        notes=(*(Note("warned", text, "", WARNED) for text in warnings), *unused(model), *equal.notes),
        ties=equal.ties,
        couplings=equal.couplings,
        loops=equal.loops,
        omissions=omissions(mujoco, model, joints, links),
        sites=_sites(model, links),
        driven=_driven(mujoco, model, joints),
        ordered=True,
    )


def _driven(mujoco: Any, model: Any, joints: list[str]) -> tuple[str, ...]:
    """Return the joints that actuators turn or push, by fixed tendons too; a muscle drives no one joint."""
    kinds, found = (mujoco.mjtTrn.mjTRN_JOINT, mujoco.mjtTrn.mjTRN_JOINTINPARENT), list[int]()
    for kind, (target, _) in zip(model.actuator_trntype, model.actuator_trnid, strict=True):
        if mujoco.mjtTrn(int(kind)) in kinds:
            found.append(int(target))
        elif mujoco.mjtTrn(int(kind)) == mujoco.mjtTrn.mjTRN_TENDON:
            found += joints_of(mujoco, model, int(target))
    return tuple(joints[at] for at in found)


@dataclass(frozen=True)
class _Joint:
    """One joint of a body: its anchor in the body's frame, and `rest`, the q at which the body rests."""

    name: str
    type: str
    axis: tuple[float, float, float] = (0.0, 0.0, 1.0)
    anchor: Vec3 = ZERO3
    rest: float = 0.0
    passive: Passive = NOTHING
    limits: Limits = UNLIMITED


def _body(mujoco: Any, model: Any, number: int) -> tuple[list[Connection], Body]:
    """Return the chain of a body's joints, which massless bodies connect, and the body behind it.

    The body's frame is the file's, whose origin need not be the last joint's anchor.
    """
    name, parent = _name(model, number), int(model.body_parentid[number])
    turn, snapped = transforms.snapped(transforms.from_quaternion(*map(float, model.body_quat[number])))
    position = _vector(model.body_pos[number])
    chain: list[Connection] = []
    joints, last, start = _joints(mujoco, model, number, name), ZERO3, _name(model, parent)
    for joint in joints:
        if joint.type == "floating":
            turn, position, snapped = IDENTITY, ZERO3, False
        x, y, z = joint.axis
        shift = transforms.add(joint.anchor, transforms.minus(last))
        if joint.type == "prismatic":
            shift = transforms.add(shift, (-joint.rest * x, -joint.rest * y, -joint.rest * z))
        position = transforms.add(position, transforms.rotate(turn, shift))
        if joint.type == "revolute" and joint.rest:
            turn = transforms.compose(turn, _about(joint.axis, -joint.rest))
        child = name if joint is joints[-1] else f"{name}_{joint.name}"
        place = start, child, turn, position
        joined = Connection(joint.name, joint.type, *place, joint.axis, None, snapped, joint.passive)
        chain.append(replace(joined, limits=joint.limits))
        turn, position, last, start, snapped = IDENTITY, ZERO3, joint.anchor, child, False
    mass, com = float(model.body_mass[number]), _vector(model.body_ipos[number])
    return chain, Body(name, mass, com, _inertia(model, number), origin=transforms.minus(last))


def _sites(model: Any, links: list[str]) -> tuple[Site, ...]:
    """Return the sites that have names, in the frames of their bodies."""
    return tuple(
        Site(
            model.site(index).name,
            links[int(model.site_bodyid[index])],
            transforms.snap(transforms.from_quaternion(*map(float, model.site_quat[index]))),
            _vector(model.site_pos[index]),
        )
        for index in range(model.nsite)
        if model.site(index).name.strip()
    )


def _joints(mujoco: Any, model: Any, number: int, body: str) -> list[_Joint]:
    """Return the joints of a body, a fixed one if it has none."""
    first, count = int(model.body_jntadr[number]), int(model.body_jntnum[number])
    if not count:
        return [_Joint(f"{body}_weld", "fixed")]
    joints, off = [], switched_off(mujoco, model)
    for index in range(first, first + count):
        kind = TYPES[int(model.jnt_type[index])]
        single = kind in ("prismatic", "revolute")
        x, y, z = map(float, model.jnt_axis[index])
        joints.append(
            _Joint(
                joint_name(model.joint(index).name, body, index - first, count),
                kind,
                (x, y, z),
                _vector(model.jnt_pos[index]),
                float(model.qpos0[model.jnt_qposadr[index]]) if single else 0.0,
                passive_of(mujoco, model, index, off),
                limits_of(model, index) if single else UNLIMITED,
            )
        )
    return joints


def joint_name(name: str, body: str, at: int, count: int) -> str:
    """Return the name of joint `at` of a body's `count`: its name in the file, or one made of the body's."""
    return name or f"{body}_joint{at + 1 if count > 1 else ''}"


def body_name(name: str, number: int) -> str:
    """Return the name of the body that MuJoCo counts as `number`: its name in the file, or one made of it."""
    return name or f"body{number}"


def _name(model: Any, number: int) -> str:
    return body_name(model.body(number).name, number)


def _vector(a: Any) -> Vec3:
    x, y, z = map(float, a)
    return x, y, z


def _about(axis: tuple[float, float, float], angle: float) -> Rotation:
    align = transforms.align_z(axis)
    return transforms.compose(
        transforms.compose(align, transforms.about_z(angle)), transforms.transpose(align)
    )


def _inertia(model: Any, number: int) -> Mat3:
    x, y, z = map(float, model.body_inertia[number])
    frame = transforms.snap(transforms.from_quaternion(*map(float, model.body_iquat[number])))
    return transforms.rotate_inertia(frame, ((x, 0.0, 0.0), (0.0, y, 0.0), (0.0, 0.0, z)))
