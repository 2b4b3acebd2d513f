"""The subcommands `report terms` and `report reduction`."""

import re
from pathlib import Path
from typing import Annotated, Literal

import typer

from linkwise.errors import LinkwiseError
from linkwise.model import Options
from linkwise.pipeline import read_system
from linkwise.report import measured_text, plots, study_text, terms_text
from linkwise.report.files import json_text, write_all
from linkwise.report.progress import progress_bar
from linkwise.report.question import Question, position
from linkwise.report.readings import readings
from linkwise.report.seconds import machine, measure
from linkwise.report.study import Study, study
from linkwise.report.survey import BUDGET
from linkwise.report.terms import terms_report
from linkwise.symbolic.system import System

CHECKED_TO = 14
"""A planar arm is counted at least to here: the paper's ten joints, and four to confirm."""

Out = Annotated[Path | None, typer.Option(help="Directory for the report's files.")]
Budget = Annotated[int, typer.Option(min=1, help="Terms that one expansion may hold.")]
Json = Annotated[bool, typer.Option("--json", help="Print the data as JSON.")]


def register(app: typer.Typer) -> None:
    """Add the commands to an application."""
    report = typer.Typer(no_args_is_help=True, help="Term counts and the cost-reduction curve.")
    report.command()(terms)
    report.command()(reduction)
    app.add_typer(report, name="report")


def terms(
    robot: Annotated[str, typer.Argument(help="Built-in name, .toml, .urdf or .py file.")],
    joint: Annotated[str, typer.Option(help="Joint i: name, number from 1, or all.")] = "1",
    link: Annotated[str, typer.Option(help="Link j: name, number from 1, or all.")] = "all",
    coordinate: Annotated[str, typer.Option(help="Joint k whose motion is kept.")] = "1",
    order: Annotated[
        int, typer.Option(min=0, max=2, help="What is kept: 2 acceleration, 1 velocity, 0 gravity.")
    ] = 2,
    parameters: Annotated[
        Literal["symbolic", "numeric"], typer.Option(help="A symbol a parameter, or its number.")
    ] = "symbolic",
    lock: Annotated[
        list[str] | None, typer.Option(metavar="JOINT=VALUE", help="Hold a joint at a value.")
    ] = None,
    budget: Budget = BUDGET,
    out: Out = None,
    as_json: Json = False,
) -> None:
    """Count terms and operations of the partial torques, and those that one bucket needs."""
    options = Options(parameters=parameters, lock=_locks(lock or []))
    system = read_system(robot, options)
    joints, links = [c.name for c in system.coordinates], [part.name for part in system.links]
    question = Question(
        None if joint == "all" else position(joint, joints, "--joint"),
        None if link == "all" else position(link, links, "--link"),
        position(coordinate, joints, "--coordinate"),
        order,
    )
    with progress_bar(f"expanding {system.name}") as progress:
        result = terms_report(system, question, budget, progress)
    data, page = json_text(terms_text.data(result)), terms_text.page(result)
    if out is not None:
        files = {"terms.json": data, "terms.md": page, "terms.csv": terms_text.table(result)}
        write_all(out, _encoded(files) | plots.terms_images(result))
    typer.echo(data if as_json else page, nl=False)
    if not result.complete:
        typer.echo(terms_text.progress_line(result), err=True)


def reduction(
    robot: Annotated[str, typer.Option(help="planar for the paper's arm, or any serial robot.")] = "planar",
    dof: Annotated[str, typer.Option(metavar="FIRST..LAST", help="Degrees of freedom.")] = "1..10",
    measure_seconds: Annotated[
        bool, typer.Option("--measure", help="Time generated code too; needs torch.")
    ] = False,
    seconds: Annotated[
        Path | None, typer.Option(help="Draw the times of an earlier measured.json instead.")
    ] = None,
    budget: Budget = BUDGET,
    out: Out = None,
    as_json: Json = False,
) -> None:
    """Draw the share of terms of τ_1 that its q̈_1 part does not need (Fig. 15)."""
    first, last = _range(dof)
    beyond = max(last, CHECKED_TO) if robot == "planar" else last
    spec = f"planar{beyond}" if robot == "planar" else robot
    system = read_system(spec, Options(parameters="symbolic"))
    name = "planar arm" if robot == "planar" else system.name
    found = measured_text.read(seconds) if seconds is not None else None
    with progress_bar(f"expanding {name}") as progress:
        result = study(name, system, first, last, beyond, budget, progress)
    if measure_seconds and found is None:
        found = _measured(system, result)
    data, page = json_text(study_text.data(result)), study_text.page(result)
    if out is not None:
        files = {
            "reduction.json": data,
            "reduction.md": page,
            "reduction.csv": study_text.table(result),
        }
        write_all(out, _encoded(files) | _images(result) | _measured_files(result, found))
    typer.echo(data if as_json else page, nl=False)


def _measured(system: System, result: Study) -> dict[str, object]:
    with progress_bar("measuring") as progress:
        timings = measure(system, result.dof, progress)
    return measured_text.data(result.robot, timings, machine())


def _images(result: Study) -> dict[str, bytes]:
    drawn = plots.readings_images("readings", result.robot, readings(result))
    return plots.reduction_images(result) | drawn


def _measured_files(result: Study, found: dict[str, object] | None) -> dict[str, bytes]:
    if found is None:
        return {}
    lines = readings(result, measured_text.timings_of(found))
    files = {"measured.json": json_text(found), "measured.md": measured_text.page(result, found)}
    return _encoded(files) | plots.readings_images("measured", result.robot, lines)


def _encoded(files: dict[str, str]) -> dict[str, bytes]:
    return {name: text.encode() for name, text in files.items()}


def _range(text: str) -> tuple[int, int]:
    match = re.fullmatch(r"(-?\d+)(?:\.\.(-?\d+))?", text)
    first, last = (int(match[1]), int(match[2] or match[1])) if match else (0, 0)
    if not 1 <= first <= last:
        raise LinkwiseError(
            f"--dof {text!r} is no range; write FIRST..LAST with 1 ≤ FIRST ≤ LAST, such as 1..10"
        )
    return first, last


def _locks(entries: list[str]) -> dict[str, float]:
    locks = {}
    for entry in entries:
        name, _, value = entry.rpartition("=")
        try:
            locks[name] = float(value)
        except ValueError:
            name = ""
        if not name:
            raise LinkwiseError(f"--lock {entry!r} is not JOINT=VALUE; write such as --lock finger=0.02")
    return locks
