"""The command `check`."""

import math
import sys
from collections.abc import Sequence
from dataclasses import asdict
from typing import Annotated, Any

import typer

from linkwise.check.checks import SAMPLES, results_of
from linkwise.check.compare import Result
from linkwise.cli import GeneratedPackage, Json, counted, tell
from linkwise.escape import json_text

app = typer.Typer(add_completion=False)

WIDTH = 64
"""Columns of a check's name, fixed as each check is printed as soon as it is made."""


@app.command()
def check(
    package: GeneratedPackage,
    samples: Annotated[int, typer.Option(min=1, help="Random states")] = SAMPLES,
    as_json: Json = False,
) -> None:
    """Prove a package right: hashes, and every entry of every formula, back end and C function."""
    results = []
    for result in results_of(package, samples):
        results.append(result)
        if not as_json:
            tell(f"{result.mark:<4}  {result.name:<{WIDTH}}  {result.detail}")
            sys.stdout.flush()
    if as_json:
        print(json_text([_row(result) for result in results], indent=1))
    else:
        tell(verdict(results))
    if any(result.failed for result in results):
        raise typer.Exit(1)


def verdict(results: Sequence[Result]) -> str:
    """Return one line on all checks: how many held, how many failed, and how many could not be made."""
    failed = [result.name for result in results if result.failed]
    held = sum(result.held is True for result in results)
    left = len(results) - held - len(failed)
    told = [
        f"{counted(held, 'check')} held",
        f"{len(failed)} failed" + (f" ({'; '.join(failed)})" if failed else ""),
        f"{left} could not be made here" + (", see skip above" if left else ""),
    ]
    return ", ".join(told)


def _row(result: Result) -> dict[str, Any]:
    """Return a result for JSON, which has no infinite error: the detail says it."""
    finite = result.error is not None and math.isfinite(result.error)
    return asdict(result) | {"error": result.error if finite else None, "mark": result.mark}
