"""Closed forms to read: each τ_ij, fully expanded, as text and LaTeX, for robots small enough to read."""

import re
from collections.abc import Callable, Iterator, Mapping

import sympy as sp
from sympy.simplify.fu import TR8

from linkwise.emit.derivation import Derivation
from linkwise.emit.render import render
from linkwise.escape import identifiers, latex_symbol, python_literal
from linkwise.symbolic.chain_rule import partial_torques
from linkwise.symbolic.system import System
from linkwise.version import VERSION

MOST_COORDINATES = 3
ROUNDING = 1e-12
"""Share of a torque's largest coefficient below which one is rounding."""
USABLE = re.compile(r"(?!(q|qd|qdd|tau)_|(sin|cos|tan|sqrt|exp|log|pi|E|I)$)[A-Za-z][0-9A-Za-z_]*")
"""Names of parameters that a formula can hold as they are, and that stand for nothing else in it."""


def formula_files(derivation: Derivation) -> Iterator[tuple[str, str]]:
    """formulas.txt and formulas.tex; nothing for a robot that nobody would read."""
    system = derivation.system
    if len(system.coordinates) > MOST_COORDINATES:
        return
    parameters = _parameter_symbols(system)
    rows = [(i, j, _shown(system, parameters, tau)) for i, j, tau in _rows(system)]
    latex = _latex_names(system, parameters)
    printers: dict[str, Callable[[sp.Expr], str]] = {
        "txt": sp.sstr,
        "tex": lambda expr: str(sp.latex(expr, symbol_names=latex)),
    }
    for kind, printer in printers.items():
        view = {
            "version": VERSION,
            "rows": [(i + 1, j + 1, printer(expr)) for i, j, expr in rows],
            "joints": [python_literal(c.name) for c in system.coordinates],
            "links": [python_literal(link.name) for link in system.links],
            "parameters": [
                (text, python_literal(symbol.name))
                for symbol, text in ((symbol, printer(shown)) for symbol, shown in parameters.items())
                if text not in (symbol.name, latex_symbol(symbol.name))
            ],
        }
        yield f"formulas.{kind}", render(f"formulas/formulas.{kind}.j2", view)


def _rows(system: System) -> Iterator[tuple[int, int, sp.Expr]]:
    for j in range(len(system.links)):
        for i, tau in partial_torques(system, j).items():
            yield i, j, tau


def _parameter_symbols(system: System) -> dict[sp.Symbol, sp.Symbol]:
    """What stands for each parameter in formulas: its own name where that is usable, else one made of it."""
    names = [symbol.name for symbol in system.parameters]
    usable = [name for name in names if USABLE.fullmatch(name)]
    made = iter(identifiers([name for name in names if name not in usable], "p_", usable))
    shown = [name if name in usable else next(made) for name in names]
    return {symbol: sp.Symbol(name) for symbol, name in zip(system.parameters, shown, strict=True)}


def _shown(system: System, parameters: Mapping[sp.Symbol, sp.Symbol], expr: sp.Expr) -> sp.Expr:
    """The expression expanded, products of sines and cosines as ones of angle sums, numbers short.

    What then cancels, such as sin² + cos² − 1, leaves rounding behind, which is dropped.
    """
    names = dict(parameters)
    for k, c in enumerate(system.coordinates, 1):
        names |= {c.q: sp.Symbol(f"q_{k}"), c.qd: sp.Symbol(f"qd_{k}"), c.qdd: sp.Symbol(f"qdd_{k}")}
    expanded = sp.expand(TR8(sp.expand(expr.xreplace(names))))
    terms = [term.as_coeff_Mul() for term in sp.Add.make_args(expanded)]
    least = ROUNDING * max((abs(number) for number, _ in terms), default=0)
    kept = sp.Add(*(number * rest for number, rest in terms if abs(number) > least))
    return kept.xreplace({f: sp.Float(f, 12) for f in kept.atoms(sp.Float)})


def _latex_names(system: System, parameters: Mapping[sp.Symbol, sp.Symbol]) -> dict[sp.Symbol, str]:
    """LaTeX of every symbol: dots over q_k for its velocity and acceleration; no two look alike."""
    names: dict[sp.Symbol, str] = {}
    for k in range(1, len(system.coordinates) + 1):
        for kind, dotted in (("qd", r"\dot{q}"), ("qdd", r"\ddot{q}")):
            names[sp.Symbol(f"{kind}_{k}")] = f"{dotted}_{{{k}}}"
    for symbol in parameters.values():
        text = latex_symbol(symbol.name)
        names[symbol] = latex_symbol(f"p_{symbol.name}") if text in names.values() else text
    return names
