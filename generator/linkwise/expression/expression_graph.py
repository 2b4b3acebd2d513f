"""A hash-consed expression graph: equal expressions are one node.

A node is an index into `Graph.nodes`; an entry is `(op, a, b)`. Operands of `add`, `sub`, `mul`, `div`,
`neg`, `atan2` and `pow` are nodes, and those of the conditions `lt` and `le`, a < b and a ≤ b, which are true
or false; a `select` holds a condition, and a pair of nodes, one where it is true and one where not. A `const`
holds its value, a `symbol` its name, a `call` its function's name and argument.
Construction folds constants, drops zeros and ones, and pulls signs outward, so that x − y and y − x, or
(−x)·y and x·y, share their work. A number stands for the decimal that it prints as: 0.6 · 0.125 folds to
0.075, not to 0.07499999999999998, and what is emitted is short wherever the robot's numbers are.
"""

import math
import operator
from collections.abc import Callable, Container, Iterable
from decimal import Context, Decimal
from typing import Any

Node = int
Entry = tuple[str, Any, Any]

DECIMAL = Context(prec=40, traps=[])
"""Context that is exact for the product of two floats as they print; infinity and NaN come out as such."""

FUNCTIONS: dict[str, Callable[[float], float]] = {
    "sin": math.sin,
    "cos": math.cos,
    "tan": math.tan,
    "asin": math.asin,
    "acos": math.acos,
    "atan": math.atan,
    "sinh": math.sinh,
    "cosh": math.cosh,
    "tanh": math.tanh,
    "exp": math.exp,
    "log": math.log,
    "sqrt": math.sqrt,
    "abs": abs,
}


ARITHMETIC = frozenset({"add", "sub", "mul", "div"})
"""Operations that count as arithmetic."""
CONDITIONS = frozenset({"lt", "le"})
"""Operations on two nodes that are true or false."""
PAIRS = ARITHMETIC | CONDITIONS | {"atan2", "pow"}
"""Operations on two nodes."""


