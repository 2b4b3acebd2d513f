"""Table of a trial: its labels, its samples or cycles, and the columns that a study keeps."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import numpy as np

from linkwise.analysis.result_rows import Column
from linkwise.extras import extra
from linkwise.package.load import Array
from linkwise.study.column_patterns import fitting

CYCLE, PERCENT = "cycle", "percent"


def kept_columns(columns: Sequence[Column], patterns: Sequence[str]) -> list[int]:
    """Return the numbers of columns that patterns fit, the time first.

    Raises LinkwiseError for a pattern that fits none.
    """
    names = [column.name for column in columns]
    kept = {"time", *fitting("'columns'", names, patterns)}
    return [at for at, name in enumerate(names) if name in kept]


class TrialTable:
    """A Parquet file of one trial; texts that are the same in every row take almost no space."""

    def __init__(
        self, path: Path, labels: Mapping[str, str], columns: Sequence[Column], is_of_cycles: bool
    ) -> None:
        self._arrow = arrow = extra("pyarrow")
        self._labels = labels
        text = arrow.dictionary(arrow.int32(), arrow.string())
        fields = [arrow.field(name, text, False) for name in labels]
        if is_of_cycles:
            fields += [arrow.field(CYCLE, arrow.int32(), False), arrow.field(PERCENT, arrow.float64(), False)]
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
        self._writer.close()

    def __call__(self, rows: Array, cycle: int | None = None) -> None:
        """Write rows (columns, samples); the samples of a cycle are at even shares of it."""
        arrow, count = self._arrow, rows.shape[1]
        codes = np.zeros(count, dtype=np.int32)
        arrays = [
            arrow.DictionaryArray.from_arrays(codes, arrow.array([text])) for text in self._labels.values()
        ]
        if cycle is not None:
            arrays += [
                arrow.array(np.full(count, cycle, dtype=np.int32)),
                arrow.array(np.linspace(0, 100, count)),
            ]
        batch = arrow.record_batch([*arrays, *map(arrow.array, rows)], schema=self._schema)
        self._writer.write_batch(batch, row_group_size=count)
