"""Comparison with a reference: each value by its own size, or by the rounding of what it is summed from."""

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from linkwise.arrays import Array, Index
from linkwise.oracle.reference import TOLERANCE, Reference

ROUNDINGS = 10.0
"""Roundings that a value may gather, each as large as that of the numbers that it is summed from."""


SHORT_OF_MEMORY = ("allocate memory", "failed to map segment")
"""Words for too little memory in errors of torch, and of the system where it loads a library."""
BLOCK = 1 << 20
"""Entries compared at a time."""


@dataclass(frozen=True)
class Result:
    """Result of a check: its name, whether it held, the largest error (None: not numerical), and a line.

    held is None for what could not be checked here, which speaks neither for the package nor against it; the
    line says why.
    """

    name: str
    held: bool | None
    error: float | None
    detail: str

    @property
    def failed(self) -> bool:
        """True if the package is wrong."""
        return self.held is False

    @property
    def mark(self) -> str:
        """Mark of the result: ok, FAIL or skip."""
        return {True: "ok", False: "FAIL", None: "skip"}[self.held]


def skipped(name: str, reason: str) -> Result:
    """Return the result of a check that could not be made here, and why."""
    return Result(name, None, None, reason)


def is_short_of_memory(error: Exception) -> bool:
    """Return whether an error means too little memory for an array, a tensor of torch or a library.

    The latter two raise RuntimeError, OSError and ImportError; any other may quote such words from a package.
    """
    if isinstance(error, RuntimeError | OSError | ImportError):
        return any(words in str(error) for words in SHORT_OF_MEMORY)
    return isinstance(error, MemoryError)


def line_of(error: Exception) -> str:
    """Return an error's kind and message on one line."""
    return f"{type(error).__name__}: {' '.join(str(error).split())}"


@dataclass(frozen=True)
class Entries:
    """Values beside the expected ones, samples first; scale: size of the numbers that each is the sum of.

    rows: for packed values (samples, count), the indices (count, 2 or 3) that they are reported by, from 0
    """

    what: str
    value: Array
    expected: Array
    scale: Array
    rows: Index | None = None


def compare(
    name: str, groups: Iterable[Entries], tolerance: float = TOLERANCE, epsilon: float = 2.0**-52
) -> Result:
    """Compare groups of entries with their expected values, and return the worst as a result.

    A value's error is relative to the value itself; where that is next to nothing, an error as large as the
    rounding of its operands, ROUNDINGS · epsilon · scale, just passes. Without any entries the check is
    skipped.
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
            least = scale[block] * (ROUNDINGS * epsilon / tolerance)
            errors = _errors(value[block], expected[block], least)
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


def _errors(value: Array, expected: Array, least: Array) -> Array:
    """Return errors relative to the value, or to the least that it is counted as; infinite for NaN."""
    own = np.maximum(np.maximum(least, 1e-300), np.abs(expected))
    errors: Array = np.abs(np.subtract(value, expected, dtype=float)) / own
    if np.isnan(errors.max()):
        errors[np.isnan(errors)] = np.inf
    return errors


def _blocks(shape: tuple[int, ...]) -> Iterator[tuple[slice, ...]]:
    """Yield parts of an array along its second axis, so that at most BLOCK entries are compared at a time."""
    if len(shape) < 2:
        yield (slice(None),)
        return
    step = max(1, BLOCK * shape[1] // math.prod(shape))
    for start in range(0, shape[1], step):
        yield slice(None), slice(start, start + step)


def dense(what: str, value: Array, reference: Reference, rows: Any = slice(None)) -> Entries:
    """Return a dense quantity beside that of some of the reference's samples."""
    return Entries(what, value, reference.values[what][rows], reference.scales[what][rows])


@dataclass(frozen=True)
class IndexRows:
    """Index (i, j, k) of every packed c2, c1 and h1, and (i, j) of every tau and g, in order."""

    c2: Index
    c1: Index
    tau: Index
    h1: Index

    @classmethod
    def of_paths(cls, paths: Sequence[Sequence[int]], linear: Sequence[int]) -> "IndexRows":
        """Return indices by link, then i, then k along the path.

        c2 has k from i on only, h1 the links in `linear` only.
        """
        c1 = [(i, j, k) for j, path in enumerate(paths) for i in path for k in path]
        return cls(
            _table([row for row in c1 if row[0] <= row[2]], 3),
            _table(c1, 3),
            _table([(i, j) for j, path in enumerate(paths) for i in path], 2),
            _table([row for row in c1 if row[1] in linear], 3),
        )

    def of(self, what: str) -> Index:
        """Return the indices of a quantity."""
        return {"c2": self.c2, "c1": self.c1, "c0": self.c1, "tau": self.tau, "g": self.tau, "h1": self.h1}[
            what
        ]

    def fields(self, packed: Any) -> dict[str, Array]:
        """Return the fields of `packed` by quantity; h1 only where there is any."""
        named = dict(zip(("c2", "c1", "g", "tau", "h1"), packed, strict=True))
        return (
            named if len(self.h1) or np.shape(named["h1"])[-1] else {k: named[k] for k in named if k != "h1"}
        )


def packed(what: str, value: Any, rows: Index, reference: Reference, at: Index) -> Entries:
    """Return packed values (..., count) beside the reference's; `at` (...) gives the sample of each."""
    value = np.asarray(value)
    picked, scale = (
        source[what][(at.reshape(-1, 1), *rows.T)] for source in (reference.values, reference.scales)
    )
    if value.shape != (*at.shape, len(rows)):
        return Entries(what, value, np.empty((*at.shape, len(rows))), scale)
    return Entries(what, value.reshape(picked.shape), picked, scale, rows)


def _table(rows: Sequence[Sequence[int]], width: int) -> Index:
    return np.array(rows, dtype=np.intp).reshape(-1, width)
