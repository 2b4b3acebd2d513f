"""The command line: `app` starts it, and imports a command's file when the command is called.

Here are the flags that several commands share; those that read a robot are in `options`.
"""

import sys
from pathlib import Path
from typing import Annotated

import typer

from linkwise.escape import printable

BUDGET = 2_000_000
"""Most terms of one expansion; a polynomial of this size takes about 0.5 GB."""

Json = Annotated[bool, typer.Option("--json", help="Print JSON")]
Details = Annotated[
    bool, typer.Option("--details", help="Name every joint and link that a remark is about, one by one")
]
Budget = Annotated[int, typer.Option(min=1, help="Terms that one expansion may hold")]
ReportOut = Annotated[Path | None, typer.Option(help="Directory that gets the report's files")]


def tell(*lines: str, err: bool = False) -> None:
    """Print each argument as one line that no name in it can break or colour."""
    for line in lines:
        print(printable(line), file=sys.stderr if err else sys.stdout)


def counted(number: int, what: str) -> str:
    """Return a number of things in words, "1 joint" or "3 joints"."""
    return f"{number} {what}{'' if number == 1 else 's'}"
