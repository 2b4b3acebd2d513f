"""Summary of each trial, kept for the combined results of a study."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from linkwise.analysis.logs.log_checks import read_as
from linkwise.package.load import Array
from linkwise.study.study_paths import require_own
from linkwise.study.study_plan import StudyPlan
from linkwise.study.trial_ledger import CURVES, SUMMARY


@dataclass(frozen=True, eq=False)
class TrialSummary:
    """Summary of a trial: its labels, and by column the unit, STATISTICS and mean curve over cycles."""

    name: str
    labels: dict[str, str]
    units: dict[str, str]
    statistics: dict[str, Array]
    curves: dict[str, Array]
    """Mean curve of each column, (points,); empty without cycles."""
    cycles: int

    @classmethod
    def read(cls, name: str, labels: Mapping[str, str], folder: Path) -> "TrialSummary":
        """Return the summary that a trial left in its folder; raise LinkwiseError if it was damaged."""
        with _arrays(folder / SUMMARY) as data:
            names = data["names"].tolist()
            units = dict(zip(names, data["units"].tolist(), strict=True))
            statistics = dict(zip(names, data["statistics"].T, strict=True))
        curves: dict[str, Array] = {}
        cycles = 0
        if (folder / CURVES).exists():
            with _arrays(folder / CURVES) as data:
                curves = dict(zip(data["names"].tolist(), data["curves"][0], strict=True))
                cycles = int(data["cycles"])
        return cls(name, dict(labels), units, statistics, curves, cycles)


@contextmanager
def _arrays(path: Path) -> Iterator[Mapping[str, Array]]:
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
