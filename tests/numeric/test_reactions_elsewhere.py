"""Reactions of joints against MuJoCo, OpenSim, and the balance of each body of a four-bar."""

from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from conftest import DATA
from linkwise import generate, read_system, write_package
from linkwise.package.load import import_package

Packages = Callable[[str], ModuleType]

TREE = """<mujoco model="tree">
<compiler angle="radian"/><option gravity="1 -2 -9"><flag contact="disable"/></option>
<worldbody>
  <body name="mast" pos="0.1 0 0.5" euler="0 0.7 0">
    <joint name="lift" type="slide" axis="1 0.5 0" ref="0.2" damping="0.4"/>
    <joint name="swing" type="hinge" axis="0 1 1" pos="0.1 0.2 0.3" ref="-0.4" stiffness="3"/>
    <geom type="box" size="0.1 0.2 0.3" pos="0.1 0 0" euler="0.3 0.2 0.1" mass="3"/>
    <body name="hook" pos="0.2 0 0.7"><joint name="neck" axis="1 2 3" pos="0 0.1 0"/>
      <inertial pos="0.1 0 0.05" mass="1.5" fullinertia="0.02 0.03 0.04 0.001 0.002 -0.003"/>
      <body name="tip" pos="0 0 0.4"><joint name="turn" axis="1 0 0"/><geom size="0.05" mass="0.2"/></body>
    </body>
    <body name="rail" pos="0 0.3 0.2"><joint name="slide" type="slide" axis="0 1 2"/>
      <geom type="box" size="0.1 0.1 0.2" pos="0.1 0.2 0.05" mass="0.7"/></body>
  </body>
</worldbody></mujoco>"""
FIRST_JOINTS = {"mast": "lift", "hook": "neck", "tip": "turn", "rail": "slide"}


def test_joints_bear_mujocos_interaction_forces_under_loads(tmp_path: Path) -> None:
    mujoco = pytest.importorskip("mujoco")
    (tmp_path / "tree.xml").write_text(TREE)
    write_package(generate(read_system(tmp_path / "tree.xml"), ["numpy"]), tmp_path / "tree")
    package = import_package(tmp_path / "tree")
    robot, model = package.load("numpy"), mujoco.MjModel.from_xml_string(TREE)
    data, draw = mujoco.MjData(model), np.random.default_rng(8)
    q, qd, qdd = draw.uniform(-1.0, 1.0, (3, robot.n))
    order = [model.joint(name).qposadr[0] for name in robot.joint_names]
    data.qpos[order], data.qvel[order], data.qacc[order] = q, qd, qdd
    data.xfrc_applied[1:] = draw.uniform(-3.0, 3.0, (4, 6))
    mujoco.mj_inverse(model, data)
    mujoco.mj_rnePostConstraint(model, data)
    loads = [
        package.AppliedLoad(
            body,
            data.xfrc_applied[number, :3],
            data.xfrc_applied[number, 3:],
            at=data.xipos[number],
        )
        for body, number in ((body, model.body(body).id) for body in FIRST_JOINTS)
    ]
    centre = data.subtree_com[model.body("mast").id]
    given = {"axes": "world", "point": centre, "joints": list(FIRST_JOINTS.values()), "loads": loads}
    found = robot.reactions(q, qd, qdd, **given)
    expected = np.array([data.cfrc_int[model.body(body).id] for body in FIRST_JOINTS])
    assert np.abs(found.total - expected).max() <= 1e-10 * np.abs(expected).max()
    assert not found.passive.any()


def planar(force: Any) -> Any:
    """Return the moment about z and the forces along x and y of wrenches."""
    return force[..., [2, 3, 4]]


