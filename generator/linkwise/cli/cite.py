"""The command `cite`."""

from pathlib import Path
from typing import Annotated

import typer

from linkwise.citations import citations, record_of
from linkwise.escape import printable

app = typer.Typer(add_completion=False)


@app.command()
def cite(
    result: Annotated[
        Path | None,
        typer.Argument(help="Folder that analyze, study or generate wrote, or its record"),
    ] = None,
) -> None:
    """Print the references of what a result used, as BibTeX; without one those of linkwise itself."""
    path, record = (None, {}) if result is None else record_of(result)
    print("% of every result" if path is None else f"% {printable(str(path))}")
    for citation in {one.key: one for one in citations(record)}.values():
        print(f"\n{citation.bibtex}")