class Graph:
    """A growing set of shared expressions; every operation returns a node."""

    def __init__(self) -> None:
        self.nodes: list[Entry] = []
        self.names: dict[Node, str] = {}
        self._index: dict[Entry, Node] = {}
        self._decimals: dict[Node, Decimal] = {}
        self.zero = self.const(0.0)
        self.one = self.const(1.0)

    def _node(self, op: str, a: Any, b: Any) -> Node:
        entry = (op, a, b)
        node = self._index.get(entry)
        if node is None:
            node = self._index[entry] = len(self.nodes)
            self.nodes.append(entry)
        return node

    def name(self, node: Node, name: str) -> Node:
        """Suggest the variable that holds `node` in emitted code; return `node`. Leaves stay unnamed."""
        if self.nodes[node][0] in ("add", "sub", "mul", "div", "call"):
            self.names.setdefault(node, name)
        return node

    def const(self, value: float) -> Node:
        """Return the node of a number; −0.0 becomes 0.0."""
        return self._decimal(Decimal(repr(float(value))))

    def _decimal(self, value: Decimal) -> Node:
        """Return the node of the float nearest to a decimal; constants fold by the decimals behind them."""
        node = self._node("const", float(value) + 0.0, None)
        self._decimals.setdefault(node, value)
        return node

    def _fold(self, operation: Callable[[Decimal, Decimal], Decimal], a: Node, b: Node) -> Node:
        """Return the node of an operation on two constants."""
        return self._decimal(operation(self._decimals[a], self._decimals[b]))

    def symbol(self, name: str) -> Node:
        """Return the node of an input."""
        return self._node("symbol", name, None)

    def value(self, node: Node) -> float | None:
        """Return the number that `node` is, or None."""
        op, a, _ = self.nodes[node]
        return a if op == "const" else None

    def neg(self, a: Node) -> Node:
        """Return −a."""
        op, x, y = self.nodes[a]
        if op == "const":
            return self._decimal(DECIMAL.minus(self._decimals[a]))
        if op == "neg":
            return int(x)
        if op == "sub" and ("sub", y, x) in self._index:
            return self._index["sub", y, x]
        return self._node("neg", a, None)

    def add(self, a: Node, b: Node) -> Node:
        """Return a + b."""
        if a == self.zero:
            return b
        if b == self.zero:
            return a
        op_a, xa, _ = self.nodes[a]
        op_b, xb, _ = self.nodes[b]
        if op_a == "const" and op_b == "const":
            return self._fold(DECIMAL.add, a, b) if xa + xb else self.zero
        if op_b == "neg":
            return self.neg(self.add(xa, xb)) if op_a == "neg" else self.sub(a, xb)
        if op_a == "neg":
            return self.sub(b, xa)
        if op_a == "const" and xa < 0.0:
            return self.sub(b, self.neg(a))
        if op_b == "const" and xb < 0.0:
            return self.sub(a, self.neg(b))
        if a == b:
            return self.mul(self.const(2.0), a)
        return self._node("add", a, b) if a < b else self._node("add", b, a)

    def sub(self, a: Node, b: Node) -> Node:
        """Return a − b."""
        if a == b:
            return self.zero
        if b == self.zero:
            return a
        if a == self.zero:
            return self.neg(b)
        op_a, xa, _ = self.nodes[a]
        op_b, xb, yb = self.nodes[b]
        if op_a == "const" and op_b == "const":
            return self._fold(DECIMAL.subtract, a, b)
        if op_b == "neg":
            return self.add(a, xb)
        if op_b == "sub" and xb == a:
            return int(yb)
        if op_a == "neg":
            return self.neg(self.add(xa, b))
        if op_b == "const" and xb < 0.0:
            return self.add(a, self.neg(b))
        swapped = self._index.get(("sub", b, a))
        if swapped is not None:
            return self.neg(swapped)
        return self._node("sub", a, b)

    def mul(self, a: Node, b: Node) -> Node:
        """Return a · b."""
        if a == self.zero or b == self.zero:
            return self.zero
        if a == self.one:
            return b
        if b == self.one:
            return a
        op_a, xa, _ = self.nodes[a]
        op_b, xb, _ = self.nodes[b]
        if op_b == "const":
            a, b, op_a, xa, op_b, xb = b, a, op_b, xb, op_a, xa
        if op_a == "const":
            if op_b == "const":
                return self._fold(DECIMAL.multiply, a, b)
            if xa < 0.0:
                return self.neg(self.mul(self.neg(a), b))
            if op_b == "mul" and self.value(xb) is not None:
                return self.mul(self._fold(DECIMAL.multiply, a, xb), self.nodes[b][2])
        if op_a == "neg":
            return self.neg(self.mul(xa, b))
        if op_b == "neg":
            return self.neg(self.mul(a, xb))
        if op_a != "const" and b < a:
            a, b = b, a
        return self._node("mul", a, b)

    def div(self, a: Node, b: Node) -> Node:
        """Return a / b; division by a number becomes a product. Raises ZeroDivisionError for the number 0."""
        divisor = self.value(b)
        if divisor == 0.0:
            raise ZeroDivisionError("an expression divides by zero")
        if divisor is not None:
            return self.mul(a, self._fold(DECIMAL.divide, self.one, b))
        if a == self.zero:
            return a
        if self.nodes[a][0] == "neg":
            return self.neg(self.div(self.nodes[a][1], b))
        return self._node("div", a, b)

    def call(self, function: str, a: Node) -> Node:
        """Return function(a), one of FUNCTIONS; sine and cosine shed the sign of `a`."""
        value = self.value(a)
        if value is not None:
            if function == "sqrt":
                return self._decimal(DECIMAL.sqrt(self._decimals[a]))
            return self.const(FUNCTIONS[function](value))
        if self.nodes[a][0] == "neg":
            if function == "cos":
                return self.call("cos", self.nodes[a][1])
            if function == "sin":
                return self.neg(self.call("sin", self.nodes[a][1]))
            if function == "abs":
                return self.call("abs", self.nodes[a][1])
        return self._node("call", function, a)

    def atan2(self, y: Node, x: Node) -> Node:
        """Return the angle of the point (x, y)."""
        known = self.value(y), self.value(x)
        if known[0] is not None and known[1] is not None:
            return self.const(math.atan2(known[0], known[1]))
        return self._node("atan2", y, x)

    def pow(self, a: Node, b: Node) -> Node:
        """Return a**b, for exponents that `power` and square roots do not have."""
        base, exponent = self.value(a), self.value(b)
        if base is not None and exponent is not None:
            return self.const(base**exponent)
        if exponent is not None and exponent.is_integer():
            return self.power(a, int(exponent))
        return self.call("sqrt", a) if exponent == 0.5 else self._node("pow", a, b)

    def lt(self, a: Node, b: Node) -> Node:
        """Return whether a < b; of numbers, 1 or 0."""
        return self._condition("lt", a, b, operator.lt)

    def le(self, a: Node, b: Node) -> Node:
        """Return whether a ≤ b; of numbers, 1 or 0."""
        return self._condition("le", a, b, operator.le)

    def _condition(self, op: str, a: Node, b: Node, holds: Callable[[float, float], bool]) -> Node:
        known = self.value(a), self.value(b)
        if known[0] is not None and known[1] is not None:
            return self.one if holds(known[0], known[1]) else self.zero
        return self._node(op, a, b)

    def select(self, condition: Node, then: Node, other: Node) -> Node:
        """Return `then` where the condition is true, and `other` where it is not."""
        if condition in (self.one, self.zero):
            return then if condition == self.one else other
        return then if then == other else self._node("select", condition, (then, other))

    def power(self, a: Node, exponent: int) -> Node:
        """Return a**exponent for a whole exponent, by repeated squaring."""
        if exponent < 0:
            return self.div(self.one, self.power(a, -exponent))
        result, square = self.one, a
        while exponent:
            if exponent & 1:
                result = self.mul(result, square)
            square = self.mul(square, square) if exponent > 1 else square
            exponent >>= 1
        return result

    def sum(self, terms: Iterable[Node]) -> Node:
        """Return the sum of `terms` from left to right."""
        total = self.zero
        for term in terms:
            total = self.add(total, term)
        return total


def operands(entry: Entry) -> tuple[Node, ...]:
    """Return the nodes that an entry is computed from."""
    op, a, b = entry
    if op in PAIRS:
        return (a, b)
    if op == "neg":
        return (a,)
    if op == "select":
        return (a, *b)
    return (b,) if op == "call" else ()


def reachable(graph: Graph, outputs: Iterable[Node], given: Container[Node] = ()) -> list[Node]:
    """Return the nodes that `outputs` need, operands before users, without what only `given` nodes need."""
    nodes = graph.nodes
    needed: set[Node] = set()
    stack = list(outputs)
    while stack:
        node = stack.pop()
        if node not in needed:
            needed.add(node)
            if node not in given:
                stack.extend(operands(nodes[node]))
    return sorted(needed)
