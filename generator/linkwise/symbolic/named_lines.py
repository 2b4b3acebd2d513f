"""Lines of a Python file of energies where what an error names is made or given."""

import ast
import re
from collections.abc import Iterator, Mapping
from pathlib import Path

from sympy.core.function import AppliedUndef

TEXT = r"""'(?:[^'\\\\]|\\\\.)*'|"(?:[^"\\\\]|\\\\.)*\""""
NAMED = re.compile(
    rf"(?:the )?(?P<kind>link|coordinate|constraint|parameter|input)s?\b(?: names?)?"
    rf"(?: (?P<name>{TEXT}|[^\s,;:]+))?"
    r"|the file must define '(?P<lacking>\w+)'"
    r"|`(?P<given>\w+)`"
    r"|.*; choose (?P<asked>independent)="
)
"""Beginning of an error that names a thing of its kind, or a name that linkwise reads."""
COORDINATE = "Coordinate"
NO_LINKS = ("Symbol", "symbols", "dynamicsymbols", "Function", COORDINATE)
"""Functions whose first argument is the name of something else than a link."""


def with_line(told: str, path: Path, defined: Mapping[str, object], otherwise: int | None = None) -> str:
    """Return an error behind the last line with what it names, if the file has one.

    defined: values of the file's names
    otherwise: line of an error that names nothing
    """
    found = NAMED.match(told)
    tree = ast.parse(path.read_bytes())
    lines: list[int] = []
    if found is not None:
        kind, name = found["kind"], found["name"]
        given = f"{kind}s" if kind else found["lacking"] or found["given"] or found["asked"]
        assignments = [
            node for node in ast.walk(tree) if isinstance(node, ast.stmt) and _assigns(node, given)
        ]
        inside = [node for one in assignments for node in ast.walk(one)]
        for nodes in (inside, [*ast.walk(tree)]) if kind and name else ():
            lines = lines or [line for node in nodes for line in _naming(node, kind, _text(name), defined)]
        lines = lines or [node.lineno for node in assignments]
    line = max(lines, default=otherwise)
    return told if line is None else f"line {line}: {told}"


def _text(name: str) -> str:
    return str(ast.literal_eval(name)) if re.fullmatch(TEXT, name) else name


def _assigns(node: ast.stmt, name: str) -> bool:
    """Return whether a statement gives a value to a name, or more to it or to an element of it."""
    if isinstance(node, ast.Assign):
        targets = node.targets
    elif isinstance(node, ast.AnnAssign | ast.AugAssign):
        targets = [node.target]
    else:
        return False
    stored = (part for target in targets for part in ast.walk(target) if isinstance(part, ast.Name))
    return any(part.id == name for part in stored)


def _naming(node: ast.AST, kind: str, name: str, defined: Mapping[str, object]) -> Iterator[int]:
    """Yield the line of a call that makes what has this name, or where a table has it as a key."""
    match node:
        case ast.Call() if kind == "constraint":
            yield from (keyword.value.lineno for keyword in node.keywords if keyword.arg == name)
        case ast.Call() if _makes(node, kind) and _is_named(node, name):
            yield node.lineno
        case ast.Dict():
            yield from (key.lineno for key in node.keys if key is not None and _is(key, kind, name, defined))
        case ast.Subscript(ctx=ast.Store()) if _is(node.slice, kind, name, defined):
            yield node.lineno


def _makes(call: ast.Call, kind: str) -> bool:
    """Return whether a call may make a link, or a coordinate, by the name of its function."""
    function = call.func
    called = function.attr if isinstance(function, ast.Attribute) else getattr(function, "id", "")
    return called == COORDINATE if kind == "coordinate" else kind == "link" and called not in NO_LINKS


def _is_named(call: ast.Call, name: str) -> bool:
    given = [*call.args[:1], *(keyword.value for keyword in call.keywords if keyword.arg == "name")]
    return any(isinstance(one, ast.Constant) and one.value == name for one in given)


def _is(key: ast.expr, kind: str, name: str, defined: Mapping[str, object]) -> bool:
    """Return whether a key of a table is the name of a constraint, or a symbol or function of this name."""
    if isinstance(key, ast.Constant):
        return kind == "constraint" and key.value == name
    if kind not in ("coordinate", "parameter") or not isinstance(key, ast.Name):
        return False
    value = defined.get(key.id)
    called = value.func.__name__ if isinstance(value, AppliedUndef) else getattr(value, "name", key.id)
    return name in (called, str(value))
