"""Search for places where an expression in pieces jumps: an energy has no derivative there.

Along random lines through the space of its symbols, the nearest place is found where pieces change, and the
values on its two sides are compared at two distances: what a slope makes of them shrinks, a jump stays.
"""

import random
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import mpmath
import sympy as sp

LINES = 6
"""Random lines for each switching expression and symbol."""
FARTHEST = 1e5
"""Distance up to which a line is followed."""
DIGITS = 50
STEPS = 170
"""Halvings of the interval in which it passes zero."""
FAR, NEAR = 1e-9, 1e-18
"""Distances of the two sides from the place."""
JUMP = 1e-12
"""Least difference that is a jump, relative to the size of the values: less is rounding of literals."""
SHRUNK = 0.5
"""Largest part of the farther difference that the nearer one is, where there is no jump."""


def jump(expr: sp.Expr) -> sp.Expr | None:
    """Return an expression at whose zero the given one jumps; None where none was found."""
    switches = sorted(set(_switches(expr)), key=str)
    if not switches:
        return None
    symbols = sorted(expr.free_symbols, key=str)
    value = sp.lambdify(symbols, expr, modules="mpmath")
    with mpmath.workdps(DIGITS):
        return next(
            (s for s in switches if _jumps(value, sp.lambdify(symbols, s, modules="mpmath"), len(symbols))),
            None,
        )


def _switches(expr: sp.Expr) -> Iterator[sp.Expr]:
    """Yield expressions at whose zeros pieces change."""
    for part in expr.atoms(sp.Piecewise, sp.sign, sp.Heaviside, sp.atan2):
        if isinstance(part, sp.Piecewise):
            for relation in (
                r for _, condition in part.args for r in condition.atoms(sp.core.relational.Relational)
            ):
                if relation.free_symbols:
                    yield relation.lhs - relation.rhs
        elif part.args[0].free_symbols:
            yield part.args[0]


def _jumps(value: Callable[..., Any], switch: Callable[..., Any], count: int) -> bool:
    chosen = random.Random(0)
    for _ in range(LINES * count):
        start, along = ([mpmath.mpf(chosen.uniform(-3.0, 3.0)) for _ in range(count)] for _ in range(2))
        try:
            if _jumps_on(_OnLine(value, start, along), _OnLine(switch, start, along)):
                return True
        except (ArithmeticError, ValueError, TypeError):
            continue
    return False


class _OnLine:
    """A function along a line through the space of its arguments."""

    def __init__(self, function: Callable[..., Any], start: Sequence[Any], along: Sequence[Any]) -> None:
        self._function, self._start, self._along = function, start, along

    def __call__(self, at: Any) -> Any:
        return self._function(*(a + at * b for a, b in zip(self._start, self._along, strict=True)))


def _jumps_on(value: _OnLine, switch: _OnLine) -> bool:
    place = _zero(switch)
    if place is None:
        return False
    far, near = ([value(place + side) for side in (-distance, distance)] for distance in (FAR, NEAR))
    apart, rest = abs(far[1] - far[0]), abs(near[1] - near[0])
    return bool(rest > JUMP * (abs(near[0]) + abs(near[1])) and rest > SHRUNK * apart)


def _zero(switch: _OnLine) -> Any:
    """Return the place next to 0 on a line at which a switching expression passes zero; None without one."""
    low, high = mpmath.mpf(0), mpmath.mpf("0.125")
    below = switch(low) < 0
    while (switch(high) < 0) == below:
        low, high = high, high * 1.5
        if high > FARTHEST:
            return None
    for _ in range(STEPS):
        middle = (low + high) / 2
        if (switch(middle) < 0) == below:
            low = middle
        else:
            high = middle
    return (low + high) / 2
