"""`analyze`: from a log and a robot to arrays in memory, or to a directory of files."""

import json
import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from linkwise.analysis.closed_motion import ClosedLog, closed_samples
from linkwise.analysis.column_matching import with_columns
from linkwise.analysis.contacts import Contacts
from linkwise.analysis.contacts.contact_times import contact_times, switch_columns
from linkwise.analysis.contacts.standing_robot import standing_on
from linkwise.analysis.filtering import lowpass
from linkwise.analysis.induced_points import induced_points
from linkwise.analysis.loaded_robot import LoadedRobot, load_robot
from linkwise.analysis.loads import Load, Loads
from linkwise.analysis.loads.read_loads import placed_loads
from linkwise.analysis.logs import open_log
from linkwise.analysis.payload import carrying
from linkwise.analysis.result import AnalysisResult
from linkwise.analysis.samples import Samples, read_samples
from linkwise.analysis.settings import Payload, Processing, Reading, choices
from linkwise.analysis.show import check_figure, draw, figure_png
from linkwise.analysis.show.page import NUMBERS, SAMPLES, numbers_on_page, report
from linkwise.analysis.stream import KeptSamples, Sink, Streamed, span_of, stream, stride_for
from linkwise.analysis.tables import Format, open_table
from linkwise.analysis.torques import Decomposer
from linkwise.errors import LinkwiseError, within
from linkwise.escape import file_name, json_text
from linkwise.extras import extra
from linkwise.output import whole_directory
from linkwise.package.load import Array
from linkwise.package.write import refuse_inside_package
from linkwise.progress import Progress, silent
from linkwise.runtime.robot_constraints import Contact

if TYPE_CHECKING:
    from matplotlib.figure import Figure

NO_LOADS = Loads()
NO_CONTACTS = Contacts()
RECORD = "analysis.json"
"""The record, and the mark by which a directory is known to hold a former result."""


@dataclass(frozen=True, eq=False)
class Analysis(AnalysisResult):
    """What `analyze` returns: an `AnalysisResult` that draws itself."""

    def figure(self, name: str = "paper") -> "Figure":
        """A matplotlib figure: "paper", or "paper:JOINT" for another joint than the first; "shares"; "power";
        "induced", or "induced:POINT" likewise; "contacts".

        "paper" has five panels, laid out like the paper's Fig. 5-9. Raises LinkwiseError for another name.
        """
        extra("matplotlib.pyplot")  # switches on a notebook's display of figures
        return draw(self, name)


@dataclass(frozen=True)
class Wanted:
    """Which files to write, and what in them: the table's format, figures by name, whether the page."""

    table: Format = "parquet"
    figures: tuple[str, ...] = ()
    page: bool = True
    power_terms: bool = False
    """Power by cause and order, too: as many columns again as torques have."""
    induced: tuple[str, ...] = ()
    """Whose acceleration is told by its sources: FRAME or FRAME,X,Y,Z, joints, centre-of-mass."""


def analyze(
    log: str | Path,
    robot: str | Path | LoadedRobot,
    reading: Reading | None = None,
    processing: Processing | None = None,
    progress: Progress = silent,
    payloads: Sequence[Payload] = (),
    loads: Sequence[Load | str | Path] = (),
    loads_cutoff: float | None = None,
    induced: Sequence[str] = (),
    contacts: Contacts | Sequence[Contact] = (),
) -> Analysis:
    """Analyse a motion log with a generated robot (its directory), all samples in memory.

    payloads: point masses that the robot carries, each a link of its own in the result
    loads: forces and moments from outside, or files of them, each a cause of its own in the result;
    loads_cutoff in Hz is of the low-pass that those of files get
    induced: whose acceleration is to be told by its sources: FRAME or FRAME,X,Y,Z, joints, centre-of-mass
    contacts: frames that the ground holds, whose reactions are found from the motion; `Contacts` says when
    Raises LinkwiseError, naming file, row and column, for what cannot be analysed.
    """
    held = Contacts.of(contacts)
    loaded = carrying(robot if isinstance(robot, LoadedRobot) else load_robot(Path(robot)), payloads)
    loaded, borne = standing_on(loaded, held), Loads.of(loads, loads_cutoff)
    wanted, made = Wanted(induced=tuple(induced)), (reading or Reading(), processing or Processing())
    job = _prepared(Path(log), loaded, *made, borne, held, progress, wanted)
    kept = KeptSamples(len(job.decomposer.columns), 1)
    return job.analysis(job.run(kept, progress), kept)


