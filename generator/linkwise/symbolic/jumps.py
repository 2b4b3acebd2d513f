"""Search for places where an expression in pieces jumps: an energy has no derivative there.

Along random lines through the space of its symbols, the places are found where pieces change, and the values
on their two sides are compared.
"""

import random
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import sympy as sp

LINES = 6
"""Random lines for each switching expression."""
STEPS = 60
"""Halvings of the interval in which it passes zero."""
NEAR = 1e-8
"""Distance of the two sides, relative to 1 + |x|."""
JUMP = 1e-4
"""Least difference that is a jump, relative to the size of the values: slopes up to 1e3 are none."""


def jump(expr: sp.Expr) -> sp.Expr | None:
    """Return an expression at whose zero the given one jumps; None where none was found."""
    switches = sorted(set(_switches(expr)), key=str)
    if not switches:
        return None
    symbols = sorted(expr.free_symbols, key=str)
    value = sp.lambdify(symbols, expr, modules="mpmath")
    return next(
        (s for s in switches if _jumps(value, sp.lambdify(symbols, s, modules="mpmath"), symbols)), None
    )


def _switches(expr: sp.Expr) -> Iterator[sp.Expr]:
    """Yield expressions at whose zeros pieces change."""
    for part in expr.atoms(sp.Piecewise, sp.sign, sp.Heaviside):
        if isinstance(part, sp.Piecewise):
            for relation in (
                r for _, condition in part.args for r in condition.atoms(sp.core.relational.Relational)
            ):
                if relation.free_symbols:
                    yield relation.lhs - relation.rhs
        elif part.args[0].free_symbols:
            yield part.args[0]


def _jumps(value: Callable[..., Any], switch: Callable[..., Any], symbols: Sequence[sp.Symbol]) -> bool:
    chosen = random.Random(0)
    for _ in range(LINES * len(symbols)):
        start, end = ([chosen.uniform(-3.0, 3.0) for _ in symbols] for _ in range(2))
        found = _zero(switch, start, end)
        if found is None:
            continue
        try:
            below, above = (complex(value(*_between(start, end, found + side))) for side in (-NEAR, NEAR))
        except (ArithmeticError, ValueError, TypeError):
            continue
        if abs(above - below) > JUMP * (1.0 + abs(above) + abs(below)):
            return True
    return False


def _zero(switch: Callable[..., Any], start: Sequence[float], end: Sequence[float]) -> float | None:
    """Return the place between 0 and 1 at which a switching expression passes zero; None without one."""
    try:
        low, high = 0.0, 1.0
        below = float(switch(*start)) < 0.0
        if below == (float(switch(*end)) < 0.0):
            return None
        for _ in range(STEPS):
            middle = (low + high) / 2.0
            if (float(switch(*_between(start, end, middle))) < 0.0) == below:
                low = middle
            else:
                high = middle
    except (ArithmeticError, ValueError, TypeError):
        return None
    return (low + high) / 2.0


def _between(start: Sequence[float], end: Sequence[float], at: float) -> list[float]:
    return [a + at * (b - a) for a, b in zip(start, end, strict=True)]
