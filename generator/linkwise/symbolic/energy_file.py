"""Python files that define energies in SymPy; they are run."""

import ast
import runpy
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from traceback import walk_tb
from types import FrameType, ModuleType
from typing import Any

import sympy as sp
from sympy.core.function import AppliedUndef

from linkwise.errors import LinkwiseError
from linkwise.escape import short
from linkwise.symbolic.moving_bodies import BODIES
from linkwise.symbolic.named_lines import with_line
from linkwise.symbolic.passed_over import refuse_passed_over
from linkwise.symbolic.system import EnergySystem, LinkEnergy
from linkwise.symbolic.user_energies import energy_system


def read_energies(path: Path, symbolic: bool = False, as_made: bool = False) -> EnergySystem:
    """Return the system of a Python file that defines `coordinates`, `links`, and optionally other names.

    The file is run; the other names are those of the arguments of `energy_system`. A file may define `system`
    instead, as `energy_system` and `from_sympy` return it; if it has numbers for parameters and these are to
    stay symbols, it is taken `as_made`, or refused. Raises LinkwiseError as they do, with the line of what
    they name, and for a name that nobody reads.
    """
    try:
        scope: dict[str, Any] = runpy.run_path(str(path))
    except LinkwiseError as error:
        frame, line = _user_lines(error, str(path))[0]
        raise LinkwiseError(with_line(str(error), path, frame.f_globals, line)) from error
    except (Exception, SystemExit) as error:  # the user's own code may raise anything
        raise LinkwiseError(f"running the file failed{_said(error, str(path))}") from error
    try:
        return _system(path, scope, symbolic, as_made)
    except LinkwiseError as error:
        raise LinkwiseError(with_line(str(error), path, scope)) from error


def _system(path: Path, scope: Mapping[str, Any], symbolic: bool, as_made: bool) -> EnergySystem:
    """Return the system that the names of a file define."""
    system = scope.get("system")
    refuse_passed_over(path.read_bytes(), scope, isinstance(system, EnergySystem))
    _refuse_doubles(path.read_bytes())
    if isinstance(system, EnergySystem):
        return _whole(system, symbolic, as_made)
    if _is_of_sympy(system):
        raise LinkwiseError(
            "`system` is a System of sympy.physics.mechanics; give system = linkwise.from_sympy(system, "
            "parameters), or name it otherwise"
        )
    if "system" in scope:
        raise LinkwiseError(
            f"`system` is {short(repr(system))}; give what linkwise.from_sympy or linkwise.energy_system "
            "returns, or name it otherwise"
        )
    links = scope.get("links")
    if not isinstance(links, (list, tuple)) or not all(
        isinstance(one, (LinkEnergy, *BODIES)) for one in links
    ):
        kinds = ", ".join(f"linkwise.{kind.__name__}" for kind in BODIES)
        raise LinkwiseError(f"the file must define 'links', a list of linkwise.LinkEnergy, or of {kinds}")
    coordinates = scope.get("coordinates")
    if not isinstance(coordinates, (list, tuple, Mapping)):
        raise LinkwiseError("the file must define 'coordinates', a list of linkwise.Coordinate")
    _refuse_other_times(path.read_bytes(), coordinates, scope)
    return energy_system(
        scope.get("name", path.stem),
        coordinates,
        links,
        scope.get("parameters"),
        symbolic,
        None if isinstance(scope.get("time"), ModuleType) else scope.get("time"),
        scope.get("inputs", ()),
        scope.get("constraints"),
        scope.get("independent", ()),
    )


def _refuse_other_times(source: bytes, coordinates: Iterable[object], scope: Mapping[str, Any]) -> None:
    """Raise LinkwiseError where something is derived by a symbol that only looks like the coordinates' time.

    To SymPy it is another where assumptions differ: derivatives by it are zero, and with them whole kinetic
    energies.
    """
    by = {name for call in ast.walk(ast.parse(source)) for name in _derived_by(call)}
    for function in coordinates:
        for time in function.args if isinstance(function, AppliedUndef) else ():
            for name in sorted(by):
                other = scope.get(name)
                if isinstance(other, sp.Symbol) and other.name == str(time) and other != time:
                    raise LinkwiseError(
                        f"`{name}` is another symbol than the {time} of which {function} is a function, as "
                        f"their assumptions differ: {function}.diff({name}) is 0; give that of {function}, "
                        "sympy.physics.mechanics.dynamicsymbols._t where dynamicsymbols made it"
                    )


def _derived_by(node: ast.AST) -> Iterator[str]:
    """Yield the names among the arguments of a call of diff or Derivative."""
    if isinstance(node, ast.Call):
        called = node.func.attr if isinstance(node.func, ast.Attribute) else getattr(node.func, "id", "")
        if called in ("diff", "Derivative"):
            yield from (argument.id for argument in node.args if isinstance(argument, ast.Name))


def _refuse_doubles(source: bytes) -> None:
    """Raise LinkwiseError for a dictionary with a text twice: Python drops the first in silence."""
    for node in ast.walk(ast.parse(source)):
        keys = (
            [key for key in node.keys if isinstance(key, ast.Constant)] if isinstance(node, ast.Dict) else []
        )
        values = [key.value for key in keys]
        for at, key in enumerate(keys):
            if key.value in values[:at]:
                raise LinkwiseError(
                    f"line {key.lineno}: {key.value!r} stands twice in one dictionary, and the first would "
                    "count for nothing; name one otherwise"
                )


def _whole(system: EnergySystem, symbolic: bool, as_made: bool) -> EnergySystem:
    """Return the system that a file made itself, by `from_sympy` or `energy_system`."""
    if symbolic and not as_made and system.request.get("parameters") != "symbolic":
        raise LinkwiseError("`system` is made with numbers; give symbolic=True there")
    return system


def _is_of_sympy(given: object) -> bool:
    """Return whether this is a System of SymPy, whose module is not imported for others."""
    return any(
        kind.__name__ == "System" and kind.__module__.startswith("sympy.physics.mechanics")
        for kind in type(given).__mro__
    )


def _said(error: BaseException, path: str) -> str:
    """Return in words the last line of the user's file that an error passed through, and the error."""
    said = _text_of(error)
    lines: list[int] = [line for _, line in _user_lines(error, path)]
    if isinstance(error, SyntaxError) and error.filename == path:
        lines, said = [error.lineno] if error.lineno else [], error.msg
    place = f" in line {lines[0]}" if lines else ""
    return f"{place}: {type(error).__name__}{': ' if said else ''}{said}"


def _user_lines(error: BaseException, path: str) -> list[tuple[FrameType, int]]:
    """Return the lines of the user's file that an error passed through, the last one first."""
    passed = [at for at in walk_tb(error.__traceback__) if at[0].f_code.co_filename == path]
    return passed[::-1]


def _text_of(error: BaseException) -> str:
    try:
        return str(error)
    except Exception:  # the user's own class may raise here, too
        return ""
