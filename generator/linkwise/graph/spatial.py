"""Spatial vectors: a motion (ω, v) or a force (N, f), about a common origin."""

from linkwise.graph import vector as vec
from linkwise.graph.expression import Graph, Node, Vector

Spatial = tuple[Vector, Vector]


def motion_cross(g: Graph, a: Spatial, b: Spatial) -> Spatial:
    """(ω, v) × (z, s) = (ω × z, ω × s + v × z)."""
    return vec.cross(g, a[0], b[0]), vec.add(g, vec.cross(g, a[0], b[1]), vec.cross(g, a[1], b[0]))


def force_cross(g: Graph, a: Spatial, f: Spatial) -> Spatial:
    """(z, s) ×* (N, f) = (z × N + s × f, z × f)."""
    return vec.add(g, vec.cross(g, a[0], f[0]), vec.cross(g, a[1], f[1])), vec.cross(g, a[0], f[1])


def spatial_add(g: Graph, a: Spatial, b: Spatial) -> Spatial:
    """a + b."""
    return vec.add(g, a[0], b[0]), vec.add(g, a[1], b[1])


def pair_product(g: Graph, s: Spatial, f: Spatial) -> Node:
    """z · N + s · f."""
    return g.add(vec.dot(g, s[0], f[0]), vec.dot(g, s[1], f[1]))
