"""One analysis of a log, which is read, filtered and checked for its length before it is carried out."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from linkwise_runtime.motion.induced_power import fed_by_couplings

from linkwise.analysis.asked_trace import AskedTrace, restart_times
from linkwise.analysis.borne_joints import borne_joints
from linkwise.analysis.closed_motion import ClosedLog, closed_samples, slip_warnings
from linkwise.analysis.column_matching import with_columns
from linkwise.analysis.contacts.times import contact_times, switch_columns
from linkwise.analysis.cutoff_sweep import RowSizes
from linkwise.analysis.filtering import lowpass
from linkwise.analysis.induced_points import InducedPlan, induced_points
from linkwise.analysis.loads.placed import PlacedLoad
from linkwise.analysis.loads.read import placed_loads
from linkwise.analysis.logs import Log, open_log
from linkwise.analysis.measured_torques import measured_torques, torque_columns
from linkwise.analysis.opened_robot import OpenedRobot
from linkwise.analysis.outputs import named_result, record, result_table
from linkwise.analysis.phases import PlacedPhase, phase_columns, placed_phases
from linkwise.analysis.poles import pole_warnings
from linkwise.analysis.request import Request
from linkwise.analysis.result import AnalysisResult, WholeMovement
from linkwise.analysis.result_rows import Column
from linkwise.analysis.samples import Samples, read_samples
from linkwise.analysis.settings import Processing, Reading, choices
from linkwise.analysis.show import draw
from linkwise.analysis.stated_bodies import check_lengths
from linkwise.analysis.stream import Sink, span_of, stream
from linkwise.analysis.swept_log import SweptLog, before_filter
from linkwise.analysis.torques import Decomposer, ToldBeside
from linkwise.analysis.traced_rows import TracedRows
from linkwise.analysis.uncertain_file import UncertainRobot, read_uncertain
from linkwise.analysis.uncertain_inputs import UncertainInputs
from linkwise.analysis.uncertain_loads import LoadSpread
from linkwise.analysis.uncertain_motion import LONGEST, MotionNoise, motion_noise
from linkwise.arrays import Array
from linkwise.errors import LinkwiseError, within
from linkwise.escape import listed
from linkwise.extras import extra
from linkwise.progress import Progress

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True, eq=False)
class Analysis(AnalysisResult):
    """Result of `analyze`: an `AnalysisResult` that draws and records itself."""

    def figure(self, name: str = "paper") -> "Figure":
        """Return a matplotlib figure.

        name: "paper" or "causes", with ":JOINT" for another joint than the first; "shares"; "power";
        "energy", or "energy:PHASE" for work over a phase; "induced", or "induced:POINT" for another point
        than the first; "reaction" or "reaction:JOINT", "trace" or "trace:JOINT" likewise; "contacts";
        "cutoff" of a sweep

        "paper" has five panels, laid out like the paper's Fig. 5-9. Raises LinkwiseError for another name.
        """
        extra("matplotlib.pyplot")  # switches on a notebook's display of figures
        return draw(self, name)

    def to_xarray(self) -> Any:
        """Return an xarray Dataset of all quantities with named axes: time, joint, link, cause, order.

        to_xarray().propagation.sel(joint="knee_angle_r", link="foot") is (time, cause, order): the torque on
        the knee through the foot by each joint's acceleration and velocity. Quantities are named as the
        properties here, or as in `robot.labelled` of a package. The attribute `units` has the unit; where it
        differs between joints of angles and of lengths, `units_from` names the coordinate that has it. The
        Dataset is saved by to_netcdf or to_zarr, and is as wide as all joints times all links: zeros stand
        where there is no column.

        Raises LinkwiseError without xarray.
        """
        return named_result(self)

    def _repr_html_(self) -> str:
        """Return the HTML that a notebook shows: each joint's torque, its work and its largest cause."""
        return result_table(self)

    def record(self) -> dict[str, Any]:
        """Return everything but the samples as plain data: choices, closure, columns and their totals."""
        return record(self)


