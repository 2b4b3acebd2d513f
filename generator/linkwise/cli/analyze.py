"""The command `analyze`."""

from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import typer
from linkwise_runtime.motion.trace_equations import BETWEEN, RESIDUAL

from linkwise.analysis import Analysis
from linkwise.analysis.choices import AnalysisChoices
from linkwise.analysis.muscle_remainder import remainder_line
from linkwise.analysis.outputs import closed_at
from linkwise.analysis.payload import with_payloads
from linkwise.analysis.run import analyze_to
from linkwise.bundle import FILE, BundledInputs, pack, written_analysis
from linkwise.cli import Json, tell
from linkwise.cli.flags import NOTHING, WrittenOptions, takes
from linkwise.cli.log_options import UNITS, Backend, LogIfAny, RobotIfAny, opened_robot
from linkwise.cli.opensim_setup import with_setup
from linkwise.escape import json_text, listed
from linkwise.progress import progress as shown_progress
from linkwise.robot import Options

Setup = Annotated[
    Path | None,
    typer.Option(
        help="Setup of OpenSim's induced acceleration analysis, in place of LOG, --robot and what it says"
    ),
]
Out = Annotated[Path, typer.Option(help="Directory to write; a former result is replaced")]
Bundled = Annotated[
    bool,
    typer.Option(
        "--bundle", help=f"Also write {FILE}: log, robot, choices, versions and result, for linkwise replay"
    ),
]

app = typer.Typer(add_completion=False)


@app.command()
@takes(
    *("log", "robot", "opensim_setup", "out", "units", "time", "topic", "qpos"),
    ...,
    *("induced", "sto", "sto_units", "induced_power", "reaction", "uncertain", "cutoff_sweep"),
    *("trace", "trace_windows", "trace_weight", "trace_restart", "trace_torque"),
    *("trace_torque_factor", "backend", "page", "bundle", "as_json"),
    complete=with_setup,
)
def analyze(
    out: Out,
    chosen: AnalysisChoices,
    options: Options,
    log: LogIfAny = None,
    robot: RobotIfAny = None,
    opensim_setup: Setup = None,
    backend: Backend = None,
    bundle: Bundled = False,
    as_json: Json = False,
    given: WrittenOptions = NOTHING,
) -> None:
    """Decompose a recorded movement: every torque term, as a table, figures and a page."""
    assert log is not None, "`with_setup` sees to it"
    assert robot is not None, "`with_setup` sees to it"
    analysis, files = analyzed(out, log, robot, chosen, options, backend, given if bundle else None)
    if as_json:
        print(json_text(analysis.record()))
    else:
        tell(*_summary(analysis, files))


def analyzed(
    out: Path,
    log: Path,
    robot: str | Path,
    chosen: AnalysisChoices,
    options: Options,
    backend: str | None,
    bundled: Mapping[str, Any] | None = None,
) -> tuple[Analysis, Sequence[Path]]:
    """Analyse a log, tell its warnings, and return the analysis and the files that were written.

    bundled: options as they were written, for a bundle beside the result; None for none
    """
    robot = Path(robot)
    with shown_progress() as progress:
        package = opened_robot(robot, backend, options, progress)
    package = with_payloads(package, chosen.payloads(package))
    asked = chosen.request(package, robot)
    beside = {}
    if bundled is not None:
        inputs = BundledInputs.of(written_analysis(log, robot, package.backend, bundled))
        beside[FILE] = partial(pack, inputs)
    with shown_progress(UNITS) as progress:
        analysis, files = analyze_to(out, log, package, asked, progress, beside)
    for warning in analysis.warnings:
        tell(f"warning: {log}: {warning}", err=True)
    for warning in analysis.load_warnings:
        tell(f"warning: {warning}", err=True)
    if analysis.ignored:
        tell(f"left out: {listed(analysis.ignored)}", err=True)
    return analysis, files


