"""Torques of actuators that a log has beside the motion: their columns, and their samples."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from linkwise_runtime.chosen_names import nearest_first

from linkwise.analysis.column_matching import time_column
from linkwise.analysis.disk_rows import collected
from linkwise.analysis.even_time import resampled
from linkwise.analysis.filtering import lowpass
from linkwise.analysis.logs import Log
from linkwise.analysis.opened_robot import OpenedRobot
from linkwise.analysis.samples import finite_blocks
from linkwise.analysis.settings import Lowpass, Reading
from linkwise.arrays import Array
from linkwise.errors import LinkwiseError, within
from linkwise.escape import listed
from linkwise.progress import Progress


@dataclass(frozen=True, eq=False)
class MeasuredTorques:
    """Torques that actuators of some joints gave."""

    joints: tuple[int, ...]
    columns: tuple[str, ...]
    """Column of the log for each of the joints."""
    torque: Array
    """Torques (S, joints) in N m or N."""

    def some(self, begin: int, end: int) -> "MeasuredTorques":
        """Return the samples from `begin` up to, but not including, `end`."""
        return MeasuredTorques(self.joints, self.columns, self.torque[begin:end])

    def dense(self, n: int) -> Array:
        """Return the torques on all joints, (S, n): zeros where none is measured."""
        out = np.zeros((len(self.torque), n))
        out[:, list(self.joints)] = self.torque
        return out


def refuse_follower(robot: OpenedRobot, joint: str) -> None:
    """Raise LinkwiseError for a joint that follows others, and so gives no torque."""
    if joint in robot.dependent_joints:
        raise LinkwiseError(
            f"{joint} follows {listed(map(repr, robot.driven_joints))} and gives no torque; leave it out, or"
            " generate the robot with --independent and other joints"
        )


def torque_columns(
    flag: str, columns: Sequence[str], robot: OpenedRobot, given: Sequence[tuple[str, str]]
) -> dict[str, str]:
    """Return the column of each joint of a flag's pairs COLUMN=JOINT.

    columns: those of the log. Raises LinkwiseError for a joint or a column that is not there, for a joint
    with two columns, and for one that follows others.
    """
    found: dict[str, str] = {}
    for column, joint in given:
        refuse_follower(robot, joint)
        if joint not in robot.joints or column not in columns:
            no_joint = joint not in robot.joints
            what, wanted, there = ("joint", joint, robot.joints) if no_joint else ("column", column, columns)
            raise LinkwiseError(
                f"{flag} {column}={joint}: there is no such {what}; there are "
                f"{listed(map(repr, nearest_first(wanted, there)))}"
            )
        if found.setdefault(joint, column) != column:
            raise LinkwiseError(
                f"{flag} {column}={joint}: column {found[joint]!r} is that joint's already; keep one"
            )
    return found


def measured_torques(
    log: Log,
    by_joint: dict[str, str],
    robot: OpenedRobot,
    reading: Reading,
    factor: float,
    rate: float,
    filtered: Lowpass | None,
    progress: Progress,
    buffer: Path | None,
) -> MeasuredTorques | None:
    """Return the torques of some joints, as evenly spaced and as much filtered as the motion; None without.

    by_joint: the column of each joint; factor: what brings them to N m and N; rate: that of
    the motion, in Hz
    """
    if not by_joint:
        return None
    columns = tuple(by_joint.values())
    with within(str(log.path)):
        read = time_column(log.columns, reading), *(list(log.columns).index(one) for one in columns)
    width = 1 + len(columns)
    rows = collected(finite_blocks(log, read, progress), width, buffer)
    with within(str(log.path)):
        if reading.resample is not None:
            rows = collected(resampled(rows, reading.resample, progress=progress), width, buffer)
        torque = rows[:, 1:]
        torque *= factor
        if filtered is not None:
            lowpass(torque, rate, filtered)
    return MeasuredTorques(tuple(map(robot.joints.index, by_joint)), columns, torque)