@dataclass(frozen=True)
class Job:
    """A log that was read, filtered and found long enough; `run` does the rest."""

    source: str
    asked: Request
    samples: Samples
    decomposer: Decomposer
    closed: ClosedLog | None = None
    """Largest violation of a constraint by positions of the log, where joints are tied."""
    phases: tuple[PlacedPhase, ...] = ()
    uncertain: UncertainInputs = field(default_factory=UncertainInputs)
    swept: SweptLog | None = None
    """The log as it was before the filter, where a sweep of cutoffs is asked for."""

    def run(self, sink: Sink, progress: Progress) -> WholeMovement:
        """Analyse every sample, handing the blocks to `sink`; then sweep cutoffs where that is asked for."""
        own = None if self.swept is None else RowSizes(self.decomposer.rows)

        def both(block: Array) -> None:
            if own is not None:
                own(block)
            sink(block)

        with within(self.source):
            asked = self.asked.processing
            done = stream(self.samples, self.decomposer, asked, both, progress, self.phases)
            if self.swept is None or own is None:
                return done
            return replace(done, cutoff_sweep=self.swept.run(own, progress))

    def note(self) -> dict[str, Any]:
        """Return the description that a table carries: log, robot and all choices."""
        robot = self.decomposer.robot
        return {
            "log": self.source,
            "robot": robot.name,
            **choices(self.asked.reading, self.asked.processing),
            "payloads": [payload.record() for payload in robot.payloads],
            "loads": [borne.record() for borne in self.decomposer.loads],
            "contacts": [] if robot.contacts is None else list(robot.contacts.names),
            "induced": [point.name for point in self.decomposer.rows.points],
            "trace": None if self.decomposer.traced is None else self.decomposer.traced.record(),
            "reactions": [joint.name for joint in self.decomposer.reactions.borne],
            "uncertain": self.uncertain.record(),
        }

    @property
    def columns(self) -> tuple[Column, ...]:
        """Columns of the result, with names and units."""
        return self.decomposer.rows.columns

    @property
    def analysed(self) -> Samples:
        """Samples that will be analysed: those of the log in the range of time, without trimmed ends."""
        return self.samples.within(*span_of(self.samples, self.asked.processing))

    @property
    def count(self) -> int:
        """Number of samples that will be analysed."""
        return len(self.analysed.time)

    def analysis(self, done: WholeMovement, values: Array) -> Analysis:
        """Return the analysis, with what is known of the samples.

        values: all samples, (rows, S)
        """
        robot = self.decomposer.robot
        poles = pole_warnings(robot.tree, robot.joints, self.analysed)
        found = self.uncertain.warnings
        warnings = (
            *self.samples.warnings,
            *found,
            *self._twice_borne(),
            *self._fed(),
            *poles,
            *self._never_on(done),
        )
        return Analysis(
            **vars(done),
            robot=robot,
            reading=self.asked.reading,
            processing=self.asked.processing,
            source=self.source,
            rate=self.samples.rate,
            rows=self.decomposer.rows,
            values=values,
            loads=self.decomposer.loads,
            induced=tuple(point.name for point in self.decomposer.rows.points),
            borne=self.decomposer.reactions.borne,
            ignored=self.samples.ignored,
            warnings=warnings,
            closed=self.closed,
            times=self.decomposer.times,
            phases=self.phases,
            uncertain=self.uncertain.record(),
            traced=None if self.decomposer.traced is None else self.decomposer.traced.record(),
        )

    def _never_on(self, done: WholeMovement) -> Iterator[str]:
        """Yield warnings about contacts that are off throughout."""
        ground, times = self.decomposer.robot.contacts, self.decomposer.times
        peaks = done.totals.peak[self.decomposer.rows["contact"].rows].tolist()
        for c, peak in enumerate(peaks):
            if not peak and ground and times:
                yield f"contact {ground.names[c]!r} is never on: {times.largest(c)}"

    def _fed(self) -> Iterator[str]:
        """Yield warnings about what flows through joints beside the power of their own wrenches."""
        robot = self.decomposer.robot
        if not self.asked.outputs.induced_power or robot.tree is None:
            return
        coupled = [robot.joints[i] for i in fed_by_couplings(robot.tree, len(robot.joints))]
        if coupled:
            yield (
                f"the flow through {listed(map(repr, coupled))} contains what joints behind, which follow"
                " others, are fed by these"
            )
        if robot.constrained is not None:
            yield "flows through joints contain what ties carry to what is behind them"

    def _twice_borne(self) -> Iterator[str]:
        """Yield warnings about contacts on bodies that carry loads too.

        Such a load may be what was measured at the contact.
        """
        robot = self.decomposer.robot
        held = () if robot.contacts is None else zip(robot.ground.names, robot.ground.contacts, strict=True)
        for name, contact in held:
            for load in self.decomposer.loads:
                if load.acts_on.frame.joint == robot.joint_of(contact.frame):
                    yield (
                        f"load {load.name!r} and contact {name!r} act on one body; what was measured at the"
                        " contact is given with --contact-loads"
                    )


