"""Headers of text logs: CSV's single header line, OpenSim's lines up to `endheader`."""

import re
from itertools import islice
from pathlib import Path

from linkwise.analysis.logs.text import SHOWN, TextLog, is_number, split_cells, whole_lines
from linkwise.errors import LinkwiseError, within
from linkwise.escape import short

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

    The last two are called datarows and datacolumns in motions of SIMM.

    Raises LinkwiseError for a header that is truncated or contradicts itself.
    """
    facts, names, row = _storage_header(path)
    columns = _columns(path, row, names.rstrip(), "\t" if "\t" in names else None)
    if not any(columns):
        raise LinkwiseError(f"{path}: row {row}: no column names after 'endheader'")
    promised = _count(path, facts, "nColumns")
    if promised is not None and promised != len(columns):
        raise LinkwiseError(
            f"{path}: row {row}: {len(columns)} column names where the header promises nColumns={promised}"
        )
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
    rows = _count(path, facts, "nRows")
    # Values are padded with blanks, so any run of blanks separates them, whatever separates the names.
    return TextLog(path, columns, row + 1, None, degrees, rows, _warnings_of_the_end(path, None))


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


def _count(path: Path, facts: dict[str, str], key: str) -> int | None:
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
