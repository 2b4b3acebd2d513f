"""The command `generate`."""

from pathlib import Path
from typing import Annotated, Literal

import typer

from linkwise import pipeline
from linkwise.cli import Details, counted, tell
from linkwise.cli.options import RobotName, reads_robot
from linkwise.emit.assemble import checked_identifier
from linkwise.emit.backend import BACKENDS, backends_of, chosen_backends
from linkwise.emit.kernel_choice import chosen_kernel
from linkwise.escape import listed
from linkwise.input_file import is_file
from linkwise.output import require_writable, sweep
from linkwise.package.write import check_target, write_package
from linkwise.progress import progress
from linkwise.robot import Options, effects
from linkwise.symbolic.system import RigidSystem

app = typer.Typer(add_completion=False)


@app.command()
@reads_robot()
def generate(
    robot: RobotName,
    options: Options,
    out: Annotated[Path, typer.Option(help="Directory that gets the package")],
    name: Annotated[str | None, typer.Option(help="Name of the package; the robot's if not given")] = None,
    backend: Annotated[
        list[str] | None, typer.Option(help=f"{', '.join(BACKENDS)}; may be repeated; all if not given")
    ] = None,
    kernel: Annotated[
        Literal["auto", "straight", "loops"],
        typer.Option(
            help="straight: closed forms; loops: nothing is derived, C in loops over links and joints; "
            "auto: by what closed forms would cost"
        ),
    ] = "auto",
    derivation: Annotated[
        Literal["rule", "energy"],
        typer.Option(
            help="How closed forms of rigid links are found: by the rigid-link rule, or from their energies "
            "in SymPy by Euler-Lagrange, which costs more"
        ),
    ] = "rule",
    details: Details = False,
) -> None:
    """Write the package of a robot."""
    sweep(out)  # also where this one is refused: an earlier one may have died while it took a package away
    chosen_backends(backend or ())
    path = Path(robot)
    system = pipeline.read_system(robot, options)
    kind = chosen_kernel(system, kernel, backend, derivation)
    backends = [chosen.name for chosen in chosen_backends(backend or backends_of(kind), kind)]
    request = {
        "robot": path.name if is_file(path) else robot,
        "backends": backends,
        "kernel": kernel,
        "derivation": derivation,
        **options.request(),
    }
    directory = out / checked_identifier(name, system.name)
    check_target(directory, system.name)
    require_writable(directory)
    with progress() as report:
        files = pipeline.generate(system, backends, name, request, report, kind, derivation)
    write_package(files, directory)
    for effect in effects(system.notes, details):
        tell(f"warning: {robot}: {effect}", err=True)
    tell(
        f"wrote {directory}: {counted(len(system.coordinates), 'joint')}, "
        f"{counted(len(system.links), 'link')}, {counted(len(files), 'file')}"
    )
    if isinstance(system, RigidSystem) and (free := system.robot.independent):
        names = [c.name for c in system.coordinates]
        others = [name for k, name in enumerate(names) if k not in free]
        tell(f"independent: {listed(names[k] for k in free)}; following by constraints: {listed(others)}")
