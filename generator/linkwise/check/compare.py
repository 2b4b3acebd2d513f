"""Entries against a reference: each value by its own size, or by the rounding of what it is summed from."""

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from linkwise.check.reference import TOLERANCE, Reference
from linkwise.package.load import Array

ROUNDINGS = 10.0
"""Roundings that a value may gather, each as large as that of the numbers that it is summed from."""


SHORT_OF_MEMORY = ("allocate memory", "failed to map segment")
"""In errors of torch, and of the system where it loads a library."""
BLOCK = 1 << 20
"""Entries compared at a time."""


@dataclass(frozen=True)
class Result:
    """One check: its name, whether it held, the largest error (None: not a number's matter), and a line.

    held is None for what could not be checked here, which speaks neither for the package nor against it;
    the line says why.
    """

    name: str
    held: bool | None
    error: float | None
    detail: str

    @property
    def failed(self) -> bool:
        """Whether the package is wrong."""
        return self.held is False

    @property
    def mark(self) -> str:
        """Return ok, FAIL or skip."""
        return {True: "ok", False: "FAIL", None: "skip"}[self.held]


def skipped(name: str, reason: str) -> Result:
    """What could not be checked, and why."""
    return Result(name, None, None, reason)


def is_short_of_memory(error: Exception) -> bool:
    """Whether there was too little of it for an array, for one of torch's or for a library.

    These say so as RuntimeError, OSError and ImportError; any other may quote such words from a package.
    """
    if isinstance(error, RuntimeError | OSError | ImportError):
        return any(words in str(error) for words in SHORT_OF_MEMORY)
    return isinstance(error, MemoryError)


@dataclass(frozen=True)
class Entries:
    """Values beside those expected, samples first; scale: size of the numbers that each is the sum of.

    rows: of packed values (samples, count), the indices (count, 2 or 3) that they are told by, from 0
    """

    what: str
    value: Array
    expected: Array
    scale: Array
    rows: NDArray[np.intp] | None = None


def compare(
    name: str, groups: Iterable[Entries], tolerance: float = TOLERANCE, epsilon: float = 2.0**-52
) -> Result:
    """Hold groups of entries against what is expected of them, and report the worst.

    A value's error is relative to the value itself; where that is next to nothing, an error as large as what
    rounding leaves of its operands, ROUNDINGS · epsilon · scale, passes just so. Where there are no entries,
    nothing is held.
    """
    worst, place, compared = 0.0, "", False
    for entries in groups:
        compared = True
        value, expected = np.asarray(entries.value), entries.expected
        if value.shape != expected.shape:
            return Result(
                name, False, None, f"{entries.what} has shape {value.shape} instead of {expected.shape}"
            )
        if not value.size:
            continue
        scale = np.broadcast_to(entries.scale, expected.shape)
        for block in _blocks(expected.shape):
            own = np.maximum(scale[block] * (ROUNDINGS * epsilon / tolerance), 1e-300)
            own = np.maximum(own, np.abs(expected[block]))
            errors = np.abs(np.subtract(value[block], expected[block], dtype=float)) / own
            if np.isnan(errors.max()):
                errors[np.isnan(errors)] = np.inf
            if errors.max() <= worst:
                continue
            worst, (_, *at) = (
                float(errors.max()),
                [int(k) for k in np.unravel_index(errors.argmax(), errors.shape)],
            )
            if at:
                at[0] += block[1].start
            shown = at if entries.rows is None else entries.rows[at[0]]
            indices = f"({', '.join(str(index + 1) for index in shown)})" if at else ""
            place = f"{entries.what}{indices}"
    if not compared:
        return skipped(name, "there was nothing to compare")
    detail = f"largest relative error {worst:.1e}"
    return Result(name, worst <= tolerance, worst, detail if worst <= tolerance else f"{detail} at {place}")


def _blocks(shape: tuple[int, ...]) -> Iterator[tuple[slice, ...]]:
    """Parts of an array along its second axis, so that no more than BLOCK entries are compared at a time."""
    if len(shape) < 2:
        yield (slice(None),)
        return
    step = max(1, BLOCK * shape[1] // math.prod(shape))
    for start in range(0, shape[1], step):
        yield slice(None), slice(start, start + step)


def dense(what: str, value: Array, reference: Reference, rows: Any = slice(None)) -> Entries:
    """A dense quantity of some of the reference's samples."""
    return Entries(what, value, reference.values[what][rows], reference.scales[what][rows])
