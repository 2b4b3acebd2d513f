"""Cycles of one trial as they arrive, and at the end their mean and deviation."""

from collections.abc import Callable
from pathlib import Path

import numpy as np

from linkwise.analysis.job import Job
from linkwise.errors import within
from linkwise.package.load import Array
from linkwise.study.cycles import CycleSink, cycle_spans
from linkwise.study.running_moments import RunningMoments
from linkwise.study.study_plan import StudyPlan
from linkwise.study.trial_ledger import CURVES


class TrialCycles:
    """Receiver of samples that passes each cycle to `write`, with its number; none without cycles."""

    def __init__(self, plan: StudyPlan, job: Job, write: Callable[[int, Array], None]) -> None:
        self._write, self._names = write, [column.name for column in job.columns]
        self._points = 0 if plan.cycles is None else plan.cycles.points
        self._moments = RunningMoments(len(self._names) * self._points)
        with within(job.source):
            spans = [] if plan.cycles is None else cycle_spans(plan.cycles, job, plan.trials[0].name)
        self.sink = CycleSink(spans, self._points, self._take)

    @property
    def count(self) -> int:
        """Number of cycles so far."""
        return self._moments.count

    def _take(self, number: int, rows: Array) -> None:
        self._write(number, rows)
        shifted = rows.copy()
        shifted[0] -= rows[0, 0]  # time, from the beginning of the cycle
        self._moments(shifted.reshape(-1, 1))

    def finish(self, draft: Path) -> None:
        """Take the remaining cycles, and write the curves."""
        if not self._points:
            return
        self.sink.finish()
        curves = self._moments.table.reshape(-1, len(self._names), self._points)
        np.savez(draft / CURVES, curves=curves[:2], names=self._names, cycles=self.count)
