"""Text around printed formulas: the meaning of the symbols, then one line per formula."""

from collections.abc import Sequence

from linkwise_runtime.version import VERSION

from linkwise.escape import latex_symbol, python_literal
from linkwise.package.formula_symbols import FormulaSymbol, parameter_symbols
from linkwise.render import render

KINDS = {"txt": "text", "tex": "latex"}
"""Notation of symbols in each kind of file."""

Row = tuple[int, int, str]
"""Joint i and link j, counted from 0, and the formula of τ_ij."""


def formula_page(
    ending: str, rows: Sequence[Row], joints: Sequence[str], links: Sequence[str], parameters: Sequence[str]
) -> str:
    """Return formulas.txt or formulas.tex, from the names of a robot's joints, links and parameters."""
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
