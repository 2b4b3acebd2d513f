"""Noise of evenly spaced positions behind filter and derivatives: its covariance, ends of the log and all.

Filter and derivatives are linear, so that q, qd and qdd at sample t are sums A_t x, B_t x, C_t x of the log's
positions x. Noise of these, independent from sample to sample with deviation sigma, has there the covariance

    sigma^2 G_t        G_t = [A_t; B_t; C_t] [A_t; B_t; C_t]^T

What the filter takes away, x - A x, has the variance sigma^2 (1 - 2 A_tt + |A_t|^2), by which noise is
estimated from it, and a covariance from sample to sample, by which noise that is not independent is told.
The sums are what filter and derivatives make of single ones: of all samples of a short log and of a long one
near its ends and in its middle, between which they are the same.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from linkwise.analysis.filtering import derivatives, filter_memory, lowpass
from linkwise.analysis.settings import Processing
from linkwise.arrays import Array, Index

AT_ONCE = 1 << 21
"""Most numbers of the responses to single ones at once."""


@dataclass(frozen=True, eq=False)
class PassedNoise:
    """Passage of noise through filter and derivatives, for a log of `samples` samples."""

    samples: int
    gram: Array
    """G_t of the samples of a log that is as long or shorter, (L, 3, 3), of q, qd and qdd, per s and s^2."""
    removed: Array
    """1 - 2 A_tt + |A_t|^2 of the same samples, (L,)."""
    followed: Array
    """Covariance of what is taken away there and at the next sample, per that of noise, (L,); the last 0."""

    @classmethod
    def of(cls, samples: int, rate: float, processing: Processing) -> "PassedNoise":
        """Return the passage at `rate` Hz; raise LinkwiseError as `lowpass` does."""
        reach = processing.reach + 1
        if processing.lowpass is not None:
            reach += filter_memory(rate, processing.lowpass)
        length = min(samples, 4 * reach + 1)
        gram, removed, followed = np.zeros((length, 3, 3)), np.zeros(length), np.zeros(length)
        for first, motion in _responses(length, rate, processing):
            gram += np.einsum("atm,btm->tab", motion, motion)
            ones = np.arange(motion.shape[2])
            taken = -motion[0]
            taken[first + ones, ones] += 1.0
            removed += np.einsum("tm,tm->t", taken, taken)
            followed[:-1] += np.einsum("tm,tm->t", taken[:-1], taken[1:])
        return cls(samples, gram, removed, followed)

    def alike(self, sample: Index) -> Index:
        """Return the samples of the shorter log that are as these are, (S,)."""
        length = len(self.gram)
        found: Index = np.minimum(sample, length // 2)
        return np.maximum(found, sample + length - self.samples)

    def covariance(self, sample: Index) -> Array:
        """Return G_t at samples (S,), (S, 3, 3)."""
        found: Array = self.gram[self.alike(sample)]
        return found


def _responses(length: int, rate: float, processing: Processing) -> Iterator[tuple[int, Array]]:
    """Yield q, qd and qdd (3, length, M) that single ones at M samples give, and the first of these."""
    most = max(1, AT_ONCE // length)
    for first in range(0, length, most):
        ones = np.eye(length, min(most, length - first), -first)
        if processing.lowpass is not None:
            lowpass(ones, rate, processing.lowpass)
        yield first, np.stack(derivatives(ones, rate, 0, length, processing))
