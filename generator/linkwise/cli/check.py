"""The command `check`."""

import json
from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import typer

from linkwise.check import check_package
from linkwise.cli import Json

app = typer.Typer(add_completion=False)


@app.command()
def check(
    package: Annotated[Path, typer.Argument(help="Directory of a generated package")],
    samples: Annotated[int, typer.Option(min=1, help="Random states")] = 100,
    as_json: Json = False,
) -> None:
    """Prove a package right: hashes, and every entry of every formula, back end and C function."""
    results = check_package(package, samples)
    if as_json:
        typer.echo(json.dumps([asdict(result) | {"mark": result.mark} for result in results], indent=1))
    else:
        for result in results:
            typer.echo(f"{result.mark:<4}  {result.name:<58} {result.detail}")
    if not all(result.passed for result in results):
        raise typer.Exit(1)
