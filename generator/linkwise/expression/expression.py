"""Expressions with operators: nodes that know their graph, so that code reads like the formula over it."""

from linkwise.expression.expression_graph import Graph, Node


class Expression:
    """A node of a graph, with arithmetic: a · b + c is `a * b + c`, and numbers may stand on the left."""

    __slots__ = ("graph", "node")

    def __init__(self, graph: Graph, node: Node) -> None:
        self.graph = graph
        self.node = node

    def __repr__(self) -> str:
        return f"Expression({self.graph.nodes[self.node]})"

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Expression) and self.node == other.node and self.graph is other.graph

    def __hash__(self) -> int:
        return hash(self.node)

    def __neg__(self) -> "Expression":
        return Expression(self.graph, self.graph.neg(self.node))

    def __add__(self, other: "Expression") -> "Expression":
        return Expression(self.graph, self.graph.add(self.node, other.node))

    def __sub__(self, other: "Expression") -> "Expression":
        return Expression(self.graph, self.graph.sub(self.node, other.node))

    def __mul__(self, other: "Expression") -> "Expression":
        if not isinstance(other, Expression):
            return NotImplemented  # a vector multiplies itself by an expression
        return Expression(self.graph, self.graph.mul(self.node, other.node))

    def __truediv__(self, other: "Expression") -> "Expression":
        return Expression(self.graph, self.graph.div(self.node, other.node))

    def __radd__(self, number: float) -> "Expression":
        return self.number(number) + self

    def __rsub__(self, number: float) -> "Expression":
        return self.number(number) - self

    def __rmul__(self, number: float) -> "Expression":
        return self.number(number) * self

    def number(self, value: float) -> "Expression":
        """Return a number of the same graph."""
        return Expression(self.graph, self.graph.const(value))

    def call(self, function: str) -> "Expression":
        """Return function(self), one of `expression_graph.FUNCTIONS`."""
        return Expression(self.graph, self.graph.call(function, self.node))

    def where(self, condition: "Expression", other: "Expression") -> "Expression":
        """Return the expression where a condition is true, and `other` where it is not."""
        return Expression(self.graph, self.graph.select(condition.node, self.node, other.node))

    def named(self, name: str) -> "Expression":
        """Suggest the variable that holds the expression in emitted code, and return the expression."""
        self.graph.name(self.node, name)
        return self

    @property
    def value(self) -> float | None:
        """Number that the expression is; None where it depends on anything."""
        return self.graph.value(self.node)

    @property
    def is_zero(self) -> bool:
        """True if the expression is the number 0."""
        return self.node == self.graph.zero
