"""Text logs: CSV with a single header line, and OpenSim's storage with lines up to `endheader`.

Numbers are read block by block; what is not a number is reported by row and column. Rows are numbered as an
editor numbers lines, from 1, header included.
"""

import csv
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import TextIO

import numpy as np

from linkwise.arrays import Array
from linkwise.errors import LinkwiseError, within
from linkwise.escape import short

LONGEST = 1 << 24
"""Most characters of a line, enough for a million columns, and about as many as are in memory at once."""
SHOWN = 60
"""Most characters of a cell that a message shows."""
BLANK = ": blank row; delete it, or fill the gap"
DECIMAL_COMMA = re.compile(r"[-+]?\d*,\d+([eE][-+]?\d+)?")


@dataclass(frozen=True)
class TextLog:
    """A log of delimited text.

    delimiter: None for any run of blanks
    """

    path: Path
    columns: tuple[str, ...]
    first_row: int
    delimiter: str | None
    degrees: bool | None = None
    warnings: tuple[str, ...] = ()
    brought: frozenset[str] = frozenset()

    @property
    def size(self) -> int:
        """Number of bytes in the file."""
        return self.path.stat().st_size

    def read(self, columns: Sequence[int], rows: int = 65536) -> Iterator[tuple[Array, int]]:
        """Yield blocks (at most `rows`, len(columns)) and the bytes read so far.

        Raises LinkwiseError that names row and column for what is not a number.
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


READ = {name.lower(): name for name in ("inDegrees", "nRows", "nColumns", "DataType")}
"""Keys of a header that are read."""
SIMM = {"datacolumns": "ncolumns", "datarows": "nrows"}
"""Keys of the same meaning in motions of SIMM, which OpenSim reads too."""
MOST_FACTS, MOST_DIGITS = 10_000, 15
"""Most lines above `endheader`, and most digits of a count: no recording has as many."""
TAIL = 1 << 16
"""Bytes at the end of a file that are searched for a truncated last row."""


def open_delimited(path: Path) -> TextLog:
    """Open a CSV file with one header line, whose separator all rows have: comma, semicolon or tab.

    Raises LinkwiseError for a file without a header.
    """
    with path.open(encoding="utf-8-sig") as handle:
        header = next(whole_lines(handle, path, 1), "")
    unquoted = re.sub(r'"[^"]*"', "", header)
    delimiter = next((mark for mark in ",;\t" if mark in unquoted), ",")
    columns = _columns(path, 1, header, delimiter)
    if not any(columns):
        raise LinkwiseError(f"{path}: row 1: no header; name the columns there, the time first")
    if all(is_number(name) for name in columns):
        raise LinkwiseError(f"{path}: row 1 holds numbers; put a header of column names above it")
    return TextLog(path, columns, 2, delimiter, warnings=_warnings_of_the_end(path, delimiter))


def open_storage(path: Path) -> TextLog:
    """Open an OpenSim .mot or .sto file with the facts of its header: inDegrees, nRows and nColumns.

    The last two are called datarows and datacolumns in motions of SIMM. As in OpenSim's tables, the names and
    rows that are there count; where these two say otherwise, that is a warning.

    Raises LinkwiseError for a header that is truncated or contradicts itself.
    """
    facts, names, row = _storage_header(path)
    columns = _columns(path, row, names.rstrip(), "\t" if "\t" in names else None)
    if not any(columns):
        raise LinkwiseError(f"{path}: row {row}: no column names after 'endheader'")
    kind = facts.get("datatype", "double")
    if kind.lower() not in {"double", "float"}:
        raise LinkwiseError(
            f"{path}: DataType={short(kind, SHOWN)!r}: a cell holds several numbers; write each in a column"
            " of its own, as flatten() of OpenSim's tables does"
        )
    told = facts.get("indegrees")
    degrees = None if told is None else {"yes": True, "no": False}.get(told.lower())
    if told is not None and degrees is None:
        raise LinkwiseError(f"{path}: inDegrees={short(told, SHOWN)!r} in the header is neither yes nor no")
    warnings = (*_miscounted(path, facts, len(columns), row), *_warnings_of_the_end(path, None))
    # Values are padded with blanks, so any run of blanks separates them, whatever separates the names.
    return TextLog(path, columns, row + 1, None, degrees, warnings)


def _miscounted(path: Path, facts: Mapping[str, str], columns: int, row: int) -> Iterator[str]:
    """Yield warnings where the header promises other counts than there are.

    columns: number of names; row: number of the row that holds them
    """
    if (promised := _count(path, facts, "nColumns")) not in (None, columns):
        yield f"the header promises nColumns={promised}, and {columns} columns have names, which count"
    promised = _count(path, facts, "nRows")
    if promised is not None and promised != (found := _rows_below(path, row)):
        doubt = ": is the file cut off?" if found < promised else ", which all count"
        yield f"the header promises nRows={promised}, and {found} rows follow{doubt}"


def _rows_below(path: Path, row: int) -> int:
    """Return the number of rows behind one, without blank ones at the end."""
    last = count = 0
    with path.open("rb") as handle:
        for count, line in enumerate(handle, 1):
            last = count if line.strip() else last
    return max(0, last - row)


def _storage_header(path: Path) -> tuple[dict[str, str], str, int]:
    """Return the facts `key=value`, by key in lower case, the line of column names, and its number."""
    facts: dict[str, str] = {}
    with path.open(encoding="utf-8-sig") as handle:
        lines = whole_lines(handle, path, 1)
        for row, line in enumerate(islice(lines, MOST_FACTS), 1):
            if line.strip().lower() == "endheader":
                return facts, next(lines, ""), row + 1
            key, value = _fact(line)
            if key in READ and facts.setdefault(key, value).lower() != value.lower():
                both = f"{short(facts[key], SHOWN)!r} before, {short(value, SHOWN)!r} here"
                raise LinkwiseError(f"{path}: row {row}: the header says {READ[key]} twice, {both}; keep one")
    raise LinkwiseError(f"{path}: no line 'endheader'; the file is cut off or not OpenSim's")


def _fact(line: str) -> tuple[str, str]:
    """Return the key, in lower case, and the value of a header line; SIMM writes no equals sign."""
    key, equals, value = line.partition("=")
    if equals:
        return key.strip().lower(), value.strip()
    key, _, value = line.strip().partition(" ")
    return SIMM.get(key.lower(), ""), value.strip()


def _columns(path: Path, row: int, line: str, delimiter: str | None) -> tuple[str, ...]:
    if "\0" in line:
        raise LinkwiseError(f"{path}: row {row}: zero bytes among the column names; save it as UTF-8 text")
    with within(f"{path}: row {row}"):
        return tuple(name.strip() for name in split_cells(line, delimiter))


def _count(path: Path, facts: Mapping[str, str], key: str) -> int | None:
    text = facts.get(key.lower())
    if text is None:
        return None
    if not text.isdecimal() or len(text) > MOST_DIGITS:
        raise LinkwiseError(f"{path}: {key}={short(text, SHOWN)!r} in the header is not a count")
    return int(text)


def _warnings_of_the_end(path: Path, delimiter: str | None) -> tuple[str, ...]:
    """Return a warning if the last row has no line end, and a shorter last number than the rows before."""
    with path.open("rb") as handle:
        handle.seek(max(0, path.stat().st_size - TAIL))
        *rows, last = handle.read().decode("utf-8", "replace").split("\n")
    ends = [(row.split(delimiter) or [""])[-1].strip() for row in [*rows[-20:], last]]
    lengths = [len(end) for end in ends]
    if not last.strip() or len(ends) < 3 or lengths[-1] >= min(lengths[1:-1]):
        return ()
    return (
        f"the last row has no line end, and its last number {short(ends[-1], SHOWN)!r} is shorter than those"
        " before: the file may be cut off there",
    )
