"""`analyze`: from a log and a robot to arrays in memory, or to a directory of files."""

import json
from collections.abc import Callable, Mapping, Sequence
from os import PathLike
from pathlib import Path

from linkwise_runtime.quantities import Contact

from linkwise.analysis.asked_trace import EVERY, TraceChoices, Weight
from linkwise.analysis.column_patterns import patterns_of
from linkwise.analysis.contacts import Contacts
from linkwise.analysis.contacts.standing import with_contacts
from linkwise.analysis.cutoff_range import CutoffRange
from linkwise.analysis.disk_rows import EverySample
from linkwise.analysis.job import Analysis
from linkwise.analysis.load_robot import load_robot
from linkwise.analysis.loads import Load, Loads, Muscles
from linkwise.analysis.markers import MarkerChoices
from linkwise.analysis.opened_robot import OpenedRobot
from linkwise.analysis.opensim.inverse_kinematics import MOTION
from linkwise.analysis.opensim.storage import begin_storages
from linkwise.analysis.outputs import open_table
from linkwise.analysis.payload import with_payloads
from linkwise.analysis.phases import Phase
from linkwise.analysis.preparation import prepared
from linkwise.analysis.request import Outputs, Request
from linkwise.analysis.settings import Payload, Processing, Reading
from linkwise.analysis.show import check_figure, figure_bytes, figure_names
from linkwise.analysis.show.page import report
from linkwise.analysis.sweep_table import NAME as SWEEP_TABLE
from linkwise.analysis.sweep_table import write_sweep
from linkwise.arrays import Array
from linkwise.errors import LinkwiseError
from linkwise.escape import file_name, file_names, json_text
from linkwise.input_file import is_inside
from linkwise.output import refuse_unless_folder, whole_directory
from linkwise.package.write import refuse_inside_package
from linkwise.progress import Progress, silent

RECORD = "analysis.json"
"""File of the record, by which a directory is known to hold a former result."""


def analyze(
    log: str | Path,
    robot: str | PathLike[str] | OpenedRobot,
    reading: Reading | None = None,
    processing: Processing | None = None,
    progress: Progress = silent,
    payloads: Sequence[Payload] = (),
    loads: Sequence[Load | str | Path] = (),
    loads_cutoff: float | None = None,
    induced: Sequence[str] = (),
    contacts: Contacts | Sequence[Contact] = (),
    phases: Sequence[str] = (),
    induced_whole: bool = False,
    induced_power: bool = False,
    reactions: Sequence[str] = (),
    trace: Sequence[str] = (),
    trace_windows: float | None = None,
    trace_weight: Weight = "apart",
    trace_restart: Sequence[str] = (),
    trace_torque: Mapping[str, str] | Sequence[tuple[str, str]] = (),
    trace_torque_factor: float = 1.0,
    uncertain: str | PathLike[str] | None = None,
    cutoff_sweep: Sequence[float] | None = None,
    columns: Sequence[str] = (),
    muscles: Muscles | None = None,
    markers: MarkerChoices | None = None,
) -> Analysis:
    """Analyse a motion log with a generated robot, all samples in memory.

    robot: the directory of its package; `linkwise.kept_package` makes one from a robot's file
    payloads: point masses that the robot carries, each a link of its own in the result
    loads: external forces and moments, or files of them, each a cause of its own in the result
    loads_cutoff: cutoff in Hz of the low-pass on loads from files
    induced: points whose acceleration is split by source: FRAME or FRAME,X,Y,Z, joints, centre-of-mass
    contacts: frames that the ground holds, whose reactions are found from the motion; `Contacts` says when
    induced_whole: whether weights, and all that velocities do, are one source each, not by link and joint
    reactions: joints of the tree whose whole wrench is told by its causes: JOINT, or JOINT,AXES
    phases: phases of the movement for the figure "causes", written as for --phase: "stance/swing=LOAD"
    induced_power: whether to tell by its sources the power that each link gets, and that through each joint
    trace: joints whose velocities, and what velocities ask of them, are traced to their sources, or "all"
    trace_windows: length in s of the windows of time into which these sources are cut
    trace_weight: "apart", weight as a source, or "borne", torques as what is beyond what holds it
    trace_restart: times in s at which the trace begins anew, written as numbers, or "phases"
    trace_torque: columns of torques that actuators gave, by joint; what these leave is a source "residual"
    trace_torque_factor: what brings these to N m and N
    uncertain: file of how uncertain bodies are, which gives torques a standard deviation beside them
    cutoff_sweep: lowest and highest cutoff in Hz, and their number if not 7, at which sizes of all torques
    are told by `Analysis.cutoff_sweep`; `processing` needs a low-pass
    columns: columns that are computed, written as for --columns: "sums", ``"tau_gravity/*/hand"``; all where
    there are none, and where points, powers, a trace or a sweep, made of all torques, are asked for
    muscles: forces of muscles, and the model of OpenSim with their paths; each is a load, or each group
    markers: model of OpenSim that a log of markers, .trc or .c3d, is of, and how that and its plates are read

    Raises LinkwiseError, naming file, row and column, for what cannot be analysed.
    """
    held = Contacts.of(contacts)
    loaded = with_payloads(robot if isinstance(robot, OpenedRobot) else load_robot(Path(robot)), payloads)
    loaded, borne = with_contacts(loaded, held), Loads.of(loads, loads_cutoff)
    outputs = Outputs(
        page=False,
        columns=patterns_of(columns),
        induced=tuple(induced),
        induced_whole=induced_whole,
        induced_power=induced_power,
        reactions=tuple(reactions),
        phases=tuple(map(Phase.of, phases)),
        trace=TraceChoices(
            tuple(trace),
            trace_windows,
            trace_weight,
            tuple(map(str, trace_restart)),
            trace_torque if isinstance(trace_torque, Mapping) else tuple(trace_torque),
            trace_torque_factor,
        ),
    )
    told = None if uncertain is None else Path(uncertain)
    swept = None if cutoff_sweep is None else CutoffRange.of(cutoff_sweep)
    asked = Request(
        reading or Reading(), processing or Processing(), outputs, borne, held, told, swept, muscles, markers
    )
    job = prepared(Path(log), loaded, asked, progress)
    with EverySample(len(job.decomposer.rows), job.count) as kept:
        return job.analysis(job.run(kept, progress), kept.values)


