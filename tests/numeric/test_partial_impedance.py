"""Robots under partial impedance move as their targets say: Pinocchio moves them, SciPy integrates."""

from collections.abc import Callable
from functools import partial
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from helpers.answers import relative_error
from linkwise import generate, read_system, write_package
from linkwise.package.load import import_package

pytest.importorskip("pinocchio")

import pinocchio as pin
from tools.corpus import ROBOTS

from numeric.pinocchio_model import PinocchioModel

integrate = pytest.importorskip("scipy.integrate")
linalg = pytest.importorskip("scipy.linalg")

if not ROBOTS.is_dir():
    pytest.skip("needs real robots: pip install example-robot-data", allow_module_level=True)

LARGEST_ERROR = 1e-9
UR5 = next(ROBOTS.rglob("ur5_robot.urdf"))
Q = np.array([0.4, -1.1, 1.3, -0.6, 0.9, 0.2])
QD = np.array([0.6, -0.4, 0.5, 0.8, -0.7, 0.3])
AT = Q + np.array([0.2, 0.1, -0.2, 0.15, -0.1, 0.25])
Controller = Callable[[Any, Any], Any]


class Arm:
    """UR5: its package, and the same robot in Pinocchio."""

    def __init__(self, folder: Path) -> None:
        system = read_system(UR5)
        write_package(generate(system, ["numpy"], "ur5", kernel="loops"), folder)
        self.package: ModuleType = import_package(folder)
        self.robot = self.package.load("numpy")
        self.oracle = PinocchioModel(UR5, system)
        self.n = self.robot.n

    def moved(self, controller: Controller, force: Any, time: Any) -> tuple[Any, Any]:
        """q and qd at instants, of the robot in Pinocchio under a controller and a force on the joints."""

        def rates(_: float, state: Any) -> Any:
            q, qd = state.reshape(2, self.n)
            return np.concatenate([qd, self.oracle.acceleration(q, qd, controller(q, qd) + force)])

        start = np.concatenate([Q, QD])
        found = integrate.solve_ivp(
            rates, (time[0], time[-1]), start, "DOP853", t_eval=time, rtol=1e-12, atol=1e-13
        )
        q, qd = np.swapaxes(found.y.reshape(2, self.n, -1), 1, 2)
        return q, qd


@pytest.fixture(scope="module")
def arm(tmp_path_factory: pytest.TempPathFactory) -> Arm:
    return Arm(tmp_path_factory.mktemp("arm") / "ur5")


def positive(n: int, size: float, seed: int) -> Any:
    root = np.random.default_rng(seed).normal(size=(n, n))
    return size * (root @ root.T / n + np.eye(n))


def at_target(controller: Any, target: Any, q: Any, qd: Any) -> Any:
    return controller(q, qd, target)


def linear_motion(inertia: Any, damping: Any, stiffness: Any, x: Any, v: Any, force: Any, time: Any) -> Any:
    """x of M xdd + B xd + K x = f, by the matrix exponential."""
    n = len(x)
    system = np.block(
        [
            [np.zeros((n, n)), np.eye(n)],
            [-np.linalg.solve(inertia, stiffness), -np.linalg.solve(inertia, damping)],
        ]
    )
    rest = np.concatenate([np.linalg.solve(stiffness, force), np.zeros(n)])
    start = np.concatenate([x, v]) - rest
    return np.stack([(rest + linalg.expm(system * t) @ start)[:n] for t in time])


@pytest.mark.parametrize("form", ["summed", "by link"])
def test_joints_obey_the_target_equation(arm: Arm, form: str) -> None:
    n, time = arm.n, np.linspace(0.0, 0.5, 6)
    gains = [positive(n, size, seed) for seed, size in enumerate((2.0, 4.0, 30.0))]
    force = np.array([3.0, -2.0, 1.0, 0.5, -0.4, 0.2])
    given = gains
    if (
        form == "by link"
    ):  # any split over the links is the same controller: the paper's equation by link is a gauge
        shares = np.zeros((n, arm.robot.N, n))
        shares[*arm.robot.layout.velocity.T] = np.random.default_rng(5).uniform(
            size=len(arm.robot.layout.velocity)
        )
        shares /= shares.sum(1, keepdims=True)
        given = [shares * gain[:, None, :] for gain in gains]
    controller = arm.robot.partial_impedance(*given)
    q, _ = arm.moved(lambda q, qd: controller(q, qd, AT, force), force, time)
    expected = AT + linear_motion(*gains, Q - AT, QD, force, time)
    assert relative_error(q - AT, expected - AT) <= LARGEST_ERROR


