"""Joints as the robot's file has them, of which some are several coordinates, and numbers that simulators
keep for their positions: of a joint that turns in space a quaternion, four numbers for three angles.
"""

from collections.abc import Sequence
from typing import Literal, NamedTuple

from .chosen_names import MOST_NAMES, choice, plain, short

Order = Literal["mujoco", "pinocchio"]
FLOATING_ROOT = "root_joint"
"""What Pinocchio calls the joint by which the whole robot floats."""


class FileJoint(NamedTuple):
    """A joint of the file that moves, and its coordinates, counted from 0."""

    name: str
    kind: str
    """What it is, by the coordinates that it has:

    single      1, an angle or a length
    continuous  1, an angle without ends; Pinocchio has its cosine and sine
    planar      3: x, y and yaw
    ball        3: yaw, pitch and roll, about the moved z, y and x
    floating    6: x, y, z of the parent, then those of a ball
    """
    coordinates: tuple[int, ...]
    """Fewer than the kind has where some are locked."""


COORDINATES = {"single": 1, "continuous": 1, "planar": 3, "ball": 3, "floating": 6}
"""Of each kind; as many velocities has either simulator."""
POSITIONS: dict[str, dict[str, int]] = {
    "mujoco": COORDINATES | {"ball": 4, "floating": 7},
    "pinocchio": COORDINATES | {"continuous": 2, "planar": 4, "ball": 4, "floating": 7},
}
"""How many numbers of a qpos each kind has, by whose it is."""


def positions_of(joints: Sequence[FileJoint], order: str) -> int:
    """How many numbers a qpos has."""
    return sum(POSITIONS[order][joint.kind] for joint in joints)


def layout(joints: Sequence[FileJoint], order: str) -> str:
    """Which numbers of a qpos are which joint's, in words: base 0..6, knee 7."""
    told, at = [], 0
    for joint in joints:
        last = at + POSITIONS[order][joint.kind] - 1
        told.append(f"{plain(joint.name)} {at}" + (f"..{last}" if last > at else ""))
        at = last + 1
    return ", ".join(told[:MOST_NAMES]) + (f" and {len(told) - MOST_NAMES} more" if told[MOST_NAMES:] else "")


def why_wider(joints: Sequence[FileJoint], width: int, n: int) -> str:
    """Why positions have more numbers than n, if they are a qpos; else nothing."""
    for order in POSITIONS:
        wider = [joint for joint in joints if POSITIONS[order][joint.kind] > COORDINATES[joint.kind]]
        if wider and positions_of(joints, order) == width:
            parts = {
                "a quaternion, four numbers for three angles": ("ball", "floating"),
                "a cosine and a sine for one angle": ("continuous", "planar"),
            }
            told = [
                f"{', '.join(names)} {'has' if len(names) == 1 else 'have'} {what}"
                for what, kinds in parts.items()
                if (names := [plain(joint.name) for joint in wider if joint.kind in kinds])
            ]
            return f"{width} = {n} + {len(wider)}, for in a qpos of {order}'s {' and '.join(told)}"
    return ""


def in_given_order(joints: Sequence[FileJoint], names: Sequence[str]) -> list[FileJoint]:
    """The joints in the order of names; raises ValueError for names that are not those of all of them."""
    known = {joint.name: joint for joint in joints}
    floats = [joint for joint in joints if joint.kind == "floating"]
    if FLOATING_ROOT not in known and floats and floats[0].name not in names:
        known[FLOATING_ROOT] = floats[0]
    found = []
    for name in names:
        if name not in known:
            raise ValueError(
                f"joints has {short(name)}, which does not move by itself here: it is locked, follows "
                "another, or is not there; leave its numbers out. There are "
                f"{choice(name, known, 'robot.joint_names')}"
            )
        found.append(known[name])
    lost = [joint.name for joint in joints if joint not in found]
    if lost or len(found) > len(joints):
        told = f"lacks {choice('', lost, 'robot.joint_names')}" if lost else "has a joint twice"
        raise ValueError(f"joints {told}; give each joint once, in the order of qpos")
    return found
