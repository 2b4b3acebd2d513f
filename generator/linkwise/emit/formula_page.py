"""The text around formulas that are read: what the symbols stand for, then one line a formula."""

from collections.abc import Sequence

from linkwise_runtime.version import VERSION

from linkwise.emit.formula_symbols import FormulaSymbol, parameter_symbols
from linkwise.emit.render import render
from linkwise.escape import latex_symbol, python_literal

KINDS = {"txt": "text", "tex": "latex"}
"""Which of a symbol's notations each kind of file has."""

Row = tuple[int, int, str]
"""Joint i and link j, counted from 0, and the formula of τ_ij."""


def formula_page(
    ending: str, rows: Sequence[Row], joints: Sequence[str], links: Sequence[str], parameters: Sequence[str]
) -> str:
    """Text of formulas.txt or formulas.tex, from the names of a robot's joints, links and parameters."""
    symbols = zip(parameters, parameter_symbols(parameters), strict=True)
    view = {
        "version": VERSION,
        "rows": [(i + 1, j + 1, text) for i, j, text in rows],
        "joints": [python_literal(name) for name in joints],
        "links": [python_literal(name) for name in links],
        "parameters": [
            (getattr(symbol, KINDS[ending]), python_literal(name))
            for name, symbol in symbols
            if symbol != FormulaSymbol(name, latex_symbol(name))
        ],
    }
    return render(f"formulas/formulas.{ending}.j2", view)
