"""Both legs in one study: columns of the right and of the left under names that tell neither.

A cycle of the left is mirrored, so that it is as one of the right: what is of its own side is called `ipsi`,
what is of the other `contra`, and coordinates that a reflection about the robot's middle plane turns round
change sign.
"""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from linkwise.analysis.job import Job
from linkwise.analysis.motion_words import MotionWords
from linkwise.analysis.opened_robot import OpenedRobot
from linkwise.analysis.result_rows import Column
from linkwise.arrays import Array, Index
from linkwise.errors import LinkwiseError
from linkwise.escape import listed
from linkwise.study.deviation_columns import is_deviation
from linkwise.study.middle_plane import turned_joints
from linkwise.study.plan import LEFT, RIGHT, Cycles

WORDS = dict.fromkeys(("r", "R", "right", "Right", "RIGHT"), RIGHT)
WORDS |= dict.fromkeys(("l", "L", "left", "Left", "LEFT"), LEFT)
"""Words of a name that tell a side."""
OTHER = {"r": "l", "R": "L", "right": "left", "Right": "Left", "RIGHT": "LEFT"}
OTHER |= {left: right for right, left in OTHER.items()}
WORD = re.compile(
    r"(?<![A-Za-z0-9])(right|left|Right|Left|RIGHT|LEFT|[rRlL])(?![A-Za-z0-9])"  # knee_r, R_Knee, left foot
    r"|(?<![A-Za-z0-9])(right|left|Right|Left|[rRlL])(?=[A-Z][a-z])"  # RightKnee, rKnee
    r"|(?<=[a-z0-9])(Right|Left|R|L)(?![A-Za-z0-9])"  # kneeRight, kneeR
)
"""A word of a side, by itself, or where capitals part words."""
TOLD = re.compile(r"(?<![A-Za-z0-9])(?:ipsi|contra)(?![a-z0-9])|(?<=[a-z0-9])(?:Ipsi|Contra)(?![A-Za-z0-9])")
"""Word of a name that stands for a side in a cycle."""
TURNING = ("q", "qd", "qdd", "tau")
"""Beginnings of quantities along a coordinate, which change sign with it."""
PLAIN = ("time", "power", "flow", "gain", "energy", "kinetic", "contact")
"""Beginnings of quantities without a direction."""


def swapped(name: str) -> str:
    """Return a name of the other side; the same where it tells none."""
    return WORD.sub(lambda found: OTHER[found[0]], name)


def neutral(name: str, side: str) -> str:
    """Return a name as a cycle of this side has it: `ipsi` for its own side, `contra` for the other."""

    def word(found: re.Match[str]) -> str:
        told = "ipsi" if WORDS[found[0]] == side else "contra"
        return told.capitalize() if found[3] else told

    return WORD.sub(word, name)


def of_either_side(pattern: str) -> str:
    """Return a pattern with * in the place of sides, which fits a trial's own columns of both."""
    return WORD.sub("*", TOLD.sub("*", pattern))


