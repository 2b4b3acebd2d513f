"""Velocities and accelerations from evenly spaced positions, block by block.

Both formulas look at `span` neighbouring samples, so a block that also sees span - 1 samples on
either side gives what the whole log would.
"""

import numpy as np
from numpy.typing import NDArray

from linkwise.analysis.settings import Processing
from linkwise.extras import extra
from linkwise.package.load import Array

# Five-point formulas, from Taylor's expansion: row p holds 12 times the weights of the derivative at the
# p-th of 5 samples, times the step (or its square).
FIRST = np.array(
    [
        [-25, 48, -36, 16, -3],
        [-3, -10, 18, -6, 1],
        [1, -8, 0, 8, -1],
        [-1, 6, -18, 10, 3],
        [3, -16, 36, -48, 25],
    ]
)
SECOND = np.array(
    [
        [35, -104, 114, -56, 11],
        [11, -20, 6, 4, -1],
        [-1, 16, -30, 16, -1],
        [-1, 4, 6, -20, 11],
        [11, -56, 114, -104, 35],
    ]
)


def derivatives(
    positions: Array, rate: float, start: int, stop: int, processing: Processing
) -> tuple[Array, Array, Array]:
    """Return q, q̇, q̈ of the samples start..stop, each (stop - start, n), per s and s².

    positions: of all samples, (samples, n), at `rate` Hz; at least `processing.span` of them
    """
    reach = processing.span - 1
    low, high = max(0, start - reach), min(len(positions), stop + reach)
    window = np.asarray(positions[low:high])
    if processing.derivative == "five-point":
        motion = (window, *_five_point(window, rate))
    else:
        motion = _savitzky_golay(window, rate, processing)
    q, qd, qdd = (x[start - low : stop - low] for x in motion)
    return q, qd, qdd


def _five_point(q: Array, rate: float) -> tuple[Array, Array]:
    return _weighted(q, FIRST) * (rate / 12), _weighted(q, SECOND) * (rate**2 / 12)


def _weighted(q: Array, weights: NDArray[np.int_]) -> Array:
    """Return Σ_k w_pk (q_k - q_p): the weights sum to 0, and this way equal samples give exactly 0."""
    out = np.empty_like(q)
    last = len(q) - 5
    for p, (first, count) in enumerate([(0, 1), (0, 1), (0, last + 1), (last, 1), (last, 1)]):
        here = q[first + p : first + p + count]
        at = out[first + p : first + p + count]
        at[:] = 0.0
        for k in range(5):
            if k != p and weights[p, k]:
                at += weights[p, k] * (q[first + k : first + k + count] - here)
    return out


def _savitzky_golay(q: Array, rate: float, processing: Processing) -> tuple[Array, Array, Array]:
    """Return q, q̇, q̈ of the polynomial fitted to each window; at the ends, to the last full window."""
    savgol = extra("scipy.signal").savgol_filter
    fitted = [
        savgol(q, processing.window, processing.degree, deriv=m, delta=1 / rate, axis=0) for m in range(3)
    ]
    return fitted[0], fitted[1], fitted[2]
