"""Means, deviations and ranges over subjects; a subject's value is the mean of its trials."""

from collections.abc import Container, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from linkwise.arrays import Array
from linkwise.study.plan import SUBJECT
from linkwise.study.summary import STATISTICS, TrialSummary

MEAN = STATISTICS.index("mean")
FILLED = {"deviation": "filled: ± sd between subjects", "range": "filled: range of subjects"}
FILLED_OF_ONE = {
    "deviation": "filled: ± sd over trials of one subject",
    "range": "filled: range of trials of one subject",
}
"""Filled bands, as a figure tells of them: of subjects, or of one subject's trials."""


@dataclass(frozen=True, eq=False)
class Spread:
    """Spread of values or curves over subjects, each the mean of its trials: arrays of one shape."""

    subjects: tuple[str, ...]
    every: Array
    """Values of trials, (trials, …)."""
    each: Array
    """Means of subjects, (subjects, …)."""

    is_of_trials: bool = False
    """True where one subject's trials stand in place of subjects."""

    @property
    def over_trials(self) -> "Spread":
        """The spread over trials, whosever they are, each as if it were of a subject of its own."""
        return Spread(self.subjects, self.every, self.every, is_of_trials=True)

    @property
    def mean(self) -> Array:
        """Mean over subjects."""
        mean: Array = self.each.mean(axis=0)
        return mean

    @property
    def deviation(self) -> Array:
        """Standard deviation over subjects, as of a sample; NaN for one subject."""
        return _deviation(self.each)

    @property
    def trials_deviation(self) -> Array:
        """Standard deviation over trials, whosever they are; NaN for one trial."""
        return _deviation(self.every)

    @property
    def rows(self) -> dict[str, Array]:
        """Mean, deviation and range over subjects, then over all trials of any subject."""
        return {
            "mean": self.mean,
            "std": self.deviation,
            "min": self.each.min(axis=0),
            "max": self.each.max(axis=0),
            "trials_mean": self.every.mean(axis=0),
            "trials_std": self.trials_deviation,
            "trials_min": self.every.min(axis=0),
            "trials_max": self.every.max(axis=0),
        }


def _deviation(values: Array) -> Array:
    if len(values) < 2:
        return np.full(values.shape[1:], np.nan)
    deviation: Array = values.std(axis=0, ddof=1)
    return deviation


Group = tuple[tuple[str, str], ...]
"""Levels by factor, for all factors but the subject."""


def groups_of(trials: Sequence[TrialSummary]) -> dict[Group, list[TrialSummary]]:
    """Return the trials by the levels that they share, in the order in which these occur."""
    found: dict[Group, list[TrialSummary]] = {}
    for trial in trials:
        levels = tuple((factor, level) for factor, level in trial.labels.items() if factor != SUBJECT)
        found.setdefault(levels, []).append(trial)
    return found


def spread(trials: Sequence[TrialSummary], values: Mapping[str, Array]) -> Spread:
    """Return the spread over subjects of arrays by trial."""
    own = {
        subject: [values[trial.name] for trial in some]
        for subject, some in by_subject(trials, values).items()
    }
    each = np.stack([np.mean(some, axis=0) for some in own.values()])
    return Spread(tuple(own), np.stack([one for some in own.values() for one in some]), each)


def by_subject(trials: Sequence[TrialSummary], names: Container[str]) -> dict[str, list[TrialSummary]]:
    """Return the trials of these names by their subject, in the order in which subjects occur."""
    found: dict[str, list[TrialSummary]] = {}
    for trial in trials:
        if trial.name in names:
            found.setdefault(trial.labels[SUBJECT], []).append(trial)
    return found


def columns_of_trials(trials: Sequence[TrialSummary]) -> dict[str, str]:
    """Return every column that any trial has, with its unit, except the time."""
    found: dict[str, str] = {}
    for trial in trials:
        found |= {name: unit for name, unit in trial.units.items() if name != "time"}
    return found


def values_of(trials: Sequence[TrialSummary], name: str) -> dict[str, Array]:
    """Return a column's curve of each trial, or if none has curves, its mean, (1,)."""
    return {one.name: one.curves[name] for one in trials if name in one.curves} or {
        one.name: one.statistics[name][MEAN : MEAN + 1] for one in trials if name in one.statistics
    }
