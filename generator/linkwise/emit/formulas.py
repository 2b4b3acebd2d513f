"""Closed forms to read: each τ_ij as text and LaTeX.

Of robots small enough to read, fully expanded: what cancelling leaves in sums of rounded numbers, such as in
sin² + cos² − 1, is removed. Of others in steps: what is used more than once has a name, and a line before.
"""

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence

import sympy as sp
from sympy.simplify.fu import TR8

from linkwise.dynamics.derive import Method
from linkwise.dynamics.link_forms import LinkForms, parameter_names
from linkwise.emit.derivation import Derivation
from linkwise.emit.formula_page import Line, formula_page
from linkwise.emit.formula_printers import FormulaPrinter, latex_of
from linkwise.emit.straight_line import straight_line
from linkwise.expression.expression_graph import Graph, Node, operands, reachable
from linkwise.expression.from_sympy import SYMPY_FUNCTIONS
from linkwise.package.formula_symbols import (
    MOTION,
    FormulaSymbol,
    motion_symbol,
    parameter_symbols,
    step_latex,
)
from linkwise.symbolic.chain_rule import partial_torques
from linkwise.symbolic.system import RigidSystem, System

MOST_COORDINATES = 3
"""Most coordinates of a robot whose formulas are expanded: of more, they explode."""
MOST_TERMS = 10_000_000
"""Most terms of a formula, sine by sine multiplied out, that is expanded."""
DIGITS = 12
"""Digits of the numbers shown in expanded formulas."""
EXACT = 17
"""Digits that hold every float."""
READABLE = (sp.Rational, sp.Float, type(sp.pi), type(sp.E), sp.Add, sp.Mul, sp.Pow, *SYMPY_FUNCTIONS)
"""Types that a number may be made of for readers of Python and of LaTeX to know it."""

ROUNDING = 1e-12
"""Share of the largest coefficient below which a coefficient is rounding."""


def are_short(system: System) -> bool:
    """Return whether a robot has formulas that anybody would read from end to end."""
    return len(system.coordinates) <= MOST_COORDINATES


def formula_files(derivation: Derivation) -> Iterator[tuple[str, str]]:
    """Yield formulas.txt and formulas.tex."""
    system = derivation.system
    names = [symbol.name for symbol in system.parameters]
    joints, links = ([part.name for part in parts] for parts in (system.coordinates, system.links))
    expanded = are_short(system) and all(_can_be_expanded(forms) for forms in derivation.forms)
    lines = _expanded_lines(system) if expanded else _lines_in_steps(derivation)
    by_rule = any(forms.frame for forms in derivation.forms)
    method: Method | None = "rule" if by_rule else "energy" if isinstance(system, RigidSystem) else None
    for ending, found in lines.items():
        yield f"formulas.{ending}", formula_page(ending, found, joints, links, names, method)


def _expanded_lines(system: System) -> dict[str, list[Line]]:
    parameters = parameter_symbols([symbol.name for symbol in system.parameters])
    shown = [(i, j, _shown(system, parameters, tau)) for i, j, tau in _rows(system)]
    latex = _latex_names(system, parameters)
    return {
        "txt": [(f"tau_{i + 1}_{j + 1}", sp.sstr(expr)) for i, j, expr in shown],
        "tex": [
            (rf"\tau_{{{i + 1}{j + 1}}}", str(sp.latex(expr, symbol_names=latex))) for i, j, expr in shown
        ],
    }


def _can_be_expanded(forms: LinkForms) -> bool:
    """Return whether torques are sums that SymPy can multiply out in a moment, without any cases."""
    graph = forms.graph
    return all(terms <= MOST_TERMS for terms in _terms(graph, forms.torque.values()).values())


def _terms(graph: Graph, outputs: Iterable[Node]) -> dict[Node, float]:
    """Return the number of terms of each node, multiplied out; a product of sines has twice as many for each.

    What is chosen by conditions has no such number: it is infinite.
    """
    found: dict[Node, float] = {}
    for node in reachable(graph, outputs):
        op, *_ = graph.nodes[node]
        parts = [found[part] for part in operands(graph.nodes[node])]
        match op:
            case "add" | "sub":
                found[node] = sum(parts)
            case "mul" | "div":
                found[node] = parts[0] * parts[1]
            case "neg":
                found[node] = parts[0]
            case "call" if graph.nodes[node][1] != "abs":
                found[node] = 1.0 + parts[0]
            case "const" | "symbol":
                found[node] = 1.0
            case _:
                found[node] = float("inf")
    return found


