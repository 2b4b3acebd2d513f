"""Induced accelerations of real robots, one source at a time, against Pinocchio."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.answers import relative_error
from linkwise import Options, generate, read_system, write_package
from linkwise.package.load import import_package

pytest.importorskip("pinocchio")

import pinocchio as pin
from tools.corpus import ROBOTS

from numeric.pinocchio_model import PinocchioModel

if not ROBOTS.is_dir():
    pytest.skip("needs real robots: pip install example-robot-data", allow_module_level=True)

LARGEST_ERROR = 1e-10
ROBOT_OPTIONS = {
    "ur5_robot": Options(),
    "panda": Options(),  # a finger follows the other
    "solo12": Options(base="floating"),
    "simple_humanoid": Options(base="floating"),
}


class OneSource(PinocchioModel):
    """Accelerations of one source, the others away, by the articulated-body algorithm where it can be."""

    def alone_at(self, q: Any, qd: Any, tau: Any, weight: bool, load: tuple[Any, ...] | None = None) -> Any:
        """Return accelerations by torques, velocities, all weights or not, and a wrench on a point of a
        body."""
        gravity = self.model.gravity.linear.copy()
        self.model.gravity.linear = gravity * weight
        try:
            if load is None:
                return self.acceleration(q, qd, tau)
            return np.linalg.solve(self.mass(q), self.pull(q, *load))
        finally:
            self.model.gravity.linear = gravity

    def pull(self, q: Any, name: str, point: Any, moment: Any, force: Any) -> Any:
        """J^T of a wrench, from inverse dynamics at rest without gravity."""
        frame = self.model.frames[self.model.getFrameId(name, pin.BODY)]
        state = self._state(q, 0 * q, 0 * q)
        pin.forwardKinematics(self.model, self.data, state[0])
        carrier = self.data.oMi[frame.parentJoint]
        at = carrier.act(frame.placement.act(point))
        loads = pin.StdVec_Force()
        loads.extend([pin.Force.Zero()] * self.model.njoints)
        loads[frame.parentJoint] = carrier.actInv(pin.Force(force, moment + np.cross(at, force)))
        return -self.tie.T @ pin.rnea(self.model, self.data, *state, loads)

    def coriolis_of(self, link: str, q: Any, qd: Any) -> Any:
        """Christoffel's matrix (n, n) of one link's mass alone."""
        state = self._state(q, qd, 0 * qd)[:2]
        matrix = pin.computeCoriolisMatrix(self.alone[link], self.data, *state)
        return self.tie.T @ matrix @ self.tie


class OnFeet(PinocchioModel):
    """Feet held where they are, by Pinocchio's constrained dynamics."""

    def held(self, feet: list[str]) -> None:
        """Make the constraints of bodies whose origins are held."""
        self.ties, self.kept = pin.StdVec_RigidConstraintModel(), pin.StdVec_RigidConstraintData()
        for name in feet:
            frame = self.model.frames[self.model.getFrameId(name, pin.BODY)]
            place = frame.parentJoint, frame.placement
            tie = pin.RigidConstraintModel(pin.ContactType.CONTACT_3D, self.model, *place, pin.LOCAL)
            self.ties.append(tie)
            self.kept.append(tie.createData())

    def answer(self, q: Any, qd: Any, tau: Any, weight: bool) -> tuple[Any, Any]:
        """Accelerations, and forces on the feet in the world's axes, one foot after the other."""
        gravity = self.model.gravity.linear.copy()
        self.model.gravity.linear = gravity * weight
        state, back = self._state(q, qd, qd), np.linalg.inv(self.tie)
        pin.initConstraintDynamics(self.model, self.data, self.ties, self.kept)
        settings = pin.ProximalSettings(1e-14, 0.0, 1)
        given = self.model, self.data, *state[:2], back.T @ tau, self.ties, self.kept, settings
        qdd = back @ pin.constraintDynamics(*given)
        self.model.gravity.linear = gravity
        pin.forwardKinematics(self.model, self.data, state[0])
        forces = []
        for tie, kept in zip(self.ties, self.kept, strict=True):
            turn = self.data.oMi[tie.joint1_id].rotation @ tie.joint1_placement.rotation
            forces.append(turn @ kept.contact_force.linear)
        return qdd, np.concatenate(forces)


