"""The command `replay`."""

import math
import tempfile
from collections.abc import Sequence
from contextlib import chdir
from pathlib import Path
from typing import Annotated

import typer

from linkwise.analysis.choices import AnalysisChoices
from linkwise.bundle import RESULT, Bundle, compared, unpacked, versions_here
from linkwise.cli import tell
from linkwise.cli.analyze import analyzed
from linkwise.errors import LinkwiseError, within
from linkwise.escape import listed, printable
from linkwise.input_file import is_inside
from linkwise.option import chosen
from linkwise.robot import Options

File = Annotated[Path, typer.Argument(help="Bundle that `linkwise analyze --bundle` wrote", metavar="BUNDLE")]
Out = Annotated[
    Path | None,
    typer.Option(
        help="Directory to write; a former result is replaced; the new one is not kept if not given"
    ),
]
Backend = Annotated[
    str | None, typer.Option(help="Back end in place of the one that the bundle's result had")
]
Tolerance = Annotated[
    float,
    typer.Option(min=0.0, help="Difference, as a share of the largest number with its unit, that is none"),
]
TrustPython = Annotated[
    bool,
    typer.Option(
        "--trust-python",
        help="Run a robot that is a Python file or a package; refused otherwise, as code may do anything",
    ),
]

app = typer.Typer(add_completion=False)


@app.command()
def replay(
    bundle: File,
    out: Out = None,
    backend: Backend = None,
    tolerance: Tolerance = 1e-9,
    trust_python: TrustPython = False,
) -> None:
    """Run the analysis of a bundle again, and compare its result with the bundle's."""
    if not math.isfinite(tolerance):
        raise LinkwiseError(f"--tolerance {tolerance:g}: give a share, such as 1e-9")
    if out is not None and is_inside(bundle, out):
        raise LinkwiseError(f"--out {out} is to be replaced and holds the bundle; give another --out")
    result = None if out is None else out.absolute()
    with tempfile.TemporaryDirectory() as folder:
        found = unpacked(bundle, Path(folder))
        with within(str(bundle)):
            _require_trusted(found, trust_python)
        tell(*_versions(found))
        with within(str(bundle)), chdir(folder):  # files have the names of the bundle in all that is told
            files = _analyzed(found, result or Path("replayed"), backend)
            comparison = compared(Path(RESULT), result or Path("replayed"))
    tell(*comparison.lines, *(str(out / file.name) for file in files if out is not None))
    is_same = comparison.is_same(tolerance)
    tell(f"{'the same' if is_same else 'NOT the same'}, within {tolerance:g}")
    if not is_same:
        raise typer.Exit(1)


def _analyzed(bundle: Bundle, out: Path, backend: str | None) -> Sequence[Path]:
    asked = bundle.analysis
    choices, options = chosen(AnalysisChoices, asked.choices), chosen(Options, asked.options)
    return analyzed(out, Path(asked.log), asked.robot, choices, options, backend or asked.backend)[1]


def _require_trusted(bundle: Bundle, trust_python: bool) -> None:
    kind = {"program": "a Python program", "package": "a generated package"}.get(bundle.analysis.kind)
    if kind is not None and not trust_python:
        raise LinkwiseError(
            f"its robot {bundle.analysis.robot} is {kind}, which replay does not run by itself; read it, and"
            " give --trust-python if you trust it"
        )


def _versions(bundle: Bundle) -> list[str]:
    """Return lines on what made the result of a bundle, what is another here, and what was left out."""
    here, there = versions_here(), bundle.versions
    other = [
        f"{name} {printable(version)}, here {here.get(name, 'missing')}"
        for name, version in there.items()
        if here.get(name) != version
    ]
    first = " ".join(f"{name} {there[name]}" for name in ("linkwise", "Python", "system") if name in there)
    told = [
        f"made by {printable(first)}{'; other versions: ' + '; '.join(other) if other else '; the same here'}"
    ]
    return told + ([f"left out of it: {listed(bundle.left_out)}"] if bundle.left_out else [])
