"""Three-vectors and 3×3 matrices whose entries are graph nodes."""

from collections.abc import Callable, Sequence

from linkwise.expression.expression_graph import Graph, Matrix, Node, Vector


def dot(g: Graph, a: Sequence[Node], b: Sequence[Node]) -> Node:
    """Return a · b."""
    return g.sum(g.mul(x, y) for x, y in zip(a, b, strict=True))


def cross(g: Graph, a: Vector, b: Vector) -> Vector:
    """Return a × b."""
    return (
        g.sub(g.mul(a[1], b[2]), g.mul(a[2], b[1])),
        g.sub(g.mul(a[2], b[0]), g.mul(a[0], b[2])),
        g.sub(g.mul(a[0], b[1]), g.mul(a[1], b[0])),
    )


def add(g: Graph, *vectors: Vector) -> Vector:
    """Return the sum of vectors, from left to right."""
    x, y, z = (g.sum(parts) for parts in zip(*vectors, strict=True))
    return x, y, z


def sub(g: Graph, a: Vector, b: Vector) -> Vector:
    """Return a − b."""
    return g.sub(a[0], b[0]), g.sub(a[1], b[1]), g.sub(a[2], b[2])


def minus(g: Graph, a: Vector) -> Vector:
    """Return −a."""
    return g.neg(a[0]), g.neg(a[1]), g.neg(a[2])


def scale(g: Graph, factor: Node, a: Vector) -> Vector:
    """Return factor · a."""
    return g.mul(factor, a[0]), g.mul(factor, a[1]), g.mul(factor, a[2])


def apply(g: Graph, m: Matrix, a: Vector) -> Vector:
    """Return m a."""
    return dot(g, m[0], a), dot(g, m[1], a), dot(g, m[2], a)


def transpose(m: Matrix) -> Matrix:
    """Return mᵀ."""
    a, b, c = zip(*m, strict=True)
    return a, b, c


def product(g: Graph, a: Matrix, b: Matrix) -> Matrix:
    """Return a b."""
    columns = [apply(g, a, column) for column in transpose(b)]
    return transpose((columns[0], columns[1], columns[2]))


def zero(g: Graph) -> Vector:
    """Return the zero vector."""
    return g.zero, g.zero, g.zero


def identity(g: Graph) -> Matrix:
    """Return the unit matrix."""
    return ((g.one, g.zero, g.zero), (g.zero, g.one, g.zero), (g.zero, g.zero, g.one))


def symmetric(entry: Callable[[int, int], Node]) -> Matrix:
    """Return the matrix with entry(i, k), i ≤ k, on both sides of its diagonal."""
    e = {(i, k): entry(i, k) for i in range(3) for k in range(i, 3)}
    return (
        (e[0, 0], e[0, 1], e[0, 2]),
        (e[0, 1], e[1, 1], e[1, 2]),
        (e[0, 2], e[1, 2], e[2, 2]),
    )


def rotated(g: Graph, rotation: Matrix, m: Matrix) -> Matrix:
    """Return rotation · m · rotationᵀ of a symmetric m."""
    half = product(g, rotation, m)
    return symmetric(lambda i, k: dot(g, half[i], rotation[k]))


def named(g: Graph, name: str, a: Vector) -> Vector:
    """Suggest name_x, name_y, name_z as the variables of `a`, and return it."""
    for axis, node in zip("xyz", a, strict=True):
        g.name(node, f"{name}_{axis}")
    return a
