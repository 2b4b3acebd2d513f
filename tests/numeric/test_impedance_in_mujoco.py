"""Controllers in a loop at 1 kHz with robots that MuJoCo moves: is the impedance what was asked for?"""

from collections.abc import Callable
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from conftest import PANDA, needs_compiler

pytest.importorskip("mujoco")

import mujoco

from numeric.finite_rate import AHEAD, HELD, LOOPS, Copy, Course, Loop, measured, run, studied
from numeric.finite_rate_tables import panda_of, planar3_of, table
from numeric.impedance_fit import WAVES, Impedance, errors, sines_for
from numeric.measured_spaces import natural_hand, panda_hand, panda_joints, planar3_joints
from numeric.mujoco_plant import (
    PANDA_AT_WORK,
    STEP,
    MujocoPlant,
    panda_model,
    planar_model,
)

pytestmark = needs_compiler
needs_panda = pytest.mark.skipif(
    not PANDA.is_file(), reason="needs real robots: pip install example-robot-data"
)
ENOUGH = 0.02
"""Difference that a measured impedance may have from what was asked for."""
DT = 1e-3


@needs_panda
def test_mujocos_panda_is_the_one_that_controllers_know(package_of: Callable[[str], ModuleType]) -> None:
    robot, model = package_of(str(PANDA)).load("numpy"), panda_model(PANDA)
    data = mujoco.MjData(model)
    motion = np.random.default_rng(0).uniform(-1.0, 1.0, (3, robot.n))
    data.qpos, data.qvel, data.qacc = motion
    mujoco.mj_inverse(model, data)
    expected = robot.inverse_dynamics(*motion) + robot.passive_torque(*motion).total
    np.testing.assert_allclose(data.qfrc_inverse, expected, atol=1e-12)


@needs_panda
def test_the_plants_steps_are_short_enough() -> None:
    ends = []
    for step in (STEP, STEP / 8):
        plant = MujocoPlant([panda_model(PANDA)])
        plant.start(PANDA_AT_WORK)
        for _ in range(round(0.1 / step)):  # a tenth of a second of falling, limp
            plant.hold(np.zeros((1, 7)), step)
        ends.append(plant.q)
    assert np.abs(ends[0] - PANDA_AT_WORK).max() > 0.05
    np.testing.assert_allclose(*ends, atol=1e-9)


def test_a_fit_finds_the_impedance_of_known_motion() -> None:
    wanted = Impedance(np.diag([1.0, 2.0]), np.array([[3.0, 0.5], [-0.2, 4.0]]), np.diag([50.0, 60.0]))
    sines = sines_for(wanted, 0.01, 1.0)
    waves = np.arange(1, WAVES * 2 + 1)
    w = 2.0 * np.pi * waves
    force = sines.amplitudes * np.exp(1j * (sines.phases - np.pi / 2))[:, None]
    matrices = (
        wanted.stiffness - w[:, None, None] ** 2 * wanted.inertia + 1j * w[:, None, None] * wanted.damping
    )
    phasors = np.linalg.solve(matrices, force[..., None])[..., 0]
    t = np.arange(1000) / 1000
    motion, pushed = (np.real(np.exp(1j * w * t[:, None]) @ part) for part in (phasors, force))
    np.testing.assert_allclose(pushed[300], sines(0.3), atol=1e-12)
    record = type("Record", (), {"offset": motion, "force": pushed})
    assert max(errors(measured(record, 1.0), wanted)) < 1e-9  # type: ignore[arg-type]


def of_pushes(
    space: Any, model: Callable[[float], Any], loops: list[Loop], motion: float, seconds: float
) -> Any:
    """Measured impedance under each loop, pushed along each direction by about `motion` at each frequency."""
    course = Course(sines_for(space.wanted, motion, seconds))
    records = run(space, [Copy(loop, course) for loop in loops], model, 2 * seconds)
    return [measured(record, seconds) for record in records]


@needs_panda
@pytest.mark.parametrize(("space", "seconds"), [(panda_joints, 2.0), (natural_hand, 0.75)])
def test_natural_inertia_with_springs_and_dampers_needs_no_force_sensor(
    space: Callable[[ModuleType], Any], seconds: float, package_of: Callable[[str], ModuleType]
) -> None:
    asked = space(package_of(str(PANDA)))
    # Inertia changes with position, so that what is measured is that of small motions.
    (found,) = of_pushes(asked, panda_of, [HELD], 5e-5, seconds)
    assert max(errors(found, asked.wanted)) < ENOUGH