def prepared(
    log: Path,
    robot: OpenedRobot,
    asked: Request,
    progress: Progress,
    buffer: Path | None = None,
) -> Job:
    """Read and filter the log of a robot that stands on its contacts; return the job that analyses it.

    buffer: a directory that keeps the samples in a disk buffer, not in memory
    """
    reading, processing, outputs = asked.reading, asked.processing, asked.outputs
    uncertain = None if asked.uncertain is None else read_uncertain(asked.uncertain, robot)
    points, bearings = induced_points(outputs.induced, robot), borne_joints(outputs.reactions, robot)
    opened = open_log(log, reading, robot.joints, robot.file_joints, robot.qpos)
    with within(str(log)):
        torques = torque_columns("--trace-torque", opened.columns, robot, outputs.trace.pairs)
    beside = (*switch_columns(asked.contacts, opened), *phase_columns(outputs.phases, opened))
    samples, closed = _samples(opened, robot, reading, (*beside, *torques.values()), progress, buffer)
    with within(str(log)):
        start, stop = span_of(samples, processing)
        raw = samples.q[:LONGEST].copy() if uncertain is not None else samples.q[:0]
        unfiltered = before_filter(asked.cutoff_sweep, samples, processing, buffer)
        if processing.lowpass is not None:
            lowpass(samples.q, samples.rate, processing.lowpass)
        slips = tuple(slip_warnings(samples, robot.constrained, processing))
    samples = replace(samples, warnings=(*samples.warnings, *slips))
    motion = samples.time[start:stop]
    borne = placed_loads(asked.loads, robot, motion, reading.ignore_extra, progress, buffer)
    times = contact_times(asked.contacts, opened, robot, reading, motion, progress, buffer)
    every = (*borne, *(() if times is None else times.loads))
    phases = placed_phases(outputs.phases, opened, robot, every, reading, progress)
    traced = None
    if outputs.trace.joints:
        if processing.convention != "closing":
            raise LinkwiseError("--trace goes with --convention closing, whose velocity terms sum to torques")
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
    inputs = _uncertain(asked.uncertain, uncertain, raw, samples, processing, robot, borne)
    told = ToldBeside(outputs.power_terms, planned, bearings, outputs.induced_power, traced, inputs)
    decomposer = Decomposer.of(robot, processing.convention, borne, times, told)
    if unfiltered is None:
        return Job(log.name, asked, samples, decomposer, closed, phases, inputs)
    bare = told._replace(traced=None, uncertain=UncertainInputs())
    plain = Decomposer.of(robot, processing.convention, borne, times, bare)
    swept = SweptLog(unfiltered, plain, processing, buffer)
    return Job(log.name, asked, samples, decomposer, closed, phases, inputs, swept)


def _uncertain(
    file: Path | None,
    stated: UncertainRobot | None,
    raw: Array,
    samples: Samples,
    processing: Processing,
    robot: OpenedRobot,
    loads: Sequence[PlacedLoad],
) -> UncertainInputs:
    """Return all that is uncertain of a log; raw: its first positions, as they were before the filter."""
    if stated is None:
        return UncertainInputs()
    noise: MotionNoise | None = None
    spreads: tuple[LoadSpread | None, ...] = (None,) * len(loads)
    with within(str(file)):
        if stated.motion is not None:
            noise = motion_noise(stated.motion, raw, samples, processing, robot)
        if stated.loads is not None:
            spreads = stated.loads.placed(loads, robot)
    return UncertainInputs(stated, noise, spreads, tuple(load.name for load in loads))


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
