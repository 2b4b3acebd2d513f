"""Logs in text: CSV with one header line; OpenSim's .mot and .sto with one up to `endheader`.

Rows are numbered as an editor numbers lines, from 1, header included.
"""

import csv
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import islice
from pathlib import Path

import numpy as np

from linkwise.analysis.log import BLOCK, Array
from linkwise.analysis.text_end import doubts_of_the_end
from linkwise.errors import LinkwiseError


@dataclass(frozen=True)
class TextLog:
    """Delimited text; `delimiter` None is any run of blanks, `rows` what the header promises."""

    path: Path
    columns: tuple[str, ...]
    first_row: int
    delimiter: str | None
    degrees: bool | None = None
    rows: int | None = None
    doubts: tuple[str, ...] = ()

    @property
    def size(self) -> int:
        """Bytes in the file."""
        return self.path.stat().st_size

    def read(self, columns: Sequence[int]) -> Iterator[tuple[Array, int]]:
        """Yield blocks of the given columns and the bytes read so far."""
        row, done = self.first_row, 0
        with self.path.open(encoding="utf-8-sig") as handle:
            done += sum(len(line) for line in islice(handle, self.first_row - 1))
            try:
                while lines := list(islice(handle, BLOCK)):
                    done += sum(map(len, lines))
                    block = self._numbers(lines, columns, row)
                    row += len(block)
                    yield block, done
            except UnicodeDecodeError as error:
                raise LinkwiseError(f"{self.path}: row {row} or after: not UTF-8 text") from error
        found = row - self.first_row
        if self.rows is not None and found != self.rows:
            raise LinkwiseError(
                f"{self.path}: the header promises nRows={self.rows} but {found} rows follow"
                f" (the last is row {row - 1}); the file is cut off or nRows is wrong"
            )

    def _numbers(self, lines: list[str], columns: Sequence[int], row: int) -> Array:
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
            raise self._fault(lines, columns, row) or LinkwiseError(
                f"{self.path}: rows from {row}: {error}"
            ) from error
        # loadtxt skips blank lines, and cells past the columns it was asked for.
        if len(block) != len(lines) or any(map(self._is_long, lines)):
            fault = self._fault(lines, columns, row)
            if fault is not None:
                raise fault
        return block

    def _is_long(self, line: str) -> bool:
        if self.delimiter is None:
            return len(line.split()) > len(self.columns)
        return line.count(self.delimiter) >= len(self.columns)

    def _fault(self, lines: list[str], columns: Sequence[int], row: int) -> LinkwiseError | None:
        """Find the first cell that is no number, slowly: only ever run on a faulty block."""
        for number, line in enumerate(lines, row):
            where = f"{self.path}: row {number}"
            if not line.strip():
                return LinkwiseError(f"{where}: blank row; delete it, or fill the gap")
            cells = _cells(line, self.delimiter)
            if len(cells) <= max(columns):
                return LinkwiseError(
                    f"{where}: {len(cells)} cells where the header names {len(self.columns)};"
                    " the file is cut off or the row is"
                )
            if any(cell.strip() for cell in cells[len(self.columns) :]):
                return LinkwiseError(
                    f"{where}: {len(cells)} cells where the header names {len(self.columns)};"
                    " is there a comma within a number?"
                )
            for column in columns:
                cell, name = cells[column].strip(), self.columns[column]
                if not cell:
                    return LinkwiseError(f"{where}, column {name!r}: empty; fill the gap")
                try:
                    float(cell)
                except ValueError:
                    if re.fullmatch(r"[-+]?\d*,\d+([eE][-+]?\d+)?", cell):
                        return LinkwiseError(
                            f"{where}, column {name!r}: {cell!r} has a decimal comma; write decimal points"
                        )
                    return LinkwiseError(f"{where}, column {name!r}: {cell!r} is not a number")
        return None


def open_delimited(path: Path) -> TextLog:
    """Open a CSV file: one header line; comma, semicolon or tab, whichever the header has."""
    with path.open(encoding="utf-8-sig") as handle:
        header = handle.readline()
    unquoted = re.sub(r'"[^"]*"', "", header)
    delimiter = next((mark for mark in ",;\t" if mark in unquoted), ",")
    columns = tuple(name.strip() for name in _cells(header, delimiter))
    if not any(columns):
        raise LinkwiseError(f"{path}: row 1: no header; name the columns there, the time first")
    if all(_is_number(name) for name in columns):
        raise LinkwiseError(f"{path}: row 1 holds numbers; put a header of column names above it")
    return TextLog(path, columns, 2, delimiter, doubts=doubts_of_the_end(path, delimiter))


def open_storage(path: Path) -> TextLog:
    """Open an OpenSim .mot or .sto file, honouring inDegrees, nRows and nColumns."""
    facts: dict[str, str] = {}
    with path.open(encoding="utf-8-sig") as handle:
        row = 0
        for line in handle:
            row += 1
            key, _, value = line.partition("=")
            facts[key.strip().lower()] = value.strip()
            if line.strip().lower() == "endheader":
                break
        else:
            raise LinkwiseError(f"{path}: no line 'endheader'; the file is cut off or not OpenSim's")
        names = handle.readline()
    delimiter = "\t" if "\t" in names else None
    columns = tuple(name.strip() for name in _cells(names.rstrip(), delimiter))
    if not any(columns):
        raise LinkwiseError(f"{path}: row {row + 1}: no column names after 'endheader'")
    wanted = _count(path, facts, "nColumns")
    if wanted is not None and wanted != len(columns):
        raise LinkwiseError(
            f"{path}: row {row + 1}: {len(columns)} column names where the header promises nColumns={wanted}"
        )
    said = facts.get("indegrees")
    degrees = None if said is None else {"yes": True, "no": False}.get(said.lower())
    if said is not None and degrees is None:
        raise LinkwiseError(f"{path}: inDegrees={said!r} in the header is neither yes nor no")
    # Values are padded with blanks, so any run of blanks parts them, whatever parts the names.
    return TextLog(
        path,
        columns,
        row + 2,
        None,
        degrees,
        _count(path, facts, "nRows"),
        doubts_of_the_end(path, None),
    )


def _count(path: Path, facts: dict[str, str], key: str) -> int | None:
    text = facts.get(key.lower())
    if text is None:
        return None
    if not text.isdecimal():
        raise LinkwiseError(f"{path}: {key}={text!r} in the header is not a count")
    return int(text)


def _cells(line: str, delimiter: str | None) -> list[str]:
    if delimiter is None:
        return line.split()
    return next(csv.reader([line.rstrip("\r\n")], delimiter=delimiter, skipinitialspace=True), [])


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True
