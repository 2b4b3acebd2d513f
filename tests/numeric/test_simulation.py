"""Motion of a real arm over time against Pinocchio's accelerations, integrated by SciPy."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.answers import relative_error
from linkwise import generate, read_system, write_package
from linkwise.package.load import import_package

pytest.importorskip("pinocchio")

from tools.corpus import ROBOTS

from numeric.pinocchio_model import PinocchioModel

if not ROBOTS.is_dir():
    pytest.skip("needs real robots: pip install example-robot-data", allow_module_level=True)


def test_an_arm_under_feedback_moves_as_pinocchio_says(tmp_path: Path) -> None:
    integrate = pytest.importorskip("scipy.integrate")
    path = next(ROBOTS.rglob("ur5_robot.urdf"))
    system = read_system(path)
    write_package(generate(system, ["numpy"], "arm", kernel="loops"), tmp_path / "arm")
    arm, oracle = import_package(tmp_path / "arm").load("numpy"), PinocchioModel(path, system)
    q, qd = np.random.default_rng(3).uniform(-1.0, 1.0, (2, arm.n))
    time = np.linspace(0.0, 0.4, 5)

    def controller(t: float, q: Any, qd: Any) -> Any:
        return 20.0 * np.sin(4.0 * t) - 3.0 * qd - 10.0 * q

    def rates(t: float, state: Any) -> Any:
        at, speed = state.reshape(2, arm.n)
        return np.concatenate([speed, oracle.acceleration(at, speed, controller(t, at, speed))])

    start = np.concatenate([q, qd])
    own = integrate.solve_ivp(rates, (0.0, 0.4), start, "DOP853", t_eval=time, rtol=1e-11, atol=1e-12)
    for how, bound in (({"method": "RK45"}, 1e-7), ({"step": 1e-3}, 1e-6)):
        found = arm.simulate(q, qd, time, controller, passive=False, **how)
        assert relative_error(np.concatenate([found.q, found.qd], 1), own.y.T) <= bound
        assert relative_error(found.tau[-1], controller(0.4, found.q[-1], found.qd[-1])) <= 1e-14
        assert np.abs(found.energy_drift).max() <= 1e-5
