"""Comparison of two levels of a factor: t tests over whole curves (SPM), or of means."""

import warnings
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from linkwise.arrays import Array
from linkwise.errors import LinkwiseError, within
from linkwise.escape import one_line
from linkwise.extras import extra
from linkwise.study.deviation_columns import fitting_values
from linkwise.study.plan import Comparison
from linkwise.study.spread import Spread, columns_of_trials, spread, values_of
from linkwise.study.summary import TrialSummary

FEWEST = 3
"""Fewest subjects on a side that a test needs."""


@dataclass(frozen=True, eq=False)
class Cluster:
    """A part of the cycle, in %, where curves differ, and its p; for means, the whole cycle."""

    start: float
    end: float
    p: float


@dataclass(frozen=True, eq=False)
class Compared:
    """Result of a test of one column."""

    comparison: Comparison
    column: str
    unit: str
    sides: tuple[Spread, Spread]
    statistic: Array
    """t at each point of the cycle, (points,); for means (1,)."""
    threshold: float
    """|t| above which a curve differs by chance in `alpha` of all cases; NaN for means."""
    p: float
    """p of a test of means; NaN for curves, as each of their parts has its own."""
    clusters: tuple[Cluster, ...]
    """Parts that differ: each of some width, and of a p of its own below `alpha`."""


def compared(
    comparison: Comparison, trials: Sequence[TrialSummary]
) -> tuple[list[Compared], tuple[str, ...]]:
    """Return the test of every column that is asked for, and why some could not be made.

    Raises LinkwiseError for unknown columns.
    """
    known = columns_of_trials(trials)
    made, told = list[Compared](), list[str]()
    for name in compared_columns(comparison, known):
        try:
            with within(f"[[compare]] {comparison.factor}, {name}"):
                made.append(_of_column(comparison, trials, name, known[name]))
        except LinkwiseError as error:
            told.append(str(error))
    return made, tuple(told)


def compared_columns(comparison: Comparison, names: Iterable[str]) -> list[str]:
    """Return those of the columns `names` that are compared, deviations left out.

    Raises LinkwiseError for unknown columns, and for a pattern that fits deviations alone.
    """
    return fitting_values("[[compare]]", names, comparison.columns)


def _of_column(comparison: Comparison, trials: Sequence[TrialSummary], name: str, unit: str) -> Compared:
    sides = []
    for level in comparison.between:
        members = [trial for trial in trials if trial.labels[comparison.factor] == level]
        there = values_of(members, name)
        sides.append(spread(members, there) if there else Spread((), np.empty((0, 1)), np.empty((0, 1))))
    first, second = _paired(*sides) if comparison.paired else sides
    fewest = min(len(first.each), len(second.each))
    if fewest < FEWEST:
        raise LinkwiseError(
            f"{fewest} subjects{' in both' if comparison.paired else ' on a side'}; a test needs {FEWEST}"
        )
    return _tested(comparison, name, unit, first, second)


def _paired(first: Spread, second: Spread) -> tuple[Spread, Spread]:
    """Return both sides with the subjects that are on both, in one order."""
    both = [subject for subject in first.subjects if subject in second.subjects]
    at = [[side.subjects.index(subject) for subject in both] for side in (first, second)]
    one, other = (
        Spread(tuple(both), side.every, side.each[rows])
        for side, rows in zip((first, second), at, strict=True)
    )
    return one, other


def _tested(comparison: Comparison, name: str, unit: str, first: Spread, second: Spread) -> Compared:
    about = comparison, name, unit, (first, second)
    if first.each.shape[1] == 1:
        t, p = _of_means(comparison.paired, first.each[:, 0], second.each[:, 0])
        whole = _that_differ(comparison, [Cluster(0.0, 100.0, p)])
        return Compared(*about, np.array([t]), float("nan"), p, whole)
    field, found = _of_curves(comparison, first.each, second.each)
    scale = 100 / (first.each.shape[1] - 1)
    above = [
        Cluster(float(c.endpoints[0]) * scale, float(c.endpoints[1]) * scale, float(c.P))
        for c in found.clusters
    ]
    statistic = np.asarray(field.z, dtype=float)
    differ = _that_differ(comparison, above)
    return Compared(*about, statistic, float(found.zstar), float("nan"), differ)


def _that_differ(comparison: Comparison, parts: Sequence[Cluster]) -> tuple[Cluster, ...]:
    """Return the parts that have some width and a p below alpha.

    A curve may exceed the threshold so briefly that an excess as brief occurs by chance more often.
    """
    return tuple(part for part in parts if part.start < part.end and part.p < comparison.alpha)


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


def _of_curves(comparison: Comparison, first: Array, second: Array) -> tuple[Any, Any]:
    """Return the field of t, and the inference from it; for unpaired subjects, variances may differ."""
    stats = extra("spm1d").stats
    try:
        field = stats.ttest_paired(first, second) if comparison.paired else stats.ttest2(first, second)
        return field, field.inference(comparison.alpha, two_tailed=True)
    except Exception as error:  # spm1d's own error, for curves that do not vary somewhere
        reason = one_line(str(error).partition(":")[0], 200) or type(error).__name__
        raise LinkwiseError(f"spm1d: {reason}; leave the column out") from error