def analyze_to(
    out: Path,
    log: Path,
    robot: OpenedRobot,
    asked: Request,
    progress: Progress,
    beside: Mapping[str, Callable[[Sequence[Path], Path], object]] | None = None,
) -> tuple[Analysis, Sequence[Path]]:
    """Analyse a log of any length with flat memory; `out` appears when everything is done.

    beside: what makes more files, by their names, of the record and the table, and writes them to a path

    Returns the analysis and the paths of the files written. Samples of the analysis are in a file without a
    name where figures or a page are asked for; otherwise it has none. Raises LinkwiseError, as `analyze`
    does, and where `out` holds something else than a former result or cannot be written.
    """
    robot, outputs = with_contacts(robot, asked.contacts), asked.outputs
    phases = [phase.name for phase in outputs.phases]
    traced = robot.joints if EVERY in outputs.trace.joints else outputs.trace.joints
    swept = asked.cutoff_sweep is not None
    told = figure_names(outputs.induced, outputs.reactions, outputs.induced_power, phases, traced, swept)
    for name in outputs.figures:
        check_figure(name, robot, told)
    refuse_inside_package(out)
    own = [] if asked.uncertain is None else [asked.uncertain]
    own += [] if asked.muscles is None else asked.muscles.files
    own += [] if asked.markers is None or asked.markers.tasks is None else [asked.markers.tasks]
    for file in (log, *asked.loads.paths, *asked.contacts.measured.paths, *own):
        if is_inside(file, out):
            raise LinkwiseError(f"--out {out} is to be replaced and holds the log {file}; give another --out")
    with whole_directory(out, _refuse_unless_result) as draft:
        job = prepared(log, robot, asked, progress, draft)
        if job.markers is not None:
            (draft / MOTION).write_bytes(job.markers.followed.motion)
        note = json_text(job.note())
        keep = (job.count, draft) if outputs.page or outputs.figures else (0, None)
        naming = outputs.storage, outputs.storage_units
        store = begin_storages(draft, job.decomposer.rows, job.count, *naming)
        with (
            open_table(draft / f"analysis.{outputs.table}", job.columns, note) as table,
            EverySample(len(job.decomposer.rows), *keep) as kept,
        ):

            def sink(block: Array) -> None:
                table(job.table_rows(block))
                store(block)
                if keep[0]:
                    kept(block)

            analysis = job.analysis(job.run(sink, progress), kept.values)
        if analysis.cutoff_sweep is not None:
            write_sweep(draft / f"{SWEEP_TABLE}.{outputs.table}", analysis.cutoff_sweep, note)
        _write_beside_table(draft, analysis, outputs, beside or {})
        names = sorted(file.name for file in draft.iterdir())
    return analysis, [out / name for name in names]


def _write_beside_table(
    draft: Path,
    analysis: Analysis,
    outputs: Outputs,
    beside: Mapping[str, Callable[[Sequence[Path], Path], object]],
) -> None:
    """Write the record, the figures, the page, and what is made of the record and the table."""
    files = file_names("-".join(map(file_name, name.split(":", 1))) for name in outputs.figures)
    for file, name in zip(files, outputs.figures, strict=True):
        kind = outputs.figure_format
        (draft / f"{file}.{kind}").write_bytes(figure_bytes(analysis, name, kind))
    if outputs.page:
        (draft / "report.html").write_bytes(report(analysis).encode())
    files = sorted([RECORD, *beside, *(file.name for file in draft.iterdir())])
    record = {**analysis.record(), "files": files}
    (draft / RECORD).write_bytes(f"{json_text(record, indent=1)}\n".encode())
    table = draft / f"analysis.{outputs.table}"
    for name, write in beside.items():
        write([draft / RECORD, *([table] if table.is_file() else [])], draft / name)


def _refuse_unless_result(target: Path) -> None:
    """Raise LinkwiseError unless `target` is an empty directory or a former result, and nothing else."""
    refuse_unless_folder(target, "give another --out")
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
    """Return the names of the files of a result, as its record lists them.

    The set is empty where the file is no record.
    """
    try:
        said = json.loads(record.read_text(encoding="utf-8")) if record.is_file() else None
    except (OSError, ValueError, RecursionError):
        return set()
    files = said.get("files") if isinstance(said, dict) else None
    return {name for name in files if isinstance(name, str)} if isinstance(files, list) else set()
