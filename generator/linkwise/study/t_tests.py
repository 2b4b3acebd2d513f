"""t tests of means, and of whole curves by statistical parametric mapping (spm1d)."""

import warnings
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from linkwise.arrays import Array
from linkwise.errors import LinkwiseError
from linkwise.escape import one_line
from linkwise.extras import extra

LEAST_P = float(np.finfo(float).eps)
"""Least p of a curve that double precision can tell: spm1d takes it from 1, and may come to 0."""


@dataclass(frozen=True, eq=False)
class Cluster:
    """A part of the cycle, in %, where |t| exceeds the threshold, and its p; for means, the whole cycle.

    p is the chance of a part at least as wide, somewhere in the cycle, where there is no difference.
    """

    start: float
    end: float
    p: float


class Inference(NamedTuple):
    """Inference from a test at a level: where curves are above the threshold."""

    threshold: float
    """|t| that a whole curve exceeds anywhere with the chance of the level; NaN for means."""
    parts: tuple[Cluster, ...]


@dataclass(frozen=True, eq=False)
class TTest:
    """t of two levels at each point, (points,), for means (1,), and its two-sided p.

    Of curves, p is field-wide: the chance that |t| comes as high as its largest anywhere in the cycle.
    """

    statistic: Array
    p: float
    _field: Any = None

    @classmethod
    def of(cls, is_paired: bool, first: Array, second: Array) -> "TTest":
        """Return the test of subjects' values, (subjects, points) each, in one order where paired.

        Unpaired subjects' variances need not be equal. Raises LinkwiseError where subjects do not vary.
        """
        if first.shape[1] == 1:
            t, p = _of_means(is_paired, first[:, 0], second[:, 0])
            return cls(np.array([t]), p)
        stats = extra("spm1d").stats
        with _Told():
            field = stats.ttest_paired(first, second) if is_paired else stats.ttest2(first, second)
        statistic = np.asarray(field.z, dtype=float)
        return cls(statistic, _field_wide(field, float(np.abs(statistic).max())), field)

    def inferred(self, level: float) -> Inference:
        """Return the threshold at a level, and the parts above it."""
        if self._field is None:
            return Inference(float("nan"), (Cluster(0.0, 100.0, self.p),))
        with _Told():
            found = self._field.inference(level, two_tailed=True)
        scale = 100 / (len(self.statistic) - 1)
        parts = tuple(
            Cluster(float(c.endpoints[0]) * scale, float(c.endpoints[1]) * scale, max(LEAST_P, float(c.P)))
            for c in found.clusters
        )
        return Inference(float(found.zstar), parts)


def told_p(p: float, level: float) -> str:
    """Return p as a paper has it, "< 0.001" or "0.013"; empty where there is none.

    It has as many digits as tell it from the level that it is held to.
    """
    if not np.isfinite(p):
        return ""
    least = min(0.001, level)
    if p < least:
        return f"< {least:g}"
    digits = next((n for n in range(3, 13) if f"{p:.{n}f}" != f"{level:.{n}f}"), 13)
    return f"{p:.{digits}f}"


def _field_wide(field: Any, highest: float) -> float:
    """Return the p of the largest |t| by random field theory, as spm1d finds its threshold."""
    tail = extra("spm1d.rft1d").t.sf_resels(highest, field.df[1], field.resels, withBonf=True, nNodes=field.Q)
    return min(1.0, max(LEAST_P, 2 * float(tail)))


def _of_means(is_paired: bool, first: Array, second: Array) -> tuple[float, float]:
    """Return t and p; for unpaired subjects by Welch's test, whose variances need not be equal."""
    stats = extra("scipy.stats")
    with np.errstate(divide="ignore", invalid="ignore"), warnings.catch_warnings():
        warnings.simplefilter("ignore")  # about numbers that are nearly equal, which is reported below
        test = (
            stats.ttest_rel(first, second) if is_paired else stats.ttest_ind(first, second, equal_var=False)
        )
    if not np.isfinite(test.statistic):
        raise LinkwiseError("subjects do not vary, so that there is nothing to test")
    return float(test.statistic), float(test.pvalue)


class _Told:
    """Block in which spm1d's own error, for curves that do not vary somewhere, is told in a line."""

    def __enter__(self) -> None:
        return None

    def __exit__(self, kind: Any, error: BaseException | None, trace: Any) -> None:
        if isinstance(error, Exception):
            reason = one_line(str(error).partition(":")[0], 200) or type(error).__name__
            raise LinkwiseError(f"spm1d: {reason}; leave the column out") from error
