"""A package's robot as a URDF file, from which `generate` makes the same torques.

Links and joints have their own names and the frames of the package: z on the joint's axis. Joints have the
limits of the robot's file, and its other named frames are links without mass.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from xml.sax.saxutils import quoteattr

import numpy as np
from linkwise_runtime.certainty.pseudo_inertia import central
from linkwise_runtime.rule.joint_tree import JointTree, TreeFrame, TreeJoint
from linkwise_runtime.structure import PassiveJoint

from linkwise.arrays import Array
from linkwise.escape import printable
from linkwise.package.entries import JointEntry
from linkwise.package.manifest import Manifest

ENDLESS = 1e9
"""Limit that is written where there is none, as URDF requires one."""
STANDARD = 9.81
"""Gravity in m/s^2 along -z with which a URDF file, which says nothing of gravity, is read."""


def lost_gravity(tree: JointTree) -> str:
    """Return what is lost where gravity is stronger or weaker than a URDF file is read with; else ""."""
    size = float(np.linalg.norm(tree.gravity))
    if math.isclose(size, STANDARD, rel_tol=1e-9):
        return ""
    heavier = f"is {STANDARD / size:.6g} times as heavy" if size else "has weight"
    return (
        f"a URDF file has no gravity, and is read with {STANDARD} m/s^2 along -z where the package has "
        f"{size:.6g}: the robot generated from it {heavier}"
    )


def urdf_text(manifest: Manifest, pi: Mapping[str, Array], friction: Mapping[str, Array]) -> str:
    """Return the file of a package with a tree.

    pi: inertial parameters (10,) by link
    friction: viscous and Coulomb (2,) by joint; joints that are not in it keep the package's own
    """
    tree, joints = manifest.tree, manifest.joints
    assert tree is not None
    root, turn = root_link(tree), _upright(tree)
    lines = [
        '<?xml version="1.0"?>',
        *([f"<!-- Gravity is lost: {lost}. -->"] if (lost := lost_gravity(tree)) else []),
        f"<robot name={_attribute(manifest.name)}>",
    ]
    if turn is not None:
        base, mount = (
            _unused(wanted, [*_links(tree), root, *(joint.name for joint in tree.joints)])
            for wanted in (f"{root}_upright", "mount")
        )
        lines += [f"  <link name={_attribute(base)}/>"]
        lines += _joint(mount, "fixed", base, root, (0.0, 0.0, 0.0), turn, [])
    lines += [f"  <link name={_attribute(root)}/>"]
    masters = [joint.name for joint in joints]
    own = {entry.joint: np.array([entry.damping, entry.friction]) for entry in manifest.passive}
    for joint in tree.joints:
        lines += _link(joint.link, pi)
        parent = root if joint.parent is None else tree.joints[joint.parent].link
        more = ['<axis xyz="0 0 1"/>', *_follows(joint, masters)]
        rubs = friction.get(joint.name, own.get(joint.name))
        if rubs is not None and (rubs.any() or joint.name in masters):
            viscous, coulomb = rubs.tolist()
            more.append(f'<dynamics damping="{viscous:.6g}" friction="{coulomb:.6g}"/>')
        kind, limits = _limits(joint, joints[joint.coordinate])
        place = joint.translation, np.array(joint.rotation)
        lines += _joint(joint.name, kind, parent, joint.link, *place, [*more, *limits])
    lines += [line for frame in _frames(tree) for line in _frame(frame, tree)]
    lines += [line for entry in manifest.passive for line in _passive(entry)]
    return "\n".join([*lines, "</robot>", ""])


def root_link(tree: JointTree) -> str:
    """Return the name of the file's link on the ground, in the axes of the package's base.

    It is the name in the robot's file, where that has one.
    """
    upright = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
    for frame in tree.frames:
        if frame.joint is None and frame.rotation == upright and not any(frame.translation):
            return frame.name
    return _unused("base", _links(tree))


def _links(tree: JointTree) -> list[str]:
    """Return the names of the file's links."""
    return [*(joint.link for joint in tree.joints), *(frame.name for frame in tree.frames)]


def _frames(tree: JointTree) -> list[TreeFrame]:
    """Return the frames of the robot's file whose names no link here has."""
    taken = [root_link(tree), *(joint.link for joint in tree.joints)]
    return [frame for frame in tree.frames if frame.name not in taken]


def _frame(frame: TreeFrame, tree: JointTree) -> list[str]:
    parent = root_link(tree) if frame.joint is None else tree.joints[frame.joint].link
    joint = _unused(f"{frame.name}_fixed", [joint.name for joint in tree.joints])
    turn = np.array(frame.rotation)
    return [
        f"  <link name={_attribute(frame.name)}/>",
        *_joint(joint, "fixed", parent, frame.name, frame.translation, turn, []),
    ]


