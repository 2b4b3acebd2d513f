"""Result tables on disk, written block by block: Parquet, or CSV."""

import csv
from collections.abc import Sequence
from pathlib import Path
from types import TracebackType
from typing import Any, Literal, Protocol, Self

from linkwise.analysis.result_columns import Column
from linkwise.analysis.result_quantities import MEANING
from linkwise.extras import extra
from linkwise.package.load import Array

Format = Literal["parquet", "csv"]


class ResultTable(Protocol):
    """A sink that is closed at the end."""

    def __enter__(self) -> Self:
        """Open the table; the file exists from now on."""

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Close the table."""

    def __call__(self, block: Array) -> None:
        """Write a block (columns, samples)."""


def open_table(path: Path, columns: Sequence[Column], note: str) -> ResultTable:
    """Open `path`, .parquet or .csv, to write; `note`, JSON, is kept in a Parquet file's schema."""
    return CsvTable(path, columns) if path.suffix == ".csv" else ParquetTable(path, columns, note)


class ParquetTable:
    """Parquet with float64 columns; unit, meaning and indices are in each field's metadata."""

    def __init__(self, path: Path, columns: Sequence[Column], note: str) -> None:
        self._arrow = arrow = extra("pyarrow")
        fields = [arrow.field(c.name, arrow.float64(), False, _metadata(c)) for c in columns]
        self._schema = arrow.schema(fields, {"linkwise": note})
        # Torques hardly repeat, so that a dictionary would only cost time; long rests do compress.
        self._writer: Any = extra("pyarrow.parquet").ParquetWriter(
            path, self._schema, compression="snappy", use_dictionary=False, write_statistics=False
        )

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        self._writer.close()

    def __call__(self, block: Array) -> None:
        """Write a block (columns, samples) as one row group."""
        arrow = self._arrow
        arrays = [arrow.array(values) for values in block]
        batch = arrow.record_batch(arrays, schema=self._schema)
        self._writer.write_batch(batch, row_group_size=block.shape[1])


class CsvTable:
    """CSV with a header; numbers are written so that they read back exactly."""

    def __init__(self, path: Path, columns: Sequence[Column]) -> None:
        self._file = path.open("w", encoding="utf-8", newline="")
        self._writer = csv.writer(self._file)
        self._writer.writerow(column.name for column in columns)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        self._file.close()

    def __call__(self, block: Array) -> None:
        """Write a block (columns, samples)."""
        self._writer.writerows(block.T.tolist())


def _metadata(column: Column) -> dict[str, str]:
    indices = {name: getattr(column, name) for name in ("joint", "link", "cause", "point", "row")}
    return {
        "unit": column.unit,
        "meaning": MEANING[column.quantity],
        **{name: str(at) for name, at in indices.items() if at is not None},
    }
