"""Weighted least squares of base parameters and friction, with standard errors.

Every joint has noise of its own: its equations have weight 1/sigma_i, with sigma_i from their residuals. With
W the weighted equations, the covariance of the estimates is (W^T W)^-1 (M. Gautier, P. Poignet, Control
Engineering Practice 9(12), 2001).
"""

from dataclasses import dataclass

import numpy as np

from linkwise.arrays import Array, Mask
from linkwise.identification.base_parameters import BaseParameters
from linkwise.identification.bearings import Bearings
from linkwise.identification.normal_factors import JointEquations

ROUNDS = 3
"""Rounds of reweighting: from equal weights to the joints' own, and twice again."""
LEAST = 1e-9
"""Least noise, as a part of the largest joint's torque: the noise of a log that has none."""
POOR, WORST = 30.0, 1000.0
"""Multiples of the condition number of random motions, above which a log determines some combinations poorly,
or not at all.
"""


@dataclass(frozen=True, eq=False)
class Fit:
    """Result of a fit: base parameters (base,) and friction (B, 2), viscous and Coulomb.

    Friction is zero where a joint has none. B are the joints of `Bearings`, first the n whose torques are
    measured, in the robot's order: all, where joints are free.
    """

    beta: Array
    friction: Array
    beta_errors: Array
    friction_errors: Array
    """Standard errors of friction, as `beta_errors` are of beta."""
    noise: Array
    """sigma of each joint, (n,), in N m or N."""
    condition: float
    """Condition number of the equations, each column divided by its size over random motions."""
    triangle: Array
    """[W | tau] of all joints, weighted: the unknowns are beta and, joint by joint, its friction."""


@dataclass(frozen=True)
class Excitation:
    """Excitation of the unknowns: the equations' condition number, and the unknown determined worst."""

    condition: float
    """Condition number of the columns, each divided by its size over random motions."""
    worst: str


def weighted_fit(equations: JointEquations, base: BaseParameters, bearings: Bearings) -> Fit:
    """Return the fit of all joints together."""
    rubs, n = bearings.rubs, len(equations.triangles)
    noise = np.ones(n)
    condition = excitation(equations, base, bearings).condition
    for _ in range(ROUNDS):
        triangle = stacked(equations, noise, rubs)
        beta, friction = _solved(triangle, base, rubs)
        unknowns = len(triangle) - 1
        noise = _noise(equations, beta, friction, max(equations.rows - unknowns / n, 1.0))
    triangle = stacked(equations, noise, rubs)
    beta, friction = _solved(triangle, base, rubs)
    errors = np.linalg.norm(np.linalg.inv(triangle[:-1, :-1]), axis=1)
    own = np.zeros((len(rubs), 2))
    own[rubs] = errors[base.count :].reshape(-1, 2)
    return Fit(beta, friction, errors[: base.count], own, noise, condition, triangle)


def _noise(equations: JointEquations, beta: Array, friction: Array, free: float) -> Array:
    """Return sigma of each joint, (n,), from its residuals.

    free: degrees of freedom of a joint's equations
    """
    left, sizes = equations.errors(beta, friction) * np.sqrt(equations.rows / free), equations.sizes()
    noise: Array = np.maximum(left, LEAST * (sizes.max() or 1.0))
    # Bodies without mass meet a torque of zeros exactly: it must not count as free of noise for that.
    still = sizes == 0
    if still.any() and not still.all():
        noise[still] = np.maximum(noise[still], np.median(noise[~still]))
    return noise


def stacked(equations: JointEquations, noise: Array, rubs: Mask) -> Array:
    """Return the triangle of all joints' equations, each divided by its noise."""
    n, size = equations.triangles.shape[:2]
    base = size - 2 * len(rubs) - 1
    kept = np.concatenate([np.ones(base, np.bool_), np.repeat(rubs, 2), [True]])
    weighted = equations.triangles[:, :, kept] / noise[:, None, None]
    triangle = np.linalg.qr(weighted.reshape(n * size, -1), mode="r")
    return np.asarray(triangle)


def _solved(triangle: Array, base: BaseParameters, rubs: Mask) -> tuple[Array, Array]:
    """Return beta (base,) and friction (B, 2)."""
    x = np.linalg.solve(triangle[:-1, :-1], triangle[:-1, -1]).astype(float)
    friction = np.zeros((len(rubs), 2))
    friction[rubs] = x[base.count :].reshape(-1, 2)
    return x[: base.count], friction


def excitation(equations: JointEquations, base: BaseParameters, bearings: Bearings) -> Excitation:
    """Return how well a log's motion tells the unknowns apart, with equal weights for all joints."""
    triangle = stacked(equations, np.ones(len(equations.triangles)), bearings.rubs)
    sizes = np.concatenate([base.sizes, bearings.sizes[bearings.rubs].reshape(-1)])
    _, values, directions = np.linalg.svd(triangle[:-1, :-1] / sizes)
    worst = int(np.abs(directions[-1]).argmax())
    return Excitation(
        float(values[0] / max(values[-1], 1e-300)),
        base.texts()[worst] if worst < base.count else "a joint's friction",
    )
