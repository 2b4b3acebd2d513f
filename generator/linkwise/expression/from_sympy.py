"""Translation from SymPy to the expression graph; SymPy goes no further than here."""

from collections.abc import Iterable, Mapping

import sympy as sp

from linkwise.errors import LinkwiseError
from linkwise.expression.expression_graph import FUNCTIONS, Graph, Node
from linkwise.robot.robot import Scalar
from linkwise.symbolic.link_energy import Definition

SYMPY_FUNCTIONS: dict[type, str] = {getattr(sp, name): name for name in FUNCTIONS if name != "sqrt"}


class Lowering:
    """Translator of expressions into one graph, which remembers what each symbol stands for."""

    def __init__(self, graph: Graph, symbols: Mapping[sp.Symbol, Node]) -> None:
        self.graph = graph
        self.symbols: dict[sp.Symbol, Node] = dict(symbols)
        self._done: dict[sp.Expr, Node] = {}

    def define(self, definitions: Iterable[Definition]) -> None:
        """Lower named steps in order; later expressions may use their symbols."""
        for symbol, expr in definitions:
            self.symbols[symbol] = self.graph.name(self(expr), symbol.name)

    def __call__(self, expr: Scalar) -> Node:
        """Return the node of `expr`; raises LinkwiseError for a symbol or function without meaning here."""
        if isinstance(expr, (int, float)):
            return self.graph.const(float(expr))
        node = self._done.get(expr)
        if node is None:
            node = self._done[expr] = self._lower(expr)
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
            return self._power(expr)
        function = SYMPY_FUNCTIONS.get(expr.func)
        if function is None:
            raise LinkwiseError(
                f"the function {expr.func.__name__} is not supported; use one of {', '.join(FUNCTIONS)}"
            )
        return g.call(function, self(expr.args[0]))

    def _product(self, expr: sp.Expr) -> Node:
        """Return numerator over denominator, so that x/y is one division and no reciprocal."""
        g, above, below = self.graph, self.graph.one, self.graph.one
        for factor in expr.args:
            if factor.is_Pow and factor.exp.is_Rational and factor.exp < 0:
                below = g.mul(below, self(factor.base**-factor.exp))
            else:
                above = g.mul(above, self(factor))
        return g.div(above, below)

    def _power(self, expr: sp.Expr) -> Node:
        g, base, exponent = self.graph, self(expr.base), expr.exp
        if exponent.is_Integer:
            return g.power(base, int(exponent))
        if (2 * exponent).is_Integer:
            return g.power(g.call("sqrt", base), int(2 * exponent))
        return g.call("exp", g.mul(self(exponent), g.call("log", base)))
