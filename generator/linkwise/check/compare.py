"""Entries against a reference: each value by its own size, or by the rounding of what it is summed from."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

from linkwise.check.reference import TOLERANCE, Reference
from linkwise.package.load import Array

ROUNDINGS = 10.0
"""Roundings that a value may gather, each as large as that of the numbers that it is summed from."""


@dataclass(frozen=True)
class Result:
    """One check: its name, whether it passed, the largest error (None: not a number's matter), and a line."""

    name: str
    passed: bool
    error: float | None
    detail: str

    @property
    def mark(self) -> str:
        """Return ok, FAIL or skip."""
        return "ok" if self.passed else "FAIL"


class Skipped(Result):
    """A check that could not be made here, which speaks neither for the package nor against it."""

    def __init__(self, name: str, detail: str) -> None:
        super().__init__(name, True, None, detail)

    @property
    def mark(self) -> str:
        """Return skip."""
        return "skip"


@dataclass(frozen=True)
class Entries:
    """Values beside those expected, samples first; scale: size of the numbers that each is the sum of."""

    what: str
    value: Array
    expected: Array
    scale: Array


def compare(
    name: str, groups: Iterable[Entries], tolerance: float = TOLERANCE, epsilon: float = 2.0**-52
) -> Result:
    """Hold groups of entries against what is expected of them, and report the worst.

    A value's error is relative to the value itself; where that is next to nothing, an error as large as what
    rounding leaves of its operands, ROUNDINGS · epsilon · scale, passes just so.
    """
    worst, place = 0.0, ""
    for entries in groups:
        value, expected = np.asarray(entries.value), entries.expected
        if value.shape != expected.shape:
            return Result(
                name, False, None, f"{entries.what} has shape {value.shape} instead of {expected.shape}"
            )
        if not value.size:
            continue
        least = ROUNDINGS * epsilon / tolerance * entries.scale
        own = np.maximum(np.abs(expected), np.maximum(least, 1e-300))
        errors = np.abs(value.astype(float) - expected) / own
        errors = np.where(np.isnan(errors), np.inf, errors)
        if errors.max() > worst:
            worst, (_, *at) = float(errors.max()), np.unravel_index(errors.argmax(), errors.shape)
            indices = f"({', '.join(str(index + 1) for index in at)})" if at else ""
            place = f"{entries.what}{indices}"
    detail = f"largest relative error {worst:.1e}"
    return Result(name, worst <= tolerance, worst, detail if worst <= tolerance else f"{detail} at {place}")


def dense(what: str, value: Array, reference: Reference, rows: Any = slice(None)) -> Entries:
    """A dense quantity of some of the reference's samples."""
    return Entries(what, value, reference.values[what][rows], reference.scales[what][rows])