def test_every_source_alone_moves_a_robot_that_stands_as_pinocchio_says(tmp_path: Path) -> None:
    path, options = next(ROBOTS.rglob("solo12.urdf")), Options(base="floating")
    system = read_system(path, options)
    write_package(generate(system, ["numpy"], "robot", kernel="loops"), tmp_path / "robot")
    module = import_package(tmp_path / "robot")
    robot, oracle = module.load("numpy"), OnFeet(path, system, True)
    feet = ["FL_FOOT", "HR_FOOT", "HL_FOOT"]
    oracle.held(feet)
    bend = {"HAA": 0.2, "HFE": 0.7, "KFE": -1.3}
    q = np.array([0.1, 0.2, 0.3, 0.3, -0.2, 0.1, *(bend[name[-3:]] for name in robot.joint_names[6:])])
    standing = robot.constrained(contacts=[module.Contact(foot, "point") for foot in feet], at=q)
    generator = np.random.default_rng(4)
    qd = standing.velocity(q, generator.uniform(-1.0, 1.0, robot.n - 9))
    tau, rest = generator.uniform(-1.0, 1.0, robot.n), 0 * q
    shares = robot.induced_accelerations(q, qd, tau, passive=False, constraints=standing)
    forces = robot.induced_reactions(q, qd, tau, passive=False, constraints=standing)
    units = [oracle.answer(q, rest, torque, False) for torque in np.diag(tau)]
    for found, k in ((shares, 0), (forces, 1)):
        own = found.velocity.sum((-2, -1)) + found.constraints.sum(-1)
        for value, expected in (
            (found.actuators, np.stack([unit[k] for unit in units], -1)),
            (found.gravity.sum(-1), oracle.answer(q, rest, rest, True)[k]),
            (own, oracle.answer(q, qd, rest, False)[k]),
            (found.total, oracle.answer(q, qd, tau, True)[k]),
        ):
            assert relative_error(value, expected) <= LARGEST_ERROR
    foot = robot.induced_accelerations(q, qd, tau, passive=False, frame=feet[1], constraints=standing)
    assert np.abs(foot.total[3:]).max() <= LARGEST_ERROR, "a foot that is held does not accelerate"


@pytest.mark.parametrize("name", ROBOT_OPTIONS)
def test_every_source_alone_accelerates_as_pinocchio_says(name: str, tmp_path: Path) -> None:
    path, options = next(ROBOTS.rglob(f"{name}.urdf")), ROBOT_OPTIONS[name]
    system = read_system(path, options)
    write_package(generate(system, ["numpy"], "robot", kernel="loops"), tmp_path / "robot")
    module = import_package(tmp_path / "robot")
    robot, oracle = module.load("numpy"), OneSource(path, system, options.base == "floating")
    q, qd, tau = np.random.default_rng(2).uniform(-1.5, 1.5, (3, 4, robot.n))
    point, moment, force = np.random.default_rng(3).uniform(-9.0, 9.0, (3, 3))
    hand = robot.link_names[-1]
    loads = [module.AppliedLoad(hand, force, moment, point)]
    found = robot.induced_accelerations(q, qd, tau, loads=loads, passive=False)
    rest = 0 * q[0]
    for s, (at, speed, torque) in enumerate(zip(q, qd, tau, strict=True)):
        inverse = np.linalg.inv(oracle.mass(at))
        expected = {
            "actuators": np.stack(
                [oracle.alone_at(at, rest, torque * unit, False) for unit in np.eye(robot.n)], -1
            ),
            "gravity": np.stack([-inverse @ oracle.torque(at, rest, rest, j) for j in robot.link_names], -1),
            "velocity": np.stack(
                [-inverse @ oracle.coriolis_of(j, at, speed) * speed for j in robot.link_names], 1
            ),
            "loads": oracle.alone_at(at, rest, rest, False, (hand, point, moment, force))[:, None],
        }
        for source, value in expected.items():
            assert relative_error(getattr(found, source)[s], value) <= LARGEST_ERROR, source
        sums = {
            "gravity": oracle.alone_at(at, rest, rest, True),
            "velocity": oracle.alone_at(at, speed, rest, False),
        }
        for source, value in sums.items():
            total = getattr(found, source)[s].reshape(robot.n, -1).sum(-1)
            assert relative_error(total, value) <= LARGEST_ERROR, source
        whole = oracle.acceleration(at, speed, torque) + expected["loads"][:, 0]
        assert relative_error(found.total[s], whole) <= LARGEST_ERROR
