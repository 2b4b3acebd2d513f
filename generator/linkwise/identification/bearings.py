"""Friction of the joints: which joints have it, and which torques it loads.

The coordinates of a floating base have no bearings. Where joints are tied, the joints that follow have
friction as well, and the independent joints carry it: G^T of their friction. There the motion may not tell
one joint's friction from that of others: then only friction with independent columns is fitted, first that of
the independent joints.
"""

from dataclasses import dataclass

import numpy as np
from linkwise_runtime.certainty.random_motions import SPEED, Motion
from linkwise_runtime.constraints.independent_joints import loose_base

from linkwise.analysis.opened_robot import OpenedRobot
from linkwise.arrays import Array, Mask

RANK = 1e-6
"""Part of a column, below which its remainder, without its share along other columns, is rounding."""


@dataclass(frozen=True, eq=False)
class Bearings:
    """Joints whose friction counts: first those with measured torques, then those that follow."""

    robot: OpenedRobot
    measured: tuple[int, ...]
    joints: tuple[int, ...]
    """Numbers of the joints, (B,)."""
    rubs: Mask
    """True for joints whose friction is fitted, (B,)."""
    sizes: Array
    """Root mean square of the joints' columns over random motions, (B, 2)."""

    @classmethod
    def of(cls, robot: OpenedRobot, measured: tuple[int, ...], motion: Motion, friction: bool) -> "Bearings":
        """Return the bearings of a robot; `friction` is whether the friction of any joint is fitted."""
        followers = [i for i in range(len(robot.joints)) if i not in robot.driven]
        joints = (*measured, *followers)
        floats = floating_coordinates(robot)
        rubs = np.array([friction and i not in floats for i in joints])
        free = cls(robot, measured, joints, rubs, np.tile([SPEED / np.sqrt(3.0), 1.0], (len(joints), 1)))
        if robot.constrained is None:
            return free
        columns = free.columns(motion[0], motion[1])
        sizes = np.sqrt((columns**2).sum(1).mean(0))
        told = rubs & _independent(columns.reshape(-1, len(joints), 2))
        return cls(robot, measured, joints, told, np.where(sizes > 0.0, sizes, 1.0))

    def columns(self, q: Array, qd: Array) -> Array:
        """Return the load of joints' viscous and Coulomb friction on the measured joints, (S, m, B, 2)."""
        joints, measured = list(self.joints), list(self.measured)
        own = np.stack([qd, np.sign(qd)], -1)[:, None, joints]
        if self.robot.constrained is None:
            borne = np.eye(len(self.robot.joints))[None]
        else:
            borne = self.robot.constrained.velocity_map(q)
        carried: Array = borne[:, joints][:, :, measured].swapaxes(1, 2)[..., None] * own
        return carried


def floating_coordinates(robot: OpenedRobot) -> frozenset[int]:
    """Return the coordinates of a floating base, in space or in a plane; an empty set for any other base."""
    tree = robot.model.backend.tree
    return frozenset() if tree is None else frozenset(loose_base(tree))


def _independent(columns: Array) -> Mask:
    """Return whether a joint's columns (rows, B, 2) are independent of those of joints before it, (B,)."""
    told = np.zeros(columns.shape[1], dtype=np.bool_)
    kept = [np.zeros((len(columns), 0))] * 2
    for at in range(columns.shape[1]):
        left = [_across(columns[:, at, which], kept[which]) for which in range(2)]
        sizes = [np.linalg.norm(columns[:, at, which]) for which in range(2)]
        rests = [np.linalg.norm(rest) for rest in left]
        if all(rest > RANK * size for rest, size in zip(rests, sizes, strict=True)):
            told[at] = True
            kept = [np.column_stack([a, b / size]) for a, b, size in zip(kept, left, rests, strict=True)]
    return told


def _across(column: Array, directions: Array) -> Array:
    """Return a column without its components along directions of length 1."""
    for _ in range(2):  # once more, to remove what rounding has left
        column = column - directions @ (directions.T @ column)
    return column
