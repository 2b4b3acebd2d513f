"""What joints of a manifest move by, from its polynomials by NumPy's: nothing of the package is used."""

import numpy as np
from numpy.polynomial import Polynomial

from linkwise.package.load import Array
from linkwise.package.manifest import BodyEntry


def displacement(body: BodyEntry, q: Array, derivative: int = 0) -> Array:
    """Of a body's joint, or a derivative by its coordinate, (samples, 1); q is (samples, n)."""
    x = q[:, body.coordinate : body.coordinate + 1]
    if body.curve is None:
        return body.ratio * (
            x if derivative == 0 else np.ones_like(x) if derivative == 1 else np.zeros_like(x)
        )
    moved = np.zeros_like(x)
    ends = (*body.curve.starts[1:], np.inf)
    lower = -np.inf
    for start, upper, piece in zip(body.curve.starts, ends, body.curve.pieces, strict=True):
        of_piece = Polynomial(piece).deriv(derivative) if derivative else Polynomial(piece)
        within = (x.real >= lower) & (x.real < upper)
        moved = np.where(within, of_piece(x - start), moved)
        lower = upper
    return body.ratio * moved


def displacement_bound(body: BodyEntry, q: Array, derivative: int = 0) -> Array:
    """Magnitude of the same, (samples,), for coordinates of these magnitudes and either sign."""
    either = (np.abs(displacement(body, sign * q, derivative)[:, 0]) for sign in (1.0, -1.0))
    bound: Array = np.maximum(*either)
    return bound
