"""Impedance as a laboratory measures it: known forces in, motion out, and the best M, B and K between them.

(K - w^2 M + i w B) x(w) = f(w)        at each frequency w, by least squares over all of them
"""

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

WAVES = 3
"""Frequencies at which each direction is pushed."""


class Impedance(NamedTuple):
    """Matrices of an equation M xdd + B xd + K x = f."""

    inertia: Any
    damping: Any
    stiffness: Any


@dataclass(frozen=True)
class Sines:
    """Forces that repeat after a period, in sum of sines; each direction has frequencies of its own."""

    period: float
    """s; frequencies are whole multiples of 1/period."""
    amplitudes: Any
    """(waves, directions), 0 at the waves of other directions; wave k makes k + 1 turns a period."""
    phases: Any

    def __call__(self, t: float) -> Any:
        turns = 2.0 * np.pi * np.arange(1, len(self.phases) + 1) * t / self.period
        return np.sin(turns + self.phases) @ self.amplitudes


def sines_for(wanted: Impedance, motion: Any, period: float) -> Sines:
    """Forces that move each direction by about as much at each of its frequencies."""
    n = len(wanted.inertia)
    amplitudes = np.zeros((WAVES * n, n))
    for wave in range(WAVES * n):
        w, i = 2.0 * np.pi * (wave + 1) / period, wave % n
        force = wanted.stiffness[i, i] - w * w * wanted.inertia[i, i] + 1j * w * wanted.damping[i, i]
        amplitudes[wave, i] = np.broadcast_to(motion, n)[i] * abs(force)
    return Sines(period, amplitudes, np.random.default_rng(0).uniform(0.0, 2.0 * np.pi, WAVES * n))


def fitted(force: Any, motion: Any, period: float) -> Impedance:
    """M, B and K (n, n) of samples (S, n) over one period."""
    n = motion.shape[-1]
    at = np.arange(1, WAVES * n + 1)
    x, f = (np.fft.fft(samples, axis=0)[at] for samples in (motion, force))
    w = 2.0 * np.pi * at[:, None] / period
    rows = np.hstack([-(w**2) * x, 1j * w * x, x])
    found = np.linalg.lstsq(np.vstack([rows.real, rows.imag]), np.vstack([f.real, f.imag]), rcond=None)[0]
    return Impedance(*(part.T for part in np.split(found, 3)))


def errors(measured: Impedance, wanted: Impedance) -> Impedance:
    """Largest error of each, entries (i, k) in a ratio to sqrt(a_ii a_kk) of what was wanted."""

    def error(one: Any, other: Any) -> float:
        scale = np.sqrt(np.diag(other))
        return float(np.abs((one - other) / np.outer(scale, scale)).max())

    return Impedance(*(error(one, other) for one, other in zip(measured, wanted, strict=True)))
