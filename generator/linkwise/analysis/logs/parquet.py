"""Logs in Parquet; rows are numbered from 1, the first sample."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from linkwise.errors import LinkwiseError
from linkwise.extras import extra
from linkwise.package.load import Array


@dataclass(frozen=True)
class ParquetLog:
    """A Parquet file of numeric columns; an empty cell is read as NaN."""

    path: Path
    columns: tuple[str, ...]
    size: int
    """Rows in the file."""
    degrees: bool | None = None
    first_row: int = 1
    warnings: tuple[str, ...] = ()

    @classmethod
    def open(cls, path: Path) -> "ParquetLog":
        """Read the file's schema; raises LinkwiseError for a file that is cut off, or is not Parquet."""
        parquet, arrow = extra("pyarrow.parquet"), extra("pyarrow")
        try:
            metadata = parquet.read_metadata(path)
        except arrow.ArrowInvalid as error:
            raise LinkwiseError(f"{path}: not Parquet, or cut off") from error
        return cls(path, tuple(metadata.schema.to_arrow_schema().names), metadata.num_rows)

    def read(self, columns: Sequence[int], rows: int = 65536) -> Iterator[tuple[Array, int]]:
        """Yield blocks (at most `rows`, len(columns)) and the rows read so far.

        Raises LinkwiseError for a column that does not hold numbers.
        """
        arrow = extra("pyarrow")
        names, done = [self.columns[column] for column in columns], 0
        with extra("pyarrow.parquet").ParquetFile(self.path) as file:
            for batch in file.iter_batches(rows, columns=names):
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