def test_scaled_links_move_as_links_of_other_masses_without_a_measured_force(arm: Arm) -> None:
    scale = {"forearm_link": 0.4, "wrist_1_link": 1.5}
    damping, stiffness = np.full(arm.n, 3.0), np.full(arm.n, 20.0)
    force, time = np.array([3.0, -2.0, 1.0, 0.5, -0.4, 0.2]), np.linspace(0.0, 0.5, 6)
    other = arm.oracle.model.copy()
    for link, factor in scale.items():
        frame = other.frames[other.getFrameId(link, pin.BODY)]
        body = other.inertias[frame.parentJoint]
        other.inertias[frame.parentJoint] = pin.Inertia(factor * body.mass, body.lever, factor * body.inertia)
    other.gravity.linear = np.zeros(3)
    data = other.createData()

    def rates(_: float, state: Any) -> Any:
        q, qd = state.reshape(2, arm.n)
        torque = force - damping * qd - stiffness * (q - AT)
        return np.concatenate([qd, pin.aba(other, data, q, qd, torque)])

    start = np.concatenate([Q, QD])
    lighter = integrate.solve_ivp(rates, (0.0, 0.5), start, "DOP853", t_eval=time, rtol=1e-12, atol=1e-13)
    natural = arm.package.Natural
    shaped = arm.robot.partial_impedance(natural(scale), natural(scale, plus=damping), stiffness)
    assert shaped.dissipative
    q, _ = arm.moved(lambda q, qd: shaped(q, qd, AT, force), force, time)
    assert relative_error(q, lighter.y[: arm.n].T) <= LARGEST_ERROR


def test_a_moving_target_is_followed_as_the_target_equation_says(arm: Arm) -> None:
    n, time = arm.n, np.linspace(0.0, 0.5, 6)
    gains = [positive(n, size, seed) for seed, size in enumerate((2.0, 4.0, 30.0))]
    controller, target = arm.robot.partial_impedance(*gains), arm.package.Target
    start = np.concatenate([Q, QD])

    def wanted(t: float) -> Any:
        return target(
            AT + 0.2 * np.sin(3.0 * t), np.full(n, 0.6 * np.cos(3.0 * t)), np.full(n, -1.8 * np.sin(3.0 * t))
        )

    def rates(t: float, state: Any) -> Any:
        q, qd = state.reshape(2, n)
        return np.concatenate([qd, arm.oracle.acceleration(q, qd, controller(q, qd, wanted(t)))])

    found = integrate.solve_ivp(rates, (0.0, 0.5), start, "DOP853", t_eval=time, rtol=1e-12, atol=1e-13)
    errors = found.y[:n].T - np.stack([wanted(t).q for t in time])
    expected = linear_motion(*gains, Q - AT, QD - 0.6, np.zeros(n), time)
    assert relative_error(errors, expected) <= LARGEST_ERROR


@pytest.mark.parametrize("rows", [("x", "y", "z", "rx", "ry", "rz"), ("x", "z")], ids=["all", "two"])
def test_a_frame_obeys_its_target_equation(arm: Arm, rows: tuple[str, ...]) -> None:
    """The equation is linear in the angle about one axis only, so that turns are held apart."""
    places = [row for row in rows if len(row) == 1]
    count, time = len(places), np.linspace(0.0, 0.4, 5)
    inertia, damping, stiffness = (positive(count, size, seed) for seed, size in enumerate((3.0, 8.0, 60.0)))
    whole = [np.eye(len(rows)) for _ in range(3)]
    for matrix, part in zip(whole, (inertia, damping, stiffness), strict=True):
        matrix[:count, :count] = part
    point, frame = (0.05, 0.02, 0.1), "ee_link"
    asked = arm.package.FrameImpedance(frame, *whole, rows, point)
    controller = arm.robot.partial_impedance(damping=arm.package.Natural(plus=1.0), frame=asked)
    target = arm.package.Target(pose=arm.robot.kinematics.pose(AT, frame))
    axes = ["xyz".index(row) for row in places]
    force_on_point = np.zeros(3)  # one along a free row moves the rest of the arm, and the frame with it
    force_on_point[axes] = np.array([8.0, -5.0, 6.0])[axes]
    model, data = arm.oracle.model, arm.oracle.data
    number = model.getFrameId(frame)

    def oracle_point(q: Any, qd: Any) -> tuple[Any, Any, Any]:
        pin.forwardKinematics(model, data, q, qd)
        pin.computeJointJacobians(model, data, q)
        pin.updateFramePlacements(model, data)
        placed = data.oMf[number]
        arm_of = placed.rotation @ np.array(point)
        full = pin.getFrameJacobian(model, data, number, pin.LOCAL_WORLD_ALIGNED)
        jacobian = full[:3] - pin.skew(arm_of) @ full[3:]
        return placed.translation + arm_of, jacobian @ qd, jacobian

    def rates(_: float, state: Any) -> Any:
        q, qd = state.reshape(2, arm.n)
        force = oracle_point(q, qd)[2].T @ force_on_point
        torque = controller(q, qd, target, force) + force
        return np.concatenate([qd, arm.oracle.acceleration(q, qd, torque)])

    start = np.concatenate([Q, QD])
    found = integrate.solve_ivp(rates, (0.0, 0.4), start, "DOP853", t_eval=time, rtol=1e-12, atol=1e-13)
    moved = np.stack([oracle_point(q, 0 * q)[0] for q in found.y[: arm.n].T])[:, axes]
    goal = oracle_point(AT, 0 * AT)[0][axes]
    begin, speed, _ = oracle_point(Q, QD)
    felt = force_on_point[axes]
    expected = goal + linear_motion(inertia, damping, stiffness, begin[axes] - goal, speed[axes], felt, time)
    assert relative_error(moved - goal, expected - goal) <= LARGEST_ERROR


