"""Standard deviations within trials, by what is uncertain, and together with the spread between subjects.

A trial's curve, as it is told, is its truth and two errors, X_t = truth_t + e + n_t. The systematic e, of
bodies, is the same in all trials, and no number of them averages it out; n_t, of noise of motion, is new in
each cycle. With S subjects, subject s of n_s trials, trial t of c_t cycles, at each point of the cycle:

    systematic² = mean over s of mean over t of (sd² − random²)      sd, random: root mean squares over cycles
    random²     = mean over s of mean over t of random²
    within²     = systematic² + random²
    mean²       = between² / S + systematic²
    new²        = max(0, between² − mean over s of Σ_t (random² / c_t) / n_s²) + mean²

`between`, the deviation of subjects as they are told, has n in it already and e not at all. A mean of errors
that go together has at most the root mean square of their deviations, by Cauchy and Schwarz.
"""

import json
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from linkwise.arrays import Array
from linkwise.study.deviation_columns import RANDOM, WHOLE
from linkwise.study.ledger import TrialRecord
from linkwise.study.spread import Spread, by_subject
from linkwise.study.summary import TrialSummary


@dataclass(frozen=True, eq=False)
class Deviations:
    """Standard deviations of a group's curve, (points,) each; NaN where one subject cannot tell."""

    systematic: Array
    """Deviation of one curve by what errs alike in all trials."""
    random: Array
    """Deviation of one cycle's curve by what is new in each."""
    mean: Array
    """Deviation of the mean, by the spread between subjects and by what is systematic."""
    new: Array
    """Deviation of the true curve of one more subject, about that mean."""

    @property
    def within(self) -> Array:
        """Deviation of one cycle's curve by all that is uncertain."""
        return np.hypot(self.systematic, self.random)

    def rows(self, over: str = "") -> dict[str, Array]:
        """Return all by the names of columns of tables; `over` is what these begin with."""
        return {f"{over}{name}": getattr(self, name.removeprefix("sd_")) for name in SD_COLUMNS}


SD_COLUMNS = ("sd_within", "sd_systematic", "sd_random", "sd_mean", "sd_new")
"""Names of deviations in the table of mean curves."""


TOGETHER = (
    f"errors that {RANDOM}… tells are new in each cycle, and the spread between subjects has them already;"
    " all others are the same in all trials of all subjects: no number of them averages these out, and the"
    " spread between subjects has none of them"
)
"""Assumption by which deviations of trials go together."""


def assumptions(records: Sequence[TrialRecord]) -> dict[str, object]:
    """Return what was assumed of trials, and of how they go together, as plain data; empty if nothing."""
    found: dict[str, tuple[list[str], dict[str, object]]] = {}
    for record in records:
        if record.uncertain is not None:
            own, _ = found.setdefault(json.dumps(record.uncertain), ([], dict(record.uncertain)))
            own.append(record.name)
    assumed = [{"trials": own, **told} for own, told in found.values()]
    return {"together": TOGETHER, "assumed": assumed} if found else {}


def have_deviations(trials: Sequence[TrialSummary]) -> bool:
    """Return whether any curve of any trial has deviations beside it."""
    return any(name.startswith(WHOLE) for one in trials for name in one.curves)


def deviations(trials: Sequence[TrialSummary], name: str, found: Spread) -> Deviations | None:
    """Return deviations of a column's mean curve over subjects, whose spread was found.

    It is None where a trial that has the curve has no deviation of it.
    """
    there = by_subject(trials, {one.name for one in trials if name in one.curves})
    return _together(list(there.values()), name, found.deviation)


def trial_deviations(trials: Sequence[TrialSummary], name: str, found: Spread) -> Deviations | None:
    """Return the same over trials, whosever they are, each as if it were of a subject of its own."""
    units = [[one] for one in trials if name in one.curves]
    return _together(units, name, found.trials_deviation)


def _together(units: Sequence[Sequence[TrialSummary]], name: str, between: Array) -> Deviations | None:
    parts = [[variances(trial, name) for trial in unit] for unit in units]
    if not parts or any(part is None for unit in parts for part in unit):
        return None
    cycles = [np.array([max(1, trial.cycles) for trial in unit])[:, None] for unit in units]
    told = [np.array(unit) for unit in parts]  # (trials, 2, points) of each unit
    systematic, random = (np.mean([one[:, at].mean(axis=0) for one in told], axis=0) for at in (0, 1))
    in_between = np.mean(
        [(one[:, 1] / c).sum(axis=0) / len(one) ** 2 for one, c in zip(told, cycles, strict=True)], axis=0
    )
    of_mean = between**2 / len(units) + systematic
    of_new = np.maximum(between**2 - in_between, 0.0) + of_mean
    return Deviations(*map(np.sqrt, (systematic, random, of_mean, of_new)))


def variances(trial: TrialSummary, name: str) -> Array | None:
    """Return the systematic and the random variance of a trial's curve, (2, points); None if it has none."""
    whole, random = (trial.curves.get(f"{beside}{name}") for beside in (WHOLE, RANDOM))
    if whole is None:
        return None
    noise = np.zeros_like(whole) if random is None else np.minimum(random**2, whole**2)
    return np.stack([whole**2 - noise, noise])
