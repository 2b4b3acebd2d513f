"""Joints of the robot's file, some of them with several coordinates, and their positions in simulators.

Simulators keep a quaternion for a joint that turns in space: four numbers for three angles. The angles are
yaw, pitch and roll, about the moved z, y and x; E maps their rates to the angular velocity w:

R = Rz(yaw) Ry(pitch) Rx(roll)      w = E (yaw', pitch', roll'), w along the body's axes

         -sin(pitch)                 0           1
    E =   sin(roll) cos(pitch)   cos(roll)       0
          cos(roll) cos(pitch)  -sin(roll)       0
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from .chosen_names import MOST_NAMES, choice, plain, short

Floats = NDArray[np.float64]
Order = Literal["mujoco", "pinocchio"]
FLOATING_ROOT = "root_joint"
"""Name that Pinocchio gives to the joint by which the whole robot floats."""


@dataclass(frozen=True)
class FileJoint:
    """A joint of the file that moves, and its coordinates, counted from 0."""

    name: str
    kind: Literal["single", "continuous", "planar", "ball", "floating"]
    """Kind of the joint, by the coordinates that it has:

    single      1, an angle or a length
    continuous  1, an angle without limits; Pinocchio has its cosine and sine
    planar      3: x, y and yaw
    ball        3: yaw, pitch and roll, about the moved z, y and x
    floating    6: x, y, z of the parent, then those of a ball
    """
    coordinates: tuple[int, ...]
    """Indices of its coordinates; fewer than the kind has where some are locked."""
    pinocchio: int
    """Place among the joints of Pinocchio's model."""


COORDINATES = {"single": 1, "continuous": 1, "planar": 3, "ball": 3, "floating": 6}
"""Number of coordinates of each kind; both simulators have as many velocities."""
POSITIONS: dict[str, dict[str, int]] = {
    "mujoco": COORDINATES | {"ball": 4, "floating": 7},
    "pinocchio": COORDINATES | {"continuous": 2, "planar": 4, "ball": 4, "floating": 7},
}
"""Number of values that each kind has in a qpos, by simulator."""


def positions_of(joints: Sequence[FileJoint], order: str) -> int:
    """Return the number of values in a qpos."""
    return sum(POSITIONS[order][joint.kind] for joint in joints)


def layout(joints: Sequence[FileJoint], order: str) -> str:
    """Return in words which values of a qpos belong to which joint: base 0..6, knee 7."""
    told, at = [], 0
    for joint in joints:
        last = at + POSITIONS[order][joint.kind] - 1
        told.append(f"{plain(joint.name)} {at}" + (f"..{last}" if last > at else ""))
        at = last + 1
    return ", ".join(told[:MOST_NAMES]) + (f" and {len(told) - MOST_NAMES} more" if told[MOST_NAMES:] else "")


def why_wider(joints: Sequence[FileJoint], width: int, n: int) -> str:
    """Return the reason why positions have more numbers than n, if they are a qpos; else ""."""
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
    """Return the joints in the order of names; raise ValueError unless names has each joint once."""
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


def angles_of(quaternion: Floats) -> Floats:
    """Return yaw, pitch (within 90 degrees) and roll (..., 3) of unit quaternions w, x, y, z (..., 4)."""
    w, x, y, z = np.moveaxis(quaternion, -1, 0)
    yaw = np.arctan2(2.0 * (x * y + w * z), w * w + x * x - y * y - z * z)
    roll = np.arctan2(2.0 * (y * z + w * x), w * w - x * x - y * y + z * z)
    across = np.hypot(2.0 * (y * z + w * x), w * w - x * x - y * y + z * z)
    pitch = np.arctan2(2.0 * (w * y - x * z), across)
    return np.stack([yaw, pitch, roll], -1)


def continued(given: Floats, before: Floats | None = None) -> Floats:
    """Return the same attitudes (..., T, 3) by angles that do not jump from sample to sample.

    before: angles (..., 3) of the sample before the first, from which they continue

    Each attitude has two triples up to whole turns, (yaw, pitch, roll) and (yaw + pi, pi - pitch, roll + pi):
    every sample takes the one that is nearer to that of the sample before it.
    """
    if before is not None:
        return continued(np.concatenate([before[..., None, :], given], -2))[..., 1:, :]
    other = np.stack([given[..., 0] + np.pi, np.pi - given[..., 1], given[..., 2] + np.pi], -1)
    same, crossed = (_apart(triple[..., 1:, :], given[..., :-1, :]) for triple in (given, other))
    # A change from either triple to the other is equally long, so that changes can be counted.
    switches = np.concatenate([np.zeros((*given.shape[:-2], 1), int), crossed < same], -1)
    found = np.where((np.cumsum(switches, -1) % 2)[..., None].astype(bool), other, given)
    return np.asarray(np.unwrap(found, axis=-2))


def _apart(one: Floats, other: Floats) -> Floats:
    """Return the sum of the squared differences between angles (..., 3), up to whole turns."""
    turned = np.remainder(one - other + np.pi, 2.0 * np.pi) - np.pi
    apart: Floats = (turned * turned).sum(-1)
    return apart


def rates_map(angles: Floats) -> Floats:
    """Return the matrix E, (..., 3, 3), of angles (..., 3)."""
    (_, sp, sr), (_, cp, cr) = (np.moveaxis(f(angles), -1, 0) for f in (np.sin, np.cos))
    zero = 0.0 * sp
    rows = [[-sp, zero, zero + 1.0], [sr * cp, cr, zero], [cr * cp, -sr, zero]]
    return np.stack([np.stack(row, -1) for row in rows], -2)


def rates_of(angles: Floats, turning: Floats) -> Floats:
    """Return E^-1 w: the rates of the angles for angular velocities along the body's axes, (..., 3) each."""
    (_, sp, sr), (_, cp, cr) = (np.moveaxis(f(angles), -1, 0) for f in (np.sin, np.cos))
    x, y, z = np.moveaxis(turning, -1, 0)
    yaw = (y * sr + z * cr) / cp
    return np.stack([yaw, y * cr - z * sr, x + yaw * sp], -1)


def turning_of_rates(angles: Floats, rates: Floats) -> Floats:
    """Return dE/dt times the rates, (..., 3): the part of w' beside E times the change of the rates."""
    (_, sp, sr), (_, cp, cr) = (np.moveaxis(f(angles), -1, 0) for f in (np.sin, np.cos))
    yaw, pitch, roll = np.moveaxis(rates, -1, 0)
    x = -yaw * cp * pitch
    y = -pitch * sr * roll + yaw * (cr * roll * cp - sr * sp * pitch)
    z = -pitch * cr * roll - yaw * (sr * roll * cp + cr * sp * pitch)
    return np.stack([x, y, z], -1)


def turned(angles: Floats, vectors: Floats) -> Floats:
    """Return vectors along the body's axes, (..., 3), along the axes in which the body turns."""
    (sy, sp, sr), (cy, cp, cr) = (np.moveaxis(f(angles), -1, 0) for f in (np.sin, np.cos))
    x, y, z = np.moveaxis(vectors, -1, 0)
    y, z = cr * y - sr * z, sr * y + cr * z
    x, z = cp * x + sp * z, -sp * x + cp * z
    return np.stack([cy * x - sy * y, sy * x + cy * y, z], -1)
