"""Tables of all trials of a study: means, deviations and ranges over trials and over subjects."""

import io
from collections.abc import Iterable, Iterator, Sequence
from itertools import islice
from typing import Any

import numpy as np

from linkwise.extras import extra
from linkwise.study.running_moments import STATISTICS
from linkwise.study.subject_spread import Spread, columns_of_trials, groups_of, spread
from linkwise.study.trial_summary import TrialSummary

AT_ONCE = 50_000
"""Rows of a table that are written at a time."""


def summary_rows(trials: Sequence[TrialSummary]) -> Iterator[dict[str, Any]]:
    """Yield STATISTICS of each column of each trial."""
    for trial in trials:
        for name, numbers in trial.statistics.items():
            if name != "time":
                about = {"trial": trial.name, **trial.labels, "column": name, "unit": trial.units[name]}
                yield about | dict(zip(STATISTICS, map(float, numbers), strict=True))


def group_rows(trials: Sequence[TrialSummary]) -> Iterator[dict[str, Any]]:
    """Yield, for each group and column, each of STATISTICS over subjects."""
    for group, members in groups_of(trials).items():
        for name, unit in columns_of_trials(members).items():
            there = {one.name: one.statistics[name] for one in members if name in one.statistics}
            found = spread(members, there)
            about = {**dict(group), "column": name, "unit": unit, **_counts(found)}
            for at, statistic in enumerate(STATISTICS):
                yield (
                    about
                    | {"statistic": statistic}
                    | {key: float(values[at]) for key, values in found.rows.items()}
                )


def curve_rows(trials: Sequence[TrialSummary], points: int) -> Iterator[dict[str, Any]]:
    """Yield, for each group and column, its curve over subjects, one point a row."""
    percent = np.linspace(0, 100, points)
    for group, members in groups_of(trials).items():
        for name, unit in columns_of_trials(members).items():
            there = {one.name: one.curves[name] for one in members if name in one.curves}
            if not there:
                continue
            found = spread(members, there)
            about, rows = {**dict(group), "column": name, "unit": unit, **_counts(found)}, found.rows
            for at, place in enumerate(percent):
                yield (
                    about
                    | {"percent": float(place)}
                    | {key: float(values[at]) for key, values in rows.items()}
                )


def _counts(found: Spread) -> dict[str, int]:
    return {"subjects": len(found.subjects), "trials": len(found.every)}


def parquet(rows: Iterable[dict[str, Any]]) -> bytes:
    """Return a table of one or more rows as a Parquet file, written in chunks that fit in memory."""
    out, coming = io.BytesIO(), iter(rows)
    table = extra("pyarrow").Table
    first = table.from_pylist(list(islice(coming, AT_ONCE)))
    with extra("pyarrow.parquet").ParquetWriter(out, first.schema) as writer:
        writer.write_table(first)
        while some := list(islice(coming, AT_ONCE)):
            writer.write_table(table.from_pylist(some, first.schema))
    return out.getvalue()
