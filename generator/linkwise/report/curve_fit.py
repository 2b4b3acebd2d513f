"""Curves through counted points: the paper's exponential, fitted, and an exact polynomial."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import pairwise

from linkwise.extras import extra

PAPER_A, PAPER_RATE = 0.95, 0.44
"""A and λ that the paper reports for n = 1..10."""
CHECKED_AT_LEAST = 2
"""Least number of counts beyond the fitted ones for which a polynomial is claimed."""


@dataclass(frozen=True)
class Saturation:
    """y(n) = a (1 − exp(−rate n)), and its residuals, point minus curve, in the points' order."""

    a: float
    rate: float
    residuals: tuple[float, ...]

    @property
    def rmse(self) -> float:
        """Root of the mean squared residual."""
        return math.sqrt(sum(r * r for r in self.residuals) / len(self.residuals))

    @property
    def is_share(self) -> bool:
        """True if the limit is a share, at most 1, as a saving must be."""
        return self.a <= 1.0

    @property
    def largest(self) -> float:
        """Size of the largest residual."""
        return max(map(abs, self.residuals))

    def __call__(self, n: float) -> float:
        """Return y(n)."""
        return _saturating(self.a, self.rate, n)


def held_against(a: float, rate: float, dof: Sequence[int], y: Sequence[float]) -> Saturation:
    """Return the curve of given A and λ with its residuals at the points."""
    return Saturation(a, rate, tuple(v - _saturating(a, rate, n) for n, v in zip(dof, y, strict=True)))


def fit(dof: Sequence[int], y: Sequence[float]) -> Saturation | None:
    """Return the least-squares fit of A and λ; None for fewer than three points, which it would meet."""
    if len(dof) < 3:
        return None
    solution = extra("scipy.optimize").least_squares(
        lambda p: [_saturating(p[0], p[1], n) - v for n, v in zip(dof, y, strict=True)],
        (PAPER_A, PAPER_RATE),
        xtol=1e-14,
        ftol=1e-14,
        gtol=1e-14,
    )
    a, rate = (float(v) for v in solution.x)
    return held_against(a, rate, dof, y)


def _saturating(a: float, rate: float, n: float) -> float:
    return a * (1.0 - math.exp(-rate * n))


@dataclass(frozen=True)
class CountPolynomial:
    """count(n) = Σ_d coefficients[d] · C(n − 1, d) for n = 1, 2, …

    fitted: the counts at 1..fitted determine it      checked: it also gives the counts up to here
    """

    coefficients: tuple[int, ...]
    fitted: int
    checked: int

    @property
    def degree(self) -> int:
        """Degree in n."""
        return len(self.coefficients) - 1

    @property
    def leading(self) -> Fraction:
        """Coefficient of the highest power of n."""
        return Fraction(self.coefficients[-1], math.factorial(self.degree))

    def __call__(self, n: int) -> int:
        """Return count(n)."""
        return sum(c * math.comb(n - 1, d) for d, c in enumerate(self.coefficients))

    def __str__(self) -> str:
        text = ""
        for d, c in enumerate(self.coefficients):
            if c:
                sign = " − " if c < 0 else " + "
                text += sign + _term(abs(c), d)
        return text.removeprefix(" + ").strip() or "0"


def _term(c: int, d: int) -> str:
    basis = "(n−1)" if d == 1 else f"C(n−1,{d})"
    return str(c) if d == 0 else basis if c == 1 else f"{c}·{basis}"


def count_polynomial(counts: Sequence[int]) -> CountPolynomial | None:
    """Return the polynomial of the lowest degree through counts(1), counts(2), …, or None.

    By Newton's forward differences: degree d is fixed by d + 1 counts; every further one,
    CHECKED_AT_LEAST or more, must agree.
    """
    differences, row = [], list(counts)
    while row:
        differences.append(row[0])
        row = [b - a for a, b in pairwise(row)]
        if len(row) >= CHECKED_AT_LEAST and not any(row):
            return CountPolynomial(tuple(differences), len(differences), len(counts))
    return None
