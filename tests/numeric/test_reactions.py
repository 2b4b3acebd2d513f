"""Reactions of joints, cause by cause, against Pinocchio's joint forces and MuJoCo's interaction forces."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from linkwise import Options, generate, read_system, write_package
from linkwise.package.load import import_package

pytest.importorskip("pinocchio")

import pinocchio as pin
from tools.corpus import ROBOTS

from numeric.pinocchio_model import PinocchioModel
from numeric.test_induced import OnFeet

if not ROBOTS.is_dir():
    pytest.skip("needs real robots: pip install example-robot-data", allow_module_level=True)

LARGEST_ERROR = 1e-12
REAL_ROBOTS = {
    "panda": "",  # a finger follows the other
    "ur5_robot": "",
    "kinova": "",
    "xarm7": "",
    "z1": "",
    "bolt": "floating",
    "baxter": "",
    "solo12": "floating",
    "simple_humanoid": "floating",
    "talos_reduced": "floating",
}


COMPILED = ("panda", "bolt")
"""Robots whose C answers too: mimic joints, and a floating base."""


def two_arms() -> str:
    """URDF of a slide that carries two arms with hinges of their own, and of a slide beside them."""
    lines = ['<robot name="two_arms"><link name="ground"/>']
    for number, (parent, child, kind, axis) in enumerate(
        (
            ("ground", "cart", "prismatic", "0.6 0.8 0"),
            ("cart", "left", "continuous", "0 0.6 0.8"),
            ("left", "left_hand", "prismatic", "1 0 0"),
            ("cart", "right", "continuous", "1 0 0"),
            ("right", "right_hand", "continuous", "0 0 1"),
            ("cart", "lift", "prismatic", "0 0 1"),
        )
    ):
        limit = '<limit lower="-9" upper="9" effort="1" velocity="1"/>' if kind == "prismatic" else ""
        lines.append(
            f'<link name="{child}"><inertial><origin xyz="0.1 -0.0{number} 0.2"/><mass value="{number + 1}"/>'
            '<inertia ixx="0.2" iyy="0.3" izz="0.25" ixy="0.01" ixz="-0.02" iyz="0.03"/></inertial></link>'
            f'<joint name="to_{child}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
            f'<origin xyz="0.3 0.{number} -0.2" rpy="0.{number} 0.2 0"/><axis xyz="{axis}"/>{limit}</joint>'
        )
    return "\n".join([*lines, "</robot>"])


class JointForces(PinocchioModel):
    """Forces that Pinocchio's joints exert on what hangs on them."""

    def forces(self, joints: tuple[str, ...], link: str, motion: tuple[Any, Any, Any], weight: bool) -> Any:
        """Return moments, about the joints' origins, over forces, in the world's axes, of one link alone."""
        model, data = self.alone[link], self.data
        gravity = model.gravity.linear.copy()
        model.gravity.linear = gravity * weight
        state = self._state(*motion)
        pin.rnea(model, data, *state)
        pin.forwardKinematics(model, data, state[0])
        model.gravity.linear = gravity
        found = []
        for name in joints:
            at = model.getJointId(name)
            turn, force = data.oMi[at].rotation, data.f[at]
            found.append(np.concatenate([turn @ force.angular, turn @ force.linear]))
        return np.array(found)


@pytest.mark.parametrize(
    ("name", "backend"),
    [*((name, "numpy") for name in REAL_ROBOTS), *((name, "native") for name in COMPILED)],
)
def test_each_share_is_what_pinocchios_joints_bear_of_that_cause_alone(
    name: str, backend: str, tmp_path: Path
) -> None:
    compare_with_pinocchio(next(ROBOTS.rglob(f"{name}.urdf")), REAL_ROBOTS[name], backend, tmp_path)


@pytest.mark.parametrize("backend", ["numpy", "native"])
def test_a_slide_bears_each_share_of_arms_with_hinges_of_their_own(backend: str, tmp_path: Path) -> None:
    path = tmp_path / "two_arms.urdf"
    path.write_text(two_arms(), encoding="utf-8")
    compare_with_pinocchio(path, "", backend, tmp_path)


