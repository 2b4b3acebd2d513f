"""docs/control-root.png: link 3's effect on the root is cancelled, link 2's is left; in MuJoCo, too."""

from collections.abc import Callable
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from conftest import needs_compiler

pytest.importorskip("matplotlib")

from tools import control_root
from tools.control_root import CANCELLED, END, EVERY, LINK_2_MOVES, START, STEP, Run

pytestmark = needs_compiler


@pytest.fixture(scope="module")
def robot(package_of: Callable[[str], ModuleType]) -> Any:
    return package_of("planar3").load("native")


@pytest.fixture(scope="module")
def runs(robot: Any) -> tuple[Run, Run]:
    return control_root.both(robot)


def test_the_root_rests_while_only_link_3_moves(runs: tuple[Run, Run]) -> None:
    felt, freed = (run.q[run.time < LINK_2_MOVES] - START for run in runs)
    assert np.ptp(felt[:, 0]) > np.radians(15)
    assert np.ptp(freed[:, 0]) < 1e-12
    # both runs lead joints 2 and 3 along the same motion
    np.testing.assert_allclose(felt[:, 1:], freed[:, 1:], atol=1e-5)


def test_link_2_moves_the_root_as_if_there_were_no_link_3(
    runs: tuple[Run, Run], package_of: Callable[[str], ModuleType]
) -> None:
    two = package_of("planar2").load("native")

    def tau(t: float, q: Any, qd: Any) -> Any:
        at, rate, wanted = (a[0] for a in control_root.led(t))
        joint = wanted + control_root.DAMPING * (rate - qd[1]) + control_root.STIFFNESS * (at - q[1])
        mass, force = two.mass_matrix(q), two.coriolis_matrix(q, qd) @ qd
        root = -(mass[0, 1] * joint + force[0]) / mass[0, 0]
        return mass @ [root, joint] + force + two.gravity_torque(q)

    time = np.arange(0.0, END + EVERY / 2, EVERY)
    motion = two.simulate(START[:2], np.zeros(2), time, tau, step=STEP)
    assert np.ptp(motion.q[:, 0]) > np.radians(15)
    np.testing.assert_allclose(runs[1].q[:, 0], motion.q[:, 0], atol=1e-9)


def test_the_motor_answers_link_3_and_nothing_else(runs: tuple[Run, Run]) -> None:
    felt, freed = runs
    np.testing.assert_allclose(felt.motor, 0.0, atol=1e-12)
    np.testing.assert_allclose(freed.motor, freed.through[:, 2], atol=1e-9)
    np.testing.assert_allclose(freed.through[:, :2].sum(-1), 0.0, atol=1e-9)
    assert np.abs(freed.motor).max() > 4.0


def test_at_1_khz_in_mujoco_the_root_all_but_rests(robot: Any) -> None:
    pytest.importorskip("mujoco")
    from numeric.mujoco_plant import MujocoPlant, planar_model

    controller, kept, period = robot.cancel(CANCELLED), np.ones((3, 3, 3)), 1e-3
    kept[0, 2] = 0.0
    plant, turned = MujocoPlant([planar_model()]), []
    plant.start(START)
    for k in range(round(LINK_2_MOVES / period)):
        q, qd = plant.q[0], plant.qd[0]
        turned.append(q[0] - START[0])
        plant.hold(controller(q, qd, control_root.task(robot, kept, k * period, q, qd))[None], period)
    # Torques are half a millisecond late: the root drifts by a fiftieth of what link 3 would do to it.
    assert np.abs(turned).max() < np.radians(0.4)


def test_the_figure_is_drawn(runs: tuple[Run, Run]) -> None:
    picture = control_root.picture(runs)
    assert picture.startswith(b"\x89PNG")
    assert len(picture) > 50_000
