"""Variances of what follows from uncertain things, by divided differences along independent directions.

With independent standard normals e_r, values s at x_0 + sum_r e_r d_r have, with differences of width h,

    var(s) = sum_r (s_r+ - s_r-)^2 / (4 h^2) + (h^2 - 1) / (4 h^4) (s_r+ + s_r- - 2 s_0)^2

exact for values that are quadratic in every direction by itself, with h^2 = 3 as is right for normals
(M. Norgaard, N. K. Poulsen, O. Ravn, New developments in state estimation for nonlinear systems,
Automatica 36, 2000). Of a linear direction one side tells all.
"""

from collections.abc import Callable, Iterable, Sequence
from math import sqrt
from typing import Any, NamedTuple

Values = Callable[[float], Sequence[Any]]
"""Function that returns arrays of values at so many standard deviations along a direction."""
WIDTH = sqrt(3.0)
"""h, in standard deviations."""


class Direction(NamedTuple):
    """Direction of one standard deviation, along which values are known."""

    values: Values
    width: float = WIDTH
    """h; with 1 differences are central, and what is quadratic counts as linear."""
    is_linear: bool = False
    """True if no value is more than linear along it."""


def variances(
    here: Sequence[Any],
    directions: Iterable[Direction],
    note: Callable[[Sequence[Any]], None] | None = None,
) -> list[Any]:
    """Return the variances of arrays of values by all directions.

    here: the values at no deviation; note: is told the changes along each direction
    """
    found = [abs(0.0 * one) for one in here]
    for values, width, is_linear in directions:
        ahead, steps = values(width), []
        behind = here if is_linear else values(-width)
        for number, (a, b, one) in enumerate(zip(ahead, behind, here, strict=True)):
            # In place, as memory for what lies between costs more than the numbers.
            step = a - b
            step *= 1.0 / width if is_linear else 0.5 / width
            found[number] += step * step
            steps.append(step)
            if not is_linear and width != 1.0:
                bend = a + b
                bend -= one
                bend -= one
                bend *= sqrt(width**2 - 1.0) / (2.0 * width**2)
                found[number] += bend * bend
        if note is not None:
            note(steps)
    return found
