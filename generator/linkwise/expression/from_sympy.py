"""Translation from SymPy to the expression graph; SymPy goes no further than here."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import TypeAlias

import sympy as sp

from linkwise.errors import LinkwiseError
from linkwise.expression.differentiate import sign
from linkwise.expression.expression import Expression
from linkwise.expression.expression_graph import FUNCTIONS, Graph, Node
from linkwise.robot.robot import Scalar
from linkwise.symbolic.link_energy import Definition

SYMPY_FUNCTIONS: dict[type, str] = {
    **{getattr(sp, name): name for name in FUNCTIONS if name not in ("sqrt", "abs")},
    sp.Abs: "abs",
}
KNOWN = ", ".join((*FUNCTIONS, "atan2", "sign", "Max", "Min", "Piecewise"))
"""Functions that an energy may have, in words."""
DEFINED = {"log": 1.0, "sqrt": 1.0, "asin": 0.0, "acos": 0.0}
"""Functions that not every number has, and a number with a value and a slope."""


Conditions: TypeAlias = tuple[tuple[Node, bool], ...]
"""Conditions, from the outermost on, and whether each is true."""


class Lowering:
    """Translator of expressions into one graph, which remembers what each symbol stands for."""

    def __init__(self, graph: Graph, symbols: Mapping[sp.Symbol, Node]) -> None:
        self.graph = graph
        self.symbols: dict[sp.Symbol, Node] = dict(symbols)
        self._done: dict[tuple[sp.Expr, Conditions], Node] = {}
        self._where: Conditions = ()

    def define(self, definitions: Iterable[Definition]) -> None:
        """Lower named steps in order; later expressions may use their symbols."""
        for symbol, expr in definitions:
            self.symbols[symbol] = self.graph.name(self(expr), symbol.name)

    def __call__(self, expr: Scalar) -> Node:
        """Return the node of `expr`; raises LinkwiseError for a symbol or function without meaning here."""
        if isinstance(expr, (int, float)):
            return self.graph.const(float(expr))
        known = expr, self._where
        node = self._done.get(known)
        if node is None:
            node = self._done[known] = self._lower(expr)
        return node

    def _lower(self, expr: sp.Expr) -> Node:
        g = self.graph
        if isinstance(expr, sp.Symbol):
            if expr not in self.symbols:
                raise LinkwiseError(
                    f"the symbol {expr.name!r} is neither a coordinate, its velocity nor a parameter; "
                    "give it a value among the parameters"
                )
            node: Node = self.symbols[expr]
            return node
        if expr.is_number:
            return g.const(float(expr))
        if expr.is_Add:
            return g.sum(self(term) for term in expr.args)
        if expr.is_Mul:
            return self._product(expr)
        if expr.is_Pow:
            return self._power(expr) if (pieces := _in_pieces(expr, expr.base)) is None else self(pieces)
        if isinstance(expr, sp.Piecewise):
            return self._pieces(expr.args)
        if isinstance(expr, sp.Max | sp.Min):
            return self._extreme(expr)
        if isinstance(expr, sp.atan2):
            return g.atan2(*map(self, expr.args))
        if isinstance(expr, sp.sign):
            return sign(Expression(g, self(expr.args[0]))).node
        function = SYMPY_FUNCTIONS.get(expr.func)
        if function is None:
            raise LinkwiseError(f"the function {expr.func.__name__} is not supported; use one of {KNOWN}")
        if function in DEFINED and (pieces := _in_pieces(expr, expr.args[0])) is not None:
            return self(pieces)
        return g.call(function, self._defined(function, self(expr.args[0])))

    def _product(self, expr: sp.Expr) -> Node:
        """Return numerator over denominator, so that x/y is one division and no reciprocal."""
        g, above, below = self.graph, self.graph.one, self.graph.one
        for factor in expr.args:
            if factor.is_Pow and factor.exp.is_Rational and factor.exp < 0:
                below = g.mul(below, self(factor.base**-factor.exp))
            else:
                above = g.mul(above, self(factor))
        return g.div(above, self._kept(below, 1.0))

    def _power(self, expr: sp.Expr) -> Node:
        g, base, exponent = self.graph, self(expr.base), expr.exp
        if exponent.is_Integer:
            return g.power(self._kept(base, 1.0) if exponent < 0 else base, int(exponent))
        if (2 * exponent).is_Integer and (exponent < 1 or expr.base.is_positive):
            return g.power(g.call("sqrt", self._defined("sqrt", base)), int(2 * exponent))
        return g.pow(self._kept(base, 1.0), self(exponent))

    def _extreme(self, expr: sp.Expr) -> Node:
        """Return the largest or smallest argument."""
        g, (first, *others) = self.graph, map(self, expr.args)
        for other in others:
            pair = (first, other) if isinstance(expr, sp.Max) else (other, first)
            first = g.select(g.lt(*pair), other, first)
        return first

    def _pieces(self, pieces: Sequence[tuple[sp.Expr, sp.Basic]]) -> Node:
        """Return the first expression whose condition is true; raises LinkwiseError where none may be."""
        if not pieces:
            raise LinkwiseError(
                "a Piecewise has no value where none of its conditions is true; end it by (..., True), or "
                "take linkwise.interpolated for a table"
            )
        (value, condition), *others = pieces
        return self._chosen(condition, lambda: self(value), lambda: self._pieces(others))

    def _chosen(self, condition: sp.Basic, then: Callable[[], Node], other: Callable[[], Node]) -> Node:
        """Return one of two values by a condition; what is not asked for may be undefined there."""
        g = self.graph
        match condition:
            case sp.true:
                return then()
            case sp.false:
                return other()
            case sp.Not(args=(negated,)):
                return self._chosen(negated, other, then)
            case sp.And(args=(first, *rest)):
                return self._chosen(first, lambda: self._chosen(sp.And(*rest), then, other), other)
            case sp.Or(args=(first, *rest)):
                return self._chosen(first, then, lambda: self._chosen(sp.Or(*rest), then, other))
            case sp.Eq(args=(a, b)):
                return self._chosen(sp.And(a <= b, b <= a, evaluate=False), then, other)
            case sp.Ne(args=(a, b)):
                return self._chosen(sp.And(a <= b, b <= a, evaluate=False), other, then)
            case sp.StrictLessThan() | sp.StrictGreaterThan():
                node = g.lt(self(condition.lts), self(condition.gts))
            case sp.LessThan() | sp.GreaterThan():
                node = g.le(self(condition.lts), self(condition.gts))
            case _:
                raise LinkwiseError(
                    f"the condition {condition} of a Piecewise is none of <, <=, >, >=, Eq, Ne, and, or, not"
                )
        if node in (g.one, g.zero):
            return then() if node == g.one else other()
        return g.select(node, self._under(node, True, then), self._under(node, False, other))

    def _under(self, condition: Node, holds: bool, made: Callable[[], Node]) -> Node:
        """Return a value that is asked for only where a condition, beside those around it, holds or not."""
        before = self._where
        self._where = (*before, (condition, holds))
        try:
            return made()
        finally:
            self._where = before

    def _defined(self, function: str, a: Node) -> Node:
        """Return the argument of a function that not every number has, as `_kept`."""
        return self._kept(a, DEFINED[function]) if function in DEFINED else a

    def _kept(self, a: Node, instead: float) -> Node:
        """Return a where its value is asked for, and a harmless number elsewhere.

        Both sides of a condition are evaluated, and a NaN on the other side would come through by the slopes.
        """
        g, other = self.graph, self.graph.const(instead)
        for condition, holds in reversed(self._where):
            a = g.select(condition, *((a, other) if holds else (other, a)))
        return a


def _in_pieces(expr: sp.Expr, argument: sp.Expr) -> sp.Piecewise | None:
    """Return a function whose argument is in pieces as pieces of that function; None for another.

    Max(0, x)**(3/2) has no slope of its own where x < 0: that of the root, 1/0, would meet that of Max, 0.
    """
    if (expr.is_Pow and expr.exp.is_Integer) or not argument.has(sp.Piecewise, sp.Max, sp.Min):
        return None
    found = sp.piecewise_fold(expr.rewrite((sp.Max, sp.Min), sp.Piecewise))
    return found if isinstance(found, sp.Piecewise) else None
