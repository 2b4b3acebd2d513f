"""Integrals of a trial's columns over each of its cycles: work of a power, impulse of a force or torque."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from types import TracebackType
from typing import Self

import numpy as np

from linkwise.analysis.integrals import parted_integrals
from linkwise.analysis.result_rows import Column
from linkwise.arrays import Array, Index
from linkwise.study.deviation_columns import fitting_values, is_deviation
from linkwise.study.ledger import CYCLES
from linkwise.study.plan import StudyPlan
from linkwise.study.summary import RunningMoments
from linkwise.study.tables import CYCLE, TrialTable, kept_columns

PARTS = ("integral", "integral_positive", "integral_negative")
"""First parts of the names of integrals: ∫ x dt, ∫ max(x, 0) dt and ∫ min(x, 0) dt."""
ENDS = (Column("time", "start", "s"), Column("time", "end", "s"))
AT_ONCE = 4096
"""Cycles that are written at a time."""


def integrated_columns(plan: StudyPlan, columns: Sequence[Column]) -> list[int]:
    """Return the numbers of columns that are integrated over cycles: those asked for, or of power and kept.

    Deviations are not among them. Raises LinkwiseError for a pattern that fits none, or deviations alone.
    """
    if plan.cycles is None:
        return []
    if not plan.cycles.integrals:
        kept = kept_columns(columns, plan.columns)
        return [at for at in kept if columns[at].unit == "W" and not is_deviation(columns[at].name)]
    numbers = {column.name: at for at, column in enumerate(columns) if column.name != "time"}
    return [numbers[name] for name in fitting_values("[cycles]: 'integrals'", numbers, plan.cycles.integrals)]


def integral_columns(plan: StudyPlan, columns: Sequence[Column]) -> list[Column]:
    """Return the integrals of columns over a cycle, part by part, as columns of tables."""
    some = [columns[at] for at in integrated_columns(plan, columns)]
    return [
        replace(column, name=f"{part}/{column.name}", unit=integral_unit(column.unit))
        for part in PARTS
        for column in some
    ]


def integral_unit(unit: str) -> str:
    """Return the unit of the integral over time: J of W, rad of rad/s, N·m·s of N·m."""
    if unit in ("W", "1"):
        return {"W": "J", "1": "s"}[unit]
    if unit.endswith("/s²"):
        return unit.removesuffix("²")
    return unit.removesuffix("/s") if unit.endswith("/s") else f"{unit}·s"


class CycleIntegrals:
    """Receiver of a trial's cycles that writes their integrals, a row for each, and sums them up."""

    def __init__(
        self, plan: StudyPlan, columns: Sequence[Column], labels: Mapping[str, str], folder: Path
    ) -> None:
        self.columns = integral_columns(plan, columns)
        self._numbers: Index = np.array(integrated_columns(plan, columns), np.intp)
        self._moments = RunningMoments(len(self.columns))
        self._waiting: list[Array] = []
        self._first = 0
        self._table = None
        if plan.cycles is not None:
            self._table = TrialTable(folder / CYCLES, labels, [*ENDS, *self.columns], (CYCLE,))

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._table is not None:
            if error is None:
                self._write(self._table)
            self._table.close()

    def __call__(self, samples: Array) -> None:
        """Take the next cycle: samples (columns, samples), the time first, both ends among them."""
        time = samples[0]
        above, below = parted_integrals(samples[self._numbers], np.diff(time)[None])[0]
        found = np.concatenate([above - below, above, -below])
        self._moments(found[:, None])
        self._waiting.append(np.concatenate([time[[0, -1]], found]))
        if self._table is not None and len(self._waiting) == AT_ONCE:
            self._write(self._table)

    def _write(self, table: TrialTable) -> None:
        if count := len(self._waiting):
            table(np.stack(self._waiting, axis=1), np.arange(self._first, self._first + count))
            self._first, self._waiting = self._first + count, []

    @property
    def statistics(self) -> Array:
        """STATISTICS of each integral over all cycles so far, (statistics, integrals)."""
        return self._moments.table
