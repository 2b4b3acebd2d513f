"""The flags that read a robot, defined once for every command that reads one."""

import inspect
import math
from collections.abc import Callable, Iterable
from functools import wraps
from pathlib import Path
from typing import Annotated, Any, Literal, cast

import typer

from linkwise.cli import tell
from linkwise.errors import LinkwiseError
from linkwise.pipeline import is_program
from linkwise.robot import DESCRIPTIONS, Options

Parameters = Literal["numeric", "nonzero", "symbolic"]
RobotName = Annotated[str, typer.Argument(help=DESCRIPTIONS)]
RobotNames = Annotated[list[str], typer.Argument(help=DESCRIPTIONS)]
PANEL = "Reading the robot"


def _flag(*names: str, help: str, metavar: str | None = None) -> Any:
    return typer.Option(*names, help=help, rich_help_panel=PANEL)


def tell_run(*robots: str | Path) -> None:
    """Print, in a line each, which of these robots are programs, and so were run to be read."""
    for robot in filter(is_program, robots):
        tell(f"note: {robot} is a Python program, which was run", err=True)


def robot_options(
    parameters: Annotated[
        Parameters,
        _flag(
            help="numeric: their values; symbolic: a symbol for each, set at run time; nonzero: zeros stay "
            "zeros, which keeps formulas short"
        ),
    ] = "numeric",
    lock: Annotated[
        list[str] | None,
        _flag(metavar="JOINT=VALUE", help="Hold a joint, rad or m; may be repeated"),
    ] = None,
    base: Annotated[
        Literal["fixed", "floating"] | None,
        _flag(
            help="How the root link is held; fixed unless given, but floating where an SDFormat model has no "
            "joint to the world"
        ),
    ] = None,
    root: Annotated[str | None, _flag(help="Keep only this link and what it carries")] = None,
    tip: Annotated[str | None, _flag(help="Keep only the chain of links to this one")] = None,
    allow_unphysical: Annotated[
        bool, _flag("--allow-unphysical", help="Accept bodies that cannot exist")
    ] = False,
    free_mimic: Annotated[
        bool,
        _flag(
            "--free-mimic",
            help="Let a mimic joint without a master, or one that MJCF couples, move by itself",
        ),
    ] = False,
    constraints: Annotated[
        Path | None,
        _flag(help="TOML file of constraints: loops and couplings beside those of the robot's own file"),
    ] = None,
    independent: Annotated[
        list[str] | None,
        _flag(
            metavar="JOINT",
            help="Joints whose motion gives that of all others under the constraints: A,B; may be repeated, "
            "as for names with a comma; chosen by pivoting unless given",
        ),
    ] = None,
) -> Options:
    """Return the options of the flags' values; raises LinkwiseError naming the flag."""
    return Options(
        parameters,
        _locks(lock or ()),
        base,
        root,
        tip,
        allow_unphysical,
        free_mimic,
        None if constraints is None else str(constraints),
        _names(independent or ()),
    )


def reads_robot(
    parameters: Parameters = "numeric",
) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """Return a decorator that gives a command the flags of `robot_options`, as its argument `options`.

    `parameters` is the default of the flag of that name.
    """
    flags = dict(inspect.signature(robot_options).parameters)
    flags["parameters"] = flags["parameters"].replace(default=parameters)

    def decorate(command: Callable[..., None]) -> Callable[..., None]:
        @wraps(command)
        def run(**given: Any) -> None:
            chosen = {name: given.pop(name) for name in flags}
            command(options=robot_options(**chosen), **given)

        own = inspect.signature(command)
        merged = [p for name, p in own.parameters.items() if name != "options"] + list(flags.values())
        named = [p.replace(kind=inspect.Parameter.KEYWORD_ONLY) for p in merged]
        cast(Any, run).__signature__ = own.replace(parameters=named)  # what typer makes the flags from
        return run

    return decorate


def _names(items: Iterable[str]) -> tuple[str, ...]:
    """Return the lists A,B as they were given, for a joint's name may have a comma.

    Raises LinkwiseError for an empty name.
    """
    given = tuple(item.strip() for item in items)
    if not all(name.strip() for item in given for name in item.split(",")):
        raise LinkwiseError("--independent has an empty name; give joints as A,B")
    return given


def _locks(items: Iterable[str]) -> dict[str, float]:
    """Return the values of the held joints, from JOINT=VALUE; raises LinkwiseError for another form."""
    locked: dict[str, float] = {}
    for item in items:
        joint, _, text = item.rpartition("=")
        try:
            value = float(text)
        except ValueError:
            value = math.nan
        if not joint or not math.isfinite(value):
            raise LinkwiseError(f"--lock {item!r} is not of the form JOINT=VALUE, such as --lock elbow=0.5")
        if joint in locked:
            raise LinkwiseError(f"--lock holds {joint!r} twice; give it one value")
        locked[joint] = value
    return locked
