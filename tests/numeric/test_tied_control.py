"""Controllers of tied and standing robots: Pinocchio moves the robot by their torques, and the law must hold.

The law is asked of Pinocchio too: each link's torque on the open tree, without gravity, times its share.
"""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from linkwise import Options, generate, read_system, write_package
from linkwise.package.load import import_package
from linkwise_runtime.quantities import Contact

pytest.importorskip("pinocchio")

from helpers.answers import relative_error
from tools.corpus import ROBOTS

from numeric.loops import MECHANISMS, LoopOracle
from numeric.pinocchio_model import PinocchioModel
from numeric.standing import standing_acceleration

LIMIT = 1e-9
needs_robots = pytest.mark.skipif(
    not ROBOTS.is_dir(), reason="needs real robots: pip install example-robot-data"
)
LinkTorque = Callable[[str, Any, Any, Any], Any]


def free_motions(rows: Any) -> Any:
    """Return an orthonormal basis (m, n) of the velocities that rows A allow."""
    values, across = np.linalg.svd(rows)[1:]
    return across[int((values > 1e-6 * values.max()).sum()) :]


def inertial(torque: LinkTorque, weights: dict[str, float], q: Any, qd: Any, qdd: Any) -> Any:
    """Sum of w_j (c2 qdd + c1 qd) of the links."""
    rest = 0.0 * q
    return sum(w * (torque(j, q, qd, qdd) - torque(j, q, rest, rest)) for j, w in weights.items())


class Law:
    """Targets in all the forms that add up: the last link weighs half, springs and dampers on all joints."""

    def __init__(self, package: Any, robot: Any, draw: Any, soft: Any = 1.0) -> None:
        self.shares = dict.fromkeys(robot.link_names, 1.0) | {robot.link_names[-1]: 0.5}
        self.damping = draw.uniform(0.3, 0.6, robot.n)
        self.stiffness = soft * draw.uniform(1.0, 3.0, robot.n)
        self.wanted = package.Natural({robot.link_names[-1]: 0.5})
        self.damped = package.Natural({robot.link_names[-1]: 0.5}, plus=self.damping)
        self.at, self.qd, self.qdd, self.push = draw.uniform(-0.5, 0.5, (4, robot.n))
        self.target = package.Target(self.at, self.qd, self.qdd)

    def left(self, torque: LinkTorque, q: Any, qd: Any, qdd: Any) -> Any:
        """M* (qdd - qdd_d) + B* (qd - qd_d) + K* (q - q_d) - f, (n,)."""
        moving = inertial(torque, self.shares, q, qd, qdd)
        # Shares of velocity are bilinear: c1 qd_d is asked for by way of the square of a sum.
        still = 0.0 * q
        both = [inertial(torque, self.shares, q, qd + s * self.qd, still) for s in (1.0, -1.0)]
        target = inertial(torque, self.shares, q, still, self.qdd) + (both[0] - both[1]) / 4.0
        return moving - target + self.damping * (qd - self.qd) + self.stiffness * (q - self.at) - self.push


@pytest.mark.parametrize("name", MECHANISMS)
def test_loops_obey_the_law_along_what_their_ties_leave(name: str, tmp_path: Path) -> None:
    mechanism = MECHANISMS[name]
    (tmp_path / "made.toml").write_text(mechanism.text)
    write_package(generate(read_system(tmp_path / "made.toml"), ["numpy"]), tmp_path / "made")
    package = import_package(tmp_path / "made")
    robot, draw = package.load("numpy"), np.random.default_rng(2)
    oracle = LoopOracle(mechanism, robot.joint_names)
    law, ties = Law(package, robot, draw), robot.constraints
    q = ties.closed(np.array(mechanism.q))
    qd = ties.velocity(q, draw.uniform(-1.0, 1.0, len(ties.independent)))
    control = robot.partial_impedance(law.wanted, law.damped, law.stiffness)
    assert control.actuated == ties.independent
    assert not control.undriven
    tau = control(q, qd, law.target, law.push)
    assert not tau[[robot.joint_index(joint) for joint in ties.dependent]].any()
    qdd, forces = oracle.motion(q, qd, tau + law.push)
    moving, size = free_motions(oracle.rows(q, qd)[0]), np.abs(law.stiffness * q).max()
    np.testing.assert_allclose(moving @ law.left(oracle.torque, q, qd, qdd), 0.0, atol=LIMIT * size)
    assert relative_error(control.acceleration(q, qd, law.target, law.push), qdd) <= LIMIT
    assert relative_error(control.forces(q, qd, law.target, law.push), forces) <= LIMIT


