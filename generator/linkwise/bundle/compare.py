"""ResultComparison of two results of one analysis, column by column."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from linkwise.analysis.run import RECORD
from linkwise.arrays import Array
from linkwise.errors import LinkwiseError
from linkwise.escape import listed
from linkwise.extras import extra
from linkwise.package.decode import parse_json

TABLES = ("analysis.parquet", "analysis.csv")
AT_ONCE = 256
"""Columns that are compared at once, which bounds memory."""
OF_RECORD = ("mean_magnitude", "peak_magnitude")
"""Entries of a column in a record, where there is no table."""


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
    samples: int
    relative: float
    worst: Difference | None
    missing: tuple[str, ...]
    added: tuple[str, ...]
    of_record: bool
    """True where there is no table: means and peaks were compared."""

    def is_same(self, tolerance: float) -> bool:
        """Return whether all numbers agree within a share of the largest with their unit."""
        return not (self.missing or self.added) and self.relative <= tolerance

    @property
    def lines(self) -> list[str]:
        """Text of the comparison."""
        what = "mean and peak of" if self.of_record else f"{self.samples:,} samples of"
        told = [f"compared: {what} {self.columns:,} columns"]
        for names, where in ((self.missing, "not here"), (self.added, "not in the bundle")):
            told += [f"{len(names)} columns {where}: {listed(names)}"] if names else []
        if self.worst is None:
            return [*told, "no number differs"]
        one = self.worst
        where = OF_RECORD[one.at].replace("_", " ") if self.of_record else f"sample {one.at}"
        return [
            *told,
            f"largest difference: {one.largest:.3g} {one.unit} in {one.column}, {where};"
            f" {self.relative:.1e} of the largest number in {one.unit or 'that unit'}",
        ]


def compared(former: Path, now: Path) -> ResultComparison:
    """Return how a result differs from a former one: folders with a record and, where asked for, a table.

    Raises LinkwiseError for results of different numbers of samples.
    """
    records = [_record(former), _record(now)]
    units = {column["name"]: column["unit"] for column in records[0]["columns"]}
    names = [[column["name"] for column in record["columns"]] for record in records]
    shared = [name for name in names[0] if name in set(names[1])]
    samples = [record["samples"] for record in records]
    if samples[0] != samples[1]:
        raise LinkwiseError(f"the bundle's result has {samples[0]:,} samples, and this one {samples[1]:,}")
    tables = [_table(former), _table(now)]
    is_of_record = None in tables
    worst, largest = _differences(records if is_of_record else tables, shared, units)
    relative = {name: _share(one.largest, largest[one.unit]) for name, one in worst.items()}
    first = max(relative, key=relative.__getitem__, default=None)
    is_none = first is None or relative[first] == 0
    return ResultComparison(
        len(shared),
        samples[0],
        0.0 if first is None else relative[first],
        None if first is None or is_none else worst[first],
        tuple(name for name in names[0] if name not in set(names[1])),
        tuple(name for name in names[1] if name not in set(names[0])),
        is_of_record,
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
    """Yield the columns of a table, or of a record, as arrays."""
    if isinstance(source, Mapping):
        told = {column["name"]: column for column in source["columns"]}
        yield from (np.array([float(told[name][key]) for key in OF_RECORD]) for name in names)
        return
    found = source.to_table(columns=list(names))
    yield from (found.column(name).to_numpy().astype(float) for name in names)


def _table(folder: Path) -> Any:
    path = next((folder / name for name in TABLES if (folder / name).is_file()), None)
    if path is None:
        return None
    return extra("pyarrow.dataset").dataset(path, format=path.suffix[1:])


def _record(folder: Path) -> dict[str, Any]:
    try:
        found: dict[str, Any] = parse_json((folder / RECORD).read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise LinkwiseError(f"{RECORD} of the bundle cannot be read: {error}") from error
    return found
