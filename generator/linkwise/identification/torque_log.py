"""A log of motion and torques in SI units, with its torque columns found."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from linkwise_runtime.chosen_names import nearest_first

from linkwise.analysis.closed_motion import ClosedLog, closed_samples
from linkwise.analysis.column_matching import TIMES, with_columns, with_nearest
from linkwise.analysis.filtering import lowpass
from linkwise.analysis.logs import open_log
from linkwise.analysis.measured_torques import refuse_follower, torque_columns
from linkwise.analysis.opened_robot import OpenedRobot
from linkwise.analysis.samples import Samples, read_samples
from linkwise.analysis.settings import Lowpass, Processing, Reading
from linkwise.analysis.stream import LEAST_SAMPLES, beyond_log, span_of
from linkwise.arrays import Array
from linkwise.errors import LinkwiseError, within
from linkwise.escape import listed
from linkwise.identification.position_noise import position_noise
from linkwise.progress import Progress

SPELLINGS = ("tau/{}", "tau_{}", "{}_moment", "{}_force", "{}_torque", "{}/effort", "{}_effort")
"""Names of a joint's torque in logs: of `analyze`, scripts, OpenSim's inverse dynamics, ROS."""
PERIODS = 1.5
"""Periods of the cutoff, for each order, in which the filter's response to the log's ends dies down."""
ENDLESS = 1e100
"""Value in N m, N, rad or m that no robot reaches; its square is still a finite number."""
STILL = 0.01
"""Range of motion in rad or m, below which a joint shows nothing but noise."""


@dataclass(frozen=True, eq=False)
class TorqueLog:
    """Evenly spaced samples: positions `q` (S, n) in rad or m, filtered, and torques as measured."""

    source: str
    rate: float
    q: Array
    noise: Array
    """Standard deviation of the positions' noise, unfiltered, (n,)."""
    measured: tuple[int, ...]
    """Joints, counted from 0 and ascending, whose torques are measured."""
    torque: Array
    """Torques of the measured joints, (S, measured)."""
    start: int
    stop: int
    """First sample to use, `start`, and the one after the last: derivatives may need those beyond."""
    warnings: tuple[str, ...]
    ignored: tuple[str, ...]
    closed: ClosedLog | None = None
    """Distance of the log's positions from closed ties, where joints are tied; in `q` the ties close."""


def read_torque_log(
    path: Path,
    robot: OpenedRobot,
    reading: Reading,
    processing: Processing,
    torques: Sequence[tuple[str, str]],
    unmeasured: Sequence[str],
    factor: float,
    progress: Progress,
) -> TorqueLog:
    """Return a log; `torques` are (column, joint) pairs, and `factor` brings these columns to N m (N).

    Raises LinkwiseError for a joint without a torque that is not `unmeasured`, and for one with a torque that
    stands still.
    """
    measured = _measured(robot, torques, unmeasured)
    log = open_log(path, reading, robot.joints, robot.file_joints, robot.qpos)
    with within(str(path)):
        columns = _torque_columns(log.columns, robot, [robot.joints[i] for i in measured], torques)
        if not reading.ignore_extra:
            _refuse_more_torques(log.columns, robot, columns, measured)
        moving = with_columns(log.columns, robot.joints, robot.dependent_joints, reading)
    names = tuple(f"torque of {robot.joints[i]}" for i in measured)
    mapping = (*reading.pairs, *zip(columns, names, strict=True))
    samples = read_samples(
        log,
        (*(robot.joints[k] for k in moving), *names),
        (*(robot.units_in_logs[k] for k in moving), *["N m"] * len(names)),
        replace(reading, mapping=mapping),
        progress,
        reach=(*(robot.reach[k] for k in moving), *[math.inf] * len(names)),
        followers=robot.followers,
    )
    torque = samples.q[:, len(moving) :] * factor
    with within(str(path)):
        moved = replace(samples, q=samples.q[:, : len(moving)])
        found, closed = closed_samples(moved, moving, robot.constrained, reading.loop_tolerance, progress)
        q = found.q.copy()
        noise = position_noise(q)
        _refuse_endless(q, robot.joints, "position")
        _refuse_endless(torque, [robot.joints[i] for i in measured], "torque")
        start, stop = span_of(samples, processing)
        if processing.lowpass is not None:
            lowpass(q, samples.rate, processing.lowpass)
            start, stop = _within(start, stop, samples, processing, processing.lowpass)
        _refuse_still(q[start:stop], robot, measured)
    told = (*samples.warnings, *beyond_log(samples, processing)), samples.ignored
    return TorqueLog(path.name, samples.rate, q, noise, measured, torque, start, stop, *told, closed)


