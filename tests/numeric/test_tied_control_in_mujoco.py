"""Controllers of a loop and of legs at 2 kHz, with robots, joints and grounds that MuJoCo moves, softly."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.walker import Q, feet, walker_in
from linkwise import generate, read_system, write_package
from linkwise.package.load import import_package

pytest.importorskip("mujoco")
pytest.importorskip("pinocchio")  # whose mechanisms these are

import mujoco

from numeric.loops import MECHANISMS

DT = 5e-4
"""s; torques are held so long."""
Law = Callable[[Any, Any], Any]
STIFF = 'solref="0.001 1" solimp="0.999 0.9999 1e-6"'
FOURBAR = f"""<mujoco><option gravity="0.3 -9.81 0.2" timestep="{DT / 4}" integrator="implicitfast"/>
<compiler balanceinertia="false" autolimits="true"/><worldbody>
<body name="a"><joint name="crank" axis="0 0 1"/>
<inertial pos="0.15 0.01 0.02" mass="1.2" fullinertia="0.024 0.036 0.03 0.0024 0 -0.0036"/>
<body name="b" pos="0.3 0 0"><joint name="knee" axis="0 0 1"/>
<inertial pos="0.3 -0.02 0" mass="2" fullinertia="0.04 0.06 0.05 0.004 0 -0.006"/>
<site name="rod" pos="0.7 0 0"/></body></body>
<body name="c" pos="0.6 0.1 0"><joint name="rocker" axis="0 0 1"/>
<inertial pos="0.2 0.01 0" mass="1.5" fullinertia="0.03 0.045 0.0375 0.003 0 -0.0045"/>
<site name="end" pos="0.5 0 0"/></body></worldbody>
<equality><connect name="pin" site1="rod" site2="end" {STIFF}/></equality></mujoco>"""


def leg(side: str, y: float) -> str:
    return f"""<body name="thigh_{side}" pos="0 {y} -0.1"><joint name="hip_{side}" axis="0 1 0"/>
<inertial pos="0 0 -0.2" mass="4" diaginertia="0.06 0.06 0.01"/>
<body name="shank_{side}" pos="0 0 -0.4"><joint name="knee_{side}" axis="0 1 0"/>
<inertial pos="0.01 0 -0.2" mass="2" diaginertia="0.03 0.03 0.005"/>
<geom name="{side}" type="sphere" size="0.001" pos="0 0 -0.4"/></body></body>"""


def walker_on(friction: float) -> str:
    """The walker of `helpers.walker` over a plane that its feet may slip and tip on."""
    return f"""<mujoco><option timestep="{DT / 4}" cone="elliptic" impratio="100" integrator="implicitfast"/>
<compiler balanceinertia="false"/><default><geom condim="3" friction="{friction} 0 0" {STIFF}/></default>
<worldbody><geom type="plane" size="5 5 1"/><body name="trunk"><joint name="x" type="slide" axis="1 0 0"/>
<joint name="z" type="slide" axis="0 0 1"/><joint name="pitch" axis="0 1 0"/>
<inertial pos="0.02 0 0.2" mass="20" diaginertia="0.6 0.5 0.3"/>{leg("r", 0.0)}{leg("l", 0.02)}</body>
</worldbody></mujoco>"""


def moved(text: str, q: Any, qd: Any, law: Law, time: float) -> Any:
    """Return q (steps, n) as MuJoCo moves it from there."""
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    data.qpos, data.qvel = q, qd
    path = [np.array(q)]
    for _ in range(round(time / DT)):
        data.qfrc_applied = law(data.qpos.copy(), data.qvel.copy())
        for _ in range(4):
            mujoco.mj_step(model, data)
        path.append(data.qpos.copy())
    return np.array(path)


def test_a_four_bar_swings_as_one_with_a_lighter_rod(tmp_path: Path) -> None:
    (tmp_path / "made.toml").write_text(MECHANISMS["fourbar"].text)
    write_package(generate(read_system(tmp_path / "made.toml"), ["numpy"]), tmp_path / "made")
    package = import_package(tmp_path / "made")
    robot = package.load("numpy")
    ties, own = robot.constrained(tolerance=1e-2), robot.constraints
    half = dict.fromkeys(("b",), 0.5)
    spring = np.array([8.0, 0.0, 4.0])
    control = robot.partial_impedance(package.Natural(half), package.Natural(half), spring, constraints=ties)
    q = own.closed(np.array(MECHANISMS["fourbar"].q))
    rest, still = q - 0.4, np.zeros(3)
    path = moved(FOURBAR, q, still, lambda q, qd: control(ties.closed(q), qd, rest), 0.6)
    # Energy of the crank, of half of the rod and of the rocker, on springs and without weight, stays.
    states = own.closed(path)
    qd = np.gradient(path, DT, axis=0)
    energy = (0.5 * spring * (states - rest) ** 2).sum(-1)
    weights = np.array([1.0, 0.5, 1.0])
    energy += (weights * robot.energy(states, qd).kinetic).sum(-1)
    inner = slice(2, -2)  # where differences of positions are as good as velocities
    assert np.ptp(energy[inner]) < 0.01 * energy.max()
    assert np.ptp(path[:, 0]) > 0.5
    # The whole motion, simulated under the same law.
    time = DT * np.arange(len(path))[::40]
    expected = robot.simulate(
        q, still, time, lambda t, q, qd: control(q, qd, rest), constraints=ties, step=DT
    )
    np.testing.assert_allclose(path[::40], expected.q, atol=5e-3)


def test_feet_stay_where_cones_are_kept_and_slip_where_not(tmp_path: Path) -> None:
    package = walker_in(tmp_path)
    robot = package.load("numpy")
    ties = robot.constrained(contacts=feet(package))
    start, friction = on_ground(robot), 0.05
    slips = []
    for grips in ((), [package.Grip(side, 0.9 * friction) for side in "rl"]):
        limp = robot.partial_impedance(damping=package.Natural(plus=1.0), constraints=ties, grips=grips)
        path = moved(walker_on(friction), start, 0.0 * start, limp, 0.3)
        slips.append(np.abs(feet_at(robot, path[-1]) - feet_at(robot, start)).max())
    assert slips[0] > 0.005, "the least torques alone let a foot slip"
    assert slips[1] < 0.0002


def feet_at(robot: Any, q: Any) -> Any:
    """Places of both feet, (2, 3)."""
    sole = np.array([0.0, 0.0, -0.4, 1.0])
    return np.array([(robot.kinematics.pose(q, f"shank_{side}") @ sole)[:3] for side in "rl"])


def on_ground(robot: Any) -> Any:
    """Return the walker with both feet on the plane."""
    q = Q.copy()
    low = feet_at(robot, q)[:, 2]
    q[2] = 0.0
    for _ in range(50):  # the trunk's height and the left knee
        low = feet_at(robot, q)[:, 2] - 0.001
        q[1] -= low[0]
        q[6] += 2.0 * (low[1] - low[0])
    assert np.abs(feet_at(robot, q)[:, 2] - 0.001).max() < 1e-6
    return q
