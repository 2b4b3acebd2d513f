"""Names that a Python file of energies defines for nobody: linkwise does not read them, nor does the file."""

import ast
from collections.abc import Collection, Iterator

from linkwise.errors import LinkwiseError
from linkwise.runtime.chosen_names import nearest_first

READ = ("coordinates", "links", "parameters", "name")
"""What linkwise reads of a file."""


def refuse_passed_over(source: bytes, defined: Collection[str]) -> None:
    """Raise LinkwiseError for what the file defines by a name of its own, and neither reads nor loads.

    Such as `dissipation`, which would count for nothing. What is imported, unpacked, looped over, or begins
    with _ may be left over.

    defined: names that the file had when it had run
    """
    tree = ast.parse(source)
    used = {
        node.id for node in ast.walk(tree) if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Load)
    }
    for name, line in _definitions(tree):
        if name in defined and name not in used and name not in READ and not name.startswith("_"):
            raise LinkwiseError(
                f"{name!r} in line {line} would count for nothing: linkwise reads "
                f"{', '.join(nearest_first(name, READ))}, and the file does not use it; remove it, or begin "
                "its name with _"
            )


def _definitions(tree: ast.AST) -> Iterator[tuple[str, int]]:
    """Names and lines of single assignments, functions and classes, outside of functions and classes."""
    for node in ast.iter_child_nodes(tree):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
            yield node.name, node.lineno
            continue
        targets = node.targets if isinstance(node, ast.Assign) else [getattr(node, "target", None)]
        if isinstance(node, ast.Assign | ast.AnnAssign | ast.AugAssign):
            yield from ((one.id, node.lineno) for one in targets if isinstance(one, ast.Name))
        elif isinstance(node, ast.stmt | ast.ExceptHandler):
            yield from _definitions(node)
