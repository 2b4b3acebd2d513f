"""Numbers of two records, by place: work, residuals, cutoff sweeps, markers, peaks of columns, and others."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from linkwise.escape import listed

NAMING = ("name", "phase", "joint", "load", "contact", "link", "marker", "body")
"""Entries by whose text an object in a list is called."""
NOT_COMPARED = frozenset({"schema", "time", "peak_time"})
"""The record's form, and times of peaks, which leap where two peaks are alike but for the last digit."""


@dataclass(frozen=True)
class RecordEntry:
    """A number, and all others like it: those of one key and one unit."""

    value: float
    alike: tuple[str, ...]


@dataclass(frozen=True)
class RecordComparison:
    """Differences of a record's numbers from those of a former one.

    `relative` is the largest difference, as a share of the largest number like it, or of 1 where that is
    less; `worst` tells its place and both numbers.
    """

    count: int
    relative: float
    worst: str
    missing: tuple[str, ...]
    added: tuple[str, ...]

    @classmethod
    def of(cls, former: Mapping[str, Any], now: Mapping[str, Any]) -> "RecordComparison":
        """Compare two records."""
        was, found = numbers_of(former), numbers_of(now)
        largest: dict[tuple[str, ...], float] = {}
        for entry in was.values():
            largest[entry.alike] = max(largest.get(entry.alike, 1.0), abs(entry.value))
        apart = {
            place: abs(found[place].value - entry.value) / largest[entry.alike]
            for place, entry in was.items()
            if place in found and found[place].value != entry.value
        }
        place = max(apart, key=apart.__getitem__, default="")
        return cls(
            sum(place in found for place in was),
            apart[place] if place else 0.0,
            f"{place}: {was[place].value:.9g} before, {found[place].value:.9g} now" if place else "",
            tuple(place for place in was if place not in found),
            tuple(place for place in found if place not in was),
        )

    def is_same(self, tolerance: float) -> bool:
        """Return whether both have the same numbers within a share of the largest like them."""
        return not (self.missing or self.added) and self.relative <= tolerance

    @property
    def lines(self) -> list[str]:
        """Text of the comparison."""
        told = [f"compared: {self.count:,} numbers of the record"]
        for places, where in ((self.missing, "not here"), (self.added, "not in the bundle")):
            told += [f"{len(places)} numbers {where}: {listed(places)}"] if places else []
        largest = f"; largest difference: {self.relative:.1e}, {self.worst}" if self.worst else ""
        return [f"{told[0]}{largest or '; none differs'}", *told[1:]]


def numbers_of(record: Mapping[str, Any]) -> dict[str, RecordEntry]:
    """Return all numbers of a record by their place, such as work/of_joints/hip/net."""
    return {"/".join(place): RecordEntry(value, alike) for place, alike, value in _walked(record, (), (), "")}


def _walked(
    part: Any, place: tuple[str, ...], keys: tuple[str, ...], unit: str
) -> Iterator[tuple[tuple[str, ...], tuple[str, ...], float]]:
    """Yield the place, the keys with the unit, and the value of each number of a part of a record."""
    if isinstance(part, Mapping):
        unit = str(part.get("unit", unit))
        for key, inner in part.items():
            if key not in NOT_COMPARED:
                yield from _walked(inner, (*place, key), (*keys, key), unit)
    elif isinstance(part, list):
        called: dict[str, int] = {}
        for inner in part:
            own = _called(inner)
            number = called[own] = called.get(own, 0) + 1
            name = own if own and number == 1 else f"{own} {number}".strip()
            yield from _walked(inner, (*place, name), keys, unit)
    elif isinstance(part, (bool, int, float)):
        yield place, (*keys, unit), float(part)


def _called(part: Any) -> str:
    """Return what an object of a list is called; "" where it has no name."""
    told = part if isinstance(part, Mapping) else {}
    return " ".join(str(told[key]) for key in NAMING if isinstance(told.get(key), str))
