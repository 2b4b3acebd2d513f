"""Motions by the compiled C against RK4, written here, of other programs' accelerations.

A quadruped in the air, by Pinocchio, and on three feet, by Lagrange multipliers on Pinocchio's mass matrix,
bias, Jacobians and accelerations of feet.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from conftest import needs_compiler
from helpers.answers import relative_error
from linkwise import Options, generate, read_system, write_package
from linkwise.package.load import import_package

pytest.importorskip("pinocchio")

import pinocchio as pin
from tools.corpus import ROBOTS

from numeric.pinocchio_model import PinocchioModel

if not ROBOTS.is_dir():
    pytest.skip("needs real robots: pip install example-robot-data", allow_module_level=True)

pytestmark = needs_compiler
SOLO = ROBOTS / "solo_description" / "robots" / "solo12.urdf"
STEP, STEPS = 1e-3, 40
FEET = ("FL_FOOT", "FR_FOOT", "HL_FOOT")


def runge_kutta(rates: Callable[[float, Any], Any], state: Any) -> Any:
    """Return the states after each of the steps."""
    states = [state]
    for k in range(STEPS):
        t, y = k * STEP, states[-1]
        k1 = rates(t, y)
        k2 = rates(t + STEP / 2, y + STEP / 2 * k1)
        k3 = rates(t + STEP / 2, y + STEP / 2 * k2)
        k4 = rates(t + STEP, y + STEP * k3)
        states.append(y + STEP / 6 * (k1 + 2 * k2 + 2 * k3 + k4))
    return np.array(states)


def pull(t: float, q: Any, qd: Any) -> Any:
    """Torques at the legs, none at the floating base."""
    tau = 0.1 * np.sin(9.0 * t) - 0.5 * q - 0.01 * qd
    tau[..., :6] = 0.0
    return tau


@pytest.fixture(scope="module")
def solo(tmp_path_factory: pytest.TempPathFactory) -> tuple[Any, Any, PinocchioModel]:
    folder = tmp_path_factory.mktemp("solo")
    system = read_system(SOLO, Options(base="floating"))
    write_package(generate(system, ["numpy", "native"], "solo", kernel="loops"), folder / "solo")
    module = import_package(folder / "solo")
    return module, module.load("native"), PinocchioModel(SOLO, system, True)


def point_rows(oracle: PinocchioModel, q: Any, qd: Any) -> tuple[Any, Any]:
    """Return A (9, n) of the feet, and what their velocities alone accelerate them by."""
    model, data = oracle.model, oracle.data
    state = oracle._state(q, qd, 0.0 * qd)
    pin.forwardKinematics(model, data, *state)
    pin.computeJointJacobians(model, data, state[0])
    pin.updateFramePlacements(model, data)
    rows, drift = [], []
    for name in FEET:
        at, axes = model.getFrameId(name), pin.LOCAL_WORLD_ALIGNED
        rows.append(pin.getFrameJacobian(model, data, at, axes)[:3] @ oracle.tie)
        drift.append(pin.getFrameClassicalAcceleration(model, data, at, axes).linear)
    return np.concatenate(rows), np.concatenate(drift)


def start(robot: Any) -> tuple[Any, Any]:
    """Return a stance with bent legs, and a start at some velocities."""
    rng = np.random.default_rng(4)
    q = np.concatenate([rng.uniform(-0.2, 0.2, 6), np.tile([0.1, 0.7, -1.3], 4) + rng.uniform(-0.1, 0.1, 12)])
    return q, rng.uniform(-0.3, 0.3, robot.n)


def test_a_quadruped_flies_as_pinocchio_says(solo: tuple[Any, Any, PinocchioModel]) -> None:
    _, robot, oracle = solo
    q, qd = start(robot)

    def rates(t: float, state: Any) -> Any:
        at, speed = state.reshape(2, -1)
        return np.concatenate([speed, oracle.acceleration(at, speed, pull(t, at, speed))])

    expected = runge_kutta(rates, np.concatenate([q, qd]))
    found = robot.simulate(q, qd, STEP * np.arange(STEPS + 1), pull, passive=False)
    assert relative_error(np.concatenate([found.q, found.qd], 1), expected) <= 1e-9


def test_a_quadruped_stands_on_three_feet_as_multipliers_say(solo: tuple[Any, Any, PinocchioModel]) -> None:
    """Integrated are all joints: feet that stand still by accelerations alone drift by the error of steps."""
    module, robot, oracle = solo
    q, qd = start(robot)
    feet = [module.Contact(name, kind="point") for name in FEET]
    standing = robot.constrained(contacts=feet, at=q)
    qd = standing.velocity(q, qd[[robot.joint_names.index(name) for name in standing.independent]])

    def rates(t: float, state: Any) -> Any:
        at, speed = state.reshape(2, -1)
        rows, drift = point_rows(oracle, at, speed)
        free = oracle.acceleration(at, speed, pull(t, at, speed))
        inverse = np.linalg.inv(oracle.mass(at))
        force = np.linalg.solve(rows @ inverse @ rows.T, -(rows @ free + drift))
        return np.concatenate([speed, free + inverse @ rows.T @ force])

    expected = runge_kutta(rates, np.concatenate([q, qd]))
    found = robot.simulate(q, qd, STEP * np.arange(STEPS + 1), pull, passive=False, constraints=standing)
    assert relative_error(np.concatenate([found.q, found.qd], 1), expected) <= 1e-9
    places = [[robot.kinematics.pose(at, foot)[:3, 3] for foot in FEET] for at in found.q[[0, -1]]]
    np.testing.assert_allclose(places[1], places[0], atol=1e-12)
