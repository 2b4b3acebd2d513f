"""The command `analyze`."""

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer

from linkwise.analysis import Analysis
from linkwise.analysis.analysis_choices import AnalysisChoices
from linkwise.analysis.payload import carrying
from linkwise.analysis.run import analyze_to
from linkwise.analysis.settings import Convention
from linkwise.analysis.tables import Format
from linkwise.cli import Json, tell
from linkwise.cli.contact_options import Held, Measured, Threshold, Unactuated, While
from linkwise.cli.log_options import (
    UNITS,
    AngleUnits,
    Backend,
    Cutoff,
    Degree,
    Ends,
    FilterOrder,
    How,
    IgnoreExtra,
    Log,
    LoopTolerance,
    Map,
    Pad,
    Positions,
    Resample,
    Time,
    Topic,
    Window,
)
from linkwise.cli.options import reads_robot
from linkwise.cli.robot_option import RobotOption, opened_robot
from linkwise.escape import json_text, listed
from linkwise.progress import progress as shown_progress
from linkwise.robot import Options

Out = Annotated[Path, typer.Option(help="Directory to write; a former result is replaced")]
Terms = Annotated[
    Convention, typer.Option(help="Velocity terms: closing sums to the torque, gradient is Eq. 1")
]
TableFormat = Annotated[Format, typer.Option(help="Format of the table")]
Figures = Annotated[
    list[str] | None,
    typer.Option(
        help="paper or causes, alone or with :JOINT, shares, power, induced, induced:POINT or contacts;"
        " may be repeated"
    ),
]
Phases = Annotated[
    list[str] | None,
    typer.Option(
        "--phase",
        metavar="NAME/REST=WHAT",
        help="Part of the movement that the figure causes holds against the rest: WHAT is a load or contact,"
        " a column COLUMN>VALUE of the log, or FROM..TO in s; may be repeated",
    ),
]
PowerTerms = Annotated[bool, typer.Option("--power-terms", help="Write power by cause and order too")]
Carried = Annotated[
    list[str] | None,
    typer.Option(
        "--payload",
        metavar="BODY=KG,X,Y,Z",
        help="Point mass on a body, at a point in its axes, m; NAME:BODY=… names it; may be repeated",
    ),
]
ConstantLoads = Annotated[
    list[str] | None,
    typer.Option(
        "--load",
        metavar="BODY=FX,FY,FZ@X,Y,Z",
        help="Constant force, N, in the world's axes, at a point in the body's, m; ,MX,MY,MZ behind FZ adds a"
        " moment, N·m; NAME:BODY=… names it; may be repeated",
    ),
]
LoadFiles = Annotated[
    list[Path] | None,
    typer.Option(
        metavar="FILE",
        help="Log of loads, columns BODY/force_x …, or OpenSim's external loads; may be repeated",
    ),
]
LoadsCutoff = Annotated[
    float | None, typer.Option(help="Zero-phase low-pass for these loads, Hz; no filter if not given")
]
Induced = Annotated[
    list[str] | None,
    typer.Option(
        metavar="POINT",
        help="Tell an acceleration by its sources: FRAME or FRAME,X,Y,Z in m, joints, or centre-of-mass; may "
        "be repeated",
    ),
]
Page = Annotated[bool, typer.Option("--page/--no-page", help="Write report.html")]

app = typer.Typer(add_completion=False)


@app.command()
@reads_robot()
def analyze(
    options: Options,
    log: Log,
    robot: RobotOption,
    out: Out,
    units: AngleUnits = None,
    time: Time = None,
    topic: Topic = None,
    qpos: Positions = None,
    mapping: Map = None,
    ignore_extra: IgnoreExtra = False,
    resample: Resample = None,
    loop_tolerance: LoopTolerance = 0.01,
    derivative: How = "five-point",
    window: Window = None,
    degree: Degree = None,
    cutoff: Cutoff = None,
    filter_order: FilterOrder = None,
    padding: Pad = None,
    edges: Ends = "one-sided",
    convention: Terms = "closing",
    format: TableFormat = "parquet",
    figure: Figures = None,
    phase: Phases = None,
    power_terms: PowerTerms = False,
    payload: Carried = None,
    load: ConstantLoads = None,
    loads: LoadFiles = None,
    loads_cutoff: LoadsCutoff = None,
    contact: Held = None,
    contact_while: While = None,
    contact_loads: Measured = None,
    contact_threshold: Threshold = None,
    unactuated: Unactuated = None,
    induced: Induced = None,
    backend: Backend = None,
    page: Page = True,
    as_json: Json = False,
) -> None:
    """Who loads whom: every torque term of a recorded movement, as a table, figures and a page."""
    chosen = AnalysisChoices(
        units,
        time,
        topic,
        qpos,
        tuple(mapping or ()),
        ignore_extra,
        resample,
        loop_tolerance,
        derivative,
        window,
        degree,
        cutoff,
        filter_order,
        padding,
        edges,
        convention,
        tuple(phase or ()),
        power_terms,
        tuple(payload or ()),
        tuple(load or ()),
        tuple(map(str, loads or ())),
        loads_cutoff,
        tuple(contact or ()),
        tuple(contact_while or ()),
        tuple(map(str, contact_loads or ())),
        contact_threshold,
        tuple(unactuated or ()),
        tuple(induced or ()),
    )
    how = chosen.reading, chosen.processing, chosen.wanted(format, figure or (), page)
    with shown_progress() as progress:
        package = opened_robot(robot, backend, options, progress)
    package = carrying(package, chosen.payloads(package))
    put = chosen.borne(package), chosen.contacts(package)
    with shown_progress(UNITS) as progress:
        analysis, files = analyze_to(out, log, package, *how, progress, *put)
    for warning in analysis.warnings:
        tell(f"warning: {log}: {warning}", err=True)
    for warning in analysis.load_warnings:
        tell(f"warning: {warning}", err=True)
    if analysis.ignored:
        tell(f"left out: {listed(analysis.ignored)}", err=True)
    if as_json:
        print(json_text(analysis.record()))
    else:
        tell(*_told(analysis, files))


def _told(analysis: Analysis, files: Sequence[Path]) -> list[str]:
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
    return [
        f"{analysis.total:,} samples at {analysis.rate:.6g} Hz, back end {analysis.robot.backend};"
        f" {recursion}; closure: terms sum to partial torques within {closure.terms_relative:.1e},"
        f" these to joint torques within {closure.links_relative:.1e} (relative){shares}",
        *_of_contacts(analysis),
        *map(str, files),
    ]


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
