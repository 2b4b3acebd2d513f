"""Induced accelerations of real robots, one source at a time, against Pinocchio."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from answers import relative_error
from linkwise import Options, generate, read_system, write_package
from linkwise.package.load import import_package

pytest.importorskip("pinocchio")

import pinocchio as pin
from corpus import ROBOTS

from numeric.pinocchio_model import PinocchioModel

if not ROBOTS.is_dir():
    pytest.skip("needs the package example-robot-data", allow_module_level=True)

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
        """Of torques, velocities, all weights or not, and a wrench on a point of a body."""
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
    found = robot.induced_accelerations(q, qd, tau, loads=loads)
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
