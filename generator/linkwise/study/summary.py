"""Summary of each trial, kept for the combined results of a study; its numbers are running statistics."""

import math
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from linkwise.analysis.logs.checks import read_as
from linkwise.analysis.motion_words import MotionWords
from linkwise.arrays import Array
from linkwise.study.deviation_columns import is_deviation
from linkwise.study.ledger import CURVES, SUMMARY
from linkwise.study.paths import require_own
from linkwise.study.plan import StudyPlan

STATISTICS = ("mean", "std", "min", "max", "rms")
AT_ONCE = 512
"""Samples whose centred values fit in the cache."""


@dataclass(frozen=True, eq=False)
class TrialSummary:
    """Summary of a trial: its labels, and by column the unit, STATISTICS and mean curve over cycles."""

    name: str
    labels: dict[str, str]
    units: dict[str, str]
    statistics: dict[str, Array]
    curves: dict[str, Array]
    """Mean curve of each column, (points,), of deviations the root mean square; empty without cycles."""
    cycles: int
    mass: float = math.nan
    """Mass of the trial's robot in kg, without payloads; NaN where it does not say."""
    words: Mapping[str, MotionWords] = field(default_factory=dict)
    """Words of the coordinates of a person's joints, by name."""

    @classmethod
    def read(cls, name: str, labels: Mapping[str, str], folder: Path) -> "TrialSummary":
        """Return the summary that a trial left in its folder; raise LinkwiseError if it was damaged."""
        with trial_arrays(folder / SUMMARY) as data:
            names = data["names"].tolist()
            units = dict(zip(names, data["units"].tolist(), strict=True))
            statistics = dict(zip(names, data["statistics"].T, strict=True))
            words = {name: MotionWords(*some) for name, *some in data["words"].tolist()}
            mass = float(data["mass"])
        curves: dict[str, Array] = {}
        cycles = 0
        if (folder / CURVES).exists():
            with trial_arrays(folder / CURVES) as data:
                names, (mean, std) = data["names"].tolist(), data["curves"]
                squared = np.array([is_deviation(name) for name in names])[:, None]
                curves = dict(zip(names, np.where(squared, np.hypot(mean, std), mean), strict=True))
                cycles = int(data["cycles"])
        return cls(name, dict(labels), units, statistics, curves, cycles, mass, words)


@contextmanager
def trial_arrays(path: Path) -> Iterator[Mapping[str, Array]]:
    """Open the arrays of a trial's own file; raise LinkwiseError where they cannot be read."""
    require_own(path)
    with read_as("a trial's file of arrays", path, "remove its folder"), np.load(path) as data:
        yield data


def summaries(plan: StudyPlan, folders: Mapping[str, Path]) -> list[TrialSummary]:
    """Return the summaries of the trials that exist, in the study's order."""
    return [
        TrialSummary.read(trial.name, dict(trial.labels), folders[trial.name])
        for trial in plan.trials
        if trial.name in folders
    ]


def words_of_trials(trials: Sequence[TrialSummary]) -> dict[str, MotionWords]:
    """Return the words of coordinates by name, those of which all trials' models say the same."""
    every = [(name, words) for trial in trials for name, words in trial.words.items()]
    return {
        name: words for name, words in every if all(one.words.get(name, words) == words for one in trials)
    }


class RunningMoments:
    """Running statistics over the rows of blocks, (rows, samples).

    The sums are of differences from the first block's mean, so that a small deviation on a large mean is
    kept.
    """

    def __init__(self, rows: int) -> None:
        self.count = 0
        self._about, self._sums, self._squares = np.zeros((3, rows))
        self._min, self._max = np.full(rows, np.inf), np.full(rows, -np.inf)

    def __call__(self, block: Array) -> None:
        """Add a block (rows, samples)."""
        if not self.count and block.shape[1]:
            self._about = block.mean(axis=1)
        for at in range(0, block.shape[1], AT_ONCE):
            part = block[:, at : at + AT_ONCE]
            np.minimum(self._min, part.min(axis=1), out=self._min)
            np.maximum(self._max, part.max(axis=1), out=self._max)
            centred = part - self._about[:, None]
            self._sums += centred.sum(axis=1)
            self._squares += np.einsum("ij,ij->i", centred, centred)
        self.count += block.shape[1]

    @property
    def table(self) -> Array:
        """STATISTICS of each row, (statistics, rows); the deviation is divided by the number of samples."""
        count = max(1, self.count)
        apart = self._sums / count
        mean = self._about + apart
        variance = np.maximum(self._squares / count - apart**2, 0.0)
        return np.stack([mean, np.sqrt(variance), self._min, self._max, np.sqrt(mean**2 + variance)])
