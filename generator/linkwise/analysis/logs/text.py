"""Numbers of a text log, block by block; what is not a number is reported by row and column.

Rows are numbered as an editor numbers lines, from 1, header included.
"""

import csv
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import TextIO

import numpy as np

from linkwise.errors import LinkwiseError, within
from linkwise.escape import short
from linkwise.package.load import Array

LONGEST = 1 << 24
"""Most characters of a line, enough for a million columns, and about as many as are in memory at once."""
SHOWN = 60
"""Most characters of a cell that a message shows."""
BLANK = ": blank row; delete it, or fill the gap"
DECIMAL_COMMA = re.compile(r"[-+]?\d*,\d+([eE][-+]?\d+)?")


@dataclass(frozen=True)
class TextLog:
    """A log of delimited text.

    delimiter: None for any run of blanks; promised: the number of samples that the header promises, if any
    """

    path: Path
    columns: tuple[str, ...]
    first_row: int
    delimiter: str | None
    degrees: bool | None = None
    promised: int | None = None
    warnings: tuple[str, ...] = ()
    brought: frozenset[str] = frozenset()

    @property
    def size(self) -> int:
        """Number of bytes in the file."""
        return self.path.stat().st_size

    def read(self, columns: Sequence[int], rows: int = 65536) -> Iterator[tuple[Array, int]]:
        """Yield blocks (at most `rows`, len(columns)) and the bytes read so far.

        Raises LinkwiseError that names row and column for what is not a number, and for a truncated file.
        """
        row, done, blank = self.first_row, 0, 0
        with self.path.open(encoding="utf-8-sig") as handle:
            try:
                whole = whole_lines(handle, self.path, 1)
                done += sum(len(line) for line in islice(whole, self.first_row - 1))
                for lines in _blocks(whole, rows):
                    if blank and any(map(str.strip, lines)):
                        raise LinkwiseError(f"{self.path}: row {row}{BLANK}")
                    done += sum(map(len, lines))
                    count = len(lines)
                    block = self._numbers(lines, columns, row)
                    row, blank = row + len(block), blank + count - len(block)
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
        """Find the first faulty line, slowly, and return its error; only ever run on a faulty block."""
        for number, line in enumerate(lines, row):
            with within(f"{self.path}: row {number}"):
                fault = self._fault(line, columns)
            if fault is not None:
                return LinkwiseError(f"{self.path}: row {number}{fault}")
        return None

    def _fault(self, line: str, columns: Sequence[int]) -> str | None:
        """Return the fault of a line, to stand after its number in a message; None if there is none."""
        if not line.strip():
            return BLANK
        cells = split_cells(line, self.delimiter)
        counts = f": {len(cells)} cells where the header names {len(self.columns)}"
        if len(cells) <= max(columns):
            return f"{counts}; the file is cut off or the row is"
        if any(cell.strip() for cell in cells[len(self.columns) :]):
            return f"{counts}; is there a comma within a number?"
        for column in columns:
            cell, where = cells[column].strip(), f", column {short(self.columns[column], SHOWN)!r}"
            if not cell:
                return f"{where}: empty; fill the gap"
            if DECIMAL_COMMA.fullmatch(cell):
                return f"{where}: {short(cell, SHOWN)!r} has a decimal comma; write decimal points"
            if not is_number(cell):
                return f"{where}: {short(cell, SHOWN)!r} is not a number"
        return None


def split_cells(line: str, delimiter: str | None) -> list[str]:
    """Return the cells of a line, without quotes."""
    if delimiter is None:
        return line.split()
    try:
        return next(csv.reader([line.rstrip("\r\n")], delimiter=delimiter, skipinitialspace=True), [])
    except csv.Error as error:  # above all a cell longer than the module accepts
        raise LinkwiseError(f"cannot be read as separated values: {error}") from error


def whole_lines(handle: TextIO, path: Path, row: int) -> Iterator[str]:
    """Yield the lines of a text, the first with number `row`; raise LinkwiseError for one far too long."""
    while line := handle.readline(LONGEST):
        if len(line) == LONGEST and not line.endswith("\n"):
            raise LinkwiseError(f"{path}: row {row} has more than {LONGEST:,} characters; is it a log?")
        yield line
        row += 1


def _blocks(lines: Iterator[str], rows: int) -> Iterator[list[str]]:
    """Yield lists of at most `rows` lines, or fewer where lines are long."""
    block: list[str] = []
    held = 0
    for line in lines:
        block.append(line)
        held += len(line)
        if len(block) == rows or held > LONGEST:
            yield block
            block, held = [], 0
    if block:
        yield block


def is_number(cell: str) -> bool:
    """Return whether NumPy reads a cell as a number.

    Python's own float also accepts 1_000 and digits of other scripts.
    """
    try:
        float(cell)
    except ValueError:
        return False
    return cell.isascii() and "_" not in cell
