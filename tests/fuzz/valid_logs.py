"""Random motion logs as people write them: a table of numbers in one of the formats, and what it says."""

from random import Random
from typing import NamedTuple

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from numpy.typing import NDArray

NAMES = (
    "time",
    "hip",
    "knee angle",
    "Gelenk_ä",
    "関節",
    "a/b",
    "x.1",
    "q%",
    "#1",
    "tau=1",
    "left|right",
    "'s'",
)


class LogFile(NamedTuple):
    """A log's file name and bytes, and the columns and numbers in it."""

    name: str
    content: bytes
    columns: tuple[str, ...]
    table: NDArray[np.float64]


def random_log(rng: Random) -> LogFile:
    """Draw a log of 1 to 40 rows and 2 to 6 columns."""
    columns = tuple(rng.sample(NAMES, rng.randint(2, 6)))
    size = 10.0 ** rng.randint(-12, 12)
    rows = [[rng.uniform(-size, size) for _ in columns] for _ in range(rng.randint(1, 40))]
    table, kind = np.array(rows), rng.choice(("csv", "storage", "parquet"))
    if kind == "csv":
        return LogFile(
            rng.choice(("a.csv", "a.txt", "A.TSV")), _delimited(rng, columns, rows), columns, table
        )
    if kind == "storage":
        return LogFile(rng.choice(("a.mot", "a.sto")), _storage(rng, columns, rows), columns, table)
    sink = pa.BufferOutputStream()
    values = dict(zip(columns, (pa.array(column) for column in table.T.copy()), strict=True))
    pq.write_table(pa.table(values), sink, compression=rng.choice(("none", "snappy", "zstd", "gzip")))
    return LogFile("a.parquet", sink.getvalue().to_pybytes(), columns, table)


def _delimited(rng: Random, columns: tuple[str, ...], rows: list[list[float]]) -> bytes:
    mark, quote = rng.choice((",", ";", "\t", ", ")), rng.choice(('"', ""))
    lines = [mark.join(f"{quote}{name}{quote}" for name in columns)]
    lines += [mark.join(_number(rng, value) for value in row) for row in rows]
    return _text(rng, lines)


def _storage(rng: Random, columns: tuple[str, ...], rows: list[list[float]]) -> bytes:
    facts = [f"nRows={len(rows)}", f"nColumns={len(columns)}", f"inDegrees={rng.choice(('yes', 'no'))}"]
    rng.shuffle(facts)
    lines = ["Coordinates", "version=1", *rng.sample(facts, rng.randint(0, 3)), "", "endheader"]
    lines += ["\t".join(columns), *("\t".join(f"{_number(rng, v):>16}" for v in row) for row in rows)]
    return _text(rng, lines)


def _number(rng: Random, value: float) -> str:
    """A number that reads back exactly."""
    return rng.choice((repr(value), f"{value:.17g}", f"{value:+.17e}"))


def _text(rng: Random, lines: list[str]) -> bytes:
    end = rng.choice(("\n", "\r\n"))
    text = end.join(lines) + rng.choice((end, end + end))
    return text.encode(rng.choice(("utf-8", "utf-8-sig")))
