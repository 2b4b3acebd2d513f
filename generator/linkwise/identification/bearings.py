"""Which joints rub, and which torques that loads.

The coordinates of a base that floats have no bearings. Where joints are tied, those that follow rub as well,
and the independent ones bear it: G^T of their friction. There the motion may not tell one joint's friction
from that of others: so much of it as needs another column is then fitted, the independent joints' first.
"""

from dataclasses import dataclass

import numpy as np
from linkwise_runtime.constraints.independent_joints import loose_base
from numpy.typing import NDArray

from linkwise.analysis.loaded_robot import LoadedRobot
from linkwise.identification.random_motions import SPEED, Motion
from linkwise.package.load import Array

RANK = 1e-6
"""Of a column: what is left of it across others is rounding where it is smaller."""


@dataclass(frozen=True, eq=False)
class Bearings:
    """Joints whose friction counts: those whose torques are measured, and behind them those that follow."""

    robot: LoadedRobot
    measured: tuple[int, ...]
    joints: tuple[int, ...]
    """(B,)"""
    rubs: NDArray[np.bool_]
    """Whose friction is fitted, (B,)."""
    sizes: Array
    """Root mean square of their columns over random motions, (B, 2)."""

    @classmethod
    def of(cls, robot: LoadedRobot, measured: tuple[int, ...], motion: Motion, friction: bool) -> "Bearings":
        """friction: whether any joint's is fitted."""
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
        """What measured joints bear of the viscous and the Coulomb friction of each joint, (S, m, B, 2)."""
        joints, measured = list(self.joints), list(self.measured)
        own = np.stack([qd, np.sign(qd)], -1)[:, None, joints]
        if self.robot.constrained is None:
            borne = np.eye(len(self.robot.joints))[None]
        else:
            borne = self.robot.constrained.velocity_map(q)
        carried: Array = borne[:, joints][:, :, measured].swapaxes(1, 2)[..., None] * own
        return carried


def floating_coordinates(robot: LoadedRobot) -> frozenset[int]:
    """Coordinates of a base that floats, in space or in a plane; none of another."""
    tree = robot.model.backend.tree
    return frozenset() if tree is None else frozenset(loose_base(tree))


def _independent(columns: Array) -> NDArray[np.bool_]:
    """Which joints' columns (rows, B, 2) are no combinations of those of the joints before them."""
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
    """What is left of it across directions of length 1."""
    for _ in range(2):  # once more, for what rounding has left
        column = column - directions @ (directions.T @ column)
    return column