def _summary(analysis: Analysis, files: Sequence[Path]) -> list[str]:
    closure = analysis.closure
    recursion = (
        "no independent value for energies written by hand"
        if closure.recursion_relative is None
        else f"partial torques agree with an independent Newton-Euler recursion within"
        f" {closure.recursion_relative:.1e}, power with the gain of the links' energies there within"
        f" {closure.energy_relative:.1e}"
    )
    residual = closure.induced_relative
    shares = "" if residual is None else f"; shares sum to accelerations within {residual:.1e}"
    if closure.power_relative is not None:
        shares += f"; power by source sums to what links gain within {closure.power_relative:.1e}"
    traced = closure.trace_relative
    shares += "" if traced is None else f"; traced velocities sum to those of the log within {traced:.1e}"
    nets = closure.nets_relative
    shares += "" if nets is None else f"; net torques by cause sum to joint torques within {nets:.1e}"
    where = f", of {closed_at(analysis)}" if analysis.rows.left_out else ""
    return [
        f"{analysis.total:,} samples at {analysis.rate:.6g} Hz, back end {analysis.robot.backend};"
        f" {recursion}; closure: terms sum to partial torques within {closure.terms_relative:.1e},"
        f" these to joint torques within {closure.links_relative:.1e} (relative){where}{shares}",
        *_of_contacts(analysis),
        *analysis.residual_report.lines,
        *_of_residual(analysis),
        *([] if analysis.markers is None else [analysis.markers.line]),
        *filter(None, [remainder_line(analysis)]),
        *_of_bodies(analysis),
        *analysis.signs.lines,
        *(() if analysis.cutoff_sweep is None else analysis.cutoff_sweep.lines),
        *map(str, files),
    ]


def _of_bodies(analysis: Analysis) -> list[str]:
    """Return lines on which segments links are, and on what a covariance of bodies is of."""
    uncertain = analysis.uncertain or {}
    presets = [
        f"{preset}: {', '.join(f'{link} is {segment}' for link, segment in told['segments'].items())}"
        for preset, told in uncertain.get("presets", {}).items()
    ]
    return [f"{uncertain['file']}: {line}" for line in [*presets, uncertain.get("note")] if line]


def _of_residual(analysis: Analysis) -> list[str]:
    """Return a line on how much of traced velocities measured torques leave."""
    if analysis.traced is None:
        return []
    robot, peak = analysis.robot, analysis.totals.peak
    names = analysis.rows.axes["origin"].names
    left = [o for o, name in enumerate(names) if name.partition(" ")[0].partition(BETWEEN)[0] == RESIDUAL]
    if not left:
        return []
    told = []
    for name in analysis.traced["joints"]:
        i = robot.joints.index(name)
        parts = peak[analysis.rows.numbers("qd_from", joint=i, origin=left)]
        whole = float(peak[analysis.rows.numbers("qd", joint=i)].max())
        left_over = f"{parts.max(initial=0.0):.3g} {robot.units[i]}/s"
        told.append(f"{left_over} of {name} (which reaches {whole:.3g})")
    what = (
        "measured torques leave"
        if analysis.traced["measured"]
        else "motion asks of joints that nothing drives"
    )
    return [f"residual, what {what}, gives up to {listed(told)}"]


def _of_contacts(analysis: Analysis) -> list[str]:
    """Return lines on how far a motion is from keeping its contacts."""
    robot, ground = analysis.robot, analysis.robot.contacts
    if ground is None:
        return []
    still = listed([robot.joints[i] for i in ground.unactuated])
    told = [f"nothing drives {still}: what these would have to give, contacts bear"]
    for c, name in enumerate(ground.names):
        if not analysis.is_ever_on(c):
            continue
        metres, turns = analysis.largest_slip(c)
        told.append(f"contact {name} moves by up to {metres:.3g} m/s and {turns:.3g} rad/s while it is on")
    return told
