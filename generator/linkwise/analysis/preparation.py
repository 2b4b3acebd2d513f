"""Preparation of an analysis: a log is read, brought to where ties close, and filtered; rows are planned."""

import math
from collections.abc import Sequence
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path

from linkwise.analysis.asked_trace import AskedTrace, restart_times
from linkwise.analysis.borne_joints import borne_joints
from linkwise.analysis.chosen_columns import chosen_rows
from linkwise.analysis.closed_motion import ClosedLog, closed_samples, slip_warnings
from linkwise.analysis.column_matching import with_columns
from linkwise.analysis.contacts.times import contact_times, switch_columns
from linkwise.analysis.filtering import lowpass
from linkwise.analysis.induced_points import InducedPlan, induced_points
from linkwise.analysis.job import Job
from linkwise.analysis.loads.muscles import placed_muscles
from linkwise.analysis.loads.read import placed_loads
from linkwise.analysis.logs import Log, open_log
from linkwise.analysis.markers import SUFFIXES
from linkwise.analysis.markers.followed import followed
from linkwise.analysis.measured_torques import measured_torques, torque_columns
from linkwise.analysis.named_bodies import told_apart
from linkwise.analysis.opened_robot import OpenedRobot
from linkwise.analysis.phases import phase_columns, placed_phases
from linkwise.analysis.request import Request
from linkwise.analysis.samples import Samples, read_samples
from linkwise.analysis.settings import Reading
from linkwise.analysis.stated_bodies import check_lengths
from linkwise.analysis.stream import beyond_log, span_of
from linkwise.analysis.swept_log import SweptLog, before_filter
from linkwise.analysis.told_beside import ToldBeside
from linkwise.analysis.torques import Decomposer
from linkwise.analysis.traced_rows import TracedRows
from linkwise.analysis.uncertain_file import read_uncertain
from linkwise.analysis.uncertain_inputs import UncertainInputs, uncertain_inputs
from linkwise.analysis.uncertain_motion import LONGEST
from linkwise.errors import LinkwiseError, within
from linkwise.output import passing_folder
from linkwise.progress import Progress


def prepared(
    log: Path,
    robot: OpenedRobot,
    asked: Request,
    progress: Progress,
    buffer: Path | None = None,
) -> Job:
    """Read and filter the log of a robot that stands on its contacts; return the job that analyses it.

    A log of markers is brought to joint coordinates first.

    buffer: a directory that keeps the samples in a disk buffer, not in memory
    """
    is_of_markers = log.suffix.lower() in SUFFIXES
    with passing_folder() if is_of_markers else nullcontext(log.parent) as folder:
        made = followed(log, asked.markers, asked.loads, folder, progress)
        if made is None:
            return _prepared(log, robot, asked, progress, buffer)
        try:
            job = _prepared(made.log, robot, replace(asked, loads=made.loads), progress, buffer)
        except LinkwiseError as error:  # its own folder is gone when this is read
            told = str(error).replace(str(made.log), f"{log}, inverse kinematics of it")
            raise LinkwiseError(told) from error
        warnings = (*job.samples.warnings, *made.told)
        return replace(job, source=log.name, markers=made, samples=replace(job.samples, warnings=warnings))


