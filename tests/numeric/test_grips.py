"""Torques of standing robots that keep friction cones, moved by Pinocchio, against SciPy's own minimum."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from linkwise import Options, generate, read_system, write_package
from linkwise.package.load import import_package
from linkwise_runtime.quantities import Contact
from linkwise_runtime.targets import Grip, Target

pytest.importorskip("pinocchio")
pytest.importorskip("clarabel")
pytest.importorskip("scipy")

from helpers.answers import relative_error
from scipy import optimize
from tools.corpus import ROBOTS

from numeric.pinocchio_model import PinocchioModel
from numeric.standing import standing_acceleration

if not ROBOTS.is_dir():
    pytest.skip("needs real robots: pip install example-robot-data", allow_module_level=True)

SOLE = ((0.12, 0.06, -0.1), (0.12, -0.06, -0.1), (-0.08, 0.06, -0.1), (-0.08, -0.06, -0.1))
"""Corners of a sole in the ankle's axes."""
FEET = [Contact(f"{side}_FOOT", "point", name=side) for side in ("FL", "FR", "HL", "HR")]
HANDLE = [
    Contact("l_ankle", name="left"),
    Contact("r_ankle", name="right"),
    Contact("l_wrist", name="handle"),
]


class Held:
    """A robot of a URDF file, with frames held."""

    def __init__(self, name: str, contacts: list[Contact], folder: Path) -> None:
        path = next(ROBOTS.rglob(f"{name}.urdf"))
        system = read_system(path, Options(base="floating"))
        write_package(generate(system, ["numpy", "torch"], kernel="loops"), folder / name)
        self.package, self.contacts = import_package(folder / name), contacts
        self.robot: Any = self.package.load("numpy")
        self.ties = self.robot.constrained(contacts=contacts)
        self.own = PinocchioModel(path, system, floating=True)
        self.driven = np.array([not joint.startswith("base") for joint in self.robot.joint_names])

    def moved(self, q: Any, qd: Any, tau: Any) -> Any:
        return standing_acceleration(self.own, self.contacts, q, qd, tau)


@pytest.fixture(scope="module")
def solo(tmp_path_factory: pytest.TempPathFactory) -> Held:
    return Held("solo12", FEET, tmp_path_factory.mktemp("solo"))


@pytest.fixture(scope="module")
def humanoid(tmp_path_factory: pytest.TempPathFactory) -> Held:
    return Held("simple_humanoid_classical", HANDLE, tmp_path_factory.mktemp("humanoid"))


def crouched(solo: Held) -> tuple[Any, Any]:
    """A place of Solo 12 with its feet apart, and one that springs pull it to."""
    q = np.zeros(solo.robot.n)
    for at, joint in enumerate(solo.robot.joint_names):
        q[at] = {"HAA": 0.1, "HFE": 0.8, "KFE": -1.6}.get(joint[-3:], 0.0)
    return q, q + 0.1 * np.random.default_rng(0).uniform(-1.0, 1.0, solo.robot.n)


def test_four_feet_keep_their_cones_by_the_least_change(solo: Held) -> None:
    robot, ties, (q, at) = solo.robot, solo.ties, crouched(solo)
    mu, rest = 0.25, 0.0 * q
    soft = {"stiffness": np.where(solo.driven, 3.0, 0.0), "constraints": ties, "passive": False}
    free = robot.partial_impedance(**soft)
    kept = robot.partial_impedance(**soft, grips=[Grip(foot, mu) for foot in ("FL", "FR", "HL", "HR")])
    before, forces = (control.forces(q, rest, at).reshape(4, 3) for control in (free, kept))
    assert (outside(before, mu) > 0.1).any(), "the least torques alone let a foot slip"
    assert outside(forces, mu).max() <= 1e-7
    tau = kept(q, rest, at)
    qdd = solo.moved(q, rest, tau)
    assert relative_error(qdd, solo.moved(q, rest, free(q, rest, at))) <= 1e-9
    rows, needed = ties.jacobian(q), solo.own.torque(q, rest, qdd)
    assert relative_error(tau + rows.T @ forces.ravel(), needed) <= 1e-9

    # SciPy's own search among all torques that give this motion.
    idle = np.linalg.svd(np.linalg.svd(rows)[2][len(rows) :][:, solo.driven])[2][len(q) - len(rows) :]
    start = tau[solo.driven]

    changes = np.zeros((len(q), len(idle)))
    changes[solo.driven] = idle.T
    borne = [np.linalg.lstsq(rows.T, t, rcond=None)[0] for t in (needed - tau, changes)]

    def inside(z: Any) -> Any:
        f = (borne[0] - borne[1] @ z).reshape(4, 3)
        return np.concatenate([mu**2 * f[:, 2] ** 2 - f[:, 0] ** 2 - f[:, 1] ** 2, f[:, 2]])

    found = optimize.minimize(
        lambda z: np.sum((start + idle.T @ z) ** 2),
        0.05 * np.ones(len(idle)),
        jac=lambda z: 2.0 * idle @ (start + idle.T @ z),
        method="SLSQP",
        constraints={"type": "ineq", "fun": inside},
        options={"ftol": 1e-13, "maxiter": 500},
    )
    assert found.success
    assert inside(found.x).min() >= -1e-7
    np.testing.assert_allclose(idle.T @ found.x, 0.0, atol=1e-5 * np.abs(start).max())


