"""The command line: parse, call, print."""

import json
import sys
from pathlib import Path
from typing import Annotated, NoReturn

import typer

from linkwise.emit.backend import BACKENDS
from linkwise.errors import LinkwiseError

app = typer.Typer(
    add_completion=False,
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    help="Which joint's movement loads which joint, through which link.",
)

Robot = Annotated[
    str,
    typer.Argument(
        help="planar3, planarN, puma560, or a .toml, .urdf, .xml (URDF or MJCF), .mjcf or .py file"
    ),
]
Lock = Annotated[list[str] | None, typer.Option(help="Hold a joint: JOINT=VALUE; may be repeated")]
Unphysical = Annotated[bool, typer.Option("--allow-unphysical", help="Accept bodies that cannot exist")]
Base = Annotated[str, typer.Option(help="fixed or floating")]
Root = Annotated[str | None, typer.Option(help="Keep only what hangs on this link")]
Tip = Annotated[str | None, typer.Option(help="Keep only the chain to this link")]
FreeMimic = Annotated[
    bool,
    typer.Option(
        "--free-mimic", help="Let a mimic joint without a master, or one that MJCF couples, move by itself"
    ),
]
Json = Annotated[bool, typer.Option("--json", help="Print JSON")]


@app.command()
def generate(
    robot: Robot,
    out: Annotated[Path, typer.Option(help="Directory that gets the package")],
    name: Annotated[str | None, typer.Option(help="Name of the package; the robot's if not given")] = None,
    backend: Annotated[
        list[str] | None,
        typer.Option(help=f"{', '.join(BACKENDS)}; may be repeated; all if not given"),
    ] = None,
    parameters: Annotated[
        str, typer.Option(help="numeric, or symbolic: keep them as run-time parameters")
    ] = "numeric",
    lock: Lock = None,
    base: Base = "fixed",
    root: Root = None,
    tip: Tip = None,
    allow_unphysical: Unphysical = False,
    free_mimic: FreeMimic = False,
) -> None:
    """Write the package of a robot."""
    from linkwise import pipeline
    from linkwise.cli.options import reading_options
    from linkwise.emit.assemble import identifier
    from linkwise.package.write import check_target, write_package
    from linkwise.progress import progress

    options = reading_options(
        lock,
        parameters,
        base,
        root=root,
        tip=tip,
        allow_unphysical=allow_unphysical,
        free_mimic=free_mimic,
    )
    request = {
        "robot": robot if not Path(robot).is_file() else Path(robot).name,
        "backends": backend or list(BACKENDS),
        "parameters": parameters,
        "lock": dict(options.lock),
        "base": base,
        "root": root,
        "tip": tip,
        "allow_unphysical": allow_unphysical,
        "free_mimic": free_mimic,
    }
    system = pipeline.read_system(robot, options)
    check_target(out / (name or identifier(system.name)), system.name)
    with progress() as report:
        files = pipeline.generate(system, backend or list(BACKENDS), name, request, report)
    directory = out / json.loads(files["manifest.json"])["name"]
    write_package(files, directory)
    typer.echo(
        f"wrote {directory}: {len(system.coordinates)} joints, {len(system.links)} links, {len(files)} files"
    )


@app.command()
def check(
    package: Annotated[Path, typer.Argument(help="Directory of a generated package")],
    samples: Annotated[int, typer.Option(min=1, help="Random states")] = 100,
    as_json: Json = False,
) -> None:
    """Prove a package right: hashes, back ends, an independent recursion, closure, structure."""
    from linkwise.check import check_package

    results = check_package(package, samples)
    if as_json:
        typer.echo(json.dumps([{**result.__dict__, "mark": result.mark} for result in results], indent=1))
    else:
        for result in results:
            typer.echo(f"{result.mark:<4}  {result.name:<58} {result.detail}")
    if not all(result.passed for result in results):
        raise typer.Exit(1)


@app.command()
def inspect(
    robot: Robot,
    lock: Lock = None,
    base: Base = "fixed",
    root: Root = None,
    tip: Tip = None,
    parameters: Annotated[str, typer.Option(help="numeric or symbolic")] = "numeric",
    allow_unphysical: Unphysical = False,
    free_mimic: FreeMimic = False,
    joint_friction: Annotated[
        bool,
        typer.Option(
            "--joint-friction", help="Also list the joints' damping and friction, which no torque holds"
        ),
    ] = False,
    as_json: Json = False,
) -> None:
    """Show a robot's joints, links and parameters, and what was merged, locked or ignored."""
    from linkwise import pipeline
    from linkwise.cli.inspect import inspection, table
    from linkwise.cli.options import reading_options

    system = pipeline.read_system(
        robot,
        reading_options(
            lock,
            parameters,
            base,
            root=root,
            tip=tip,
            allow_unphysical=allow_unphysical,
            free_mimic=free_mimic,
            joint_friction=joint_friction,
        ),
    )
    data = inspection(system)
    typer.echo(json.dumps(data, indent=1) if as_json else table(data))


def _register() -> None:
    from linkwise.cli import motion, report

    report.register(app)
    motion.register(app)


def main() -> None:
    """Run the command line; a user's mistake is one line on stderr and exit status 2."""
    _register()
    try:
        status = typer.main.get_command(app)(standalone_mode=False)
    except LinkwiseError as error:
        _fail(str(error))
    except typer.Abort:
        sys.exit(130)
    except Exception as error:
        # Typer's own complaints about options; anything else is no mistake of the user's.
        if not hasattr(error, "format_message"):
            raise
        _fail(f"{error.format_message()} See linkwise --help")
    sys.exit(status if isinstance(status, int) else 0)


def _fail(message: str) -> NoReturn:
    print(f"linkwise: error: {' '.join(message.split())}", file=sys.stderr)
    sys.exit(2)
