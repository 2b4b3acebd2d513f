"""Python files that define energies in SymPy; they are run."""

import ast
import re
import runpy
from collections.abc import Mapping
from pathlib import Path
from traceback import walk_tb
from types import ModuleType
from typing import Any

from linkwise.errors import LinkwiseError
from linkwise.symbolic.moving_bodies import BODIES
from linkwise.symbolic.passed_over import READ, refuse_passed_over
from linkwise.symbolic.system import EnergySystem, LinkEnergy
from linkwise.symbolic.user_energies import energy_system


def read_energies(path: Path, symbolic: bool = False) -> EnergySystem:
    """Return the system of a Python file that defines `coordinates`, `links`, and optionally other names.

    The file is run; the other names are those of the arguments of `energy_system`. A file may define `system`
    instead, as `energy_system` and `from_sympy` return it. Raises LinkwiseError as
    that does, and for a name that nobody reads.
    """
    try:
        scope: dict[str, Any] = runpy.run_path(str(path))
    except LinkwiseError:
        raise
    except (Exception, SystemExit) as error:  # the user's own code may raise anything
        raise LinkwiseError(f"running the file failed{_said(error, str(path))}") from error
    refuse_passed_over(path.read_bytes(), scope)
    if isinstance(scope.get("system"), EnergySystem):
        return _whole(scope, symbolic)
    links = scope.get("links")
    if not isinstance(links, (list, tuple)) or not all(
        isinstance(one, (LinkEnergy, *BODIES)) for one in links
    ):
        kinds = ", ".join(f"linkwise.{kind.__name__}" for kind in BODIES)
        raise LinkwiseError(f"the file must define 'links', a list of linkwise.LinkEnergy, or of {kinds}")
    if not isinstance(scope.get("coordinates"), (list, tuple, Mapping)):
        raise LinkwiseError("the file must define 'coordinates', a list of linkwise.Coordinate")
    try:
        return energy_system(
            scope.get("name", path.stem),
            scope["coordinates"],
            links,
            scope.get("parameters"),
            symbolic,
            None if isinstance(scope.get("time"), ModuleType) else scope.get("time"),
            scope.get("inputs", ()),
            scope.get("constraints"),
            scope.get("independent", ()),
        )
    except LinkwiseError as error:
        raise LinkwiseError(with_line(str(error), path)) from error


def with_line(told: str, path: Path) -> str:
    """Return an error behind the last line with the link or constraint that it names, if the file has one."""
    found = re.match(r"(link|constraint) ('[^']*'|\"[^\"]*\")", told)
    if found is None:
        return told
    name, nodes = ast.literal_eval(found[2]), [*ast.walk(ast.parse(path.read_bytes()))]
    calls = [node.lineno for node in nodes if isinstance(node, ast.Call) and _is_named(node, name)]
    given = (key for node in nodes if isinstance(node, ast.Dict) for key in node.keys)
    keys = [key.lineno for key in given if key is not None and _is(key, name)]
    line = max(calls if found[1] == "link" else keys, default=None)
    return told if line is None else f"line {line}: {told}"


def _is_named(call: ast.Call, name: str) -> bool:
    given = [*call.args[:1], *(keyword.value for keyword in call.keywords if keyword.arg == "name")]
    return any(_is(one, name) for one in given)


def _is(node: ast.expr, name: str) -> bool:
    return isinstance(node, ast.Constant) and node.value == name


def _whole(scope: Mapping[str, Any], symbolic: bool) -> EnergySystem:
    """Return the system that a file made itself, by `from_sympy` or `energy_system`."""
    system: EnergySystem = scope["system"]
    if beside := [name for name in READ if name in scope and name not in ("system", "time", "inputs")]:
        raise LinkwiseError(
            f"the file defines 'system', and {beside[0]!r} beside it, which counts for nothing"
        )
    if symbolic and system.request.get("parameters") != "symbolic":
        raise LinkwiseError("the file makes its 'system' with numbers; give symbolic=True there")
    return system


def _said(error: BaseException, path: str) -> str:
    """Return in words the last line of the user's file that an error passed through, and the error."""
    said = _text_of(error)
    lines = [at for frame, at in walk_tb(error.__traceback__) if frame.f_code.co_filename == path]
    if isinstance(error, SyntaxError) and error.filename == path:
        lines, said = [error.lineno] if error.lineno else [], error.msg
    place = f" in line {lines[-1]}" if lines else ""
    return f"{place}: {type(error).__name__}{': ' if said else ''}{said}"


def _text_of(error: BaseException) -> str:
    try:
        return str(error)
    except Exception:  # the user's own class may raise here, too
        return ""
