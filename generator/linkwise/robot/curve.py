"""Functions of one coordinate in pieces, each a polynomial: how a joint moves that follows a curve."""

import math
from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.polynomial import polynomial

Polynomial = tuple[float, ...]
"""Coefficients of powers 0, 1, 2, …"""


@dataclass(frozen=True)
class Curve:
    """Polynomials in x − start, each from its `start` to the next one's; the first holds before it too.

    The curve's values are in rad or m, x in those of the coordinate that it follows.
    """

    starts: tuple[float, ...]
    """Ascending; the first two may be the same."""
    pieces: tuple[Polynomial, ...]

    def __call__(self, x: float, derivative: int = 0) -> float:
        """Value at x, or that of a derivative."""
        at = bisect_right(self.starts, x, lo=1) - 1
        value = 0.0
        for coefficient in reversed(_differentiated(self.pieces[at], derivative)):
            value = value * (x - self.starts[at]) + coefficient
        return value

    @property
    def line(self) -> tuple[float, float] | None:
        """Value at 0 and slope of a curve that is one line; None of another."""
        if len(self.pieces) > 1 or any(self.pieces[0][2:]):
            return None
        return self(0.0), self(0.0, 1)

    @classmethod
    def straight(cls, at_zero: float, slope: float = 0.0) -> "Curve":
        """One that is a line, or the same everywhere."""
        return cls((0.0,), ((at_zero, slope) if slope else (at_zero,),))

    def scaled(self, factor: float) -> "Curve":
        """The curve times a number."""
        return Curve(self.starts, tuple(tuple(factor * c for c in piece) for piece in self.pieces))

    def after(self, inner: "Curve") -> "Curve":
        """The curve of what another curve gives: self(inner(x))."""
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
        """Where between two places a polynomial in x − start meets the end of one of this curve's pieces."""
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
    """Coefficients of outer(inner), by Horner's rule."""
    value: np.ndarray[tuple[int], np.dtype[np.floating[Any]]] = np.zeros(1)
    for coefficient in reversed(outer):
        value = polynomial.polyadd(polynomial.polymul(value, inner), (coefficient,))
    return tuple(map(float, value))


def _inside(low: float, high: float) -> float:
    """A place between two ends, each of which may be infinite."""
    if math.isinf(low):
        return 0.0 if math.isinf(high) else high - 1.0
    return low + 1.0 if math.isinf(high) else 0.5 * (low + high)
