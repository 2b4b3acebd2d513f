"""constraints.py: rows of the constraints that a user wrote, as functions over an array namespace."""

from collections.abc import Iterator

from linkwise_runtime.version import VERSION

from linkwise.dynamics.constraint_rows import constraint_rows
from linkwise.emit.closed_forms import form_function, functions_text
from linkwise.escape import python_docstring
from linkwise.render import render
from linkwise.symbolic.system import EnergySystem


def constraint_files(system: EnergySystem) -> Iterator[tuple[str, str]]:
    """Yield the path inside the package and the text; nothing for a system without constraints."""
    if not system.constraints:
        return
    rows = constraint_rows(system)
    n = len(system.coordinates)
    placed = [
        (label, node)
        for r, nodes in enumerate(rows.positions, 1)
        for label, node in zip([f"phi({r})", *(f"A({r}, {k})" for k in range(1, n + 1))], nodes, strict=True)
    ]
    changing = [
        (f"dA/dt({r}, {k})", node) for r, nodes in enumerate(rows.rates, 1) for k, node in enumerate(nodes, 1)
    ]
    functions = [
        form_function(system, rows.graph, "positions", "Return phi and A, row by row", [placed], ("q",)),
        form_function(system, rows.graph, "rates", "Return dA/dt, row by row", [changing], ("q", "qd")),
    ]
    names = [one.name for one in system.constraints]
    view = {
        "version": VERSION,
        "names": [python_docstring(name) for name in names],
        "functions": functions_text(functions),
    }
    yield "constraints.py", render("package/constraints.py.j2", view)
