"""The command `study`."""

from pathlib import Path
from typing import Annotated, Literal

import typer

from linkwise.cli import tell
from linkwise.cli.flags import tell_run
from linkwise.progress import progress as shown_progress
from linkwise.study import ProcessPool, RayCluster, run_study

File = Annotated[
    Path, typer.Argument(help="TOML file of the study: trials, robots, choices", metavar="STUDY.toml")
]
Out = Annotated[Path, typer.Option(help="Directory of the study; trials that are done there stay")]
WhichEngine = Annotated[
    Literal["processes", "ray"],
    typer.Option("--engine", help="Processes of this machine, or a cluster of Ray"),
]
Workers = Annotated[int | None, typer.Option(min=1, help="Processes; one for each core if not given")]
Address = Annotated[
    str | None,
    typer.Option(
        help="Address of Ray's cluster, auto for one that runs here; one of this machine alone if not given"
    ),
]
TrustPython = Annotated[
    bool,
    typer.Option(
        "--trust-python",
        help="Run robots of the study that are Python files; refused otherwise, as code may do anything",
    ),
]

app = typer.Typer(add_completion=False)


@app.command()
def study(
    file: File,
    out: Out,
    engine: WhichEngine = "processes",
    workers: Workers = None,
    address: Address = None,
    trust_python: TrustPython = False,
) -> None:
    """Analyse many recordings: every trial, and what they say together; also on a cluster."""
    chosen = ProcessPool(workers) if engine == "processes" else RayCluster(address)
    with shown_progress({"trials": "trials"}) as progress:
        found = run_study(file, out, chosen, progress, trust_python)
    tell_run(*dict.fromkeys(trial.robot for trial in found.plan.trials))
    for warning in found.warnings:
        tell(f"warning: {warning}", err=True)
    for one in found.broken:
        tell(f"broken: {one.name}: {one.reason}", err=True)
    kept = len(found.done) - found.fresh
    tell(
        f"{len(found.done)} trials done, {kept} of them before, {len(found.broken)} broken;"
        f" {found.samples:,} samples now",
        *map(str, found.files),
    )
    if found.broken:
        raise typer.Exit(1)
