"""D_i L_j by central differences of a Lagrangian, for energies that no recursion knows."""

from typing import Any

import numpy as np

from linkwise.extras import extra
from linkwise.package.load import Array

STEP = 1e-4


def partial_torque(modules: Any, q: Array, qd: Array, qdd: Array) -> Array:
    """τ_ij, shape (samples, n, N), from modules (q, qd) -> L_j; error of order STEP²."""
    torch = extra("torch")
    samples, n = q.shape
    tau = np.zeros((samples, n, len(modules)))
    for j, module in enumerate(modules):

        def value(x: Array, v: Array, module: Any = module) -> Array:
            return module(torch.from_numpy(x), torch.from_numpy(v)).detach().numpy()  # type: ignore[no-any-return]

        for i in range(n):
            unit = STEP * np.eye(n)[i]

            def momentum(t: float, unit: Array = unit, value: Any = value) -> Array:
                x, v = q + t * qd + 0.5 * t * t * qdd, qd + t * qdd
                return (value(x, v + unit) - value(x, v - unit)) / (2 * STEP)  # type: ignore[no-any-return]

            rate = (momentum(STEP) - momentum(-STEP)) / (2 * STEP)
            tau[:, i, j] = rate - (value(q + unit, qd) - value(q - unit, qd)) / (2 * STEP)
    return tau
