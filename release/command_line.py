"""The command line as functions of the public face: each command's arguments and flags are its parameters."""

import inspect
from collections.abc import Iterator
from importlib import import_module
from typing import Annotated, Any, Literal, get_args, get_origin

import typer
from griffe import Function, Parameter, ParameterKind, Parameters
from linkwise.cli.app import COMMANDS, REPORTS, app, command_of

PROGRAM = "linkwise"
"""Name of the function whose parameters are the flags of the whole program."""
LINE = 0
"""Line of every name: griffe asks for one, and where a name stands is nothing to its users."""


def commands() -> Iterator[Function]:
    """Yield the whole program and each command as a function of its arguments, flags and their choices."""
    yield _function(PROGRAM, app)
    for name in (*COMMANDS, *(f"report_{name}" for name in REPORTS)):
        yield _function(name, import_module(f"linkwise.cli.{name}").app)


def _function(name: str, own: typer.Typer) -> Function:
    return Function(name, parameters=Parameters(*_parameters(own)), lineno=LINE)


def _parameters(own: typer.Typer) -> Iterator[Parameter]:
    """Yield a parameter for each spelling of an argument or flag, and one for each choice that it leaves."""
    declared = _declared(own)
    for asked in command_of(own).params:
        default = None if asked.required else repr(asked.default)
        is_flag = asked.opts[0].startswith("-")
        kind = ParameterKind.keyword_only if is_flag else ParameterKind.positional_only
        for spelling in (*asked.opts, *asked.secondary_opts):
            yield Parameter(spelling, kind=kind, default=default)
        for choice in choices(declared[asked.name].annotation):
            yield Parameter(
                f"{asked.opts[0]}={choice}", kind=ParameterKind.keyword_only, default="'a choice'"
            )


def _declared(own: typer.Typer) -> dict[str, inspect.Parameter]:
    """Return the parameters of the function that is called, by the names that typer gives them."""
    called = own.registered_callback or own.registered_commands[0]
    assert called.callback is not None
    return dict(inspect.signature(called.callback, eval_str=True).parameters)


def choices(annotation: Any) -> tuple[Any, ...]:
    """Return the values that a type leaves, of a Literal or one inside; none where it leaves all."""
    if get_origin(annotation) is Literal:
        return get_args(annotation)
    inner = get_args(annotation)
    inside = inner[:1] if get_origin(annotation) is Annotated else inner
    return tuple(choice for each in inside for choice in choices(each))
