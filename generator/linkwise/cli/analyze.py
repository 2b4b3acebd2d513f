"""The command `analyze`."""

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer

from linkwise.analysis import Analysis
from linkwise.analysis.loaded_robot import load_robot
from linkwise.analysis.run import Wanted, analyze_to
from linkwise.analysis.settings import (
    Convention,
    Derivative,
    Edges,
    Lowpass,
    Padding,
    Processing,
    Reading,
    Units,
)
from linkwise.analysis.tables import Format
from linkwise.cli import Json, tell
from linkwise.errors import LinkwiseError
from linkwise.escape import json_text, listed
from linkwise.progress import progress as shown_progress

UNITS = {"reading": "B", "resampling": "samples", "analysing": "samples"}

Log = Annotated[Path, typer.Argument(help="Motion log: .csv, .mot, .sto or .parquet")]
Package = Annotated[Path, typer.Option(help="Directory of a generated robot")]
Out = Annotated[Path, typer.Option(help="Directory to write; a former result is replaced")]
AngleUnits = Annotated[
    Units | None,
    typer.Option(help="Unit of the angles, lengths are metres; the file's own, else rad, if not given"),
]
Time = Annotated[str | None, typer.Option(help="Column of the time, in s")]
Map = Annotated[
    list[str] | None,
    typer.Option("--map", metavar="COLUMN=JOINT", help="Column of a joint; may be repeated"),
]
IgnoreExtra = Annotated[bool, typer.Option("--ignore-extra", help="Leave out columns no joint has")]
Resample = Annotated[float | None, typer.Option(help="Bring uneven time to this rate, Hz, by splines")]
How = Annotated[Derivative, typer.Option(help="How velocities and accelerations are made")]
Window = Annotated[int | None, typer.Option(help="Savitzky-Golay: samples a window; 11 if not given")]
Degree = Annotated[int | None, typer.Option(help="Savitzky-Golay: degree of the fit; 4 if not given")]
Cutoff = Annotated[
    float | None, typer.Option(help="Zero-phase Butterworth low-pass, Hz; no filter if not given")
]
FilterOrder = Annotated[int | None, typer.Option(help="The filter's order, of one pass; 2 if not given")]
Pad = Annotated[
    Padding | None, typer.Option(help="How the filter continues the log past its ends; odd if not given")
]
Ends = Annotated[Edges, typer.Option(help="First and last samples: one-sided formulas, or cut off")]
Terms = Annotated[
    Convention, typer.Option(help="Velocity terms: closing sums to the torque, gradient is Eq. 1")
]
TableFormat = Annotated[Format, typer.Option(help="Format of the table")]
Figures = Annotated[list[str] | None, typer.Option(help="paper, paper:JOINT or shares; may be repeated")]
Backend = Annotated[str | None, typer.Option(help="Back end of the package; its fastest if not given")]
Page = Annotated[bool, typer.Option("--page/--no-page", help="Write report.html")]

app = typer.Typer(add_completion=False)


@app.command()
def analyze(
    log: Log,
    robot: Package,
    out: Out,
    units: AngleUnits = None,
    time: Time = None,
    mapping: Map = None,
    ignore_extra: IgnoreExtra = False,
    resample: Resample = None,
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
    backend: Backend = None,
    page: Page = True,
    as_json: Json = False,
) -> None:
    """Who loads whom: every torque term of a recorded movement, as a table, figures and a page."""
    reading = Reading(units, time, _pairs(mapping or []), ignore_extra, resample)
    lowpass = _lowpass(cutoff, filter_order, padding)
    if derivative == "five-point" and (window, degree) != (None, None):
        raise LinkwiseError("--window and --degree go with --derivative savitzky-golay; add it")
    processing = Processing(
        derivative,
        11 if window is None else window,
        4 if degree is None else degree,
        lowpass,
        edges,
        convention,
    )
    wanted = Wanted(format, tuple(figure or ()), page)
    package = load_robot(robot, backend)
    with shown_progress(UNITS) as progress:
        analysis, files = analyze_to(out, log, package, reading, processing, wanted, progress)
    for warning in analysis.warnings:
        tell(f"warning: {log}: {warning}", err=True)
    if analysis.ignored:
        tell(f"left out: {listed(analysis.ignored)}", err=True)
    if as_json:
        print(json_text(analysis.record()))
    else:
        tell(*_told(analysis, files))


def _lowpass(cutoff: float | None, order: int | None, padding: Padding | None) -> Lowpass | None:
    if cutoff is not None:
        return Lowpass(cutoff, 2 if order is None else order, padding or "odd")
    if (order, padding) != (None, None):
        raise LinkwiseError("--filter-order and --padding go with --cutoff; add it")
    return None


def _told(analysis: Analysis, files: Sequence[Path]) -> list[str]:
    closure = analysis.closure
    recursion = (
        "no independent value for energies written by hand"
        if closure.recursion_relative is None
        else f"partial torques agree with an independent Newton-Euler recursion within"
        f" {closure.recursion_relative:.1e}"
    )
    return [
        f"{analysis.total:,} samples at {analysis.rate:.6g} Hz, back end {analysis.robot.backend};"
        f" {recursion}; closure: terms sum to partial torques within {closure.terms_relative:.1e},"
        f" these to joint torques within {closure.links_relative:.1e} (relative)",
        *map(str, files),
    ]


def _pairs(mapping: list[str]) -> tuple[tuple[str, str], ...]:
    pairs = []
    for text in mapping:
        column, sign, joint = text.rpartition("=")
        if not (sign and column and joint):
            raise LinkwiseError(f"--map {text}: write it as COLUMN=JOINT")
        pairs.append((column, joint))
    return tuple(pairs)
