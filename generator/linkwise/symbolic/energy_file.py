"""Python files that define energies in SymPy; they are run."""

import ast
import re
import runpy
from collections.abc import Iterator, Mapping
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
    except LinkwiseError as error:
        raise LinkwiseError(with_line(str(error), path)) from error
    except (Exception, SystemExit) as error:  # the user's own code may raise anything
        raise LinkwiseError(f"running the file failed{_said(error, str(path))}") from error
    refuse_passed_over(path.read_bytes(), scope)
    _refuse_doubles(path.read_bytes())
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


TEXT = r"""'(?:[^'\\\\]|\\\\.)*'|"(?:[^"\\\\]|\\\\.)*\""""
NAMED = re.compile(rf"(link|constraints?|the constraints|`independent`)(?: names)? ({TEXT})?")


def with_line(told: str, path: Path) -> str:
    """Return an error behind the last line with the link or constraint that it names, if the file has one."""
    found = NAMED.match(told)
    if found is None:
        return told
    nodes = [*ast.walk(ast.parse(path.read_bytes()))]
    if found[1] == "`independent`" or found[2] is None:
        wanted = "independent" if found[1] == "`independent`" else "constraints"
        lines = [line for node in nodes for line in _assigned(node, wanted)]
    else:
        name = ast.literal_eval(found[2])
        lines = [line for node in nodes for line in _with_name(node, name, found[1] == "link")]
    return f"line {max(lines)}: {told}" if lines else told


def _assigned(node: ast.AST, name: str) -> Iterator[int]:
    targets = node.targets if isinstance(node, ast.Assign) else ()
    yield from (at.lineno for at in targets if isinstance(at, ast.Name) and at.id == name)


def _with_name(node: ast.AST, name: str, is_link: bool) -> Iterator[int]:
    """Yield the line of a call that makes a link of this name, or where a constraint of it is given."""
    if isinstance(node, ast.Call):
        if is_link and _is_named(node, name):
            yield node.lineno
        yield from (keyword.value.lineno for keyword in node.keywords if not is_link and keyword.arg == name)
    elif isinstance(node, ast.Dict) and not is_link:
        yield from (key.lineno for key in node.keys if key is not None and _is(key, name))
    elif isinstance(node, ast.Subscript) and not is_link and _is(node.slice, name):
        yield node.lineno


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