def _limits(joint: TreeJoint, entry: JointEntry) -> tuple[str, list[str]]:
    """Return the type of a joint, and its limits; those of a joint that follows are not known."""
    given = asdict(entry) if entry.name == joint.name else {}
    ends = [given.get(end) for end in ("lower", "upper")]
    kind = "prismatic" if joint.kind == "prismatic" else "continuous" if ends == [None, None] else "revolute"
    said = {end: sign * ENDLESS for end, sign in (("lower", -1), ("upper", 1)) if kind != "continuous"}
    said |= dict.fromkeys(("effort", "velocity"), ENDLESS)
    said |= {what: value for what in said if (value := given.get(what)) is not None}
    if kind == "continuous" and set(said.values()) == {ENDLESS}:
        return kind, []
    return kind, ["<limit " + " ".join(f'{what}="{value!r}"' for what, value in said.items()) + "/>"]


def _passive(entry: PassiveJoint) -> list[str]:
    """Return spring and armature of a joint, in extensions of URDF by simulators."""
    joint = _attribute(entry.joint)
    lines = []
    if entry.stiffness:
        lines += [
            f"  <gazebo reference={joint}>",
            f"    <springStiffness>{entry.stiffness!r}</springStiffness>",
            f"    <springReference>{entry.rest!r}</springReference>",
            "  </gazebo>",
        ]
    if entry.armature:
        lines += [
            '  <transmission xmlns:drake="http://drake.mit.edu">',
            "    <type>transmission_interface/SimpleTransmission</type>",
            f"    <joint name={joint}/>",
            f"    <actuator name={joint}>",
            f'      <drake:rotor_inertia value="{entry.armature!r}"/>',
            "    </actuator>",
            "  </transmission>",
        ]
    return lines


def _link(link: str, pi: Mapping[str, Array]) -> list[str]:
    if link not in pi:
        return [f"  <link name={_attribute(link)}/>"]
    mass, com, inertia = central(pi[link])
    entries = zip(("xx", "xy", "xz", "yy", "yz", "zz"), inertia[np.triu_indices(3)].tolist(), strict=True)
    moments = " ".join(f'i{key}="{value!r}"' for key, value in entries)
    return [
        f"  <link name={_attribute(link)}>",
        "    <inertial>",
        f'      <origin xyz="{_row(com)}" rpy="0 0 0"/>',
        f'      <mass value="{mass!r}"/>',
        f"      <inertia {moments}/>",
        "    </inertial>",
        "  </link>",
    ]


def _joint(
    name: str,
    kind: str,
    parent: str,
    child: str,
    place: Sequence[float],
    turn: Array,
    more: Sequence[str],
) -> list[str]:
    return [
        f"  <joint name={_attribute(name)} type={_attribute(kind)}>",
        f'    <origin xyz="{_row(np.array(place))}" rpy="{_row(rpy(turn))}"/>',
        f"    <parent link={_attribute(parent)}/>",
        f"    <child link={_attribute(child)}/>",
        *(f"    {line}" for line in more),
        "  </joint>",
    ]


def _follows(joint: TreeJoint, masters: Sequence[str]) -> list[str]:
    master = masters[joint.coordinate]
    if master == joint.name:
        return []
    return [f'<mimic joint={_attribute(master)} multiplier="{joint.ratio!r}"/>']


def _upright(tree: JointTree) -> Array | None:
    """Return the axes of the package's base in axes where gravity is along -z; None where they are equal."""
    g = np.array(tree.gravity)
    size = float(np.linalg.norm(g))
    if size == 0 or ((g[:2] == 0).all() and g[2] < 0):
        return None
    up = -g / size
    x = np.eye(3)[int(np.abs(up).argmin())]
    x = x - (x @ up) * up
    x /= np.linalg.norm(x)
    return np.stack([x, np.cross(up, x), up])


def rpy(turn: Array) -> Array:
    """Return the angles (roll, pitch, yaw), (3,), with Rz(yaw) Ry(pitch) Rx(roll) = turn."""
    pitch = math.atan2(-turn[2, 0], math.hypot(turn[0, 0], turn[1, 0]))
    if abs(math.cos(pitch)) < 1e-9:  # roll and yaw turn about one axis: all of it is roll
        return np.array([math.atan2(-turn[1, 2], turn[1, 1]), pitch, 0.0])
    return np.array([math.atan2(turn[2, 1], turn[2, 2]), pitch, math.atan2(turn[1, 0], turn[0, 0])])


def _row(values: Array) -> str:
    return " ".join(repr(value) for value in values.tolist())


def _attribute(text: str) -> str:
    """Return a name in quotes, without characters that XML cannot hold."""
    return quoteattr(printable(text))


def _unused(name: str, taken: Sequence[str]) -> str:
    while name in taken:
        name += "_"
    return name
