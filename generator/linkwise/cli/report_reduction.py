"""The command `report reduction`."""

import re
from dataclasses import replace
from pathlib import Path
from typing import Annotated

import typer

from linkwise.cli import BUDGET, Budget, Json, ReportOut
from linkwise.cli.flags import takes, tell_run
from linkwise.errors import LinkwiseError
from linkwise.escape import short
from linkwise.output import write_files
from linkwise.package.write import require_free
from linkwise.pipeline import read_system
from linkwise.progress import progress
from linkwise.report import (
    measure,
    measure_derivations,
    read_seconds,
    reduction_json,
    reduction_markdown,
    report_json,
    seconds_json,
    seconds_markdown,
    study,
    study_files,
)
from linkwise.robot import DESCRIPTIONS, Options, read_robot
from linkwise.robot.coordinates import MOST_JOINTS
from linkwise.symbolic.system import System, rigid_system

CHECKED_TO = 14
"""Joints to which a planar arm is counted at least: the paper's ten, and four to confirm."""
PLANAR_ARM = "planar arm"
ASKED_FOR = 10
"""Most degrees of freedom where nobody says how many: as many as the paper's."""

app = typer.Typer(add_completion=False)


@app.command()
@takes(parameters="nonzero")
def reduction(
    options: Options,
    robot: Annotated[
        str,
        typer.Option(help=f"planar: an arm as the paper's; or a serial robot: {DESCRIPTIONS}"),
    ] = "planar",
    dof: Annotated[
        str | None,
        typer.Option(help=f"Degrees of freedom, FIRST..LAST; else from 1 on, to {ASKED_FOR} at most"),
    ] = None,
    graphs: Annotated[
        bool,
        typer.Option("--graphs", help="Count what autograd takes too, operations and nodes; needs torch"),
    ] = False,
    measured: Annotated[bool, typer.Option("--measure", help="Time generated code too; needs torch")] = False,
    seconds: Annotated[Path | None, typer.Option(help="Draw the times of an earlier measured.json")] = None,
    budget: Budget = BUDGET,
    out: ReportOut = None,
    as_json: Json = False,
) -> None:
    """Draw the share of terms of τ_1 that its q̈_1 part does not need (the paper's Fig. 15)."""
    first, last = (1, ASKED_FOR) if dof is None else dof_range(dof)
    name, system, beyond = _arm(robot, last, options)
    tell_run(robot)
    if dof is None:
        last = min(last, len(system.links))
    found = None if seconds is None else read_seconds(seconds)
    if out is not None:
        require_free(out)
    with progress() as advance:
        result = study(name, system, first, last, beyond, budget, advance, graphs)
        if measured and found is None:
            derivations = measure_derivations(system, result.dof, advance)
            found = seconds_json(name, measure(system, result.dof, advance), derivations)
    if out is not None:
        write_files(out, study_files(result, found))
    if as_json:
        measurement = {} if found is None else {"measured": found}
        print(report_json(reduction_json(result) | measurement), end="")
        return
    print(reduction_markdown(result), end="")
    if found is not None:
        print("\n" + seconds_markdown(result, found), end="")


def dof_range(text: str) -> tuple[int, int]:
    """Return FIRST and LAST of FIRST..LAST or a single number.

    Raises LinkwiseError for an empty or negative range.
    """
    # Nine digits: more than any robot's joints, and far below what Python takes for one number.
    match = re.fullmatch(r"(\d{1,9})(?:\.\.(\d{1,9}))?", text)
    first, last = (int(match[1]), int(match[2] or match[1])) if match else (0, 0)
    if not 1 <= first <= last:
        raise LinkwiseError(
            f"--dof {short(text)!r} is not a range; write FIRST..LAST with 1 ≤ FIRST ≤ LAST, such as 1..10"
        )
    return first, last


def _arm(robot: str, last: int, options: Options) -> tuple[str, System, int]:
    """Return the arm's name, the arm, and the degrees of freedom up to which it is counted in any case."""
    if robot == "planar":
        arm = read_robot(f"planar{_planar_joints(last, len(options.lock))}", options)
        return PLANAR_ARM, rigid_system(replace(arm, name=PLANAR_ARM)), CHECKED_TO
    return Path(robot).stem, read_system(robot, options), 0


def _planar_joints(last: int, locked: int) -> int:
    """Return the number of joints of the planar arm of which `locked` are held, so that enough move."""
    if last > MOST_JOINTS:
        raise LinkwiseError(f"--dof reaches {last}, but the planar arm has at most {MOST_JOINTS} joints")
    return min(max(last, CHECKED_TO) + locked, MOST_JOINTS)
