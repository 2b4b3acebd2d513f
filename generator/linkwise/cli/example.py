"""The command `example`."""

from pathlib import Path
from shlex import quote
from typing import Annotated

import typer

from linkwise.cli import counted, tell
from linkwise.errors import LinkwiseError
from linkwise.example_cases import ExampleCase, example_case, example_cases, write_case

app = typer.Typer(add_completion=False)


@app.command()
def example(
    name: Annotated[str | None, typer.Argument(help="The case; all are listed if not given")] = None,
    out: Annotated[Path | None, typer.Option(help="Folder to write; the case's name if not given")] = None,
) -> None:
    """Put a whole case into a folder: robot, movement, forces, and what to type next."""
    if name is None:
        if out is not None:
            raise LinkwiseError(
                f"--out {out} is the folder of one case; name it: {', '.join(example_cases())}"
            )
        cases = example_cases().values()
        width = max(len(case.name) for case in cases)
        tell(*(f"{case.name:{width}}  {case.title}" for case in cases))
        tell("", "linkwise example NAME puts one into a folder of that name")
        return
    case = example_case(name)
    folder = Path(case.name) if out is None else out
    _tell_next(case, folder, write_case(case, folder))


def _tell_next(case: ExampleCase, folder: Path, written: bool) -> None:
    place = folder.as_posix()
    place = f"./{place}" if place.startswith("-") else place  # else cd takes it for an option
    tell(f"{'wrote' if written else 'up to date:'} {place}: {counted(len(case.files), 'file')}")
    tell(f"{case.title}; where it is from: {place}/SOURCE.md")
    tell("", "Next, and more of it in its README.md:", "")
    tell(*(f"  {line}" for line in (f"cd {quote(place)}", *case.first_command)))
