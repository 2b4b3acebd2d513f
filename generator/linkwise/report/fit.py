"""The paper's approximation y = A (1 − exp(−λ n)), fitted to counted points."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from linkwise.report.extras import report_extra

PAPER_A, PAPER_RATE = 0.95, 0.44
"""What the paper reports for n = 1..10."""


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
    def largest(self) -> float:
        """Size of the largest residual."""
        return max(map(abs, self.residuals))

    def __call__(self, n: float) -> float:
        """y(n)."""
        return _curve(self.a, self.rate, n)


def held_against(a: float, rate: float, dof: Sequence[int], y: Sequence[float]) -> Saturation:
    """Return the curve of given A and λ with its residuals at the points."""
    return Saturation(a, rate, tuple(v - _curve(a, rate, n) for n, v in zip(dof, y, strict=True)))


def fit(dof: Sequence[int], y: Sequence[float]) -> Saturation | None:
    """Least-squares fit of A and λ; None for fewer than three points, which it would meet."""
    if len(dof) < 3:
        return None
    solution = report_extra("scipy.optimize").least_squares(
        lambda p: [_curve(p[0], p[1], n) - v for n, v in zip(dof, y, strict=True)],
        (PAPER_A, PAPER_RATE),
        xtol=1e-14,
        ftol=1e-14,
        gtol=1e-14,
    )
    a, rate = (float(v) for v in solution.x)
    return held_against(a, rate, dof, y)


def _curve(a: float, rate: float, n: float) -> float:
    return a * (1.0 - math.exp(-rate * n))