@pytest.mark.parametrize("name", MECHANISMS)
def test_what_is_left_of_a_cancelled_link_moves_the_loop(name: str, tmp_path: Path) -> None:
    mechanism = MECHANISMS[name]
    (tmp_path / "made.toml").write_text(mechanism.text)
    write_package(generate(read_system(tmp_path / "made.toml"), ["numpy"]), tmp_path / "made")
    robot, draw = import_package(tmp_path / "made").load("numpy"), np.random.default_rng(3)
    oracle, ties, link = LoopOracle(mechanism, robot.joint_names), robot.constraints, robot.link_names[-1]
    q = ties.closed(np.array(mechanism.q))
    qd = ties.velocity(q, draw.uniform(-1.0, 1.0, len(ties.independent)))
    task, push = draw.uniform(-1.0, 1.0, (2, robot.n))
    cancel = robot.cancel({(None, link, None, None)})
    tau = cancel(q, qd, task, push)
    qdd, forces = oracle.motion(q, qd, tau + push)
    kept = dict.fromkeys(robot.link_names, 1.0) | {link: 0.0}
    left = inertial(oracle.torque, kept, q, qd, qdd) - task - push
    np.testing.assert_allclose(free_motions(oracle.rows(q, qd)[0]) @ left, 0.0, atol=LIMIT)
    assert relative_error(cancel.acceleration(q, qd, task, push), qdd) <= LIMIT
    assert relative_error(cancel.forces(q, qd, task, push), forces) <= LIMIT
    # At the acceleration that follows, measured, the torque is the same.
    assert relative_error(cancel(q, qd, task, push, qdd), tau) <= LIMIT


FEET = {
    "four": ("solo12", [Contact(f"{side}_FOOT", "point") for side in ("FL", "FR", "HL", "HR")], 0),
    "two": ("solo12", [Contact(f"{side}_FOOT", "point") for side in ("FL", "HR")], 1),
    "handle": (
        "simple_humanoid_classical",
        [Contact("l_ankle", name="left"), Contact("r_ankle"), Contact("l_wrist", name="handle")],
        0,
    ),
}
"""Robot, what it stands on and holds, and the number of motions that nothing drives."""


class Standing:
    """A robot of a URDF file with frames held, at a state that they allow."""

    def __init__(self, which: str, folder: Path) -> None:
        name, self.contacts, self.undriven = FEET[which]
        path = next(ROBOTS.rglob(f"{name}.urdf"))
        system = read_system(path, Options(base="floating"))
        write_package(generate(system, ["numpy"], kernel="loops"), folder / "robot")
        self.package = import_package(folder / "robot")
        self.robot: Any = self.package.load("numpy")
        self.ties = self.robot.constrained(contacts=self.contacts)
        self.own, self.draw = PinocchioModel(path, system, floating=True), np.random.default_rng(4)
        self.q = self.draw.uniform(-0.6, 0.6, self.robot.n)
        self.qd = self.ties.velocity(self.q, self.draw.uniform(-1.0, 1.0, len(self.ties.independent)))
        self.base = np.array([joint.startswith("base") for joint in self.robot.joint_names])

    def torque(self, link: str, *motion: Any) -> Any:
        return self.own.torque(*motion, link)

    def moved(self, tau: Any) -> Any:
        return standing_acceleration(self.own, self.contacts, self.q, self.qd, tau)


