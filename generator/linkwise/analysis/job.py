"""One analysis of a log, which is read, filtered and checked for its length before it is carried out."""

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

from linkwise_runtime.motion.induced_power import fed_by_couplings

from linkwise.analysis.closed_motion import ClosedLog
from linkwise.analysis.cutoff_sweep import RowSizes
from linkwise.analysis.markers.followed import MarkerLog
from linkwise.analysis.outputs import named_result, record, result_table
from linkwise.analysis.phases import PlacedPhase
from linkwise.analysis.poles import pole_warnings
from linkwise.analysis.request import Request
from linkwise.analysis.residuals import ResidualSums
from linkwise.analysis.result import AnalysisResult
from linkwise.analysis.result_rows import Column
from linkwise.analysis.samples import Samples
from linkwise.analysis.settings import choices
from linkwise.analysis.show import draw
from linkwise.analysis.stream import Sink, span_of, stream
from linkwise.analysis.swept_log import SweptLog
from linkwise.analysis.torques import Decomposer
from linkwise.analysis.uncertain_inputs import UncertainInputs
from linkwise.analysis.whole_movement import WholeMovement
from linkwise.arrays import Array, Index
from linkwise.errors import within
from linkwise.escape import listed
from linkwise.extras import extra
from linkwise.progress import Progress

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True, eq=False, repr=False)
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
    told: Index
    """Numbers of the rows of a block that a table has: of those that are computed, those asked for."""
    closed: ClosedLog | None = None
    """Largest violation of a constraint by positions of the log, where joints are tied."""
    phases: tuple[PlacedPhase, ...] = ()
    uncertain: UncertainInputs = field(default_factory=UncertainInputs)
    swept: SweptLog | None = None
    """The log as it was before the filter, where a sweep of cutoffs is asked for."""
    markers: MarkerLog | None = None
    """Recording of markers that the log was made of, if it was."""

    def run(self, sink: Sink, progress: Progress) -> WholeMovement:
        """Analyse every sample, handing the blocks to `sink`; then sweep cutoffs where that is asked for."""
        own = None if self.swept is None else RowSizes(self.decomposer.rows)
        plan = self.decomposer
        residuals = ResidualSums(plan.robot, plan.rows, plan.loads)

        def both(block: Array) -> None:
            if own is not None:
                own(block)
            residuals(block)
            sink(block)

        with within(self.source):
            asked = self.asked.processing
            done = stream(self.samples, self.decomposer, asked, both, progress, self.phases)
            done = replace(done, residual_report=residuals.report())
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
            "asked_columns": self.asked.outputs.columns or ["all"],
        }

    def table_rows(self, block: Array) -> Array:
        """Return the rows of a block (rows, samples) that a table has."""
        return block if len(self.told) == len(block) else block[self.told]

    @property
    def columns(self) -> tuple[Column, ...]:
        """Columns of a table of the result, with names and units."""
        every = self.decomposer.rows.columns
        return tuple(every[row] for row in self.told.tolist())

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
            asked_columns=self.asked.outputs.columns or ("all",),
            told=self.told,
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
            markers=self.markers,
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
                if not load.is_muscle and robot.joint_of(load.bodies[0]) == robot.joint_of(contact.frame):
                    yield (
                        f"load {load.name!r} and contact {name!r} act on one body; what was measured at the"
                        " contact is given with --contact-loads"
                    )
