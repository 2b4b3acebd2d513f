"""Partial torques against a recursion that shares nothing with the generator."""

import numpy as np
from numpy.typing import NDArray

from linkwise.analysis.closure import Closure
from linkwise.analysis.columns import Column, Quantity
from linkwise.analysis.robot import Robot

Array = NDArray[np.float64]
SAMPLES = 8
"""Samples of each block that are computed again; Newton and Euler's way is slow in Python."""

LARGEST = 1e6
"""Past this many radians an angle's own rounding drowns the comparison."""


def against_recursion(robot: Robot, columns: tuple[Column, ...], block: Array) -> Closure:
    """τ_ij of some samples of a block (columns, S) against Newton–Euler; none for hand-written energies.

    Relative errors are by unit: a joint that carries nothing but rounding is measured by its peers.
    """
    if robot.recursion is None:
        return Closure()
    at = np.unique(np.linspace(0, block.shape[1] - 1, SAMPLES).astype(int))

    def dense(quantity: Quantity) -> Array:
        return np.array([block[row, at] for row, c in enumerate(columns) if c.quantity == quantity]).T

    if np.abs(dense("q")).max(initial=0.0) > LARGEST:
        return Closure()
    expected = robot.recursion.partial_torque(dense("q"), dense("qd"), dense("qdd"))
    ours = np.zeros_like(expected)
    for row, column in enumerate(columns):
        if column.quantity == "tau_link":
            ours[:, column.joint, column.link] = block[row, at]
    absolute, relative = 0.0, 0.0
    for unit in set(robot.units):
        alike = [i for i, other in enumerate(robot.units) if other == unit]
        error = float(np.abs(ours - expected)[:, alike].max(initial=0.0))
        scale = float(np.abs(expected).sum(axis=2)[:, alike].max(initial=0.0))
        absolute = max(absolute, error)
        relative = max(relative, error / scale if scale else error)
    return Closure(recursion_absolute=absolute, recursion_relative=relative)
