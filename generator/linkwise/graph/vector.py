"""Three-vectors and 3×3 matrices whose entries are graph nodes."""

from collections.abc import Sequence

from linkwise.graph.expression import Graph, Matrix, Node, Vector


def dot(g: Graph, a: Sequence[Node], b: Sequence[Node]) -> Node:
    """a · b."""
    return g.sum(g.mul(x, y) for x, y in zip(a, b, strict=True))


def cross(g: Graph, a: Vector, b: Vector) -> Vector:
    """a × b."""
    return (
        g.sub(g.mul(a[1], b[2]), g.mul(a[2], b[1])),
        g.sub(g.mul(a[2], b[0]), g.mul(a[0], b[2])),
        g.sub(g.mul(a[0], b[1]), g.mul(a[1], b[0])),
    )


def add(g: Graph, *vectors: Vector) -> Vector:
    """Sum of vectors, from left to right."""
    x, y, z = (g.sum(parts) for parts in zip(*vectors, strict=True))
    return x, y, z


def sub(g: Graph, a: Vector, b: Vector) -> Vector:
    """a − b."""
    return g.sub(a[0], b[0]), g.sub(a[1], b[1]), g.sub(a[2], b[2])


def scale(g: Graph, factor: Node, a: Vector) -> Vector:
    """factor · a."""
    return g.mul(factor, a[0]), g.mul(factor, a[1]), g.mul(factor, a[2])


def apply(g: Graph, m: Matrix, a: Vector) -> Vector:
    """m a."""
    return dot(g, m[0], a), dot(g, m[1], a), dot(g, m[2], a)


def transpose(m: Matrix) -> Matrix:
    """Return mᵀ."""
    a, b, c = zip(*m, strict=True)
    return a, b, c


def product(g: Graph, a: Matrix, b: Matrix) -> Matrix:
    """a b."""
    columns = [apply(g, a, column) for column in transpose(b)]
    return transpose((columns[0], columns[1], columns[2]))
