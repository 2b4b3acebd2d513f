"""Three-vectors and 3×3 matrices of expressions, with operators.

Their operations go over the components in one order, from which the order of emitted statements follows.
"""

from collections.abc import Callable, Iterator
from typing import overload

from linkwise.expression.expression import Expression
from linkwise.expression.expression_graph import Graph, Node


class Vector:
    """A vector; its components are nodes of `graph`, and expressions by index."""

    __slots__ = ("graph", "x", "y", "z")

    def __init__(self, graph: Graph, x: Node, y: Node, z: Node) -> None:
        self.graph = graph
        self.x = x
        self.y = y
        self.z = z

    @staticmethod
    def zero(graph: Graph) -> "Vector":
        """Return the zero vector."""
        return Vector(graph, graph.zero, graph.zero, graph.zero)

    @property
    def nodes(self) -> tuple[Node, Node, Node]:
        """Nodes of the components."""
        return self.x, self.y, self.z

    def __getitem__(self, index: int) -> Expression:
        return Expression(self.graph, self.nodes[index])

    def __neg__(self) -> "Vector":
        g = self.graph
        return Vector(g, g.neg(self.x), g.neg(self.y), g.neg(self.z))

    def __add__(self, other: "Vector") -> "Vector":
        g = self.graph
        return Vector(g, g.add(self.x, other.x), g.add(self.y, other.y), g.add(self.z, other.z))

    def __sub__(self, other: "Vector") -> "Vector":
        g = self.graph
        return Vector(g, g.sub(self.x, other.x), g.sub(self.y, other.y), g.sub(self.z, other.z))

    def __rmul__(self, factor: Expression | float) -> "Vector":
        g = self.graph
        node = factor.node if isinstance(factor, Expression) else g.const(factor)
        return Vector(g, g.mul(node, self.x), g.mul(node, self.y), g.mul(node, self.z))

    def dot(self, other: "Vector") -> Expression:
        """Return self · other."""
        return Expression(self.graph, _dot(self.graph, self, other))

    def cross(self, other: "Vector") -> "Vector":
        """Return self × other."""
        g, sub, mul = self.graph, self.graph.sub, self.graph.mul
        return Vector(
            g,
            sub(mul(self.y, other.z), mul(self.z, other.y)),
            sub(mul(self.z, other.x), mul(self.x, other.z)),
            sub(mul(self.x, other.y), mul(self.y, other.x)),
        )

    def named(self, name: str) -> "Vector":
        """Suggest name_x, name_y and name_z as variables of emitted code, and return the vector."""
        for axis, node in zip("xyz", self.nodes, strict=True):
            self.graph.name(node, f"{name}_{axis}")
        return self


class Matrix:
    """A matrix, by its rows."""

    __slots__ = ("rows",)

    def __init__(self, a: Vector, b: Vector, c: Vector) -> None:
        self.rows = a, b, c

    @staticmethod
    def identity(graph: Graph) -> "Matrix":
        """Return the unit matrix."""
        one, zero = graph.one, graph.zero
        return Matrix(
            Vector(graph, one, zero, zero), Vector(graph, zero, one, zero), Vector(graph, zero, zero, one)
        )

    @staticmethod
    def of(entry: Callable[[int, int], Expression]) -> "Matrix":
        """Return the matrix with entry(i, k) in row i and column k."""
        return _matrix({(i, k): entry(i, k) for i in range(3) for k in range(3)})

    @staticmethod
    def symmetric(entry: Callable[[int, int], Expression]) -> "Matrix":
        """Return the matrix with entry(i, k), i ≤ k, on both sides of its diagonal."""
        upper = {(i, k): entry(i, k) for i in range(3) for k in range(i, 3)}
        return _matrix(upper | {(k, i): value for (i, k), value in upper.items()})

    def __getitem__(self, index: int) -> Vector:
        return self.rows[index]

    def __iter__(self) -> Iterator[Vector]:
        return iter(self.rows)

    @property
    def T(self) -> "Matrix":
        """Transpose."""
        g, (a, b, c) = self.rows[0].graph, self.rows
        return Matrix(Vector(g, a.x, b.x, c.x), Vector(g, a.y, b.y, c.y), Vector(g, a.z, b.z, c.z))

    @overload
    def __matmul__(self, other: Vector) -> Vector: ...
    @overload
    def __matmul__(self, other: "Matrix") -> "Matrix": ...
    def __matmul__(self, other: "Vector | Matrix") -> "Vector | Matrix":
        if isinstance(other, Matrix):
            a, b, c = (self @ column for column in other.T)
            return Matrix(a, b, c).T
        g, (a, b, c) = other.graph, self.rows
        return Vector(g, _dot(g, a, other), _dot(g, b, other), _dot(g, c, other))

    def rotated(self, rotation: "Matrix") -> "Matrix":
        """Return rotation · self · rotationᵀ of a symmetric matrix."""
        half = rotation @ self
        return Matrix.symmetric(lambda i, k: half[i].dot(rotation[k]))


def sum_of(first: Vector, *others: Vector) -> Vector:
    """Return a sum of vectors, component after component, each from left to right."""
    g, (x, y, z) = first.graph, first.nodes
    for other in others:
        x = g.add(x, other.x)
    for other in others:
        y = g.add(y, other.y)
    for other in others:
        z = g.add(z, other.z)
    return Vector(g, x, y, z)


def _dot(g: Graph, a: Vector, b: Vector) -> Node:
    return g.add(g.add(g.mul(a.x, b.x), g.mul(a.y, b.y)), g.mul(a.z, b.z))


def _matrix(e: dict[tuple[int, int], Expression]) -> Matrix:
    a, b, c = (Vector(e[i, 0].graph, e[i, 0].node, e[i, 1].node, e[i, 2].node) for i in range(3))
    return Matrix(a, b, c)