def compare_with_pinocchio(path: Path, base: str, backend: str, folder: Path) -> None:
    """Compare each share, by link, cause and order, with Pinocchio's joint forces."""
    system = read_system(path, Options(base=base) if base else Options())
    write_package(generate(system, [backend], "robot", kernel="loops"), folder / "robot")
    robot = import_package(folder / "robot").load(backend)
    pinocchio = JointForces(path, system, base == "floating")
    q, qd, qdd = np.random.default_rng(3).uniform(-1.0, 1.0, (3, robot.n))
    found = robot.reactions(q, qd, qdd, axes="world", constraints=False)
    names, zero, scale = robot.tree_joint_names, np.zeros(robot.n), 0.0
    error = 0.0

    def compare(share: Any, expected: Any) -> None:
        nonlocal error, scale
        error = max(error, np.abs(share - expected).max())
        scale = max(scale, np.abs(expected).max())

    for j, link in enumerate(robot.link_names):
        compare(found.gravity[:, j], pinocchio.forces(names, link, (q, zero, zero), True))
        for k, unit in enumerate(np.eye(robot.n)):
            motion = q, zero, unit * qdd[k]
            compare(found.acceleration[:, j, k], pinocchio.forces(names, link, motion, False))
            # Half the slope of what is quadratic in qd is this quarter of a difference.
            more, less = (
                pinocchio.forces(names, link, (q, qd + step * unit, zero), False) for step in (1.0, -1.0)
            )
            compare(found.velocity[:, j, k], qd[k] * (more - less) / 4.0)
    assert error <= LARGEST_ERROR * scale


def standing_on(feet: list[str], folder: Path) -> tuple[Any, Any, Any, Any]:
    """Return solo12 on a floating base with feet held, Pinocchio's, and a position."""
    path, options = next(ROBOTS.rglob("solo12.urdf")), Options(base="floating")
    system = read_system(path, options)
    write_package(generate(system, ["numpy"], "robot", kernel="loops"), folder / "robot")
    module = import_package(folder / "robot")
    robot, oracle = module.load("numpy"), OnFeet(path, system, True)
    oracle.held(feet)
    bend = {"HAA": 0.2, "HFE": 0.7, "KFE": -1.3}
    q = np.array([0.1, 0.2, 0.3, 0.3, -0.2, 0.1, *(bend[name[-3:]] for name in robot.joint_names[6:])])
    return robot, robot.constrained(contacts=[module.Contact(f, "point") for f in feet], at=q), oracle, q


def test_joints_of_a_robot_that_stands_bear_what_pinocchio_says(tmp_path: Path) -> None:
    feet = ["FL_FOOT", "HR_FOOT", "HL_FOOT"]
    robot, standing, oracle, q = standing_on(feet, tmp_path)
    draw = np.random.default_rng(4)
    qd = standing.velocity(q, draw.uniform(-1.0, 1.0, robot.n - 9))
    qdd = standing.acceleration(q, qd, draw.uniform(-1.0, 1.0, robot.n - 9))
    found = robot.reactions(q, qd, qdd, axes="world", constraints=standing)
    # What follows has no actuators; by the torques of the others Pinocchio moves the robot alike.
    tau = np.zeros(robot.n)
    tau[[robot.joint_names.index(name) for name in standing.independent]] = standing.inverse_dynamics(
        q, qd, qdd
    )
    moved, forces = oracle.answer(q, qd, tau, True)
    np.testing.assert_allclose(moved, qdd, atol=1e-9)
    model, data = oracle.model, oracle.data
    on_feet = pin.StdVec_Force()
    on_feet.extend([pin.Force.Zero()] * model.njoints)
    state = oracle._state(q, qd, moved)
    pin.forwardKinematics(model, data, state[0])
    for tie, force in zip(oracle.ties, forces.reshape(-1, 3), strict=True):
        place = data.oMi[tie.joint1_id]
        at = place.act(tie.joint1_placement).translation
        own = on_feet[tie.joint1_id]
        on_feet[tie.joint1_id] = own + place.actInv(pin.Force(force, np.cross(at, force)))
    pin.rnea(model, data, *state, on_feet)
    for at, name in enumerate(robot.tree_joint_names):
        joint = model.getJointId(name)
        turn, force = data.oMi[joint].rotation, data.f[joint]
        expected = np.concatenate([turn @ force.angular, turn @ force.linear])
        np.testing.assert_allclose(found.total[at], expected, atol=1e-9, err_msg=name)
    base = found.total[: robot.tree_joint_names.index("base_roll") + 1]
    np.testing.assert_allclose(base, 0.0, atol=1e-9, err_msg="nothing holds a floating base")
