"""Comparison of two results of one analysis: tables column by column, and the numbers of their records."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from linkwise.analysis.run import RECORD
from linkwise.arrays import Array
from linkwise.bundle.record_numbers import RecordComparison
from linkwise.errors import LinkwiseError
from linkwise.escape import listed, one_line
from linkwise.extras import extra
from linkwise.package.decode import parse_json

TABLES = ("analysis.parquet", "analysis.csv")
AT_ONCE = 256
"""Columns that are compared at once, which bounds memory."""


@dataclass(frozen=True)
class Difference:
    """Largest difference in one column, and the place of the sample."""

    column: str
    unit: str
    largest: float
    at: int


@dataclass(frozen=True)
class ResultComparison:
    """Differences of a result from a former one.

    `relative` is the largest difference as a share of the largest number that has the same unit; infinite
    where one result has a number and the other none. `worst` is where it is.
    """

    columns: int
    """Number of columns of tables that both have; 0 where one has no table."""
    samples: int
    relative: float
    worst: Difference | None
    missing: tuple[str, ...]
    added: tuple[str, ...]
    other_units: tuple[str, ...]
    """Columns that both have, in other units."""
    record: RecordComparison

    def is_same(self, tolerance: float) -> bool:
        """Return whether all numbers agree within a share of the largest with their unit."""
        is_same = not (self.missing or self.added or self.other_units) and self.relative <= tolerance
        return is_same and self.record.is_same(tolerance)

    @property
    def lines(self) -> list[str]:
        """Text of the comparison."""
        told = [f"compared: {self.samples:,} samples of {self.columns:,} columns"] if self.columns else []
        for names, where in (
            (self.missing, "not here"),
            (self.added, "not in the bundle"),
            (self.other_units, "in another unit"),
        ):
            told += [f"{len(names)} columns {where}: {listed(names)}"] if names else []
        one = self.worst
        if one is None:
            told += ["no number of them differs"] if self.columns else []
        elif not np.isfinite(one.largest):
            told.append(f"{one.column} has a number in one of them only, at sample {one.at}")
        else:
            told.append(
                f"largest difference: {one.largest:.3g} {one.unit} in {one.column}, sample {one.at};"
                f" {self.relative:.1e} of the largest number in {one.unit or 'that unit'}"
            )
        return [*told, *self.record.lines]


def compared(former: Path, now: Path) -> ResultComparison:
    """Return how a result differs from a former one: folders with a record and, where asked for, a table.

    Raises LinkwiseError for results of different numbers of samples, and for a former one that is damaged.
    """
    try:
        return _compared(former, now)
    except LinkwiseError:
        raise
    except (KeyError, TypeError, ValueError, OSError, extra("pyarrow").ArrowException) as error:
        raise LinkwiseError(f"its result is damaged: {one_line(str(error), 200)}") from error


def _compared(former: Path, now: Path) -> ResultComparison:
    records = [parse_json((folder / RECORD).read_text(encoding="utf-8")) for folder in (former, now)]
    units, now_units = ({one["name"]: one["unit"] for one in record["columns"]} for record in records)
    names = [list(units), list(now_units)]
    shared = [name for name in names[0] if name in set(names[1])]
    samples = [record["samples"] for record in records]
    if samples[0] != samples[1]:
        raise LinkwiseError(f"the bundle's result has {samples[0]:,} samples, and this one {samples[1]:,}")
    tables = [_table(folder, record) for folder, record in zip((former, now), records, strict=True)]
    shared = [] if None in tables else shared
    worst, largest = _differences(tables, shared, units)
    relative = {name: _share(one.largest, largest[one.unit]) for name, one in worst.items()}
    first = max(relative, key=relative.__getitem__, default=None)
    share = 0.0 if first is None else relative[first]
    return ResultComparison(
        len(shared),
        samples[0],
        share,
        worst[first] if first is not None and share else None,
        tuple(name for name in names[0] if name not in set(names[1])),
        tuple(name for name in names[1] if name not in set(names[0])),
        tuple(name for name, unit in now_units.items() if units.get(name, unit) != unit),
        RecordComparison.of(*records),
    )


def _differences(
    sources: Sequence[Any], names: Sequence[str], units: Mapping[str, str]
) -> tuple[dict[str, Difference], dict[str, float]]:
    """Return the largest difference of each column, and the largest number of each unit."""
    worst: dict[str, Difference] = {}
    largest: dict[str, float] = {}
    for begin in range(0, len(names), AT_ONCE):
        part = names[begin : begin + AT_ONCE]
        for name, was, now in zip(part, _values(sources[0], part), _values(sources[1], part), strict=True):
            unit = units[name]
            apart = np.where(was == now, 0.0, np.abs(was - now))
            apart[np.isnan(was) & np.isnan(now)] = 0.0
            apart[np.isnan(apart)] = np.inf
            at = int(apart.argmax()) if len(apart) else 0
            worst[name] = Difference(name, unit, float(apart.max(initial=0.0)), at)
            known = np.abs(was[np.isfinite(was)])
            largest[unit] = max(largest.get(unit, 0.0), float(known.max(initial=0.0)))
    return worst, largest


def _share(difference: float, largest: float) -> float:
    return difference / largest if difference and largest else (np.inf if difference else 0.0)


def _values(source: Any, names: Sequence[str]) -> Iterator[Array]:
    """Yield the columns of a table as arrays."""
    found = source.to_table(columns=list(names))
    yield from (found.column(name).to_numpy().astype(float) for name in names)


def _table(folder: Path, record: Mapping[str, Any]) -> Any:
    """Return the table that a record tells of, or None; raise LinkwiseError where it is not there."""
    name = next((name for name in TABLES if name in record["files"]), None)
    if name is None:
        return None
    if not (folder / name).is_file():
        raise LinkwiseError(f"its result lacks {name}")
    return extra("pyarrow.dataset").dataset(folder / name, format=name.rpartition(".")[2])