def outside(forces: Any, mu: float) -> Any:
    """|f_t| - mu f_n of each foot, in N."""
    return np.hypot(forces[..., 0], forces[..., 1]) - mu * forces[..., 2]


def test_cones_that_no_torques_keep_are_told_with_their_feet(solo: Held) -> None:
    robot, (q, at) = solo.robot, crouched(solo)
    names = ["FL", "FR", "HL", "HR"]
    kept = robot.partial_impedance(
        stiffness=np.where(solo.driven, 6.0, 0.0), constraints=solo.ties, grips=[Grip(n, 0.02) for n in names]
    )
    with pytest.raises(
        ValueError, match=r"slips? or lifts? off.* at sample 1: no torques of FL_HAA, .* short by"
    ):
        kept(np.stack([q, q]), 0.0 * q, np.stack([q, at]))
    # Up, faster than gravity pulls: nothing presses the feet to the ground.
    trunk = robot.partial_impedance(
        frame=solo.package.FrameImpedance("base_link", rows=("x", "y", "z")),
        constraints=solo.ties,
        grips=[Grip(n, 0.5) for n in names],
    )
    down = Target(acceleration=np.array([0.0, 0.0, 0.0, 0.0, 0.0, -12.0]))
    with pytest.raises(ValueError, match=r"FL, FR, HL, HR slip or lift off: no torques"):
        trunk(q, 0.0 * q, down)
    lighter = Target(acceleration=np.array([0.0, 0.0, 0.0, 0.0, 0.0, -8.0]))
    forces = trunk.forces(q, 0.0 * q, lighter).reshape(4, 3)
    weight = 9.81 * sum(inertia.mass for inertia in solo.own.model.inertias)
    assert 0.0 < forces[:, 2].sum() < 0.5 * weight


def test_two_feet_and_a_handle_that_bears_anything(humanoid: Held) -> None:
    """Soles bear what presses on their corners, the handle whatever it is pulled by."""
    robot, rest = humanoid.robot, np.zeros(humanoid.robot.n)
    draw = np.random.default_rng(1)
    for _ in range(3):
        q = 0.1 * draw.uniform(-1.0, 1.0, robot.n)
        q[3:6] = 0.0
        at = q + 0.2 * draw.uniform(-1.0, 1.0, robot.n)
        soft = {
            "stiffness": np.where(humanoid.driven, 30.0, 0.0),
            "constraints": humanoid.ties,
            "passive": False,
        }
        free = robot.partial_impedance(**soft)
        kept = robot.partial_impedance(**soft, grips=[Grip("left", 0.5, SOLE), Grip("right", 0.5, SOLE)])
        tau, forces = kept(q, rest, at), kept.forces(q, rest, at)
        qdd = humanoid.moved(q, rest, tau)
        assert relative_error(qdd, free.acceleration(q, rest, at)) <= 1e-9
        needed = humanoid.own.torque(q, rest, qdd)
        assert relative_error(tau + humanoid.ties.jacobian(q).T @ forces, needed) <= 1e-9
        for name, start in (("l_ankle", 0), ("r_ankle", 6)):
            moment, force = forces[start : start + 3], forces[start + 3 : start + 6]
            assert np.hypot(*force[:2]) <= 0.5 * force[2] + 1e-6
            # The centre of pressure in the sole's plane lies within the sole.
            turn = robot.kinematics.pose(q, name)[:3, :3]
            own_moment, own_force = turn.T @ moment, turn.T @ force
            x = (-own_moment[1] - 0.1 * own_force[0]) / own_force[2]
            y = (own_moment[0] - 0.1 * own_force[1]) / own_force[2]
            assert -0.08 - 1e-6 <= x <= 0.12 + 1e-6
            assert abs(y) <= 0.06 + 1e-6