def _measured(
    robot: OpenedRobot, torques: Sequence[tuple[str, str]], unmeasured: Sequence[str]
) -> tuple[int, ...]:
    """Return the joints that must have a torque, from 0; raise LinkwiseError for impossible choices."""
    joints = robot.driven_joints
    for joint in unmeasured:
        refuse_follower(robot, joint)
        if joint not in joints:
            raise LinkwiseError(
                f"--unmeasured {joint}: there is no such joint; there are "
                f"{listed(map(repr, nearest_first(joint, joints)))}"
            )
    for column, joint in torques:
        if joint in unmeasured:
            raise LinkwiseError(
                f"--torque {column}={joint} and --unmeasured {joint} contradict each other; leave one out"
            )
    found = tuple(i for i in robot.driven if robot.joints[i] not in unmeasured)
    if not found:
        raise LinkwiseError("--unmeasured names every joint; at least one torque must be there")
    return found


def _within(
    start: int, stop: int, samples: Samples, processing: Processing, filtered: Lowpass
) -> tuple[int, int]:
    """Return what of a range of samples the filter does not affect from the log's ends.

    Raises LinkwiseError where nothing is left.
    """
    whole = span_of(samples, replace(processing, start=None, stop=None))
    first, last = _settled(*whole, samples.rate, filtered)
    if min(stop, last) - max(start, first) < LEAST_SAMPLES:
        raise LinkwiseError(
            f"--from and --to leave what --cutoff {filtered.cutoff:g} blurs, up to"
            f" {samples.time[first]:.6g} s and from {samples.time[last - 1]:.6g} s; give what is between"
        )
    return max(start, first), min(stop, last)


def _settled(start: int, stop: int, rate: float, filtered: Lowpass) -> tuple[int, int]:
    """Return the range of samples that the filter does not affect from the log's ends.

    Raises LinkwiseError where none are left.
    """
    margin = round(PERIODS * filtered.order * rate / filtered.cutoff)
    if stop - start <= 2 * margin:
        raise LinkwiseError(
            f"{stop - start} samples are too few for --cutoff {filtered.cutoff:g}, which blurs {margin} at "
            "either end; give a longer log, or raise it"
        )
    return start + margin, stop - margin


def _torque_columns(
    columns: Sequence[str], robot: OpenedRobot, measured: Sequence[str], torques: Sequence[tuple[str, str]]
) -> list[str]:
    """Return the name of the torque column of each measured joint, in order."""
    given = torque_columns("--torque", columns, robot, torques)
    found, missing = [], []
    for joint in measured:
        names = [given[joint]] if joint in given else [spelling.format(joint) for spelling in SPELLINGS]
        there = [name for name in names if name in columns]
        found += there[:1]
        missing += [] if there else [joint]
    if missing:
        example = missing[0]
        others = [column for column in columns if column not in robot.joints and column.lower() not in TIMES]
        raise LinkwiseError(
            f"no torque column for joint {with_nearest(missing, others)}; call it 'tau/{example}' or "
            f"'{example}_moment', or name it with --torque COLUMN={example}; where nothing measures it, as "
            f"of a floating base, say so with --unmeasured {example}"
        )
    return found


def _refuse_more_torques(
    columns: Sequence[str], robot: OpenedRobot, used: Sequence[str], measured: Sequence[int]
) -> None:
    """Raise LinkwiseError for an unused torque column: its joint has another, is unmeasured or follows."""
    for i, joint in enumerate(robot.joints):
        for column in (spelling.format(joint) for spelling in SPELLINGS):
            if column not in columns or column in (*used, *robot.joints):
                continue
            if i not in robot.driven:
                raise LinkwiseError(
                    f"column {column!r} is a torque of {joint}, which follows {listed(robot.driven_joints)}"
                    " and gives none; leave such columns out with --ignore-extra, or generate the robot with"
                    " --independent and other joints"
                )
            if i not in measured:
                raise LinkwiseError(
                    f"column {column!r} is a torque of {joint}, which is --unmeasured; leave such columns "
                    "out with --ignore-extra"
                )
            raise LinkwiseError(
                f"column {column!r} is a second torque of {joint}, beside {used[measured.index(i)]!r}; name "
                f"the one to take with --torque COLUMN={joint}, and leave the other out with --ignore-extra"
            )


def _refuse_endless(values: Array, joints: Sequence[str], what: str) -> None:
    peaks = np.abs(values).max(axis=0, initial=0.0)
    at = int(peaks.argmax())
    if peaks[at] > ENDLESS:
        raise LinkwiseError(
            f"the {what} of {joints[at]!r} reaches {peaks[at]:.3g}, which no robot's does; see its column "
            "and its unit"
        )


def _refuse_still(q: Array, robot: OpenedRobot, measured: Sequence[int]) -> None:
    ranges = np.ptp(q, axis=0)
    still = [at for at in measured if ranges[at] < STILL]
    if still:
        at = still[0]
        joint = robot.joints[at]
        raise LinkwiseError(
            f"too little excitation: joint {joint!r} moves by {ranges[at]:.2g} {robot.units[at]} in all; "
            "record a motion of every joint, or generate the robot with "
            f"--lock {joint}={np.mean(q[:, at]):.4g}"
        )
