"""Steps of linear equations of motion, by Gauss's collocation of order six.

    M(t) w' + C(t) w = F_x(t)        x: columns side by side

At the instants c_a h of a step of length h, a = 1, 2, 3, rates k_a solve

    M_a k_a + C_a (w + h sum_b A_ab k_b) = F_a        w(h) = w + h sum_a b_a k_a

so that w(h) = T w + G, with T the same for all columns. (Butcher's implicit Runge-Kutta method of three
stages; Hairer, Norsett and Wanner, Solving Ordinary Differential Equations I, II.7.)
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ..answers.inertia_solve import solve_inertia_columns
from ..arrays.backend import ArrayBackend
from ..interface import Numbers, namespace

ROOT = float(np.sqrt(15.0))
STAGES = 0.5 - ROOT / 10.0, 0.5, 0.5 + ROOT / 10.0
"""c: instants of a step, as parts of its length."""
A = (
    (5.0 / 36.0, 2.0 / 9.0 - ROOT / 15.0, 5.0 / 36.0 - ROOT / 30.0),
    (5.0 / 36.0 + ROOT / 24.0, 2.0 / 9.0, 5.0 / 36.0 - ROOT / 24.0),
    (5.0 / 36.0 + ROOT / 30.0, 2.0 / 9.0 + ROOT / 15.0, 5.0 / 36.0),
)
B = 5.0 / 18.0, 4.0 / 9.0, 5.0 / 18.0


class LinearEquations(NamedTuple):
    """Equations M w' + C w = F at instants."""

    mass: Numbers
    """M (..., m, m)."""
    coriolis: Numbers
    """C (..., m, m)."""
    forces: Numbers
    """F (..., m, X)."""


class LinearSteps(NamedTuple):
    """Steps, one or many: w(h) = T w + G."""

    transition: Numbers
    """T (..., m, m)."""
    gain: Numbers
    """G (..., m, X)."""
    stages: Sequence[tuple[Numbers, Numbers]]
    """T and G from the begin of a step to each of its instants."""


def linear_steps(
    backend: ArrayBackend, equations: Sequence[LinearEquations], length: Numbers, names: Sequence[str]
) -> LinearSteps:
    """Return steps of these lengths (...), for the equations at their three instants.

    names: those of the coordinates; raises ValueError, with these, for a singular mass matrix
    """
    xp, m = namespace(length), equations[0].mass.shape[-1]
    h, unit = length[..., None, None], backend.constant(np.eye(m), length)
    solved = [
        solve_inertia_columns(at.mass, xp.concat([-at.coriolis, at.forces], -1), names) for at in equations
    ]
    # (delta_ab - h A_ab K_a) k_b = K_a w + f_a    with K = -M^-1 C, f = M^-1 F
    rows = [
        xp.concat([(a == b) * unit - (h * A[a][b]) * k[..., :m] for b in range(len(B))], -1)
        for a, k in enumerate(solved)
    ]
    found = xp.linalg.solve(xp.concat(rows, -2), xp.concat(solved, -2))
    rates = [found[..., a * m : (a + 1) * m, :] for a in range(len(B))]

    def moved(weights: Sequence[float]) -> tuple[Numbers, Numbers]:
        change = h * sum(weight * rate for weight, rate in zip(weights, rates, strict=True))
        return unit + change[..., :m], change[..., m:]

    return LinearSteps(*moved(B), [moved(weights) for weights in A])
