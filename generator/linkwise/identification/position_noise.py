"""Noise of positions, from their sixth differences.

Positions change so little between samples that these are noise alone: independent noise of standard deviation
sigma makes differences of sigma sqrt(924), 924 being the sum of the squares of their weights.
A second derivative multiplies noise by the square of the sampling rate: 1e-4 rad at 200 Hz are 12 rad/s^2.
"""

import math

import numpy as np

from linkwise.arrays import Array

ORDER = 6
LONGEST = 1 << 16
"""Largest number of samples from which noise is estimated."""


def position_noise(q: Array) -> Array:
    """Return the standard deviation of the noise of evenly spaced positions (S, n), shape (n,)."""
    differences = np.diff(q[:LONGEST], n=ORDER, axis=0)
    if not len(differences):
        return np.zeros(q.shape[1])
    sigma: Array = np.sqrt(np.mean(differences**2, axis=0) / math.comb(2 * ORDER, ORDER))
    return sigma
