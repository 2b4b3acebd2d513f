"""Closed forms to read: each τ_ij, fully expanded, as text and LaTeX, for robots small enough to read."""

from collections.abc import Iterator

import sympy as sp
from sympy.simplify.fu import TR8

from linkwise.emit.derivation import Derivation
from linkwise.emit.render import render
from linkwise.symbolic.chain_rule import partial_torques
from linkwise.symbolic.system import System
from linkwise.version import VERSION

MOST_COORDINATES = 3
ROUNDING = 1e-12
"""Share of a torque's largest coefficient below which one is rounding."""


def formula_files(derivation: Derivation) -> Iterator[tuple[str, str]]:
    """formulas.txt and formulas.tex; nothing for a robot that nobody would read."""
    system = derivation.system
    if len(system.coordinates) > MOST_COORDINATES:
        return
    rows = [(i, j, _shown(system, tau)) for i, j, tau in _rows(system)]
    for kind, printer in (("txt", sp.sstr), ("tex", _latex)):
        view = {
            "version": VERSION,
            "rows": [(i + 1, j + 1, printer(expr)) for i, j, expr in rows],
            "joints": [ascii(c.name) for c in system.coordinates],
            "links": [ascii(link.name) for link in system.links],
        }
        yield f"formulas.{kind}", render(f"formulas/formulas.{kind}.j2", view)


def _rows(system: System) -> Iterator[tuple[int, int, sp.Expr]]:
    for j in range(len(system.links)):
        for i, tau in partial_torques(system, j).items():
            yield i, j, tau


def _shown(system: System, expr: sp.Expr) -> sp.Expr:
    """The expression expanded, products of sines and cosines as ones of angle sums, numbers short.

    What then cancels, such as sin² + cos² − 1, leaves rounding behind, which is dropped.
    """
    names: dict[sp.Symbol, sp.Symbol] = {}
    for k, c in enumerate(system.coordinates, 1):
        names |= {c.q: sp.Symbol(f"q_{k}"), c.qd: sp.Symbol(f"qd_{k}"), c.qdd: sp.Symbol(f"qdd_{k}")}
    expanded = sp.expand(TR8(sp.expand(expr.xreplace(names))))
    terms = [term.as_coeff_Mul() for term in sp.Add.make_args(expanded)]
    least = ROUNDING * max((abs(number) for number, _ in terms), default=0)
    kept = sp.Add(*(number * rest for number, rest in terms if abs(number) > least))
    return kept.xreplace({f: sp.Float(f, 12) for f in kept.atoms(sp.Float)})


def _latex(expr: sp.Expr) -> str:
    """LaTeX with dots over q_k for its velocity and acceleration."""
    dots = {}
    for symbol in expr.free_symbols:
        kind, _, number = symbol.name.rpartition("_")
        if kind in ("qd", "qdd"):
            dots[symbol] = rf"\{'d' * (len(kind) - 1)}ot{{q}}_{{{number}}}"
    return str(sp.latex(expr, symbol_names=dots))
