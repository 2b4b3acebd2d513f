"""Weighted least squares of base parameters and friction, with standard errors.

Every joint has noise of its own: its equations weigh 1/sigma_i, sigma_i being what is left of them. With W
the weighted equations, the covariance of the estimates is (W^T W)^-1 (M. Gautier, P. Poignet, Control
Engineering Practice 9(12), 2001).
"""

from dataclasses import dataclass

import numpy as np

from linkwise.errors import LinkwiseError
from linkwise.identification.base_parameters import SPEED, BaseParameters
from linkwise.identification.normal_factors import JointEquations
from linkwise.package.load import Array

ROUNDS = 3
"""From equal weights to the joints' own, and twice again."""
LEAST = 1e-9
"""Of the largest joint's torque: the noise of a log that has none."""
POOR, WORST = 30.0, 1000.0
"""Times the condition number of random motions: there a log tells some combinations badly, or not at all."""


@dataclass(frozen=True, eq=False)
class Fit:
    """What a log says of base parameters (base,) and friction (n, 2), viscous and Coulomb, zeros for none.

    n are the joints whose torques are measured, in the robot's order.
    """

    beta: Array
    friction: Array
    beta_errors: Array
    friction_errors: Array
    """Standard errors."""
    noise: Array
    """sigma of each joint, (n,), in N m or N."""
    condition: float
    """Of the equations, each column divided by its size over random motions."""
    triangle: Array
    """[W | tau] of all joints, weighted: the unknowns are beta and, joint by joint, its friction."""


def weighted_fit(equations: JointEquations, base: BaseParameters, friction: bool) -> Fit:
    """Fit all joints together; raises LinkwiseError where the log does not show a combination."""
    n, noise = len(equations.triangles), np.ones(len(equations.triangles))
    condition = _excitation(stacked(equations, noise, friction), base)
    for _ in range(ROUNDS):
        triangle = stacked(equations, noise, friction)
        beta, rubbing = _solved(triangle, base, n, friction)
        free = max(equations.rows - len(triangle) / n, 1.0)
        left = equations.errors(beta, rubbing) * np.sqrt(equations.rows / free)
        noise = np.maximum(left, LEAST * (equations.sizes().max() or 1.0))
    triangle = stacked(equations, noise, friction)
    beta, rubbing = _solved(triangle, base, n, friction)
    inverse = np.linalg.inv(triangle[:-1, :-1])
    errors = np.linalg.norm(inverse, axis=1)
    own = errors[base.count :].reshape(n, 2) if friction else np.zeros((n, 2))
    return Fit(beta, rubbing, errors[: base.count], own, noise, condition, triangle)


def stacked(equations: JointEquations, noise: Array, friction: bool) -> Array:
    """Triangle of all joints' equations, each divided by its noise."""
    n, size = equations.triangles.shape[:2]
    base = size - 3
    unknowns = base + (2 * n if friction else 0)
    rows = np.zeros((n, size, unknowns + 1))
    rows[:, :, :base] = equations.triangles[:, :, :base]
    rows[:, :, -1] = equations.triangles[:, :, -1]
    for i in range(n if friction else 0):
        rows[i, :, base + 2 * i : base + 2 * i + 2] = equations.triangles[i, :, base : base + 2]
    weighted = rows / noise[:, None, None]
    triangle = np.linalg.qr(weighted.reshape(n * size, -1), mode="r")
    return np.asarray(triangle)


def _solved(triangle: Array, base: BaseParameters, n: int, friction: bool) -> tuple[Array, Array]:
    """beta and friction."""
    x = np.linalg.solve(triangle[:-1, :-1], triangle[:-1, -1]).astype(float)
    return x[: base.count], x[base.count :].reshape(n, 2) if friction else np.zeros((n, 2))


def _excitation(triangle: Array, base: BaseParameters) -> float:
    """Condition number, columns as large as random motions make them; LinkwiseError for one far too large."""
    frictions = triangle.shape[1] - 1 - base.count
    sizes = np.concatenate([base.sizes, np.tile([SPEED / np.sqrt(3.0), 1.0], frictions // 2)])
    _, values, directions = np.linalg.svd(triangle[:-1, :-1] / sizes)
    condition = float(values[0] / max(values[-1], 1e-300))
    if condition > WORST * base.condition:
        worst = int(np.abs(directions[-1]).argmax())
        what = base.texts()[worst] if worst < base.count else "a joint's friction"
        raise LinkwiseError(
            f"too little excitation: the log does not tell {what} from the rest (condition number "
            f"{condition:.1g}, {base.condition:.1g} for random motions); record a motion in which every "
            "joint moves far and fast, in many postures"
        )
    return condition