def analyze_to(
    out: Path,
    log: Path,
    robot: LoadedRobot,
    reading: Reading,
    processing: Processing,
    wanted: Wanted,
    progress: Progress,
    loads: Loads = NO_LOADS,
    contacts: Contacts = NO_CONTACTS,
) -> tuple[Analysis, Sequence[Path]]:
    """Analyse a log of any length with flat memory; `out` appears when everything is done.

    Returns the analysis thinned to what a page shows, and the files written. Raises LinkwiseError, as
    `analyze` does, and where `out` holds something else than a former result or cannot be written.
    """
    robot = standing_on(robot, contacts)
    for name in wanted.figures:
        check_figure(name, robot, wanted.induced)
    refuse_inside_package(out)
    for file in (log, *loads.paths, *contacts.measured.paths):
        if os.path.realpath(file).startswith(os.path.join(os.path.realpath(out), "")):
            raise LinkwiseError(f"--out {out} is to be replaced and holds the log {file}; give another --out")
    with whole_directory(out, _refuse_unless_result) as draft:
        job = _prepared(log, robot, reading, processing, loads, contacts, progress, wanted, draft)
        columns = job.decomposer.columns
        stride = stride_for(job.count, numbers_on_page(columns), NUMBERS, SAMPLES)
        kept = KeptSamples(len(columns), stride)
        note = json_text(job.note())
        with open_table(draft / f"analysis.{wanted.table}", columns, note) as table:

            def sink(block: Array) -> None:
                kept(block)
                table(block)

            analysis = job.analysis(job.run(sink, progress), kept)
        _write_beside_table(draft, analysis, wanted)
        names = sorted(file.name for file in draft.iterdir())
    return analysis, [out / name for name in names]


def _write_beside_table(draft: Path, analysis: Analysis, wanted: Wanted) -> None:
    """Write the record, the figures and the page."""
    for name in wanted.figures:
        file = draft / f"{'-'.join(map(file_name, name.split(':', 1)))}.png"
        file.write_bytes(figure_png(analysis, name))
    if wanted.page:
        (draft / "report.html").write_text(report(analysis), encoding="utf-8")
    files = sorted([RECORD, *(file.name for file in draft.iterdir())])
    record = {**analysis.record(), "files": files}
    text = json_text(record, indent=1)
    (draft / RECORD).write_text(text + "\n", encoding="utf-8")


def _refuse_unless_result(target: Path) -> None:
    """Raise LinkwiseError unless `target` is an empty directory or a former result, and nothing else."""
    if target.is_symlink() or not target.is_dir():
        what = "a symbolic link" if target.is_symlink() else "not a folder"
        raise LinkwiseError(f"{target} is {what}; give another --out")
    there = sorted(file.name for file in target.iterdir())
    if not there:
        return
    written = _files_written(target / RECORD)
    if not written:
        raise LinkwiseError(
            f"{target}: exists and is not a former result (it has no {RECORD}); give another --out"
        )
    added = [name for name in there if name not in written or not (target / name).is_file()]
    if added:
        raise LinkwiseError(
            f"{target} holds {added[0][:80]!a}, which linkwise did not write; "
            "move it away, or give another --out"
        )


def _files_written(record: Path) -> set[str]:
    """Names of the files of a result, as its record lists them; an empty set for what is no record."""
    try:
        said = json.loads(record.read_text(encoding="utf-8")) if record.is_file() else None
    except (OSError, ValueError, RecursionError):
        return set()
    files = said.get("files") if isinstance(said, dict) else None
    return {name for name in files if isinstance(name, str)} if isinstance(files, list) else set()


