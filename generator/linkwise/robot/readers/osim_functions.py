"""Functions of an OpenSim model as curves."""

from itertools import pairwise

import numpy as np

from linkwise.robot.curve import Curve


def piecewise_linear(x: list[float], y: list[float]) -> Curve:
    """Straight lines between points, and on beyond the ends."""
    slopes = [(d - b) / (c - a) for (a, b), (c, d) in pairwise(zip(x, y, strict=True))]
    return Curve(tuple(x[:-1]), tuple(zip(y, slopes, strict=False)))


def simm_spline(x: list[float], y: list[float]) -> Curve:
    """SIMM's cubic spline, and straight lines beyond its ends.

    Its third derivative at an end is that of the cubic through the four points there (G. Forsythe,
    M. Malcolm, C. Moler, Computer Methods for Mathematical Computations, 1977, ch. 4); with three points, 0.
    """
    h, rise = np.diff(x), np.diff(y) / np.diff(x)
    if len(x) == 2:
        return piecewise_linear(x, y)
    # Of each point's sigma = y'' / 6: h σ + 2 (h + h') σ' + h' σ'' = the change of the slope.
    system, known = np.zeros((len(x), len(x))), np.zeros(len(x))
    for at in range(1, len(x) - 1):
        system[at, at - 1 : at + 2] = h[at - 1], 2 * (h[at - 1] + h[at]), h[at]
        known[at] = rise[at] - rise[at - 1]
    for end, inner, sign, points in ((0, 1, 1, slice(None, 4)), (-1, -2, -1, slice(-4, None))):
        system[end, end], system[end, inner] = -sign, sign
        if len(x) > 3:
            known[end] = h[end] * _third_difference(x[points], y[points])
    sigma = np.linalg.solve(system, known)
    slopes = rise - h * (sigma[1:] + 2 * sigma[:-1])
    last = rise[-1] + h[-1] * (sigma[-2] + 2 * sigma[-1])
    cubics = zip(y[:-1], slopes, 3 * sigma[:-1], np.diff(sigma) / h, strict=True)
    pieces = ((y[0], slopes[0]), *cubics, (y[-1], last))
    return Curve((x[0], *x), tuple(tuple(map(float, piece)) for piece in pieces))


def _third_difference(x: list[float], y: list[float]) -> float:
    """Divided difference of four points: a sixth of the third derivative of the cubic through them."""
    differences = list(y)
    for order in range(1, 4):
        differences = [
            (after - before) / (x[at + order] - x[at])
            for at, (before, after) in enumerate(pairwise(differences))
        ]
    return differences[0]
