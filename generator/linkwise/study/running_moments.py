"""Means, deviations and ranges over successive blocks."""

import numpy as np

from linkwise.package.load import Array

STATISTICS = ("mean", "std", "min", "max", "rms")
AT_ONCE = 512
"""Samples whose centred values fit in the cache."""


class RunningMoments:
    """Running statistics over the rows of blocks, (rows, samples).

    The sums are of differences from the first block's mean, so that a small deviation on a large mean is
    kept.
    """

    def __init__(self, rows: int) -> None:
        self.count = 0
        self._about, self._sums, self._squares = np.zeros((3, rows))
        self._min, self._max = np.full(rows, np.inf), np.full(rows, -np.inf)

    def __call__(self, block: Array) -> None:
        """Add a block (rows, samples)."""
        if not self.count and block.shape[1]:
            self._about = block.mean(axis=1)
        for at in range(0, block.shape[1], AT_ONCE):
            part = block[:, at : at + AT_ONCE]
            np.minimum(self._min, part.min(axis=1), out=self._min)
            np.maximum(self._max, part.max(axis=1), out=self._max)
            centred = part - self._about[:, None]
            self._sums += centred.sum(axis=1)
            self._squares += np.einsum("ij,ij->i", centred, centred)
        self.count += block.shape[1]

    @property
    def table(self) -> Array:
        """STATISTICS of each row, (statistics, rows); the deviation is divided by the number of samples."""
        count = max(1, self.count)
        apart = self._sums / count
        mean = self._about + apart
        variance = np.maximum(self._squares / count - apart**2, 0.0)
        return np.stack([mean, np.sqrt(variance), self._min, self._max, np.sqrt(mean**2 + variance)])
