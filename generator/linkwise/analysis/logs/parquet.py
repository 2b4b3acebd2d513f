"""Logs in Parquet; rows are numbered from 1, the first sample."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from linkwise.analysis.logs.checks import require_held
from linkwise.arrays import Array
from linkwise.errors import LinkwiseError, within
from linkwise.escape import one_line
from linkwise.extras import extra

LONGEST_REASON = 200
"""Most characters shown of pyarrow's message."""
FLOAT64 = 8
"""Bytes of a number."""


@dataclass(frozen=True)
class ParquetLog:
    """A Parquet file of numeric columns; an empty cell is read as NaN."""

    path: Path
    columns: tuple[str, ...]
    size: int
    """Number of rows in the file."""
    degrees: bool | None = None
    first_row: int = 1
    warnings: tuple[str, ...] = ()
    brought: frozenset[str] = frozenset()

    @classmethod
    def open(cls, path: Path) -> "ParquetLog":
        """Read the file's schema; raise LinkwiseError for a file that is truncated, or is not Parquet."""
        parquet, arrow = extra("pyarrow.parquet"), extra("pyarrow")
        try:
            metadata = parquet.read_metadata(path)
            names = tuple(metadata.schema.to_arrow_schema().names)
        except _unreadable(arrow) as error:
            raise LinkwiseError(f"{path}: not Parquet, or cut off") from error
        with within(str(path)):
            require_held(path, FLOAT64 * metadata.num_rows)
        return cls(path, names, metadata.num_rows)

    def read(self, columns: Sequence[int], rows: int = 65536) -> Iterator[tuple[Array, int]]:
        """Yield blocks (at most `rows`, len(columns)) and the rows read so far.

        Raises LinkwiseError for a column that does not hold numbers.
        """
        arrow = extra("pyarrow")
        names, done = [self.columns[column] for column in columns], 0
        # A buffer ahead of the reader would keep all of the file in memory until its end.
        with extra("pyarrow.parquet").ParquetFile(self.path, pre_buffer=False) as file:
            for name in names:
                kind = file.schema_arrow.field(name).type
                # Checked before any row is read: a row may refer to a text as long as the file.
                if not _is_numeric(arrow.types, kind):
                    raise LinkwiseError(f"{self.path}: column {name!r} holds {kind}, not numbers")
            batches = file.iter_batches(rows, columns=names)
            while (batch := self._next(batches, done)) is not None:
                block = np.empty((batch.num_rows, len(names)))
                for at, name in enumerate(names):
                    try:
                        block[:, at] = batch.column(name).cast(arrow.float64())
                    except (arrow.ArrowInvalid, arrow.ArrowNotImplementedError) as error:
                        raise LinkwiseError(
                            f"{self.path}: column {name!r} holds {batch.column(name).type}, not numbers"
                        ) from error
                done += len(block)
                yield block, done

    def _next(self, batches: Iterator[Any], done: int) -> Any:
        """Return the next batch, None after the last; raise LinkwiseError for damaged data."""
        try:
            return next(batches, None)
        except _unreadable(extra("pyarrow")) as error:
            reason = one_line(str(error), LONGEST_REASON)
            raise LinkwiseError(
                f"{self.path}: after row {done}: damaged ({reason}); write the file again"
            ) from error


def _is_numeric(types: Any, kind: Any) -> bool:
    """Return whether a type of pyarrow is numeric, or of empty cells only."""
    kind = kind.value_type if types.is_dictionary(kind) else kind
    asked = types.is_integer, types.is_floating, types.is_boolean, types.is_decimal, types.is_null
    return any(is_kind(kind) for is_kind in asked)


def _unreadable(arrow: Any) -> tuple[type[Exception], ...]:
    """Return the exceptions that pyarrow raises for a file that is not valid Parquet."""
    return arrow.ArrowException, OSError, ValueError, MemoryError, OverflowError
