"""The subcommands `report terms` and `report reduction`."""

import re
from dataclasses import replace
from pathlib import Path
from typing import Annotated

import typer

from linkwise.errors import LinkwiseError

CHECKED_TO = 14
"""A planar arm is counted at least to here: the paper's ten joints, and four to confirm."""
BUDGET = 2_000_000
"""Terms of one expansion; a polynomial of this size takes about 0.5 GB."""
PLANAR_ARM = "planar arm"

Budget = Annotated[int, typer.Option(help="Terms that one expansion may hold")]
Json = Annotated[bool, typer.Option("--json", help="Print JSON")]
Lock = Annotated[list[str] | None, typer.Option(help="Hold a joint: JOINT=VALUE; may be repeated")]
Out = Annotated[Path | None, typer.Option(help="Directory that gets the report's files")]
Root = Annotated[str | None, typer.Option(help="Keep only what hangs on this link")]
Tip = Annotated[str | None, typer.Option(help="Keep only the chain to this link")]


def register(app: typer.Typer) -> None:
    """Add the commands to an application."""
    report = typer.Typer(no_args_is_help=True, help="Term counts and the cost-reduction curve.")
    report.command()(terms)
    report.command()(reduction)
    app.add_typer(report, name="report")


def terms(
    robot: Annotated[str, typer.Argument(help="planar3, planarN, puma560, or a .toml, .urdf or .py file")],
    joint: Annotated[str, typer.Option(help="Joint i: its name, its number from 1, or all")] = "1",
    link: Annotated[str, typer.Option(help="Link j: its name, its number from 1, or all")] = "all",
    coordinate: Annotated[str, typer.Option(help="Joint k, whose motion is kept")] = "1",
    order: Annotated[int, typer.Option(help="Kept: 2 acceleration, 1 velocity, 0 gravity")] = 2,
    parameters: Annotated[
        str, typer.Option(help="symbolic: a symbol a parameter; numeric: its number")
    ] = "symbolic",
    lock: Lock = None,
    root: Root = None,
    tip: Tip = None,
    budget: Budget = BUDGET,
    partial: Annotated[
        bool, typer.Option("--partial", help="Report on the links that fit the budget")
    ] = False,
    out: Out = None,
    as_json: Json = False,
) -> None:
    """Count terms and operations of the partial torques, and those that one bucket needs."""
    from linkwise.cli.options import reading_options
    from linkwise.output import require_writable, write_files
    from linkwise.pipeline import read_system
    from linkwise.progress import progress
    from linkwise.report import (
        TermQuery,
        json_text,
        position,
        progress_line,
        terms_files,
        terms_json,
        terms_markdown,
        terms_report,
    )

    _require_budget(budget)
    if order not in (0, 1, 2):
        raise LinkwiseError(f"--order is {order}; choose 2 for acceleration, 1 for velocity, 0 for gravity")
    system = read_system(robot, reading_options(lock, parameters, root=root, tip=tip))
    joints, links = [c.name for c in system.coordinates], [part.name for part in system.links]
    query = TermQuery(
        None if joint == "all" else position(joint, joints, "--joint"),
        None if link == "all" else position(link, links, "--link"),
        position(coordinate, joints, "--coordinate"),
        order,
    )
    if out is not None:
        require_writable(out)
    with progress() as advance:
        result = terms_report(system, query, budget, partial, advance)
    if out is not None:
        write_files(out, terms_files(result))
    typer.echo(json_text(terms_json(result)) if as_json else terms_markdown(result), nl=False)
    if not result.complete:
        typer.echo(progress_line(result), err=True)


def reduction(
    robot: Annotated[
        str, typer.Option(help="planar: the paper's arm; or any serial robot, as in terms")
    ] = "planar",
    dof: Annotated[str, typer.Option(help="Degrees of freedom, FIRST..LAST")] = "1..10",
    lock: Lock = None,
    root: Root = None,
    tip: Tip = None,
    measured: Annotated[bool, typer.Option("--measure", help="Time generated code too; needs torch")] = False,
    seconds: Annotated[Path | None, typer.Option(help="Draw the times of an earlier measured.json")] = None,
    budget: Budget = BUDGET,
    out: Out = None,
    as_json: Json = False,
) -> None:
    """Draw the share of terms of τ_1 that its q̈_1 part does not need (the paper's Fig. 15)."""
    from linkwise.cli.options import reading_options
    from linkwise.output import require_writable, write_files
    from linkwise.pipeline import read_system
    from linkwise.progress import progress
    from linkwise.report import (
        json_text,
        measure,
        read_seconds,
        reduction_json,
        reduction_markdown,
        seconds_json,
        seconds_markdown,
        study,
        study_files,
    )

    first, last = dof_range(dof)
    _require_budget(budget)
    options = reading_options(lock, "symbolic", root=root, tip=tip)
    if robot == "planar":
        arm = read_system(f"planar{_planar_joints(last, len(options.lock))}", options)
        name, system, beyond = PLANAR_ARM, replace(arm, name=PLANAR_ARM), CHECKED_TO
    else:
        name, system, beyond = Path(robot).stem, read_system(robot, options), last
    found = None if seconds is None else read_seconds(seconds)
    if out is not None:
        require_writable(out)
    with progress() as advance:
        result = study(name, system, first, last, beyond, budget, advance)
        if measured and found is None:
            found = seconds_json(name, measure(system, result.dof, advance))
    if out is not None:
        write_files(out, study_files(result, found))
    if as_json:
        measurement = {} if found is None else {"measured": found}
        typer.echo(json_text(reduction_json(result) | measurement), nl=False)
        return
    typer.echo(reduction_markdown(result), nl=False)
    if found is not None:
        typer.echo("\n" + seconds_markdown(result, found), nl=False)


def _require_budget(budget: int) -> None:
    if budget < 1:
        raise LinkwiseError(f"--budget is {budget}; give at least 1 term")


def _planar_joints(last: int, locked: int) -> int:
    """Joints of the planar arm of which `locked` are held, so that enough move."""
    from linkwise.robot.read import MAX_PLANAR

    if last > MAX_PLANAR:
        raise LinkwiseError(f"--dof reaches {last}, but the planar arm has at most {MAX_PLANAR} joints")
    return min(max(last, CHECKED_TO) + locked, MAX_PLANAR)


def dof_range(text: str) -> tuple[int, int]:
    """Parse FIRST..LAST or a single number; raises LinkwiseError for an empty or negative range."""
    match = re.fullmatch(r"(-?\d+)(?:\.\.(-?\d+))?", text)
    first, last = (int(match[1]), int(match[2] or match[1])) if match else (0, 0)
    if not 1 <= first <= last:
        raise LinkwiseError(
            f"--dof {text!r} is not a range; write FIRST..LAST with 1 ≤ FIRST ≤ LAST, such as 1..10"
        )
    return first, last