def _prepared(log: Path, robot: OpenedRobot, asked: Request, progress: Progress, buffer: Path | None) -> Job:
    """Return the job of a log of joint coordinates."""
    reading, processing, outputs = asked.reading, asked.processing, asked.outputs
    if outputs.trace.joints and processing.convention != "closing":
        raise LinkwiseError("--trace goes with --convention closing, whose velocity terms sum to torques")
    uncertain = None if asked.uncertain is None else read_uncertain(asked.uncertain, robot)
    points, bearings = induced_points(outputs.induced, robot), borne_joints(outputs.reactions, robot)
    opened = open_log(log, reading, robot.joints, robot.file_joints, robot.qpos)
    with within(str(log)):
        torques = torque_columns("--trace-torque", opened.columns, robot, outputs.trace.pairs)
    read_beside = (*switch_columns(asked.contacts, opened), *phase_columns(outputs.phases, opened))
    samples, closed = _samples(opened, robot, reading, (*read_beside, *torques.values()), progress, buffer)
    with within(str(log)):
        start, stop = span_of(samples, processing)
        raw = samples.q[:LONGEST].copy() if uncertain is not None else samples.q[:0]
        unfiltered = before_filter(asked.cutoff_sweep, samples, processing, buffer)
        if processing.lowpass is not None:
            lowpass(samples.q, samples.rate, processing.lowpass)
        doubts = *slip_warnings(samples, robot.constrained, processing), *beyond_log(samples, processing)
    samples = replace(samples, warnings=(*samples.warnings, *doubts))
    motion = samples.time[start:stop]
    borne = placed_loads(asked.loads, robot, motion, reading.ignore_extra, progress, buffer)
    if asked.muscles is not None:
        pulling = placed_muscles(asked.muscles, robot, motion, samples.q[start:stop], progress)
        told_apart("muscle", [one.name for one in pulling], [one.name for one in borne], "rename one of them")
        borne = (*borne, *pulling)
    times = contact_times(asked.contacts, opened, robot, reading, motion, progress, buffer)
    every = (*borne, *(() if times is None else times.loads))
    phases = placed_phases(outputs.phases, opened, robot, every, reading, progress)
    traced = None
    if outputs.trace.joints:
        q = samples.q[start:stop]
        restarts = restart_times(outputs.trace.restart, phases, robot, times, motion, q)
        made = AskedTrace.of(outputs.trace, restarts, robot, motion)
        how = reading, outputs.trace.torque_factor, samples.rate, processing.lowpass, progress, buffer
        measured = measured_torques(opened, torques, robot, *how)
        traced = TracedRows.of(made, robot, borne, samples, measured and measured.some(start, stop))
    planned = InducedPlan(points, outputs.induced_whole)
    beside_torques = outputs.induced or outputs.reactions or outputs.induced_power
    if uncertain is not None and uncertain.bodies is not None and beside_torques:
        check_lengths(uncertain.bodies, "leave --induced, --reaction and --induced-power out")
    certain = [*(["payloads"] if robot.payloads else []), *(["traced velocities"] if traced else [])]
    inputs = uncertain_inputs(asked.uncertain, uncertain, raw, samples, processing, robot, borne, certain)
    columns = () if outputs.tells_of_all or unfiltered is not None else outputs.columns
    beside = outputs.power_terms, planned, bearings, outputs.induced_power
    told = ToldBeside(*beside, traced, inputs, columns, outputs.columns)
    decomposer = Decomposer.of(robot, processing.convention, borne, times, told)
    in_table = chosen_rows(decomposer.rows, outputs.columns, outputs.power_terms)
    swept = None
    if unfiltered is not None:
        bare = told._replace(traced=None, uncertain=UncertainInputs())
        plain = Decomposer.of(robot, processing.convention, borne, times, bare)
        swept = SweptLog(unfiltered, plain, processing, buffer)
    return Job(log.name, asked, samples, decomposer, in_table, closed, phases, inputs, swept)


def _samples(
    log: Log,
    robot: OpenedRobot,
    reading: Reading,
    beside: Sequence[str],
    progress: Progress,
    buffer: Path | None,
) -> tuple[Samples, ClosedLog | None]:
    """Return samples of all joints and, where joints are tied, how well the log closes.

    Dependent joints are moved to where the ties close.

    beside: columns of the log that are read elsewhere: those that say when contacts are on, torques
    """
    with within(str(log.path)):
        every = with_columns(log.columns, (*robot.joints, *robot.inputs), robot.dependent_joints, reading)
    there = [k for k in every if k < len(robot.joints)]
    names = (*(robot.joints[k] for k in there), *robot.inputs)
    units = (*(robot.units_in_logs[k] for k in there), *("" for _ in robot.inputs))
    reach = [*(robot.reach[k] for k in there), *(math.inf for _ in robot.inputs)]
    samples = read_samples(log, names, units, reading, progress, buffer, beside, reach, robot.followers)
    with within(str(log.path)):
        return closed_samples(samples, there, robot.constrained, reading.loop_tolerance, progress, buffer)
