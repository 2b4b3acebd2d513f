"""Shares of torque at their largest magnitude, with their deviation there, and whether their sign is certain.

The sign of a share is certain if, where its magnitude is largest, that is two standard deviations or more.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from math import floor, log10
from typing import Any, NamedTuple

import numpy as np

from linkwise.analysis.result_quantities import DEVIATION_OF, TERMS
from linkwise.analysis.result_rows import Column, ResultRows
from linkwise.arrays import Array, Index

DEVIATIONS = 2.0
"""Standard deviations at which a sign counts as certain: one normal value in 44 is further off that way."""
TORQUES = ("tau", "tau_link", *TERMS, "tau_load")
"""Torques whose largest magnitudes are looked for."""
SMALL = 1e-3
"""Part of a joint's largest torque below which no share of it is listed."""


class LargestTorque(NamedTuple):
    """A torque at its largest magnitude in a movement."""

    column: Column
    value: float
    deviation: float
    time: float
    """Time in s."""

    @property
    def is_certain(self) -> bool:
        """True if its sign is certain."""
        return abs(self.value) >= DEVIATIONS * self.deviation and self.value != 0.0

    def record(self) -> dict[str, Any]:
        """Return this as plain data."""
        return {
            "name": self.column.name,
            "value": self.value,
            "sd": self.deviation,
            "unit": self.column.unit,
            "time": self.time,
            "sign_is_certain": self.is_certain,
        }


class LargestTorques:
    """Search for the largest magnitudes of torques that have deviations, block by block."""

    def __init__(self, rows: ResultRows) -> None:
        numbers = [
            (rows[torque].numbers, rows[name].numbers)
            for name, torque in DEVIATION_OF.items()
            if name in rows and torque in TORQUES
        ]
        none: Index = np.zeros(0, np.intp)
        self._rows = rows
        self._torques = np.concatenate([none, *(some for some, _ in numbers)])
        self._deviations = np.concatenate([none, *(some for _, some in numbers)])
        self._found = np.zeros((3, len(self._torques)))
        self._seen = np.full(len(self._torques), -1.0)

    def add(self, block: Array) -> None:
        """Look through a block (rows, samples)."""
        for place, (row, beside) in enumerate(zip(self._torques, self._deviations, strict=True)):
            at = int(np.abs(block[row]).argmax())
            if abs(block[row, at]) > self._seen[place]:
                self._seen[place] = abs(block[row, at])
                self._found[:, place] = block[row, at], block[beside, at], block[0, at]

    def peaks(self) -> tuple[LargestTorque, ...]:
        """Return what was found, in the order of rows."""
        columns = (self._rows.columns[row] for row in self._torques.tolist())
        return tuple(
            LargestTorque(column, *found)
            for column, found in zip(columns, self._found.T.tolist(), strict=True)
        )


@dataclass(frozen=True)
class CertainSigns:
    """Signs of the shares of a result, and how certain they are; names are those of links and joints."""

    peaks: tuple[LargestTorque, ...]
    joints: tuple[str, ...]
    links: tuple[str, ...]
    is_gradient: bool = False
    """True if torques by velocity are of the gradient convention, which counts them twice."""
    residuals: frozenset[int] = frozenset()
    """Numbers of the joints that nothing drives, which are told after the others."""

    @property
    def shares(self) -> tuple[LargestTorque, ...]:
        """Shares through one link by one cause, and of loads, that are not surely next to nothing."""
        most: dict[int | None, float] = {}
        for peak in self.peaks:
            most[peak.column.joint] = max(most.get(peak.column.joint, 0.0), abs(peak.value))
        return tuple(
            peak
            for peak in self.peaks
            if peak.column.quantity in (*TERMS, "tau_load")
            and abs(peak.value) + DEVIATIONS * peak.deviation > SMALL * most[peak.column.joint]
        )

    @property
    def uncertain(self) -> tuple[LargestTorque, ...]:
        """Shares whose sign is not certain, the largest first, of residuals last."""
        found = (p for p in self.shares if not p.is_certain)
        return tuple(sorted(found, key=lambda p: (p.column.joint in self.residuals, -abs(p.value))))

    @property
    def sentence(self) -> str:
        """Sentence about the largest share of a velocity whose sign is certain, else of an acceleration."""
        for quantity, what in (("tau_qd", "velocity"), ("tau_qdd", "acceleration")):
            certain = [p for p in self.shares if p.column.quantity == quantity and p.is_certain]
            if certain:
                told = max(certain, key=lambda p: (p.column.joint not in self.residuals, abs(p.value)))
                column = told.column
                assert column.joint is not None
                assert column.link is not None
                assert column.cause is not None
                return (
                    f"the {what} of {self.joints[column.cause]} asked {self.joints[column.joint]} for"
                    f" {plus_minus(told.value, told.deviation)} {column.unit} through"
                    f" {self.links[column.link]} at {told.time:.2f} s"
                    f"{' (gradient convention)' if self.is_gradient and quantity == 'tau_qd' else ''}"
                )
        return ""

    @property
    def lines(self) -> Iterator[str]:
        """Yield the lines that a terminal shows."""
        unsure, count = self.uncertain, len(self.shares)
        if not count:
            return
        told = f"{len(unsure)} of {count} shares have no certain sign even where they are largest"
        if not unsure:
            told = f"all {count} shares have a certain sign where they are largest"
        shown = ", ".join(
            f"{p.column.name}{' (residual)' * (p.column.joint in self.residuals)}"
            f" {plus_minus(p.value, p.deviation)} {p.column.unit}"
            for p in unsure[:SHOWN]
        )
        more = f" and {len(unsure) - SHOWN} more" if len(unsure) > SHOWN else ""
        yield f"{told}{': ' if shown else ''}{shown}{more}"
        if self.sentence:
            yield self.sentence

    def record(self) -> dict[str, Any]:
        """Return this as plain data; nothing where no share is among the columns that were asked for."""
        if not self.shares:
            return {}
        return {
            "sign_is_certain_from_deviations": DEVIATIONS,
            "left_out_below_part_of_largest": SMALL,
            "shares": len(self.shares),
            "without_certain_sign": [peak.record() for peak in self.uncertain],
            "sentence": self.sentence,
            "at_largest": [peak.record() for peak in self.peaks],
        }


SHOWN = 5
"""Shares that a line lists."""


def plus_minus(value: float, deviation: float) -> str:
    """Return a value and its deviation, with as many digits as that tells: -8.7 ± 0.9, 12.31 ± 0.14."""
    if not deviation > 0:
        return f"{value:.4g} ± {deviation:.1g}"
    first = floor(log10(float(f"{deviation:.1e}")))
    digits = max(0, (1 if deviation / 10.0**first < 2.0 else 0) - first)
    return f"{value:.{digits}f} ± {deviation:.{digits}f}"
