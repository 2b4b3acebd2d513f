"""The command `generate`.

For build tools it reports the files that it would write, their dependencies and whether they are up to date;
without --verbose it reports no more than that where the output is no terminal.
"""

import sys
from collections.abc import Collection, Iterable, Sequence
from contextlib import nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import typer

from linkwise import pipeline
from linkwise.cli import Details, counted, tell
from linkwise.cli.depfile import depfile_text, own_modules
from linkwise.cli.options import RobotNames, reads_robot, tell_run
from linkwise.dynamics.derive import Method
from linkwise.emit.backend import BACKENDS
from linkwise.errors import LinkwiseError
from linkwise.escape import listed
from linkwise.input_file import is_inside, is_same
from linkwise.makers import generator_files
from linkwise.output import require_writable, sweep, write_files
from linkwise.package.manifest import FILE
from linkwise.package.write import check_target, differences, refuse_inside_package, write_package
from linkwise.progress import progress, silent
from linkwise.robot import Options, effects, robot_files
from linkwise.symbolic.system import RigidSystem

app = typer.Typer(add_completion=False)
STALE = 1
PANEL = "For build tools"


@dataclass(frozen=True)
class Choices:
    """Choices for every robot of one call."""

    options: Options
    out: Path
    name: str | None
    backends: tuple[str, ...]
    kernel: str
    derivation: Method
    vendor_runtime: bool
    replace: bool


@dataclass(frozen=True)
class Order:
    """A package that was asked for: its robot, the plan of its files, and their directory."""

    robot: str
    plan: pipeline.PackagePlan
    directory: Path


