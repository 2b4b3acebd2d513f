"""Text around printed formulas: the meaning of the symbols, then one line per formula."""

from collections.abc import Sequence

from linkwise_runtime.version import VERSION

from linkwise.emit.legend import names_told
from linkwise.escape import latex_symbol, python_literal
from linkwise.package.formula_symbols import FormulaSymbol, parameter_symbols
from linkwise.render import render

KINDS = {"txt": "text", "tex": "latex"}
"""Notation of symbols in each kind of file."""

Line = tuple[str, str]
"""Symbol of a τ_ij, or of a value that later lines use, and the formula for it."""
TORQUE = ("tau_", r"\tau_{")
"""Beginnings of the symbols of torques."""


def formula_page(
    ending: str,
    lines: Sequence[Line],
    joints: Sequence[str],
    links: Sequence[str],
    parameters: Sequence[str],
    derivation: str | None,
) -> str:
    """Return formulas.txt or formulas.tex, from the names of a robot's joints, links and parameters.

    derivation: of rigid links, rule or energy, which gives steps their names; None for energies by hand
    """
    are_torques = [symbol.startswith(TORQUE) for symbol, _ in lines]
    begins = [True, *are_torques]
    symbols = zip(parameters, parameter_symbols(parameters), strict=True)
    view = {
        "version": VERSION,
        "lines": [
            (symbol, text, is_torque or begin)
            for (symbol, text), is_torque, begin in zip(lines, are_torques, begins, strict=False)
        ],
        "in_steps": not all(are_torques),
        "legend": names_told(derivation == "rule").splitlines() if derivation else [],
        "joints": [python_literal(name) for name in joints],
        "links": [python_literal(name) for name in links],
        "parameters": [
            (getattr(symbol, KINDS[ending]), python_literal(name))
            for name, symbol in symbols
            if symbol != FormulaSymbol(name, latex_symbol(name))
        ],
    }
    return render(f"formulas/formulas.{ending}.j2", view)