def _lines_in_steps(derivation: Derivation) -> dict[str, list[Line]]:
    system = derivation.system
    parameters = parameter_symbols([symbol.name for symbol in system.parameters])
    texts = {name: s.text for name, s in zip(parameter_names(system).values(), parameters, strict=True)}
    motion = [motion_symbol(kind, k) for kind in MOTION for k in range(1, len(system.coordinates) + 1)]
    known = {symbol.text: symbol.latex for symbol in (*motion, *parameters)}
    texts |= {symbol.text.replace("_", ""): symbol.text for symbol in motion}
    lines: dict[str, list[Line]] = {"txt": [], "tex": []}
    for j, forms in enumerate(derivation.forms, 1):
        graph = forms.graph
        leaves = {graph.symbol(name): text for name, text in texts.items()}
        code = straight_line(graph, list(forms.torque.values()), FormulaPrinter(), leaves)
        latex = known | {name: step_latex(name, known.values()) for name, _ in code.assignments}
        torques = zip(forms.torque, code.outputs, strict=True)
        found = [*code.assignments, *((f"tau_{i + 1}_{j}", text) for i, text in torques)]
        lines["txt"] += found
        latex |= {f"tau_{i + 1}_{j}": rf"\tau_{{{i + 1},{j}}}" for i in forms.torque}
        lines["tex"] += [(latex[name], latex_of(text, latex)) for name, text in found]
    return lines


def _rows(system: System) -> Iterator[tuple[int, int, sp.Expr]]:
    for j in range(len(system.links)):
        for i, tau in partial_torques(system, j).items():
            yield i, j, tau


def _shown(system: System, parameters: Iterable[FormulaSymbol], expr: sp.Expr) -> sp.Expr:
    """Return the expression expanded, products of sines and cosines as those of angle sums, numbers short."""
    shown = [sp.Symbol(symbol.text) for symbol in parameters]
    names = dict(zip(system.parameters, shown, strict=True))
    sizes = zip(shown, system.parameters.values(), strict=True)
    values = {symbol: sp.Float(value or 1.0) for symbol, value in sizes}
    bounded = set()
    for k, c in enumerate(system.coordinates, 1):
        q, qd, qdd = (sp.Symbol(f"{kind}_{k}") for kind in MOTION)
        names |= {c.q: q, c.qd: qd, c.qdd: qdd}
        # A slide's position is added to lengths, so it is bounded; a user's coordinate may be of any size.
        bounded |= {q, qd, qdd} if isinstance(system, RigidSystem) else {qd, qdd}
    expanded = sp.expand(TR8(sp.expand(_readable(expr).xreplace(names))))
    kept = sp.Add(*without_residue(sp.Add.make_args(expanded), bounded, values))
    long = (r for r in kept.atoms(sp.Rational) if max(abs(r.p), r.q) >= 10**DIGITS)
    return kept.xreplace({f: sp.Float(f, DIGITS) for f in (*kept.atoms(sp.Float), *long)})


def _readable(expr: sp.Expr) -> sp.Expr:
    """Return the expression with numbers for constants without a notation of their own, such as zeta(3)."""
    constants = {
        part: sp.N(part, EXACT)
        for part in sp.preorder_traversal(expr)
        if isinstance(part, sp.Expr) and not isinstance(part, READABLE) and part.is_number
    }
    return expr.xreplace(constants)


def _latex_names(system: System, parameters: Iterable[FormulaSymbol]) -> dict[sp.Symbol, str]:
    """Return the LaTeX of every symbol."""
    motion = [motion_symbol(kind, k) for kind in MOTION for k in range(1, len(system.coordinates) + 1)]
    return {sp.Symbol(symbol.text): symbol.latex for symbol in (*motion, *parameters)}


def without_residue(
    terms: Sequence[sp.Expr], bounded: Collection[sp.Symbol], values: Mapping[sp.Symbol, sp.Float]
) -> Iterator[sp.Expr]:
    """Yield the terms that are not negligible: those whose number is small beside others' are dropped.

    A number gives the size of sines, cosines and powers of `bounded` symbols alone. Whatever else a term
    holds, as exp(15 q) or 1/q, may have any size: the term is compared with others of the same factor, and
    stays where there are none. Parameters may get other values than they have: what is dropped is small both
    without them, as if all of them were one, and with their `values`.
    """
    weighed = [(term, *_weighed(term, bounded, values)) for term in terms]
    largest: dict[sp.Expr, tuple[sp.Expr, sp.Expr]] = {}
    for _, apart, number, size in weighed:
        known = largest.get(apart, (0, 0))
        largest[apart] = max(known[0], number), max(known[1], size)
    for term, apart, number, size in weighed:
        most = largest[apart]
        if number > ROUNDING * most[0] or size > ROUNDING * most[1]:
            yield term


def _weighed(
    term: sp.Expr, bounded: Collection[sp.Symbol], values: Mapping[sp.Symbol, sp.Float]
) -> tuple[sp.Expr, sp.Expr, sp.Expr]:
    """Return factors of any size, the coefficient, and this times the factors of parameters alone."""
    number, rest = term.as_coeff_Mul()
    size, apart = number, sp.S.One
    for factor in sp.Mul.make_args(rest):
        if factor.free_symbols <= values.keys():
            size *= factor.xreplace(values)
        elif not _is_bounded(factor, bounded):
            apart *= factor
    size = abs(sp.N(size))
    return apart, abs(number), size if size.is_comparable else sp.S.Zero


def _is_bounded(factor: sp.Expr, bounded: Collection[sp.Symbol]) -> bool:
    base, exponent = factor.as_base_exp()
    whole = exponent.is_Integer and exponent > 0
    return bool(whole and (base in bounded or isinstance(base, (sp.sin, sp.cos))))
