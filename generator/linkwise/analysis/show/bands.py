"""Bands of one standard deviation around curves, and what a figure says of them."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from linkwise.analysis.result import AnalysisResult
from linkwise.analysis.row_sums import SumDeviations
from linkwise.analysis.show.drawn_curves import PIECES, drawn_curves
from linkwise.arrays import Array, Index

FAINT = 0.2
"""Opacity of a band."""


class Band(NamedTuple):
    """A band around a curve, (pieces,) each."""

    time: Array
    low: Array
    high: Array


class Bands:
    """Bands around those curves of which deviations are known, of one each to either side.

    A curve that sums several rows has at most the sum of their deviations, as `SumDeviations` says.
    """

    def __init__(self, result: AnalysisResult, curves: Sequence[Index], pieces: int = PIECES) -> None:
        """Find the bands over all samples; each curve is given by the numbers of the rows that it sums."""
        sums = SumDeviations(result.rows, curves)
        self.curves: list[int] = sums.known.tolist()
        """Numbers of the curves that have a band."""
        self.time, self.low, self.high = np.empty(0), np.empty((0, 0)), np.empty((0, 0))
        self._exact = sums.exact
        if self.curves:
            found = drawn_curves(result, lambda part: _edges(*sums(part.values)), pieces)
            count = len(self.curves)
            self.time, self.low, self.high = found.middle, found.least[:count], found.greatest[count:]

    def __len__(self) -> int:
        return len(self.curves)

    def __getitem__(self, curve: int) -> Band | None:
        """Return the band of a curve, by its number; None where no deviation is known."""
        if curve not in self.curves:
            return None
        at = self.curves.index(curve)
        return Band(self.time, self.low[at], self.high[at])

    @property
    def notes(self) -> tuple[str, ...]:
        """Notes of a figure on its bands; none where it has none."""
        if not self.curves:
            return ()
        most = "" if self._exact else f"; {SUMMED}"
        return (f"Bands are one standard deviation to either side{most}.",)


SUMMED = "of what sums several columns, the sum of theirs, which is the most that it can be"
"""Remark on deviations of sums."""
ADDED = "those of samples and columns are added up"
"""Remark on deviations of means over samples."""


def _edges(sums: Array, deviations: Array) -> Array:
    return np.concatenate([sums - deviations, sums + deviations])


def draw_band(panel: Any, band: Band | None, colour: Any) -> None:
    """Draw a band in the colour of its curve; nothing for None."""
    if band is not None:
        time, edge = np.concatenate([band.time, band.time[::-1]]), np.concatenate([band.low, band.high[::-1]])
        panel.fill(time, edge, color=colour, alpha=FAINT, linewidth=0)
