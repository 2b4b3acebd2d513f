"""What stands for each quantity in formulas that are read: as plain text and as LaTeX, no two alike."""

import re
from collections.abc import Sequence
from dataclasses import dataclass

from linkwise.escape import identifiers, latex_symbol

USABLE = re.compile(r"(?!(q|qd|qdd|tau)_|(sin|cos|tan|sqrt|exp|log|pi|E|e|I)$)[A-Za-z][0-9A-Za-z_]*")
"""Names of parameters that a formula can hold as they are, and that stand for nothing else in it."""
MOTION = {"q": "q", "qd": r"\dot{q}", "qdd": r"\ddot{q}"}
"""LaTeX of q_k, q̇_k and q̈_k without their index."""


@dataclass(frozen=True)
class FormulaSymbol:
    """One symbol, as text and as LaTeX."""

    text: str
    latex: str


def motion_symbol(kind: str, k: int) -> FormulaSymbol:
    """Symbol of q_k, qd_k or qdd_k, k counted from 1."""
    return FormulaSymbol(f"{kind}_{k}", f"{MOTION[kind]}_{{{k}}}")


def parameter_symbols(names: Sequence[str]) -> list[FormulaSymbol]:
    """Symbols of parameters: their own names where these are usable, else names made of them."""
    usable = [name for name in names if USABLE.fullmatch(name)]
    made = iter(identifiers([name for name in names if name not in usable], "p_", usable))
    symbols: list[FormulaSymbol] = []
    taken: set[str] = set()
    for name in names:
        text = name if name in usable else next(made)
        latex = latex_symbol(text)
        latex = latex_symbol(f"p_{text}") if latex in taken else latex
        taken.add(latex)
        symbols.append(FormulaSymbol(text, latex))
    return symbols
