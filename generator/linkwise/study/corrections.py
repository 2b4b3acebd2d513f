"""Corrections of p for several tests: each test's adjusted p, and the level that its own p is held to.

Bonferroni and Holm bound the chance of one or more false differences in a family of tests, Benjamini and
Hochberg the expected share of false ones among those called different.

- Holm, S. A simple sequentially rejective multiple test procedure. Scand. J. Stat. 6 (1979) 65.
- Benjamini, Y., Hochberg, Y. Controlling the false discovery rate. J. R. Stat. Soc. B 57 (1995) 289.
- Benjamini, Y., Bogomolov, M. Selective inference on multiple families of hypotheses. J. R. Stat. Soc. B 76
  (2014) 297: parts of those that are selected, R of m, are tested at R/m of alpha.
"""

from collections.abc import Sequence
from typing import Literal, NamedTuple

import numpy as np

from linkwise.arrays import Array
from linkwise.extras import extra

Correction = Literal["none", "bonferroni", "holm", "fdr-bh"]
CORRECTIONS: dict[Correction, str] = {
    "none": "not corrected for the number of columns",
    "bonferroni": "by Bonferroni",
    "holm": "by Holm",
    "fdr-bh": "by the false discovery rate of Benjamini and Hochberg",
}
"""Corrections, in words."""


class Corrected(NamedTuple):
    """Result of a correction, by test: (tests,) each."""

    adjusted: Array
    """Adjusted p: that of a test which is called different is below alpha."""
    levels: Array
    """Level that a test's own p is held to, in place of alpha."""


def corrected(correction: Correction, p: Sequence[float], alpha: float) -> Corrected:
    """Return adjusted p and levels of a family of tests, of one or more."""
    own = np.asarray(p, dtype=float)
    count = len(own)
    if correction == "none":
        return Corrected(own, np.full(count, alpha))
    if correction == "bonferroni":
        return Corrected(np.minimum(1.0, count * own), np.full(count, alpha / count))
    if correction == "holm":
        return _holm(own, alpha)
    adjusted = np.asarray(extra("scipy.stats").false_discovery_control(own, method="bh"))
    rejected = int(np.count_nonzero(adjusted < alpha))
    return Corrected(adjusted, np.full(count, alpha * max(1, rejected) / count))


def _holm(p: Array, alpha: float) -> Corrected:
    """Step down from the least p: the k-th of m is held to alpha / (m - k + 1), the rest where one fails."""
    count = len(p)
    order = np.argsort(p, kind="stable")
    left = count - np.arange(count)
    adjusted, levels = np.empty(count), np.empty(count)
    adjusted[order] = np.minimum(1.0, np.maximum.accumulate(left * p[order]))
    rejected = int(np.count_nonzero(adjusted < alpha))
    levels[order] = alpha / np.maximum(left, count - rejected)
    return Corrected(adjusted, levels)
