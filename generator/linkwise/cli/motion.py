"""The command `motion`."""

import json
from pathlib import Path
from typing import Annotated, Literal

import typer

from linkwise.analysis.motions import MOTIONS, RATE, write_csv
from linkwise.cli import Json
from linkwise.errors import LinkwiseError

Kind = Literal["recorded", "simulated", "both"]

app = typer.Typer(add_completion=False)


@app.command()
def motion(
    out: Annotated[Path, typer.Option(help="Directory for recorded.csv and simulated.csv")],
    kind: Annotated[Kind, typer.Option(help="Which of the two motions")] = "both",
    as_json: Json = False,
) -> None:
    """Write the paper's two motions (Fig. 5 and 10) for the arm of Table 2, `planar3`."""
    wanted = list(MOTIONS) if kind == "both" else [kind]
    try:
        out.mkdir(parents=True, exist_ok=True)
        written = [
            {"file": str(file), "samples": write_csv(file, MOTIONS[name]), "rate_hz": RATE}
            for name in wanted
            for file in [out / f"{name}.csv"]
        ]
    except OSError as error:
        raise LinkwiseError(f"{out}: cannot be written: {error.strerror}") from error
    if as_json:
        typer.echo(json.dumps(written))
        return
    for entry in written:
        typer.echo(f"{entry['file']}: {entry['samples']} samples at {RATE:g} Hz")
