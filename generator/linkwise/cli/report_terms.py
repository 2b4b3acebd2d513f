"""The command `report terms`."""

from typing import Annotated

import typer

from linkwise.cli import BUDGET, Budget, Json, LinkName, ReportOut, tell
from linkwise.cli.flags import RobotName, is_given, takes, tell_run
from linkwise.errors import LinkwiseError
from linkwise.output import write_files
from linkwise.package.write import require_free
from linkwise.pipeline import read_system
from linkwise.progress import progress
from linkwise.report import (
    TermQuery,
    position,
    progress_line,
    report_json,
    terms_files,
    terms_json,
    terms_markdown,
    terms_report,
)
from linkwise.robot import Options

app = typer.Typer(add_completion=False)


@app.command()
@takes(parameters="nonzero")
def terms(
    context: typer.Context,
    robot: RobotName,
    options: Options,
    joint: Annotated[str, typer.Option(help="Joint i: its name, its number from 1, or all")] = "1",
    link: LinkName = "all",
    coordinate: Annotated[str, typer.Option(help="Joint k, whose motion is kept")] = "1",
    order: Annotated[
        int, typer.Option(help="Kept: 2 acceleration, 1 velocity, 0 gravity and potentials")
    ] = 2,
    budget: Budget = BUDGET,
    partial: Annotated[
        bool, typer.Option("--partial", help="Report on the links that fit the budget")
    ] = False,
    out: ReportOut = None,
    as_json: Json = False,
) -> None:
    """Count terms and operations of the partial torques, and those that one bucket needs."""
    if order not in (0, 1, 2):
        raise LinkwiseError(
            f"--order is {order}; choose 2 for acceleration, 1 for velocity, 0 for gravity and potentials"
        )
    system = read_system(robot, options, as_made=not is_given(context, "parameters"))
    tell_run(robot)
    joints, links = [c.name for c in system.coordinates], system.link_names
    query = TermQuery(
        None if joint == "all" else position(joint, joints, "--joint"),
        None if link == "all" else position(link, links, "--link"),
        position(coordinate, joints, "--coordinate"),
        order,
    )
    if out is not None:
        require_free(out)
    with progress() as advance:
        result = terms_report(system, query, budget, partial, advance)
    if out is not None:
        write_files(out, terms_files(result))
    print(report_json(terms_json(result)) if as_json else terms_markdown(result), end="")
    if not result.complete:
        tell(progress_line(result), err=True)