class FourBar:
    """Balance of forces and moments of three bars in a plane, body by body."""

    sizes = (0.12, 0.31, 0.24)
    masses, inertias = (0.4, 0.9, 0.7), (0.0006, 0.0071, 0.0041)
    centres = ((0.06, 0.01), (0.155, 0.0), (0.12, -0.01))

    def __init__(self, q: Any, qd: Any, qdd: Any) -> None:
        turn = [np.array([a[0], a[0] + a[1], a[2]]) for a in (q, qd, qdd)]
        self.spin, self.angular = turn[1:]
        self.along = [np.array([[np.cos(t), -np.sin(t)], [np.sin(t), np.cos(t)]]) for t in turn[0]]
        knee, ground = self.along[0] @ [self.sizes[0], 0.0], np.array([0.28, 0.0])
        self.starts = [np.zeros(2), knee, ground]
        self.ends = [knee, knee + self.along[1] @ [self.sizes[1], 0.0], ground + self.along[2] @ [0.24, 0.0]]
        own = [self.along[j] @ self.centres[j] for j in range(3)]
        self.places = [self.starts[j] + own[j] for j in range(3)]
        moved = self.accelerated(0, knee)
        self.rates = [np.zeros(2) + self.accelerated(0, own[0])]
        self.rates += [moved + self.accelerated(1, own[1]), self.accelerated(2, own[2])]

    def accelerated(self, bar: int, arm: Any) -> Any:
        """Return the acceleration at the end of an arm on a bar, from its start."""
        return self.angular[bar] * np.array([-arm[1], arm[0]]) - self.spin[bar] ** 2 * arm

    def reactions(self, needs: Any) -> Any:
        """Return moment and forces at a, b and c for what each bar needs about its centre: (3, 3)."""
        # Unknown: the motor's moment at a, the forces on bars at a, b, c, and on the rod's end.
        rows, right = np.zeros((9, 9)), np.zeros(9)
        forces = {"a": 1, "b": 3, "c": 5, "d": 7}
        touched = {0: (("a", 1), ("b", -1)), 1: (("b", 1), ("d", 1)), 2: (("c", 1), ("d", -1))}
        where = {"a": self.starts[0], "b": self.starts[1], "c": self.starts[2], "d": self.ends[1]}
        for bar, pins in touched.items():
            for pin, sign in pins:
                x, y = where[pin] - self.places[bar]
                at = forces[pin]
                rows[3 * bar, at : at + 2] += sign * np.array([-y, x])
                rows[3 * bar + 1, at] += sign
                rows[3 * bar + 2, at + 1] += sign
            right[3 * bar : 3 * bar + 3] = needs[bar]
        rows[0, 0] = 1.0
        found = np.linalg.solve(rows, right)
        return np.array([[found[0], *found[1:3]], [0.0, *found[3:5]], [0.0, *found[5:7]]])

    def of_motion(self, bar: int) -> Any:
        """Return what one bar needs for its motion, the others without mass."""
        needs = np.zeros((3, 3))
        needs[bar] = [self.inertias[bar] * self.angular[bar], *(self.masses[bar] * self.rates[bar])]
        return needs


def test_pins_of_a_loop_bear_what_the_balance_of_each_body_asks(package_of: Packages) -> None:
    package = package_of(str(DATA / "fourbar.toml"))
    robot = package.load("numpy")
    ties, zero = robot.constraints, np.zeros(3)
    q = ties.closed(np.array([0.8, -0.3, 1.2]))
    qd = ties.velocity(q, np.array([1.7]))
    speeding, turning = ties.acceleration(q, 0 * qd, np.array([2.3])), ties.acceleration(q, qd, np.zeros(1))
    force, at = np.array([3.0, -2.0, 0.0]), np.array([0.1, 0.2, 0.0])
    loads = [package.AppliedLoad("rod", force, [0.0, 0.0, 0.4], at=at)]
    found = robot.reactions(q, qd, speeding + turning, axes="world", loads=loads)
    assert found.acceleration.shape == (3, 3, 1, 6), "by the independent coordinate"
    for bar in range(3):
        accelerated = FourBar(q, zero, speeding)
        expected = accelerated.reactions(accelerated.of_motion(bar))
        np.testing.assert_allclose(planar(found.acceleration[:, bar, 0]), expected, atol=1e-12)
        moving = FourBar(q, qd, turning)
        expected = moving.reactions(moving.of_motion(bar))
        np.testing.assert_allclose(planar(found.velocity[:, bar, 0]), expected, atol=1e-12)
        weight = np.zeros((3, 3))
        weight[bar, 2] = FourBar.masses[bar] * 9.81
        np.testing.assert_allclose(planar(found.gravity[:, bar]), moving.reactions(weight), atol=1e-12)
    x, y = at[:2] - moving.places[1]
    needs = np.zeros((3, 3))
    needs[1] = [-(0.4 + x * force[1] - y * force[0]), -force[0], -force[1]]
    np.testing.assert_allclose(planar(found.loads[:, 0]), moving.reactions(needs), atol=1e-12)
    motor = ties.inverse_dynamics(q, qd, speeding + turning) + ties.projected(
        q, robot.kinematics.load_torque(q, *loads[0])
    )
    np.testing.assert_allclose(found.total[:, 2], [motor[0], 0.0, 0.0], atol=1e-12)
