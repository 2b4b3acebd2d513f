"""The numbers of a log in text, block by block; what is not a number is named by row and column.

Rows are numbered as an editor numbers lines, from 1, header included.
"""

import csv
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import islice
from pathlib import Path

import numpy as np

from linkwise.errors import LinkwiseError
from linkwise.package.load import Array

DECIMAL_COMMA = re.compile(r"[-+]?\d*,\d+([eE][-+]?\d+)?")


@dataclass(frozen=True)
class TextLog:
    """Delimited text.

    delimiter: None is any run of blanks; promised: the number of samples that the header promises, if any
    """

    path: Path
    columns: tuple[str, ...]
    first_row: int
    delimiter: str | None
    degrees: bool | None = None
    promised: int | None = None
    warnings: tuple[str, ...] = ()

    @property
    def size(self) -> int:
        """Bytes in the file."""
        return self.path.stat().st_size

    def read(self, columns: Sequence[int], rows: int = 65536) -> Iterator[tuple[Array, int]]:
        """Yield blocks (at most `rows`, len(columns)) and the bytes read so far.

        Raises LinkwiseError that names row and column for what is not a number, and for a file cut off.
        """
        row, done = self.first_row, 0
        with self.path.open(encoding="utf-8-sig") as handle:
            done += sum(len(line) for line in islice(handle, self.first_row - 1))
            try:
                while lines := list(islice(handle, rows)):
                    done += sum(map(len, lines))
                    block = self._numbers(lines, columns, row)
                    row += len(block)
                    yield block, done
            except UnicodeDecodeError as error:
                raise LinkwiseError(f"{self.path}: row {row} or after: not UTF-8 text") from error
        found = row - self.first_row
        if self.promised is not None and found != self.promised:
            raise LinkwiseError(
                f"{self.path}: the header promises nRows={self.promised} but {found} rows follow"
                f" (the last is row {row - 1}); the file is cut off or nRows is wrong"
            )

    def _numbers(self, lines: list[str], columns: Sequence[int], row: int) -> Array:
        """Return the numbers (lines, columns); `row` is the number of the first line."""
        while lines and not lines[-1].strip():
            lines.pop()
        if not lines:
            return np.empty((0, len(columns)))
        try:
            block = np.loadtxt(
                lines,
                delimiter=self.delimiter,
                usecols=columns,
                comments=None,
                quotechar='"',
                ndmin=2,
            )
        except ValueError as error:
            raise self._first_fault(lines, columns, row) or LinkwiseError(
                f"{self.path}: rows from {row}: {error}"
            ) from error
        # loadtxt skips blank lines, and cells past the columns it was asked for.
        if len(block) != len(lines) or any(map(self._is_long, lines)):
            fault = self._first_fault(lines, columns, row)
            if fault is not None:
                raise fault
        return block

    def _is_long(self, line: str) -> bool:
        if self.delimiter is None:
            return len(line.split()) > len(self.columns)
        return line.count(self.delimiter) >= len(self.columns)

    def _first_fault(self, lines: list[str], columns: Sequence[int], row: int) -> LinkwiseError | None:
        """Find the first cell that is not a number, slowly: only ever run on a faulty block."""
        for number, line in enumerate(lines, row):
            fault = self._fault(line, columns)
            if fault is not None:
                return LinkwiseError(f"{self.path}: row {number}{fault}")
        return None

    def _fault(self, line: str, columns: Sequence[int]) -> str | None:
        """Say what is wrong with a line, to stand behind its number; None where nothing is."""
        if not line.strip():
            return ": blank row; delete it, or fill the gap"
        cells = split_cells(line, self.delimiter)
        counts = f": {len(cells)} cells where the header names {len(self.columns)}"
        if len(cells) <= max(columns):
            return f"{counts}; the file is cut off or the row is"
        if any(cell.strip() for cell in cells[len(self.columns) :]):
            return f"{counts}; is there a comma within a number?"
        for column in columns:
            cell, where = cells[column].strip(), f", column {self.columns[column]!r}"
            if not cell:
                return f"{where}: empty; fill the gap"
            try:
                float(cell)
            except ValueError:
                if DECIMAL_COMMA.fullmatch(cell):
                    return f"{where}: {cell!r} has a decimal comma; write decimal points"
                return f"{where}: {cell!r} is not a number"
        return None


def split_cells(line: str, delimiter: str | None) -> list[str]:
    """Cells of a line, quotes taken off."""
    if delimiter is None:
        return line.split()
    return next(csv.reader([line.rstrip("\r\n")], delimiter=delimiter, skipinitialspace=True), [])