@app.command()
@reads_robot()
def generate(
    robot: RobotNames,
    options: Options,
    out: Annotated[Path, typer.Option(help="Directory that gets the packages")],
    name: Annotated[str | None, typer.Option(help="Name of the package; the robot's if not given")] = None,
    backend: Annotated[
        list[str] | None,
        typer.Option(
            help=f"{', '.join(BACKENDS)}; may be repeated; all that the robot can have if not given"
        ),
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
    vendor_runtime: Annotated[
        bool,
        typer.Option(
            "--vendor-runtime",
            help="Copy what the package imports of linkwise_runtime into it, so that it stands alone",
        ),
    ] = False,
    details: Details = False,
    verbose: Annotated[
        bool, typer.Option("--verbose", help="Say what was written, as on a terminal, elsewhere too")
    ] = False,
    replace: Annotated[
        bool, typer.Option("--replace", help="Take the place of another robot's package too")
    ] = False,
    list_outputs: Annotated[
        bool,
        typer.Option(
            "--list-outputs", help="Print the paths that would be written; write none", rich_help_panel=PANEL
        ),
    ] = False,
    check: Annotated[
        bool,
        typer.Option(
            "--check",
            help="Say which files differ from what would be written; write none; exit status 1 if any does",
            rich_help_panel=PANEL,
        ),
    ] = False,
    depfile: Annotated[
        Path | None,
        typer.Option(
            help="File that gets, as a rule of make, what the packages depend on", rich_help_panel=PANEL
        ),
    ] = None,
    stamp: Annotated[
        Path | None,
        typer.Option(
            help="Empty file that is made anew at the end: the target of --depfile's rule, by default the "
            "manifests, which keep their time where nothing differs",
            rich_help_panel=PANEL,
        ),
    ] = None,
) -> None:
    """Write the packages of robots."""
    before = set(sys.modules)
    _check_flags(list_outputs, check, depfile, stamp)
    if name is not None and len(robot) > 1:
        raise LinkwiseError("--name is for one robot; generate each with a name of its own in its own call")
    if not (check or list_outputs):
        sweep(out)  # also where this one is refused: an earlier one may have died in its exchange
    asked = Choices(options, out, name, tuple(backend or ()), kernel, derivation, vendor_runtime, replace)
    orders = [_order(spec, asked) for spec in robot]
    tell_run(*robot)
    _check_places(orders)
    if depfile is not None or stamp is not None:
        _check_side_files(orders, [place for place in (depfile, stamp) if place is not None], options)
    if not (check or list_outputs):
        for order in orders:
            require_writable(order.directory)
    watched = verbose or sys.stdout.isatty()
    with progress() if verbose or sys.stderr.isatty() else nullcontext(silent) as report:
        packages = [(order, order.plan.files(report)) for order in orders]
    if list_outputs:
        tell(
            *(f"{(order.directory / path).as_posix()}" for order, files in packages for path in sorted(files))
        )
        return
    if check:
        raise typer.Exit(_told_differences(packages, watched))
    rule = "" if depfile is None else _rule(packages, options, stamp, before)
    for order, files in packages:
        written = write_package(files, order.directory, replace)
        for effect in effects(order.plan.system.notes, details):
            tell(f"warning: {order.robot}: {effect}", err=True)
        if watched:
            _tell_written(order, len(files), written)
    if depfile is not None:
        write_files(depfile.parent, {depfile.name: rule.encode()})
    if stamp is not None:
        stamp.parent.mkdir(parents=True, exist_ok=True)
        stamp.touch()  # the last of all: an interrupted build has none, or an older one


def _check_flags(list_outputs: bool, check: bool, depfile: Path | None, stamp: Path | None) -> None:
    """Raise LinkwiseError for a flag that writes nothing together with another one."""
    flags = {"--list-outputs": list_outputs, "--check": check, "--depfile": depfile, "--stamp": stamp}
    given = [flag for flag, value in flags.items() if value]
    if len(given) > 1 and (list_outputs or check):
        raise LinkwiseError(f"{given[0]} writes nothing and stands alone; leave {given[1]} out")


def _order(robot: str, asked: Choices) -> Order:
    """Return the order for a robot's package.

    Raises LinkwiseError, before anything is derived, where the package cannot be made.
    """
    system = pipeline.read_system(robot, asked.options)
    made = pipeline.plan(
        system, asked.backends or None, asked.name, asked.kernel, asked.derivation, asked.vendor_runtime
    )
    directory = asked.out / made.name
    check_target(directory, None if asked.replace else system.name)
    return Order(robot, made, directory)


def _check_places(orders: Iterable[Order]) -> None:
    """Raise LinkwiseError for two robots whose packages would have the same place."""
    taken: dict[Path, str] = {}
    for order in orders:
        if order.directory in taken:
            raise LinkwiseError(
                f"{taken[order.directory]} and {order.robot} would both be {order.directory}; generate one "
                "of them in its own call, with --name"
            )
        taken[order.directory] = order.robot


def _check_side_files(orders: Sequence[Order], places: Iterable[Path], options: Options) -> None:
    """Raise LinkwiseError for a depfile or a stamp in the place of an input or inside a package."""
    for place in places:
        refuse_inside_package(place.parent)
        for order in orders:
            inputs = any(is_same(place, path) for path in robot_files(order.robot, options))
            if (
                inputs
                or place.is_dir()
                or is_inside(place, order.directory)
                or is_same(place, order.directory)
            ):
                raise LinkwiseError(
                    f"{place} cannot be a depfile or a stamp: {order.robot} is read from it, or it is a "
                    "folder or in a package; choose another name"
                )


def _told_differences(packages: Iterable[tuple[Order, dict[str, str]]], watched: bool) -> int:
    """Print how each package on disk differs from its files; return the exit status for any difference."""
    status = 0
    for order, files in packages:
        found = differences(files, order.directory)
        if not order.directory.is_dir():
            tell(f"{order.directory} is not there: {counted(len(files), 'file')}")
        elif found:
            _tell_stale(order.directory, files, found)
        elif watched:
            tell(f"{order.directory} is up to date")
        status = STALE if found else status
    return status


def _tell_stale(directory: Path, files: Collection[str], found: dict[str, str]) -> None:
    kinds: dict[str, list[str]] = {}
    for path, fault in found.items():
        kinds.setdefault(fault, []).append(path)
    gone = len(found.keys() - set(files))
    more = f", and {gone} that would go" if gone else ""
    tell(f"{directory} is stale: {counted(len(found) - gone, 'file')} of {len(files)}{more}")
    tell(*(f"  {fault}: {listed(paths)}" for fault, paths in kinds.items()))


def _rule(
    packages: Iterable[tuple[Order, dict[str, str]]],
    options: Options,
    stamp: Path | None,
    before: Iterable[str],
) -> str:
    """Return the text of the depfile.

    A stamp stands for the packages: it is older than none of their files, and without one of them it is void.
    """
    inputs = [path.as_posix() for order, _ in packages for path in robot_files(order.robot, options)]
    imported = own_modules(before) if any(name.endswith(".py") for name in inputs) else ()
    made = [order.directory / path for order, files in packages for path in sorted(files)]
    targets = [path for path in made if path.name == FILE] if stamp is None else [stamp]
    own = () if stamp is None else made
    return depfile_text(
        (path.as_posix() for path in targets),
        (*inputs, *imported, *(path.as_posix() for path in own), *generator_files()),
    )


def _tell_written(order: Order, files: int, written: bool) -> None:
    system = order.plan.system
    tell(
        f"{'wrote' if written else 'up to date:'} {order.directory}: "
        f"{counted(len(system.coordinates), 'joint')}, {counted(len(system.links), 'link')}, "
        f"{counted(files, 'file')}"
    )
    if isinstance(system, RigidSystem) and (free := system.robot.independent):
        names = [c.name for c in system.coordinates]
        others = [name for k, name in enumerate(names) if k not in free]
        tell(f"independent: {listed(names[k] for k in free)}; following by constraints: {listed(others)}")
