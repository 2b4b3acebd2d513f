"""Flags of commands, made of the options that dataclasses declare; and the robot that commands read."""

import inspect
from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import MISSING, is_dataclass
from functools import wraps
from inspect import Parameter
from pathlib import Path
from types import EllipsisType
from typing import Annotated, Any, cast, get_origin

import typer

from linkwise.cli import tell
from linkwise.option import chosen, written
from linkwise.pipeline import is_program
from linkwise.robot import DESCRIPTIONS

Command = Callable[..., None]
RobotName = Annotated[str, typer.Argument(help=DESCRIPTIONS)]
RobotNames = Annotated[list[str], typer.Argument(help=DESCRIPTIONS)]


class WrittenOptions(dict[str, Any]):
    """Options of a command as they were written, by key; a command that has a parameter of it gets them."""


NOTHING = WrittenOptions()


def tell_run(*robots: str | Path) -> None:
    """Print, in a line each, which of these robots are programs, and so were run to be read."""
    for robot in filter(is_program, robots):
        tell(f"note: {robot} is a Python program, which was run", err=True)


def is_given(context: typer.Context, option: str) -> bool:
    """Return whether an option stands on the command line, be it with its default."""
    source = context.get_parameter_source(option)
    return source is not None and source.name == "COMMANDLINE"


def takes(
    *order: str | EllipsisType,
    without: Collection[str] = (),
    complete: Callable[[dict[str, Any]], dict[str, Any]] = dict,
    **usual: Any,
) -> Callable[[Command], Command]:
    """Return a decorator that gives a command the flags of its parameters that are dataclasses.

    order: names as --help lists them, ... for all others, which stand in the order of the signature
    without: options of the dataclasses that the command does not have
    complete: makes of what was given, by name, what the command gets
    usual: defaults that differ from those of the dataclasses
    """

    def decorate(command: Command) -> Command:
        own = inspect.signature(command).parameters
        kinds: dict[str, Any] = {name: p.annotation for name, p in own.items() if is_dataclass(p.annotation)}
        told = [name for name, p in own.items() if p.annotation is WrittenOptions]

        @wraps(command)
        def run(**given: Any) -> None:
            given = complete(given)
            made = {name: chosen(kind, given) for name, kind in kinds.items()}
            made |= {name: WrittenOptions(given) for name in told}
            command(**made, **{name: given[name] for name in own if name not in made})

        flags = {
            flag.name: flag.replace(kind=Parameter.KEYWORD_ONLY)
            for name, parameter in own.items()
            for flag in (_flags(kinds[name], usual) if name in kinds else [parameter])
            if flag.name not in (*without, *told)
        }
        at = order.index(...) if order else 0
        names = (*order[:at], *(name for name in flags if name not in order), *order[at + 1 :])
        shown = inspect.Signature([flags[str(name)] for name in names])
        cast(Any, run).__signature__ = shown  # what typer makes the flags from
        return run

    return decorate


def _flags(kind: Any, usual: Mapping[str, Any]) -> Iterator[Parameter]:
    """Yield the parameters of which typer makes the flags of a dataclass."""
    panel = getattr(kind, "PANEL", None)
    for one in written(kind):
        flag, hint, default, own = one.flag, one.kind, usual.get(one.key, one.default), one.option
        if get_origin(hint) is tuple:
            hint, default = list[Path] | None if own.is_file else list[str] | None, None
        elif own.is_file:
            hint = Path | None
        elif default is True:
            flag += f"/--no-{flag.removeprefix('--')}"
        declared = typer.Option(flag, help=own.help, metavar=own.metavar, rich_help_panel=panel)
        default = Parameter.empty if default is MISSING else default
        yield Parameter(
            one.key, Parameter.KEYWORD_ONLY, default=default, annotation=Annotated[hint, declared]
        )
