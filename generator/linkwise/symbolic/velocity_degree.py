"""Degree of expressions in velocities."""

from collections.abc import Collection

import sympy as sp

MOST_EXPANDED = 50
"""Largest power that is multiplied out to see whether terms cancel: a larger one may never finish."""
QUADRATIC = 2


def degree_in(expr: sp.Expr, velocities: Collection[sp.Symbol]) -> int | None:
    """Return the degree of an expression in the velocities; None where it is no polynomial in them."""
    degree = _degree(expr, frozenset(velocities), {})
    if degree is not None and (degree <= QUADRATIC or degree > MOST_EXPANDED):
        return degree
    try:  # what is multiplied out may cancel
        return int(sp.Poly(expr, *velocities, domain="EX").total_degree())
    except sp.PolynomialError:
        return degree


def _degree(
    expr: sp.Basic, velocities: frozenset[sp.Symbol], known: dict[sp.Basic, int | None]
) -> int | None:
    """Return the degree if nothing cancels; None for what is not seen to be a polynomial."""
    if expr not in known:
        known[expr] = _degree_of_parts(expr, velocities, known)
    return known[expr]


def _degree_of_parts(
    expr: sp.Basic, velocities: frozenset[sp.Symbol], known: dict[sp.Basic, int | None]
) -> int | None:
    if not expr.args:
        return int(expr in velocities)
    parts = [value for value, _ in expr.args] if isinstance(expr, sp.Piecewise) else expr.args
    degrees: list[int] = []
    for part in parts:
        degree = _degree(part, velocities, known)
        if degree is None:
            return None
        degrees.append(degree)
    if isinstance(expr, sp.Piecewise):
        fixed = all(_degree(condition, velocities, known) == 0 for _, condition in expr.args)
        return max(degrees) if fixed else None
    if isinstance(expr, sp.Add):
        return max(degrees)
    if isinstance(expr, sp.Mul):
        return sum(degrees)
    if isinstance(expr, sp.Pow) and expr.exp.is_Integer and expr.exp >= 0:
        return degrees[0] * int(expr.exp)
    return None if any(degrees) else 0
