"""Symbols of the quantities in printed formulas, as plain text and as LaTeX, no two alike."""

import re
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from keyword import kwlist

from linkwise.escape import identifiers, latex_symbol

WORDS = "|".join(("sin", "cos", "tan", "sqrt", "exp", "log", "pi", "E", "e", "I", *kwlist))
USABLE = re.compile(rf"(?!(q|qd|qdd|tau)_|({WORDS})$)[A-Za-z][0-9A-Za-z_]*")
"""Pattern of parameter names that a formula can use as they are, and that stand for nothing else in it.

Words of Python's, such as lambda, are not among them: formulas.txt is in its notation.
"""
MOTION = {"q": "q", "qd": r"\dot{q}", "qdd": r"\ddot{q}"}
"""LaTeX of q_k, q̇_k and q̈_k without their index."""
OWN = re.compile(r"(q|\\tau)_\{\d+\}")
"""Pattern of LaTeX that a parameter's name could be made into, and that a coordinate or a torque has."""


@dataclass(frozen=True)
class FormulaSymbol:
    """One symbol, as text and as LaTeX."""

    text: str
    latex: str


def motion_symbol(kind: str, k: int) -> FormulaSymbol:
    """Return the symbol of q_k, qd_k or qdd_k, k counted from 1."""
    return FormulaSymbol(f"{kind}_{k}", f"{MOTION[kind]}_{{{k}}}")


def step_latex(name: str, taken: Collection[str]) -> str:
    """Return the LaTeX of an intermediate value, by its name in the text."""
    latex = latex_symbol(name)
    return r"\mathrm{{{}}}".format(name.replace("_", r"\_")) if latex in taken else latex


def parameter_symbols(names: Sequence[str]) -> list[FormulaSymbol]:
    """Return the symbols of parameters: their own names where these are usable, else names made of them."""
    usable = [name for name in names if USABLE.fullmatch(name)]
    made = iter(identifiers([name for name in names if name not in usable], "p_", usable))
    symbols: list[FormulaSymbol] = []
    taken: set[str] = set()
    for name in names:
        text = told = name if name in usable else next(made)
        while (latex := latex_symbol(told)) in taken or OWN.fullmatch(latex):
            told = f"p_{told}"
        taken.add(latex)
        symbols.append(FormulaSymbol(text, latex))
    return symbols
