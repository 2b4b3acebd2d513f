"""Motion logs as delimited text, OpenSim storage and Parquet, broken."""

import io
from random import Random

import pyarrow as pa
import pyarrow.parquet as pq

from fuzz.case import JOINTS, Case
from fuzz.mutations import TEXTS, encoded, mutated_bytes, mutated_text


def random_rows(rng: Random) -> list[list[float]]:
    """Samples: a time in s, and a number for each joint."""
    count, step = rng.choice((0, 1, 5, 20, 40)), rng.choice((0.01, 0.01, 1.0, 1e-9))
    return [[k * step, *(rng.uniform(-1, 1) for _ in JOINTS)] for k in range(count)]


def log_case(rng: Random, name: str, content: bytes) -> Case:
    """An analysis of the log `name`, with a few flags."""
    flags: tuple[str, ...] = ("--no-page", "--format", rng.choice(("csv", "parquet")))
    if rng.random() < 0.05:
        flags = ()
    for flag in (
        "--ignore-extra", "--units=deg", "--cutoff=4", "--resample=50", "--edges=trim", "--map=joint1=joint2",
        "--derivative=savitzky-golay", "--convention=gradient", "--time=t", "--topic=arm", "--json",
    ):  # fmt: skip
        if rng.random() < 0.06:
            flags = (*flags, flag)
    return Case(
        ("analyze", f"{{in}}/{name}", "--robot", "{robot}", "--out", "{out}", *flags), {name: content}
    )


def csv(rng: Random) -> Case:
    """A log as delimited text."""
    mark = rng.choice((",", ",", ";", "\t"))
    rows = [["time", *JOINTS], *([repr(value) for value in row] for row in random_rows(rng))]
    text = "\n".join(mark.join(row) for row in rows) + "\n"
    if rng.random() < 0.9:
        text = mutated_text(rng, text)
    return log_case(rng, rng.choice(("log.csv", "log.csv", "log.txt", "log.TSV")), encoded(rng, text))


def storage(rng: Random) -> Case:
    """A log as OpenSim storage."""
    rows = random_rows(rng)
    lines = [
        "Coordinates",
        "version=1",
        f"nRows={len(rows)}",
        f"nColumns={len(JOINTS) + 1}",
        "inDegrees=yes",
        "",
    ]
    lines += ["endheader", "\t".join(["time", *JOINTS])]
    lines += ["\t".join(f"{value:16.8f}" for value in row) for row in rows]
    text = "\n".join(lines) + "\n"
    if rng.random() < 0.9:
        text = mutated_text(rng, text)
    return log_case(rng, rng.choice(("log.mot", "log.sto")), encoded(rng, text))


def parquet(rng: Random) -> Case:
    """A log in Parquet: bytes flipped, or columns of other types."""
    table = list(zip(*random_rows(rng), strict=True)) or [()] * 4
    columns = {
        name: pa.array(values, pa.float64()) for name, values in zip(("time", *JOINTS), table, strict=True)
    }
    if rng.random() < 0.4:
        count, name = len(table[0]), rng.choice(list(columns))
        other: tuple[object, ...] = ("x", None, True, b"\xff", [1.0], {"a": 1}, 10**18, float("nan"))
        columns[name] = pa.array([rng.choice(other)] * count)
        columns[rng.choice(TEXTS)] = columns.pop(rng.choice(list(columns)))
    buffer = io.BytesIO()
    codec = rng.choice(("none", "snappy", "zstd", "gzip"))
    pq.write_table(pa.table(columns), buffer, compression=codec)
    content = buffer.getvalue()
    return log_case(rng, "log.parquet", mutated_bytes(rng, content) if rng.random() < 0.8 else content)
