"""Names that a Python file of energies defines and that neither linkwise nor the file reads."""

import ast
from collections.abc import Iterator, Mapping
from typing import TypeGuard

import sympy as sp
from linkwise_runtime.chosen_names import nearest_first

from linkwise.errors import LinkwiseError

READ = (
    *("coordinates", "links", "parameters", "name", "time", "inputs", "constraints", "independent"),
    "system",
)
"""Names that linkwise reads from a file."""
SCOPES = (ast.Lambda, ast.ListComp, ast.SetComp, ast.DictComp, ast.GeneratorExp)
"""Syntax with names of its own."""
ASSIGNMENTS = (ast.Assign, ast.AnnAssign, ast.AugAssign)


def refuse_passed_over(source: bytes, defined: Mapping[str, object], whole: bool = False) -> None:
    """Raise LinkwiseError for a name that the file defines and that neither it nor linkwise reads.

    An example is `dissipation`, which would count for nothing. Imports, variables of loops, symbols that are
    not used, and names that begin with _ may be left over.

    defined: values by name, after the file has run
    whole: whether `system` is a whole system, beside which linkwise reads nothing
    """
    tree = ast.parse(source)
    filled = {id(node) for statement in ast.walk(tree) for node in _own_loads(statement)}
    used = {node.id for node in ast.walk(tree) if _is_load(node) and id(node) not in filled}
    read = ("system",) if whole else READ
    for name, line in _definitions(tree):
        is_left_over = name.startswith("_") or isinstance(defined.get(name), sp.Symbol)
        if name in defined and name not in used and name not in read and not is_left_over:
            told = (
                "beside `system` linkwise reads nothing"
                if whole
                else f"linkwise reads {', '.join(nearest_first(name, READ))}"
            )
            raise LinkwiseError(
                f"{name!r} in line {line} would count for nothing: {told}, and the file does not use it; "
                "remove it, or begin its name with _"
            )


def _is_load(node: ast.AST) -> TypeGuard[ast.Name]:
    return isinstance(node, ast.Name) and isinstance(node.ctx, ast.Load)


def _own_loads(statement: ast.AST) -> Iterator[ast.Name]:
    """Yield the reads of a name in an assignment to it or to an element of it: they do not count as a use."""
    if not isinstance(statement, ASSIGNMENTS):
        return
    targets = statement.targets if isinstance(statement, ast.Assign) else [statement.target]
    own = set()
    for target in targets:
        base: ast.AST = target
        while isinstance(base, ast.Subscript | ast.Attribute):
            base = base.value
        if isinstance(base, ast.Name):
            own.add(base.id)
    yield from (node for node in ast.walk(statement) if _is_load(node) and node.id in own)


def _definitions(tree: ast.AST) -> Iterator[tuple[str, int]]:
    """Yield names and lines of assignments, functions and classes, outside of functions and classes."""
    for node in ast.iter_child_nodes(tree):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
            yield node.name, node.lineno
        elif isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
            yield node.id, node.lineno
        elif isinstance(node, ast.For | ast.AsyncFor):
            for statement in (*node.body, *node.orelse):
                yield from _definitions(ast.Module([statement], []))
        elif not isinstance(node, SCOPES):
            yield from _definitions(node)
