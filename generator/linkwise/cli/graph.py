"""The command `graph`."""

from pathlib import Path
from typing import Annotated, Any

import typer

from linkwise.cli import GeneratedPackage, Json, LinkName, tell
from linkwise.errors import LinkwiseError
from linkwise.escape import json_text
from linkwise.extras import extra
from linkwise.graphs import (
    FOLDS,
    FORMATS,
    Overlay,
    graph_files,
    graph_json,
    graph_summary,
    overlay,
    recorded_files,
    recorded_summary,
)
from linkwise.output import write_files
from linkwise.package.load import open_package, refuse_exit
from linkwise.package.write import require_free
from linkwise.progress import progress
from linkwise.report import position

app = typer.Typer(add_completion=False)


@app.command()
def graph(
    package: GeneratedPackage,
    joint: Annotated[str, typer.Option(help="Joint i: its name or its number from 1")] = "1",
    link: LinkName = "all",
    coordinate: Annotated[str, typer.Option(help="Joint k, whose motion is followed, or all")] = "all",
    order: Annotated[
        str,
        typer.Option(
            help="2 acceleration, 1 velocity, 0 gravity or named shares (of a joint: position), or all"
        ),
    ] = "all",
    fold: Annotated[
        str, typer.Option(help="What a picture draws as one node: none, line, link, or auto")
    ] = "auto",
    recorded: Annotated[
        bool, typer.Option("--recorded", help="Files of torch's own graph of the torque too, node by node")
    ] = False,
    formats: Annotated[
        list[str] | None, typer.Option("--format", help="svg, png, dot, graphml or json; may be repeated")
    ] = None,
    out: Annotated[Path | None, typer.Option(help="Directory that gets the files")] = None,
    as_json: Json = False,
) -> None:
    """Show what autograd computes for a partial torque, or a part of it; equal operations are one."""
    _check("--order", order, ("all", "0", "1", "2"))
    _check("--fold", fold, ("auto", *FOLDS))
    wanted = formats or ["svg", "graphml", "json"]
    for name in wanted:
        _check("--format", name, FORMATS)
    if out is not None:
        require_free(out)
    robot = _robot(package)
    i = position(joint, robot.joint_names, "--joint")
    j = None if link == "all" else position(link, robot.link_names, "--link")
    k = None if coordinate == "all" else position(coordinate, robot.joint_names, "--coordinate")
    whole = robot.graph(i, j)
    torchs = whole.recorded(*_motion(robot))
    found = overlay(robot, i, j, _parts(robot, i, j, k, None if order == "all" else int(order)))
    if out is not None:
        with progress() as advance:
            files = graph_files(found, wanted, None if fold == "auto" else fold, advance)
            if recorded:
                files |= recorded_files(found, torchs, wanted, advance)
        write_files(out, files)
    if as_json:
        print(json_text(graph_json(found), indent=1))
        return
    tell(*graph_summary(found, whole, _elsewhere(robot, found)), recorded_summary(found, torchs))


def _check(option: str, given: str, choices: tuple[str, ...]) -> None:
    if given not in choices:
        raise LinkwiseError(f"{option} {given!r} is not there; choose among {', '.join(choices)}")


def _robot(directory: Path) -> Any:
    extra("torch")
    package = open_package(directory)
    if "autograd" not in package.backends:
        raise LinkwiseError(
            f"{directory}: there is no autograd back end, whose operations graphs are of; generate it with "
            "--backend autograd"
        )
    with refuse_exit():
        return package.module.load("autograd")


def _motion(robot: Any) -> list[Any]:
    """Return any motion at which a torque is a number: what torch records does not depend on it."""
    torch, n = extra("torch"), len(robot.joint_names)
    draw = torch.Generator().manual_seed(0)
    return [*(0.1 + 0.8 * torch.rand(3, n, generator=draw, dtype=torch.float64))]


def _parts(robot: Any, i: int, j: int | None, k: int | None, m: int | None) -> list[Any]:
    if k is not None and m == 0:
        found = [robot.graph(i, j, k, m)]
    else:
        name = None if k is None else robot.joint_names[k]
        found = [
            part
            for part in robot.graph_parts(i, j)
            if name in (None, part.coordinate) and m in (None, part.order)
        ]
    if not any(part.operations or part.leaves for part in found):
        through = "" if j is None else f" through link {robot.link_names[j]}"
        raise LinkwiseError(
            f"the torque on joint {robot.joint_names[i]}{through} has no such part: it is always zero"
        )
    return found


def _elsewhere(robot: Any, graph: Overlay) -> dict[str, int]:
    """Return the count of these operations in the torque through each other link, where there are any."""
    if graph.link is None:
        return {}
    counts = {}
    for j, name in enumerate(robot.link_names):
        if j != graph.link:
            keys = {node.key for node in robot.graph(graph.joint, j).operations}
            counts[name] = sum(key in keys for key in graph.nodes)
    return {name: count for name, count in counts.items() if count}
