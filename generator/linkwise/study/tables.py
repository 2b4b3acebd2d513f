"""Tables as Parquet files: of one trial, and of all, with means, deviations and ranges over subjects."""

import io
from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import islice
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import numpy as np

from linkwise.analysis.column_patterns import fitting
from linkwise.analysis.result_rows import Column
from linkwise.arrays import Array, Index
from linkwise.extras import extra
from linkwise.study.deviation_columns import is_deviation
from linkwise.study.deviations import SD_COLUMNS, deviations, have_deviations, trial_deviations
from linkwise.study.spread import Spread, columns_of_trials, groups_of, spread
from linkwise.study.summary import STATISTICS, TrialSummary

CYCLE, PERCENT = "cycle", "percent"

OVER = ("", "trials_")
"""Beginnings of the names of columns over subjects, and over trials."""
AT_ONCE = 50_000
"""Rows of a table that are written at a time."""


def kept_columns(columns: Sequence[Column], patterns: Sequence[str]) -> list[int]:
    """Return the numbers of columns that patterns fit, the time first.

    Raises LinkwiseError for a pattern that fits none.
    """
    names = [column.name for column in columns]
    kept = {"time", *fitting("'columns'", names, patterns)}
    return [at for at, name in enumerate(names) if name in kept]


class TrialTable:
    """A Parquet file of one trial; texts that are the same in every row take almost no space.

    places: which of CYCLE and PERCENT each row has, after the labels
    """

    def __init__(
        self, path: Path, labels: Mapping[str, str], columns: Sequence[Column], places: Sequence[str] = ()
    ) -> None:
        self._arrow = arrow = extra("pyarrow")
        self._labels = labels
        text = arrow.dictionary(arrow.int32(), arrow.string())
        fields = [arrow.field(name, text, False) for name in labels]
        kinds = {CYCLE: arrow.int32(), PERCENT: arrow.float64()}
        fields += [arrow.field(name, kinds[name], False) for name in places]
        self._places = [kinds[name] for name in places]
        fields += [arrow.field(c.name, arrow.float64(), False, {"unit": c.unit}) for c in columns]
        self._schema = arrow.schema(fields)
        self._writer: Any = extra("pyarrow.parquet").ParquetWriter(
            path,
            self._schema,
            compression="snappy",
            use_dictionary=list(labels),
            write_statistics=list(labels),
        )

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Write the end of the file."""
        self._writer.close()

    def __call__(self, rows: Array, *places: Array | Index) -> None:
        """Write rows (columns, samples), each sample at its places, (samples,) each."""
        arrow, count = self._arrow, rows.shape[1]
        codes = np.zeros(count, dtype=np.int32)
        arrays = [
            arrow.DictionaryArray.from_arrays(codes, arrow.array([text])) for text in self._labels.values()
        ]
        arrays += [arrow.array(at, kind) for at, kind in zip(places, self._places, strict=True)]
        batch = arrow.record_batch([*arrays, *map(arrow.array, rows)], schema=self._schema)
        self._writer.write_batch(batch, row_group_size=count)


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
    """Yield, for each group and column, its curve over subjects, one point a row.

    Deviations are no rows but columns of their own, if any trial has some: NaN where a trial of the group has
    none.
    """
    percent = np.linspace(0, 100, points)
    unknown = {f"{over}{name}": np.full(points, np.nan) for over in OVER for name in SD_COLUMNS}
    beside = unknown if have_deviations(trials) else {}
    for group, members in groups_of(trials).items():
        for name, unit in columns_of_trials(members).items():
            there = {one.name: one.curves[name] for one in members if name in one.curves}
            if not there or is_deviation(name):
                continue
            found = spread(members, there)
            about, rows = {**dict(group), "column": name, "unit": unit, **_counts(found)}, found.rows
            rows |= beside | _deviation_rows(members, name, found)
            for at, place in enumerate(percent):
                yield (
                    about
                    | {"percent": float(place)}
                    | {key: float(values[at]) for key, values in rows.items()}
                )


def _deviation_rows(members: Sequence[TrialSummary], name: str, found: Spread) -> dict[str, Array]:
    """Return deviations over subjects, then over trials; none where a trial has none."""
    some = deviations(members, name, found), trial_deviations(members, name, found)
    return {
        key: values
        for over, one in zip(OVER, some, strict=True)
        if one is not None
        for key, values in one.rows(over).items()
    }


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
