"""The command `motion`."""

from pathlib import Path
from typing import Annotated, Literal

import typer

from linkwise.analysis.paper_motions import MOTIONS, RATE, write_motions
from linkwise.cli import Json, tell
from linkwise.escape import json_text

Kind = Literal["recorded", "simulated", "both"]

app = typer.Typer(add_completion=False)


@app.command()
def motion(
    out: Annotated[Path, typer.Option(help="Directory for recorded.csv and simulated.csv")],
    kind: Annotated[Kind, typer.Option(help="Which of the two motions")] = "both",
    as_json: Json = False,
) -> None:
    """Write two motions modelled on the paper's Fig. 5 and 10, for the arm of Table 2, `planar3`."""
    wanted = list(MOTIONS.values()) if kind == "both" else [MOTIONS[kind]]
    written = [
        {"file": str(file), "samples": made.count, "rate_hz": RATE}
        for file, made in zip(write_motions(out, wanted), wanted, strict=True)
    ]
    if as_json:
        print(json_text(written))
        return
    for entry in written:
        tell(f"{entry['file']}: {entry['samples']} samples at {RATE:g} Hz")
