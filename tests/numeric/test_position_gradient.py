"""c0_ijk = ∂τ_ij/∂q_k against central differences of τ_ij."""

from collections.abc import Callable
from types import ModuleType

import numpy as np
import pytest
from helpers.answers import random_states, relative_error

STEP = 1e-5


@pytest.mark.parametrize("robot", ["planar3", "puma560"])
def test_position_gradient_is_the_slope_of_the_partial_torque(
    robot: str, package_of: Callable[[str], ModuleType]
) -> None:
    dynamics = package_of(robot).load("numpy")
    q, qd, qdd = random_states(dynamics.n, 50)
    slopes = [
        (dynamics.partial_torque(q + step, qd, qdd) - dynamics.partial_torque(q - step, qd, qdd)) / (2 * STEP)
        for step in STEP * np.eye(dynamics.n)
    ]
    assert relative_error(dynamics.position_gradient(q, qd, qdd), np.stack(slopes, -1)) <= 1e-8
