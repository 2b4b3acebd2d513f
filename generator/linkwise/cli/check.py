"""The command `check`."""

import math
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Annotated, Any

import typer

from linkwise.check import check_package
from linkwise.check.compare import Result, Skipped
from linkwise.cli import Json, counted, tell
from linkwise.escape import json_text

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
        print(json_text([_row(result) for result in results], indent=1))
    else:
        width = max(len(result.name) for result in results)
        for result in results:
            tell(f"{result.mark:<4}  {result.name:<{width}}  {result.detail}")
        tell(verdict(results))
    if not all(result.passed for result in results):
        raise typer.Exit(1)


def verdict(results: Sequence[Result]) -> str:
    """Of all checks in one line: how many held, or which failed, and how many could not be made."""
    failed = [result.name for result in results if not result.passed]
    skipped = sum(isinstance(result, Skipped) for result in results)
    made = counted(len(results) - skipped, "check")
    beside = f"; {skipped} could not be made here, see skip above" if skipped else ""
    if failed:
        return f"{len(failed)} of {made} failed: {'; '.join(failed)}{beside}"
    return f"all {made} held{beside}"


def _row(result: Result) -> dict[str, Any]:
    """JSON has no infinite error: the detail says it."""
    finite = result.error is not None and math.isfinite(result.error)
    return asdict(result) | {"error": result.error if finite else None, "mark": result.mark}