def test_stored_energy_falls_along_every_motion(arm: Arm) -> None:
    natural, frame = arm.package.Natural, arm.package.FrameImpedance
    n, pose = arm.n, arm.robot.kinematics.pose(AT, "ee_link")
    spring = np.diag([0.3, 0.2, 0.1, 60.0, 50.0, 40.0])
    kept = {"forearm_link": 0.5, "upper_arm_link": 1.3}
    robot = arm.robot
    cases = (
        (robot.partial_impedance(*(positive(n, s, k) for k, s in enumerate((2.0, 4.0, 30.0)))), AT),
        (robot.partial_impedance(natural(), natural(plus=2.0), 20.0), AT),
        (robot.partial_impedance(natural(kept, plus=0.1), natural(kept, plus=positive(n, 2.0, 4)), 20.0), AT),
        (
            robot.partial_impedance(
                damping=natural(plus=1.0),
                frame=frame("ee_link", natural(), natural(plus=spring / 10.0), spring),
            ),
            arm.package.Target(pose=pose),
        ),
        (
            robot.partial_impedance(
                damping=natural(plus=1.0),
                frame=frame("ee_link", natural(0.5), natural(0.5, plus=20.0), 60.0, rows=("x", "y", "z")),
            ),
            arm.package.Target(pose=pose),
        ),
    )
    for controller, target in cases:
        assert controller.dissipative
        q, qd = arm.moved(partial(at_target, controller, target), 0.0, np.linspace(0.0, 0.5, 51))
        energy = controller.stored_energy(q, qd, target)
        assert (np.diff(energy) < 0.0).all()
        assert energy[-1] < 0.9 * energy[0]
    assert not robot.partial_impedance(damping=2.0, stiffness=20.0).dissipative


def test_what_is_left_of_a_cancelled_link_is_pinocchios(arm: Arm) -> None:
    """Joint i is loaded by all links but the cancelled one, whose motion other joints go on feeling."""
    robot, oracle = arm.robot, arm.oracle
    joint, link = "shoulder_lift_joint", "forearm_link"
    i, controller = robot.joint_index(joint), robot.cancel({(joint, link, None, None)})
    task, force = np.array([2.0, 1.0, -1.0, 0.5, 0.2, -0.1]), np.array([0.3, -0.2, 0.1, 0.2, -0.1, 0.1])
    qdd = oracle.acceleration(Q, QD, controller(Q, QD, task, force) + force)
    left = oracle.torque(Q, QD, qdd) - oracle.gravity(Q)
    of_link = oracle.torque(Q, QD, qdd, link) - oracle.torque(Q, 0 * QD, 0 * qdd, link)
    left[i] -= of_link[i]
    assert abs(of_link[i]) > 0.1
    assert relative_error(left, task + force) <= LARGEST_ERROR
    assert relative_error(controller.acceleration(Q, QD, task, force), qdd) <= LARGEST_ERROR


def test_all_cancelled_is_computed_torque_and_none_of_it_is_gravity(arm: Arm) -> None:
    robot, oracle = arm.robot, arm.oracle
    wanted, task = np.array([1.0, -2.0, 0.5, 2.0, -1.0, 0.3]), np.array([2.0, 1.0, -1.0, 0.5, 0.2, -0.1])
    everything = robot.cancel({(None, None, None, None)})
    assert relative_error(everything(Q, QD, qdd=wanted), oracle.torque(Q, QD, wanted)) <= 1e-12
    with pytest.raises(ValueError, match="what is left of the mass matrix is singular"):
        everything(Q, QD)
    base = robot.cancel({(0, 0, 0, 1)})  # c1 of the first joint through its own link is zero
    assert relative_error(base(Q, QD, task), oracle.gravity(Q) + task) <= 1e-12
    assert relative_error(robot.partial_impedance()(Q, QD), oracle.gravity(Q)) <= 1e-12
    zero = {(j, link, k): 0.0 for j in range(6) for link in range(j, 6) for k in range(link + 1)}
    emptied = robot.partial_impedance(damping=zero)
    velocity = oracle.torque(Q, QD, 0 * QD)
    assert relative_error(emptied(Q, QD), velocity) <= 1e-12


def test_natural_impedance_is_the_change_of_every_torque(arm: Arm) -> None:
    wanted = np.array([1.0, -2.0, 0.5, 2.0, -1.0, 0.3])
    natural, step = arm.robot.natural_impedance(Q, QD, wanted), 1e-6
    for number, part in enumerate((natural.stiffness, natural.damping, natural.inertia)):
        for k in range(arm.n):
            ends = []
            for sign in (1.0, -1.0):
                motion = [Q.copy(), QD.copy(), wanted.copy()]
                motion[number][k] += sign * step
                ends.append(np.stack([arm.oracle.torque(*motion, name) for name in arm.robot.link_names], -1))
            slope = (ends[0] - ends[1]) / (2.0 * step)
            assert np.abs(part[:, :, k] - slope).max() <= 1e-7
