"""Closed forms to read: each τ_ij, fully expanded, as text and LaTeX, for robots small enough to read."""

from collections.abc import Iterator

import sympy as sp

from linkwise import __version__
from linkwise.emit.package import Derivation
from linkwise.emit.render import render
from linkwise.symbolic.chain_rule import partial_torques
from linkwise.symbolic.system import System

MOST_COORDINATES = 3


def formula_files(derivation: Derivation) -> Iterator[tuple[str, str]]:
    """formulas.txt and formulas.tex; nothing for a robot that nobody would read."""
    system = derivation.system
    if len(system.coordinates) > MOST_COORDINATES:
        return
    rows = list(_rows(system))
    for kind, printer in (("txt", sp.sstr), ("tex", sp.latex)):
        view = {
            "version": __version__,
            "rows": [(i + 1, j + 1, printer(_shown(system, expr))) for i, j, expr in rows],
            "joints": [ascii(c.name) for c in system.coordinates],
            "links": [ascii(link.name) for link in system.links],
        }
        yield f"formulas.{kind}", render(f"formulas/formulas.{kind}.j2", view)


def _rows(system: System) -> Iterator[tuple[int, int, sp.Expr]]:
    for j in range(len(system.links)):
        for i, tau in partial_torques(system, j).items():
            yield i, j, tau


def _shown(system: System, expr: sp.Expr) -> sp.Expr:
    """The expression expanded, with q_1, \\dot q_1 and \\ddot q_1 for the coordinates and short numbers."""
    names = {}
    for k, c in enumerate(system.coordinates):
        names[c.q], names[c.qd] = sp.Symbol(f"q_{k + 1}"), sp.Symbol(f"qd_{k + 1}")
        names[c.qdd] = sp.Symbol(f"qdd_{k + 1}")
    expanded = sp.expand(sp.expand(expr.xreplace(names)))
    return expanded.xreplace({f: sp.Float(f, 12) for f in expanded.atoms(sp.Float)})
