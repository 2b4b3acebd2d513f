"""The subcommands `analyze` and `motion`."""

import json
from pathlib import Path
from typing import Annotated, Literal

import typer

from linkwise.errors import LinkwiseError
from linkwise.motion.settings import (
    Convention,
    Derivative,
    Edges,
    Lowpass,
    Padding,
    Processing,
    Reading,
    Units,
)
from linkwise.motion.tables import Format

Kind = Literal["recorded", "simulated", "both"]


def register(app: typer.Typer) -> None:
    """Add the commands to an application."""
    app.command()(analyze)
    app.command()(motion)


def analyze(
    log: Annotated[Path, typer.Argument(help="Motion log: .csv, .mot, .sto or .parquet.")],
    robot: Annotated[Path, typer.Option(help="Directory of a generated robot.")],
    out: Annotated[Path, typer.Option(help="Directory to write; a former result is replaced.")],
    units: Annotated[
        Units | None,
        typer.Option(help="Unit of the angles; lengths are metres. [default: the file's, else rad]"),
    ] = None,
    time: Annotated[str | None, typer.Option(help="Column of the time, in s.")] = None,
    mapping: Annotated[
        list[str] | None, typer.Option("--map", metavar="COLUMN=JOINT", help="Column of a joint.")
    ] = None,
    ignore_extra: Annotated[
        bool, typer.Option("--ignore-extra", help="Leave out columns that no joint has.")
    ] = False,
    resample: Annotated[
        float | None, typer.Option(help="Bring uneven time to this rate, Hz, by cubic splines.")
    ] = None,
    derivative: Annotated[
        Derivative, typer.Option(help="How velocities and accelerations are made.")
    ] = "five-point",
    window: Annotated[int, typer.Option(help="Savitzky-Golay: samples a window.")] = 11,
    degree: Annotated[int, typer.Option(help="Savitzky-Golay: degree of the polynomial.")] = 4,
    cutoff: Annotated[
        float | None, typer.Option(help="Zero-phase Butterworth low-pass, Hz. [default: no filter]")
    ] = None,
    filter_order: Annotated[int, typer.Option(help="The filter's order, of one pass.")] = 2,
    padding: Annotated[Padding, typer.Option(help="How the filter continues the log past its ends.")] = "odd",
    edges: Annotated[
        Edges, typer.Option(help="First and last samples: one-sided formulas, or cut off.")
    ] = "one-sided",
    convention: Annotated[
        Convention,
        typer.Option(help="Velocity terms: closing sums to the torque; gradient is Eq. 1."),
    ] = "closing",
    format: Annotated[Format, typer.Option(help="Format of the table.")] = "parquet",
    figure: Annotated[
        list[str] | None, typer.Option(help="Figures to draw: paper, paper:JOINT, shares.")
    ] = None,
    backend: Annotated[
        str | None, typer.Option(help="Back end of the robot. [default: native, else numpy]")
    ] = None,
    page: Annotated[bool, typer.Option("--page/--no-page", help="Write report.html.")] = True,
    as_json: Annotated[bool, typer.Option("--json", help="Print the record as JSON.")] = False,
) -> None:
    """Who loads whom: every torque term of a recorded movement, as a table, figures and a page."""
    from linkwise.motion.files import Wanted, analyze_to
    from linkwise.motion.progress import shown_progress
    from linkwise.motion.robot import load_robot

    reading = Reading(units, time, _pairs(mapping or []), ignore_extra, resample)
    lowpass = None
    if cutoff is not None:
        lowpass = Lowpass(cutoff, filter_order, padding)
    processing = Processing(
        derivative,
        window,
        degree,
        lowpass,
        edges,
        convention,
    )
    wanted = Wanted(format, tuple(figure or ()), page)
    loaded = load_robot(robot, backend)
    with shown_progress() as progress:
        analysis, files = analyze_to(out, log, loaded, reading, processing, wanted, progress)
    for warning in analysis.warnings:
        typer.echo(f"warning: {log}: {warning}", err=True)
    if analysis.ignored:
        typer.echo(f"left out: {', '.join(analysis.ignored)}", err=True)
    if as_json:
        typer.echo(json.dumps(analysis.record(), ensure_ascii=False))
        return
    closure = analysis.closure
    typer.echo(
        f"{analysis.total:,} samples at {analysis.rate:.6g} Hz, back end {loaded.backend};"
        f" terms sum to partial torques within {closure.terms_relative:.1e},"
        f" these to joint torques within {closure.links_relative:.1e} (relative)"
    )
    for file in files:
        typer.echo(file)


def motion(
    out: Annotated[Path, typer.Option(help="Directory for recorded.csv and simulated.csv.")],
    kind: Annotated[Kind, typer.Option(help="Which of the two motions.")] = "both",
    as_json: Annotated[bool, typer.Option("--json", help="Print what was written as JSON.")] = False,
) -> None:
    """Write the paper's two motions (Fig. 5 and 10) for the arm of Table 2, `planar3`."""
    from linkwise.motion.motions import MOTIONS, RATE, write_csv

    wanted = list(MOTIONS) if kind == "both" else [kind]
    try:
        out.mkdir(parents=True, exist_ok=True)
        written = [
            {"file": str(file), "samples": write_csv(file, MOTIONS[name]), "rate_hz": RATE}
            for name in wanted
            for file in [out / f"{name}.csv"]
        ]
    except OSError as error:
        raise LinkwiseError(f"{out}: cannot be written: {error.strerror}") from error
    if as_json:
        typer.echo(json.dumps(written))
        return
    for entry in written:
        typer.echo(f"{entry['file']}: {entry['samples']} samples at {RATE:g} Hz")


def _pairs(mapping: list[str]) -> tuple[tuple[str, str], ...]:
    pairs = []
    for text in mapping:
        column, sign, joint = text.rpartition("=")
        if not (sign and column and joint):
            raise LinkwiseError(f"--map {text}: write it as COLUMN=JOINT")
        pairs.append((column, joint))
    return tuple(pairs)
