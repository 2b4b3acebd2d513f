"""Effect sizes: how far two levels are apart, in the column's unit and in standard deviations.

With paired subjects the standardised difference is d_z, the mean of subjects' differences over their standard
deviation; else d, the difference of means over the pooled standard deviation. Both are told as Hedges' g:

    g = J d       J = Γ(ν/2) / (√(ν/2) Γ((ν-1)/2))       ν degrees of freedom, n - 1 or n1 + n2 - 2

The interval of g is by the noncentral t distribution, whose noncentrality is d √n, or d √(n1 n2 / (n1 + n2)),
and takes variances as equal; that of the difference itself is of the t test, Welch's where subjects are
others.

- Hedges, L. V. Distribution theory for Glass's estimator of effect size. J. Educ. Stat. 6 (1981) 107.
- Cumming, G., Finch, S. A primer on confidence intervals. Educ. Psychol. Meas. 61 (2001) 532.
"""

import math
from dataclasses import dataclass

from linkwise.arrays import Array
from linkwise.extras import extra

KINDS = {True: "Hedges' g of paired differences (d_z)", False: "Hedges' g, pooled standard deviation (d)"}
"""Names of the standardised difference, by whether subjects are paired."""


@dataclass(frozen=True)
class EffectSize:
    """Difference of two levels, the first less the second, and Hedges' g, with their intervals."""

    difference: float
    difference_low: float
    difference_high: float
    effect: float
    effect_low: float
    effect_high: float

    @classmethod
    def of(cls, first: Array, second: Array, is_paired: bool, confidence: float) -> "EffectSize":
        """Return the effect between values (subjects,), in one order where they are paired."""
        stats = extra("scipy.stats")
        if is_paired:
            found = stats.ttest_rel(first, second)
            apart = first - second
            deviation, freedom, weight = float(apart.std(ddof=1)), len(apart) - 1, math.sqrt(len(apart))
        else:
            found = stats.ttest_ind(first, second, equal_var=False)
            counts = len(first), len(second)
            freedom, weight = sum(counts) - 2, math.sqrt(math.prod(counts) / sum(counts))
            squares = sum(
                (count - 1) * float(side.var(ddof=1))
                for count, side in zip(counts, (first, second), strict=True)
            )
            deviation = math.sqrt(squares / freedom)
        difference = float(first.mean() - second.mean())
        low, high = map(float, found.confidence_interval(confidence))
        g = tuple(
            _unbiased(freedom) * one
            for one in _standardised(difference / deviation, weight, freedom, confidence)
        )
        return cls(difference, low, high, *g)


def _standardised(d: float, weight: float, freedom: int, confidence: float) -> tuple[float, float, float]:
    """Return d and the ends of its interval: those noncentralities that put d at the tails."""
    inverse, tail = extra("scipy.special").nctdtrinc, (1 - confidence) / 2
    low, high = (float(inverse(freedom, share, d * weight)) / weight for share in (1 - tail, tail))
    return d, low, high


def _unbiased(freedom: int) -> float:
    """Return Hedges' J."""
    return math.exp(math.lgamma(freedom / 2) - math.lgamma((freedom - 1) / 2)) / math.sqrt(freedom / 2)
