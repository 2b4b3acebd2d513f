"""Cutoffs of a sweep: as `--cutoff-sweep LOW,HIGH[,COUNT]` writes them, evenly in the logarithm."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from linkwise.errors import LinkwiseError

FLAG = "--cutoff-sweep"
COUNT, MOST = 7, 1000
"""Cutoffs unless a count is given, and the most."""
SAME = 1e-9
"""Relative difference below which two cutoffs are one."""


@dataclass(frozen=True)
class CutoffRange:
    """Lowest and highest cutoff of a sweep in Hz, and how many there are, both included.

    Raises LinkwiseError for values that are impossible.
    """

    low: float
    high: float
    count: int = COUNT

    def __post_init__(self) -> None:
        told = f"{FLAG} {self.low:g},{self.high:g}"
        for cutoff in (self.low, self.high):
            if not 0 < cutoff < math.inf:
                raise LinkwiseError(f"{told}: give frequencies in Hz above 0")
        if self.low >= self.high:
            raise LinkwiseError(
                f"{told}: {self.low:g} Hz is not below {self.high:g} Hz; give the lower first"
            )
        if not 2 <= self.count <= MOST or self.count != int(self.count):
            raise LinkwiseError(f"{told},{self.count:g}: give a whole number of cutoffs from 2 to {MOST}")

    @classmethod
    def of(cls, given: str | Sequence[float]) -> "CutoffRange":
        """Return the range of a text LOW,HIGH or LOW,HIGH,COUNT, or of two or three numbers.

        Raises LinkwiseError for anything else.
        """
        parts = given.split(",") if isinstance(given, str) else list(given)
        try:
            low, high, *count = map(float, parts)
            counted = int(count[0]) if count and count[0].is_integer() else (count or [COUNT])[0]
        except (ValueError, TypeError):
            raise _form(given) from None
        if len(count) > 1:
            raise _form(given)
        return cls(low, high, counted)  # type: ignore[arg-type]

    def cutoffs(self, own: float) -> tuple[float, ...]:
        """Return the cutoffs in Hz, ascending, with an analysis's own among them."""
        others = np.geomspace(self.low, self.high, self.count).tolist()
        return tuple(sorted([own, *(c for c in others if not math.isclose(c, own, rel_tol=SAME))]))


def _form(given: str | Sequence[float]) -> LinkwiseError:
    told = given if isinstance(given, str) else ",".join(map(str, given))
    return LinkwiseError(f"{FLAG} {told}: write it as LOW,HIGH or LOW,HIGH,COUNT, in Hz")