@dataclass(frozen=True, eq=False)
class SidedColumns:
    """Columns of a trial as the study has them, of one side's cycles or as they are."""

    columns: tuple[Column, ...]
    order: Index
    """Number of the job's column that each one is."""
    signs: Array
    words: Mapping[str, MotionWords]
    """Words of coordinates by the names that these have in columns."""
    turned: tuple[str, ...] = ()
    """Coordinates that change sign in cycles of the left."""

    @classmethod
    def of(cls, job: Job, cycles: Cycles | None, side: str) -> "SidedColumns":
        """Return a job's columns for cycles of a side; raise LinkwiseError where these have no mirror."""
        own = job.columns
        if cycles is None or not side:
            named = zip(job.decomposer.robot.joints, job.decomposer.robot.words, strict=True)
            words = {name: said for name, said in named if said is not None}
            return cls(own, np.arange(len(own)), np.ones(len(own)), words)
        robot = job.decomposer.robot
        turned = turned_coordinates(robot, cycles)
        numbers = {column.name: at for at, column in enumerate(own)}
        order = [numbers.get(_named(column, side), -1) for column in own]
        if -1 in order:
            lone = own[order.index(-1)].name
            raise LinkwiseError(
                f"[cycles] has sides, and there is {lone!r}, but no {swapped(lone)!r}; give both, or leave"
                " such columns out with 'columns' of [analysis]"
            )
        columns = tuple(replace(column, name=neutral(column.name, RIGHT)) for column in own)
        if len({column.name for column in columns}) < len(columns):
            raise LinkwiseError(
                "[cycles] has sides, and two columns have one name without them; rename a joint"
            )
        signs = np.array([_sign(own[at], robot, turned) for at in order])
        signs = signs if side == LEFT else abs(signs)
        return cls(columns, np.array(order, np.intp), signs, _sided_words(robot), turned)

    def rows(self, block: Array) -> Array:
        """Return the rows of a block of the job's columns, (columns, samples)."""
        if not self.turned and (self.order == np.arange(len(self.order))).all():
            return block
        return block[self.order] * self.signs[:, None]


def _sided_words(robot: OpenedRobot) -> dict[str, MotionWords]:
    """Return the words of coordinates, those of the right as of the side whose cycle it is."""
    found = {}
    for name, said in zip(robot.joints, robot.words, strict=True):
        if said is not None:
            side, _, joint = said.joint.partition(" ")
            of = {RIGHT: "ipsilateral", LEFT: "contralateral"}.get(side)
            found[neutral(name, RIGHT)] = said._replace(joint=f"{of} {joint}") if of else said
    return found


def _named(column: Column, side: str) -> str:
    """Return the job's name of what a column of the right is in cycles of a side."""
    return column.name if side == RIGHT else swapped(column.name)


def _sign(column: Column, robot: OpenedRobot, turned: Sequence[str]) -> float:
    """Return -1 for a column that changes sign; raise LinkwiseError for directions that nobody mirrors."""
    first = column.quantity.partition("_")[0]
    if is_deviation(column.quantity) or first in PLAIN:
        return 1.0
    if first in TURNING and column.joint is not None:
        return -1.0 if robot.joints[column.joint] in turned else 1.0
    raise LinkwiseError(
        f"[cycles] has sides, and {column.name!r} has a direction of its own, which is not mirrored; leave"
        " such columns out with 'columns' of [analysis]"
    )


def turned_coordinates(robot: OpenedRobot, cycles: Cycles) -> tuple[str, ...]:
    """Return the coordinates that change sign in cycles of the left: those told, or by the robot's geometry.

    Raises LinkwiseError for names that are no coordinates, and where geometry does not tell.
    """
    if cycles.turned is not None:
        if odd := [name for name in cycles.turned if name not in robot.joints]:
            raise LinkwiseError(
                f"[cycles]: 'turned' has {odd[0]!r}, which is not a joint; there are"
                f" {listed(map(repr, robot.joints))}"
            )
        return cycles.turned
    pairs = {name: swapped(name) for name in robot.joints}
    if all(name == other for name, other in pairs.items()):
        raise LinkwiseError(
            "[cycles] has sides, and no joint's name tells one: r, l, R, L, right or left, as a word or where"
            f" capitals part words; there are {listed(map(repr, robot.joints))}"
        )
    if lone := [name for name, other in pairs.items() if other not in pairs]:
        raise LinkwiseError(
            f"[cycles] has sides, and joint {lone[0]!r} has no {pairs[lone[0]]!r} on the other; rename it if"
            " it is of neither"
        )
    if robot.tree is None:
        raise LinkwiseError(
            "[cycles] has sides, and links that are energies do not say where anything is; name the"
            " coordinates that change sign on the left in 'turned'"
        )
    return turned_joints(robot.tree, robot.joints, pairs)
