"""Comparison of two levels of a factor by t tests, each column's p corrected for the others of its family."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from linkwise.arrays import Array
from linkwise.errors import LinkwiseError
from linkwise.escape import listed
from linkwise.study.corrections import corrected
from linkwise.study.deviation_columns import fitting_values
from linkwise.study.effect_sizes import EffectSize
from linkwise.study.plan import Comparison
from linkwise.study.spread import Spread, columns_of_trials, spread, values_of
from linkwise.study.summary import TrialSummary
from linkwise.study.t_tests import Cluster, TTest

FEWEST = 3
"""Fewest subjects on a side that a test needs."""


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
    """|t| above which a curve comes by chance as often as `level` says; NaN for means."""
    p: float
    """p of the column: of means, or field-wide, of the largest |t| of curves."""
    clusters: tuple[Cluster, ...]
    """Parts that differ: each of some width, and of a p of its own below `level`."""
    brief: tuple[Cluster, ...] = ()
    """Parts above the threshold that do not differ, as chance makes some as wide more often."""
    adjusted: float = float("nan")
    """p of the column, corrected for the others of its family."""
    level: float = float("nan")
    """Level that p is held to: `alpha`, or what the correction makes of it."""
    family: int = 1
    """Number of columns that are corrected for."""
    left_out: tuple[str, ...] = ()
    """Subjects that are on one side only, and so in no pair."""

    def effect(self, part: Cluster | None = None) -> tuple[float, EffectSize]:
        """Return where |t| is largest, of a part or of the whole, in % of the cycle, and the effect there.

        Of means, the place is NaN.
        """
        count = len(self.statistic)
        first, second = (side.each for side in self.sides)
        asked = self.comparison.paired, 1 - self.comparison.alpha
        if count == 1:
            return float("nan"), EffectSize.of(first[:, 0], second[:, 0], *asked)
        place = np.linspace(0, 100, count)
        inside = np.ones(count, np.bool_) if part is None else (place >= part.start) & (place <= part.end)
        at = int(np.where(inside, np.abs(self.statistic), -1.0).argmax())
        return float(place[at]), EffectSize.of(first[:, at], second[:, at], *asked)


class _Tested(NamedTuple):
    """A test of a column before it is corrected for the others."""

    comparison: Comparison
    column: str
    unit: str
    sides: tuple[Spread, Spread]
    test: TTest
    left_out: tuple[str, ...]


def compared(
    comparisons: Sequence[Comparison], trials: Sequence[TrialSummary]
) -> tuple[list[Compared], tuple[str, ...]]:
    """Return the test of every column that is asked for, and why some could not be made.

    Columns that no trial has are among the reasons.
    """
    known = columns_of_trials(trials)
    tested, told = list[tuple[int, _Tested]](), list[str]()
    lacking: dict[tuple[str, str], list[str]] = {}
    for number, comparison in enumerate(comparisons):
        try:
            names = compared_columns(comparison, known)
        except LinkwiseError as error:
            told.append(str(error))
            continue
        for name in names:
            try:
                tested.append((number, _of_column(comparison, trials, name, known[name])))
            except LinkwiseError as error:
                lacking.setdefault((comparison.factor, str(error)), []).append(name)
    told += [f"[[compare]] {factor}, {listed(names)}: {why}" for (factor, why), names in lacking.items()]
    families: dict[str | int, list[_Tested]] = {}
    for number, one in tested:
        families.setdefault(one.comparison.family or number, []).append(one)
    made = [judged for family in families.values() for judged in _judged(family)]
    return made, tuple(told)


def compared_columns(comparison: Comparison, names: Iterable[str]) -> list[str]:
    """Return those of the columns `names` that are compared, deviations left out.

    Raises LinkwiseError for unknown columns, and for a pattern that fits deviations alone.
    """
    return fitting_values("[[compare]]", names, comparison.columns)


def left_out_lines(tests: Sequence[Compared]) -> tuple[str, ...]:
    """Return a line for each comparison whose pairs leave out subjects."""
    found: dict[tuple[str, tuple[str, ...], tuple[str, ...]], None] = {}
    for test in tests:
        if test.left_out:
            found[test.comparison.factor, test.comparison.between, test.left_out] = None
    return tuple(
        f"[[compare]] {factor}: subjects are paired, and {listed(map(repr, who))} left out, who"
        f" {'has' if len(who) == 1 else 'have'} not both {first!r} and {second!r}"
        for factor, (first, second), who in found
    )


def _of_column(comparison: Comparison, trials: Sequence[TrialSummary], name: str, unit: str) -> _Tested:
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
    lone = sorted(set(sides[0].subjects) ^ set(sides[1].subjects)) if comparison.paired else ()
    test = TTest.of(comparison.paired, first.each, second.each)
    return _Tested(comparison, name, unit, (first, second), test, tuple(lone))


def _paired(first: Spread, second: Spread) -> tuple[Spread, Spread]:
    """Return both sides with the subjects that are on both, in one order."""
    both = [subject for subject in first.subjects if subject in second.subjects]
    at = [[side.subjects.index(subject) for subject in both] for side in (first, second)]
    one, other = (
        Spread(tuple(both), side.every, side.each[rows])
        for side, rows in zip((first, second), at, strict=True)
    )
    return one, other


def _judged(family: Sequence[_Tested]) -> Iterable[Compared]:
    """Yield what tests say, each at the level that its p is held to among those of its family."""
    asked = family[0].comparison
    adjusted, levels = corrected(asked.correct, [one.test.p for one in family], asked.alpha)
    for one, p, level in zip(family, adjusted.tolist(), levels.tolist(), strict=True):
        threshold, parts = one.test.inferred(level)
        # A curve may exceed the threshold so briefly that an excess as brief occurs by chance more often.
        differ = [part.start < part.end and part.p < level for part in parts]
        above, brief = (
            tuple(part for part, does in zip(parts, differ, strict=True) if does is wanted)
            for wanted in (True, False)
        )
        yield Compared(
            one.comparison,
            one.column,
            one.unit,
            one.sides,
            one.test.statistic,
            threshold,
            one.test.p,
            above,
            brief if len(one.test.statistic) > 1 else (),
            p,
            level,
            len(family),
            one.left_out,
        )
