"""Integrals over time by the trapezoidal rule: of what is above zero, and of what is below."""

import numpy as np

from linkwise.arrays import Array


def parted_integrals(rows: Array, steps: Array) -> Array:
    """Return ∫ max(x, 0) dt and ∫ max(-x, 0) dt in each span, (spans, 2, rows), of rows (rows, samples).

    steps: Δt from each sample to the next one in each span, (spans, samples - 1); 0 where it is not in it
    Their difference is ∫ x dt = Σ_s Δt_s (x_s + x_(s+1))/2.
    """
    parts = np.stack([np.maximum(rows, 0.0), np.maximum(-rows, 0.0)])
    found: Array = 0.5 * np.einsum("wps,fs->fwp", parts[..., 1:] + parts[..., :-1], steps)
    return found
