"""Variances of rows of a result, from what perturbed motions, loads and bodies make of them.

With independent standard normals e_r, rows s at x_0 + sum_r e_r d_r have, by divided differences of width h,

    var(s) = sum_r (s_r+ - s_r-)^2 / (4 h^2) + (h^2 - 1) / (4 h^4) (s_r+ + s_r- - 2 s_0)^2

exact for rows that are quadratic in every direction by itself, with h^2 = 3 as is right for normals
(M. Norgaard, N. K. Poulsen, O. Ravn, New developments in state estimation for nonlinear systems,
Automatica 36, 2000). Of a linear direction one side tells all.
"""

from collections.abc import Callable, Iterator
from math import sqrt
from typing import NamedTuple

import numpy as np

from linkwise.analysis.product_rows import Pairs
from linkwise.arrays import Array

WIDTH = sqrt(3.0)
"""h, in standard deviations."""
AT_ONCE = 256
"""Samples perturbed at once, whose rows stay in the cache."""
Rows = Callable[[float], Array]
"""Function that returns the rows (rows, S) at so many standard deviations along a direction."""


class Direction(NamedTuple):
    """Direction of one standard deviation, along which rows are known."""

    rows: Rows
    width: float = WIDTH
    """h; with 1 differences are central, and what is quadratic counts as linear."""
    is_linear: bool = False
    """True if no row is more than linear along it."""


def variances(rows: Array, directions: Iterator[Direction], pairs: Pairs | None = None) -> Array:
    """Return the variances of rows (rows, S) by all directions, (rows, S), which are added to `pairs` too."""
    found = np.zeros_like(rows)
    for along, width, is_linear in directions:
        ahead = along(width)
        if is_linear:
            ahead -= rows
            ahead *= 1.0 / width
            if pairs is not None:
                pairs.add(ahead)
            ahead *= ahead
            found += ahead
            continue
        behind = along(-width)
        if width != 1.0:
            bent = ahead + behind
            bent -= 2.0 * rows
            bent *= sqrt(width**2 - 1.0) / (2.0 * width**2)
            bent *= bent
            found += bent
        ahead -= behind
        ahead *= 0.5 / width
        if pairs is not None:
            pairs.add(ahead)
        ahead *= ahead
        found += ahead
    return found
