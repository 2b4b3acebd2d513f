"""The command line: `app` starts it, and imports a command's file when the command is called.

Here is what several commands share. Options that fill a dataclass are declared on its fields, and `flags`
makes of them what typer reads.
"""

import sys
from pathlib import Path
from typing import Annotated

import typer

from linkwise.escape import printable

BUDGET = 2_000_000
"""Most terms of one expansion; a polynomial of this size takes about 0.5 GB."""

Json = Annotated[bool, typer.Option("--json", help="Print JSON")]
GeneratedPackage = Annotated[Path, typer.Argument(help="Directory of a generated package")]
LinkName = Annotated[str, typer.Option(help="Link j: its name, its number from 1, or all")]
Budget = Annotated[int, typer.Option(min=1, help="Terms that one expansion may hold")]
ReportOut = Annotated[Path | None, typer.Option(help="Directory that gets the report's files")]


def tell(*lines: str, err: bool = False) -> None:
    """Print each argument as one line that no name in it can break or colour."""
    for line in lines:
        print(printable(line), file=sys.stderr if err else sys.stdout)


def counted(number: int, what: str) -> str:
    """Return a number of things in words, "1 joint" or "3 joints"."""
    return f"{number} {what}{'' if number == 1 else 's'}"
