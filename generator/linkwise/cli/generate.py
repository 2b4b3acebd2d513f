"""The command `generate`.

For build tools it reports the files that it would write, their dependencies and whether they are up to date;
without --verbose it reports no more than that where the output is no terminal.
"""

import sys
from collections.abc import Iterable, Sequence
from contextlib import nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import typer

from linkwise import pipeline
from linkwise.cli import counted, tell
from linkwise.cli.build_step import BuildStep, is_stale
from linkwise.cli.depfile import depfile_text, own_modules
from linkwise.cli.flags import RobotNames, takes, tell_run
from linkwise.dynamics.derive import Method
from linkwise.emit.backend import BACKENDS
from linkwise.errors import LinkwiseError
from linkwise.escape import listed
from linkwise.generator_fingerprint import generator_files
from linkwise.option import REQUIRED, option
from linkwise.output import require_writable, sweep
from linkwise.package.manifest import FILE
from linkwise.package.write import check_target, write_package
from linkwise.progress import progress, silent
from linkwise.robot import Options, effects, robot_files
from linkwise.symbolic.system import RigidSystem

app = typer.Typer(add_completion=False)
STALE = 1


@dataclass(frozen=True)
class PackageChoices:
    """Choices for the packages of one call."""

    out: Path = option(REQUIRED, "Directory that gets the packages")
    name: str | None = option(None, "Name of the package; the robot's if not given")
    backend: tuple[str, ...] = option(
        (), f"{', '.join(BACKENDS)}; may be repeated; all that the robot can have if not given"
    )
    kernel: Literal["auto", "straight", "loops"] = option(
        "auto",
        "straight: closed forms; loops: nothing is derived, C in loops over links and joints; "
        "auto: by what closed forms would cost",
    )
    derivation: Method = option(
        "rule",
        "How closed forms of rigid links are found: by the rigid-link rule, or from their energies "
        "in SymPy by Euler-Lagrange, which costs more",
    )
    vendor_runtime: bool = option(
        False, "Copy what the package imports of linkwise_runtime into it, so that it stands alone"
    )
    details: bool = option(False, "Name every joint and link that a remark is about, one by one")
    verbose: bool = option(False, "Say what was written, as on a terminal, elsewhere too")
    replace: bool = option(False, "Take the place of another robot's package too")


@dataclass(frozen=True)
class Order:
    """A package that was asked for: its robot, the plan of its files, and their directory."""

    robot: str
    plan: pipeline.PackagePlan
    directory: Path


Packages = Sequence[tuple[Order, dict[str, str]]]
"""Packages that were asked for, each with its files."""


@app.command()
@takes()
def generate(robot: RobotNames, asked: PackageChoices, step: BuildStep, options: Options) -> None:
    """Write the packages of robots."""
    before = set(sys.modules)
    step.check_flags()
    if asked.name is not None and len(robot) > 1:
        raise LinkwiseError("--name is for one robot; generate each with a name of its own in its own call")
    if step.writes:
        sweep(asked.out)  # also where this one is refused: an earlier one may have died in its exchange
    orders = _orders(robot, asked, step, options)
    with progress() if asked.verbose or sys.stderr.isatty() else nullcontext(silent) as report:
        packages = [(order, order.plan.files(report)) for order in orders]
    watched = asked.verbose or sys.stdout.isatty()
    if step.list_outputs:
        tell(*((order.directory / path).as_posix() for order, files in packages for path in sorted(files)))
    elif step.check:
        stale = [is_stale(files, order.directory, watched) for order, files in packages]
        raise typer.Exit(STALE if any(stale) else 0)
    else:
        rule = "" if step.depfile is None else _rule(packages, options, step.stamp, before)
        _write(packages, asked, watched)
        step.finish(rule)


def _orders(robots: Sequence[str], asked: PackageChoices, step: BuildStep, options: Options) -> list[Order]:
    """Return the orders for all robots; raise LinkwiseError where they cannot be carried out."""
    orders = [_order(spec, asked, options) for spec in robots]
    tell_run(*robots)
    _check_places(orders)
    for order in orders:
        step.check_places(order.robot, order.directory, options)
    if step.writes:
        for order in orders:
            require_writable(order.directory)
    return orders


def _order(robot: str, asked: PackageChoices, options: Options) -> Order:
    """Return the order for a robot's package.

    Raises LinkwiseError, before anything is derived, where the package cannot be made.
    """
    system = pipeline.read_system(robot, options)
    made = pipeline.plan(
        system, asked.backend or None, asked.name, asked.kernel, asked.derivation, asked.vendor_runtime
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


def _rule(packages: Packages, options: Options, stamp: Path | None, before: Iterable[str]) -> str:
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


def _write(packages: Packages, asked: PackageChoices, watched: bool) -> None:
    """Write the packages, and say what their torques leave out."""
    for order, files in packages:
        written = write_package(files, order.directory, asked.replace)
        for effect in effects(order.plan.system.notes, asked.details):
            tell(f"warning: {order.robot}: {effect}", err=True)
        if watched:
            _tell_written(order, len(files), written)


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