@pytest.fixture(scope="module", params=FEET)
def standing(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Standing:
    if not ROBOTS.is_dir():
        pytest.skip("needs real robots: pip install example-robot-data")
    return Standing(request.param, tmp_path_factory.mktemp("standing"))


def test_standing_robots_obey_the_law(standing: Standing) -> None:
    robot, q, qd = standing.robot, standing.q, standing.qd
    law = Law(standing.package, robot, standing.draw, np.where(standing.base, 0.0, 1.0))
    control = robot.partial_impedance(
        law.wanted, law.damped, law.stiffness, passive=False, constraints=standing.ties
    )
    assert control.undriven == standing.undriven
    tau = control(q, qd, law.target, law.push)
    assert not tau[standing.base].any()
    assert tau[~standing.base].all()
    qdd = standing.moved(tau + law.push)
    assert relative_error(control.acceleration(q, qd, law.target, law.push), qdd) <= LIMIT
    rows = standing.ties.jacobian(q)
    forces = control.forces(q, qd, law.target, law.push)
    needed = standing.own.torque(q, qd, qdd)
    assert relative_error(tau + law.push + rows.T @ forces, needed) <= LIMIT
    left, moving = law.left(standing.torque, q, qd, qdd), free_motions(rows)
    size = np.abs(standing.own.torque(q, qd, qdd)).max()
    if not standing.undriven:
        np.testing.assert_allclose(moving @ left, 0.0, atol=LIMIT * size)
        return
    # Driven joints have the accelerations of the law; what nothing drives is where the law fails.
    free = moving.T @ np.linalg.svd(moving[:, ~standing.base].T)[2][-1]
    assert np.abs(free[~standing.base]).max() < 1e-12
    assert abs(free @ (needed - law.push)) <= LIMIT * size
    assert abs(free @ left) > 1e-3
    unit, count = np.eye(robot.n), robot.n
    zero = inertial(standing.torque, law.shares, q, qd, 0.0 * q)
    mass = np.array([inertial(standing.torque, law.shares, q, qd, e) - zero for e in unit]).T
    bias = law.left(standing.torque, q, qd, 0.0 * q)
    whole = np.block([[mass, -rows.T], [rows, np.zeros((len(rows), len(rows)))]])
    rate = standing.ties.jacobian_rate(q, qd) @ qd
    wanted = np.linalg.solve(whole, np.concatenate([-bias, -rate]))[:count]
    assert relative_error(wanted[~standing.base], qdd[~standing.base]) <= LIMIT


def test_torques_are_the_least_that_do(standing: Standing) -> None:
    robot, q, qd = standing.robot, standing.q, standing.qd
    weight = standing.draw.uniform(0.5, 2.0, (~standing.base).sum())
    control, own = (
        robot.partial_impedance(constraints=standing.ties, passive=False, torque_weight=w)
        for w in (weight, None)
    )
    least, plain = control(q, qd)[~standing.base], own(q, qd)[~standing.base]
    moving = free_motions(standing.ties.jacobian(q))[:, ~standing.base]
    # Changes of torque that move nothing, and so leave the motion as it is.
    idle = np.linalg.svd(moving)[2][np.linalg.matrix_rank(moving, 1e-9) :]
    assert len(idle) == len(weight) - len(moving) + standing.undriven
    np.testing.assert_allclose(idle @ (weight * least), 0.0, atol=1e-9 * np.abs(least).max())
    np.testing.assert_allclose(idle @ plain, 0.0, atol=1e-9 * np.abs(plain).max())
    assert relative_error(control.acceleration(q, qd), own.acceleration(q, qd)) <= LIMIT


def test_a_leg_is_cancelled_from_the_trunk(standing: Standing) -> None:
    """Joints of the other limbs give all that this limb's links ask of the trunk by moving."""
    robot, q, qd = standing.robot, standing.q, standing.qd
    limb = robot.link_names[1:4]
    entries = {(base, link, None, None) for base in range(6) for link in limb}
    cancel = robot.cancel(entries, passive=False, constraints=standing.ties)
    task = standing.draw.uniform(-0.1, 0.1, robot.n)
    qdd = standing.moved(cancel(q, qd, task))
    assert relative_error(cancel.acceleration(q, qd, task), qdd) <= LIMIT
    if standing.undriven:
        return
    left = inertial(standing.torque, dict.fromkeys(robot.link_names, 1.0), q, qd, qdd)
    gone = inertial(standing.torque, dict.fromkeys(limb, 1.0), q, qd, qdd)
    left[:6] -= gone[:6]
    size = np.abs(left).max()
    moving = free_motions(standing.ties.jacobian(q))
    np.testing.assert_allclose(moving @ (left - task), 0.0, atol=LIMIT * size)