@dataclass(frozen=True)
class Job:
    """A log read, filtered and found long enough; `run` does the rest."""

    source: str
    reading: Reading
    processing: Processing
    samples: Samples
    decomposer: Decomposer
    closed: ClosedLog | None = None
    """How far positions of the log were off, where joints are tied."""

    def run(self, sink: Sink, progress: Progress) -> Streamed:
        """Analyse every sample, handing the blocks to `sink`."""
        with within(self.source):
            return stream(self.samples, self.decomposer, self.processing, sink, progress)

    def note(self) -> dict[str, Any]:
        """What a table says of itself: log, robot and all choices."""
        robot = self.decomposer.robot
        return {
            "log": self.source,
            "robot": robot.name,
            **choices(self.reading, self.processing),
            "payloads": [payload.record() for payload in robot.payloads],
            "loads": [borne.record() for borne in self.decomposer.loads],
            "induced": [point.name for point in self.decomposer.induced.points],
        }

    @property
    def count(self) -> int:
        """Samples that will be analysed."""
        start, stop = span_of(self.samples, self.processing)
        return stop - start

    def analysis(self, done: Streamed, kept: KeptSamples) -> Analysis:
        """The samples kept, with what is known of them all."""
        return Analysis(
            self.decomposer.robot,
            self.reading,
            self.processing,
            self.source,
            self.samples.rate,
            self.decomposer.columns,
            kept.values,
            done.totals,
            done.work,
            done.joint_work,
            done.load_work,
            self.decomposer.loads,
            tuple(point.name for point in self.decomposer.induced.points),
            done.closure,
            self.samples.ignored,
            (*self.samples.warnings, *self._twice_borne()),
            done.samples,
            kept.stride,
            self.closed,
        )

    def _twice_borne(self) -> Iterator[str]:
        """Warnings of contacts on bodies that bear loads too, which may be what was measured there."""
        robot = self.decomposer.robot
        tree, ground = robot.package.manifest.tree, robot.contacts
        if tree is None or ground is None:
            return
        body = {frame.name: frame.body for frame in tree.frames}
        for name, contact in zip(ground.names, ground.contacts, strict=True):
            for load in self.decomposer.loads:
                if load.seat.frame.body == body[str(contact.frame)]:
                    yield (
                        f"load {load.name!r} and contact {name!r} act on one body; what was measured at the"
                        " contact is given with --contact-loads"
                    )


def _prepared(
    log: Path,
    robot: LoadedRobot,
    reading: Reading,
    processing: Processing,
    loads: Loads,
    contacts: Contacts,
    progress: Progress,
    wanted: Wanted,
    buffer: Path | None = None,
) -> Job:
    """Read and filter a log; `buffer`, a directory, keeps the samples in a disk buffer, not in memory."""
    points = induced_points(wanted.induced, robot)
    switches = switch_columns(contacts, log)
    samples, closed = _samples(log, robot, reading, switches, progress, buffer)
    with within(str(log)):
        span_of(samples, processing)
        if processing.lowpass is not None:
            lowpass(samples.q, samples.rate, processing.lowpass)
    borne = placed_loads(loads, robot, samples.time, reading.ignore_extra, progress, buffer)
    times = contact_times(contacts, log, robot, reading, samples.time, progress, buffer)
    decomposer = Decomposer.of(robot, processing.convention, wanted.power_terms, borne, points, times)
    return Job(log.name, reading, processing, samples, decomposer, closed)


def _samples(
    log: Path,
    robot: LoadedRobot,
    reading: Reading,
    switches: Sequence[str],
    progress: Progress,
    buffer: Path | None,
) -> tuple[Samples, ClosedLog | None]:
    """Samples of all joints; where joints are tied, those that follow closed, and how far the log was off.

    switches: columns of the log that say when contacts are on
    """
    if robot.constrained is None:
        return read_samples(log, robot.joints, robot.units, reading, progress, buffer, switches), None
    followers = set(robot.constrained.constraints.dependent)
    columns = open_log(log).columns
    with within(str(log)):
        there = with_columns(columns, robot.joints, followers, reading)
    names, units = (tuple(given[k] for k in there) for given in (robot.joints, robot.units))
    samples = read_samples(log, names, units, reading, progress, buffer, switches)
    with within(str(log)):
        return closed_samples(samples, there, robot.constrained, reading.loop_tolerance, progress, buffer)
