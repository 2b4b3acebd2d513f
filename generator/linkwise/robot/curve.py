"""Piecewise polynomials of one coordinate, by which a joint moves that follows a curve."""

import math
from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from linkwise_runtime.rule.joint_tree import TreeCurve
from numpy.polynomial import polynomial

Polynomial = tuple[float, ...]
"""Coefficients of powers 0, 1, 2, …"""


@dataclass(frozen=True)
class Curve(TreeCurve):
    """Polynomials in x − start, each from its `start` to the next one's; the first holds before it too.

    The curve's values are in rad or m; x is in the unit of the coordinate that it follows.
    """

    def __call__(self, x: float, derivative: int = 0) -> float:
        """Return the value at x, or the value of a derivative of the given order."""
        at = bisect_right(self.starts, x, lo=1) - 1
        value = 0.0
        for coefficient in reversed(_differentiated(self.pieces[at], derivative)):
            value = value * (x - self.starts[at]) + coefficient
        return value

    @property
    def line(self) -> tuple[float, float] | None:
        """Value at 0 and slope of a curve that is one line; None for any other curve."""
        if len(self.pieces) > 1 or any(self.pieces[0][2:]):
            return None
        return self(0.0), self(0.0, 1)

    @classmethod
    def straight(cls, at_zero: float, slope: float = 0.0) -> "Curve":
        """Return a curve that is a straight line, or constant."""
        return cls((0.0,), ((at_zero, slope) if slope else (at_zero,),))

    def scaled(self, factor: float) -> "Curve":
        """Return the curve times a number."""
        return Curve(self.starts, tuple(tuple(factor * c for c in piece) for piece in self.pieces))

    def after(self, inner: "Curve") -> "Curve":
        """Return the curve of another curve's values: self(inner(x))."""
        starts, pieces = list[float](), list[Polynomial]()
        ends = (-math.inf, *inner.starts[1:], math.inf)
        for (low, high), start, piece in zip(pairwise(ends), inner.starts, inner.pieces, strict=True):
            for a, b in pairwise((low, *self._crossings(start, piece, low, high), high)):
                centre = next((end for end in (a, b) if math.isfinite(end)), start)
                shifted = _composed(piece, (centre - start, 1.0))
                between = polynomial.polyval(_inside(a, b) - centre, shifted)
                at = bisect_right(self.starts, between, lo=1) - 1
                starts.append(centre)
                pieces.append(_composed(self.pieces[at], (shifted[0] - self.starts[at], *shifted[1:])))
        return Curve(tuple(starts), tuple(pieces))

    def _crossings(self, start: float, piece: Polynomial, low: float, high: float) -> list[float]:
        """Return the places between `low` and `high` where `piece` meets an end of this curve's pieces.

        `piece` is a polynomial in x − start.
        """
        found = set[float]()
        for end in self.starts[1:]:
            roots = polynomial.polyroots(polynomial.polytrim((piece[0] - end, *piece[1:])))
            found |= {start + float(root.real) for root in roots if abs(root.imag) <= 1e-9 * abs(root)}
        return sorted(x for x in found if low < x < high)


def _differentiated(coefficients: Polynomial, times: int) -> Polynomial:
    for _ in range(times):
        coefficients = tuple(power * c for power, c in enumerate(coefficients))[1:]
    return coefficients


def _composed(outer: Sequence[float], inner: Polynomial) -> Polynomial:
    """Return the coefficients of outer(inner), by Horner's rule."""
    value: np.ndarray[tuple[int], np.dtype[np.floating[Any]]] = np.zeros(1)
    for coefficient in reversed(outer):
        value = polynomial.polyadd(polynomial.polymul(value, inner), (coefficient,))
    return tuple(map(float, value))


def _inside(low: float, high: float) -> float:
    """Return a place between two ends, each of which may be infinite."""
    if math.isinf(low):
        return 0.0 if math.isinf(high) else high - 1.0
    return low + 1.0 if math.isinf(high) else 0.5 * (low + high)
