"""The sums over links against MuJoCo's inverse dynamics."""

from collections.abc import Callable
from types import ModuleType

import numpy as np
import pytest
from helpers.answers import random_states, relative_error

pytest.importorskip("mujoco")

import mujoco

from numeric.mujoco_plant import table_2_arm


def test_torques_sum_to_mujocos_inverse_dynamics(package_of: Callable[[str], ModuleType]) -> None:
    model = mujoco.MjModel.from_xml_string(table_2_arm())
    data = mujoco.MjData(model)
    q, qd, qdd = random_states(3, 200)
    expected = np.empty_like(q)
    for s in range(len(q)):
        data.qpos, data.qvel, data.qacc = q[s], qd[s], qdd[s]
        mujoco.mj_inverse(model, data)
        expected[s] = data.qfrc_inverse
    given = package_of("planar3").load("numpy").inverse_dynamics(q, qd, qdd)
    assert relative_error(given, expected) <= 1e-12
