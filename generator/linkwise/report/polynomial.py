"""The exact polynomial behind a sequence of counts, by Newton's forward differences."""

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import pairwise
from math import comb, factorial

CHECKED_AT_LEAST = 2
"""Counts beyond the fitted ones without which no polynomial is claimed."""


@dataclass(frozen=True)
class CountPolynomial:
    """count(n) = Σ_d coefficients[d] · C(n − 1, d) for n = 1, 2, …

    fitted: it follows from the counts at 1..fitted      checked: it also gives those up to here
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
        return Fraction(self.coefficients[-1], factorial(self.degree))

    def __call__(self, n: int) -> int:
        """count(n)."""
        return sum(c * comb(n - 1, d) for d, c in enumerate(self.coefficients))

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

    Degree d is fixed by d + 1 counts; every further one, CHECKED_AT_LEAST or more, must agree.
    """
    differences, row = [], list(counts)
    while row:
        differences.append(row[0])
        row = [b - a for a, b in pairwise(row)]
        if len(row) >= CHECKED_AT_LEAST and not any(row):
            return CountPolynomial(tuple(differences), len(differences), len(counts))
    return None