@needs_panda
def test_a_hand_weighs_what_it_is_told_in_every_direction(package_of: Callable[[str], ModuleType]) -> None:
    asked = panda_hand(package_of(str(PANDA)))
    (found,) = of_pushes(asked, panda_of, [AHEAD], 5e-4, 1.0)
    assert max(errors(found, asked.wanted)) < ENOUGH / 2


def expected_change(space: Any, loop: Loop) -> Impedance:
    """Return the change of an impedance, to first order in the time that torques are late by.

    Torques act half a period late where they are held, one more where they are late, and velocities by
    differences are of half a period before. With G = dg/dq and J = M* H^-1,

        dM = - (d + dv) J B*      dB = - d J (K* - G)      dK = 0

    and a jerk d (1 - J) M* d3q/dt3, which is not there where M* = H.
    """
    robot, at, step = space.package.load("numpy"), space.start, 1e-6
    ends = at + step * np.eye(len(at)), at - step * np.eye(len(at))
    slopes = np.subtract(*map(robot.gravity_torque, ends)).T / (2 * step)
    ratio = space.wanted.inertia @ np.linalg.inv(robot.mass_matrix(at))
    late, differences = DT * (0.5 + loop.late), DT / 2 * loop.differences
    _, damping, stiffness = space.wanted
    return Impedance(
        -(late + differences) * ratio @ damping,
        -late * ratio @ (stiffness - slopes),
        np.zeros_like(stiffness),
    )


def test_what_a_rate_does_to_an_impedance(package_of: Callable[[str], ModuleType]) -> None:
    asked = planar3_joints(package_of("planar3"))
    # heavier ones would still sink to where they settle
    loops = [loop for loop in LOOPS if loop.held and not loop.heavier]
    for loop, found in zip(loops, of_pushes(asked, planar3_of, loops, 1e-4, 1.0), strict=True):
        if loop.ahead:
            assert max(errors(found, asked.wanted)) < (5e-3 if loop.late else 1e-3), loop.name
        else:
            said = Impedance(*map(np.add, asked.wanted, expected_change(asked, loop)))
            most = max(errors(said, asked.wanted))
            assert 0.005 < most < 0.06
            assert max(errors(found, said)) < most / 5 + 1e-3, loop.name


def test_what_holds_at_a_rate(package_of: Callable[[str], ModuleType]) -> None:
    asked, together = planar3_joints(package_of("planar3")), LOOPS[-1]
    outcomes = studied(asked, [HELD, AHEAD, together], planar3_of, 1e-4, np.full(3, 0.5), 0.5)
    held, ahead, worst = outcomes
    # What is stored falls under all of them, with wrong weights to where the arm settles.
    assert max(held.rise, ahead.rise) < 1e-6
    assert worst.rise < 1e-3
    # The target, which accelerates at up to 10 rad/s^2, is followed as it was half a step before.
    assert ahead.tracking < held.tracking / 50 < worst.tracking / 500
    assert table(outcomes, asked.unit).count("\n") == len(outcomes) + 1


@pytest.mark.parametrize(("lighter", "late"), [(0.5, False), (0.1, True)])
def test_contact_with_a_lighter_arm_is_stable_up_to_a_stiffness(
    lighter: float, late: bool, package_of: Callable[[str], ModuleType]
) -> None:
    """Contact feeds d (1 - M*/M) k as negative damping, d being the time that torques are late by."""
    package = package_of("planar1")
    robot, start = package.load("numpy"), np.array([-1.0])
    natural = float(robot.mass_matrix(start)[0, 0])
    inertia, damping, stiffness = (lighter * natural * a for a in (1.0, 14.0, 100.0))
    controller = robot.partial_impedance(inertia, damping, stiffness)
    limit = damping / ((0.5 + late) * DT * (1.0 - lighter))
    for share in (0.8, 1.25):
        model = planar_model(1)
        model.jnt_stiffness[0], model.qpos_spring[0] = share * limit, start[0]
        plant, waiting, away = MujocoPlant([model]), None, []
        plant.start(start + 1e-3)
        for _ in range(2000):
            q, qd = plant.q[0], plant.qd[0]
            tau = controller(q, qd, start, -share * limit * (q - start))[None]
            plant.hold(waiting if late and waiting is not None else tau, DT)
            away.append(abs(q[0] - start[0]))
            waiting = tau
        grows = max(away[-300:]) > max(away[:300])
        assert grows == (share > 1.0), (share, limit)
