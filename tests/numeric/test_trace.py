"""Velocities traced to their sources, against integrations by SciPy of what Pinocchio and SymPy say."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from conftest import DATA
from helpers.answers import relative_error
from linkwise import Options, generate, read_system, write_package
from linkwise.package.load import import_package
from runtime.test_constrained_motion import lagrange
from tools.corpus import ROBOTS

from numeric.pinocchio_model import PinocchioModel

integrate = pytest.importorskip("scipy.integrate")
pin = pytest.importorskip("pinocchio")

TIME = np.linspace(0.0, 1.0, 1001)
INSTANTS = TIME[::250]
OF_SUMS, OF_PARTS, OF_ENERGIES = 1e-10, 1e-9, 1e-8
Motion = Callable[[Any], tuple[Any, Any, Any]]


def sines(n: int, size: float = 0.6) -> Motion:
    """q, qd and qdd (..., n) at instants (...)."""
    rates, at = 1.0 + 2.0 * np.arange(n) / n, np.arange(n)

    def motion(time: Any) -> tuple[Any, Any, Any]:
        phase = rates * np.asarray(time)[..., None] + at
        sine, cosine = size * np.sin(phase), size * np.cos(phase)
        return sine, rates * cosine, -(rates**2) * sine

    return motion


def integrated(slope: Callable[[float, Any], Any], start: Any) -> Any:
    """Parts (instants, n, X) by SciPy."""
    found = integrate.solve_ivp(
        lambda t, v: slope(t, v.reshape(start.shape)).reshape(-1),
        (0.0, 1.0),
        start.reshape(-1),
        "DOP853",
        INSTANTS,
        rtol=1e-12,
        atol=1e-12,
    )
    return found.y.T.reshape(-1, *start.shape)


def held(mass: Any, coriolis: Any, forces: Any, rows: Any, rates: Any, v: Any) -> Any:
    """Slopes of all parts under A v = 0, by multipliers of least size."""
    count = len(rows)
    whole = np.block([[mass, -rows.T], [rows, np.zeros((count, count))]])
    asked = np.concatenate([forces - coriolis @ v, -rates @ v])
    return np.linalg.lstsq(whole, asked, rcond=1e-12)[0][: len(mass)]


def check_sums(traced: Any, qd: Any) -> None:
    assert np.abs(traced.total - qd).max() <= OF_SUMS
    gained = traced.energy - traced.energy[:1] - traced.work
    assert np.abs(gained).max() <= OF_ENERGIES * np.abs(traced.energy).max()


def made(path: Path, folder: Path, options: Options) -> tuple[Any, Any]:
    system = read_system(path, options)
    write_package(generate(system, ["numpy"], "robot", kernel="loops"), folder / "robot")
    return system, import_package(folder / "robot")


@pytest.fixture
def real(tmp_path: Path) -> Callable[[str, Options], tuple[Any, Any, PinocchioModel]]:
    if not ROBOTS.is_dir():
        pytest.skip("needs real robots: pip install example-robot-data")

    def loaded(name: str, options: Options) -> tuple[Any, Any, PinocchioModel]:
        path = next(ROBOTS.rglob(f"{name}.urdf"))
        system, module = made(path, tmp_path, options)
        return module, module.load("numpy"), PinocchioModel(path, system, options.base == "floating")

    return loaded


@pytest.mark.parametrize(("name", "base"), [("panda", "fixed"), ("solo12", "floating")])
def test_each_part_of_a_tree_is_what_scipy_integrates_of_pinocchio(name: str, base: Any, real: Any) -> None:
    _, robot, oracle = real(name, Options(base=base))
    motion = sines(robot.n)
    q, qd, qdd = motion(TIME)
    traced = robot.trace(q, qd, qdd, TIME, passive=False)
    check_sums(traced, qd)

    loose = np.arange(robot.n) < (6 if base == "floating" else 0)

    def slope(t: float, v: Any) -> Any:
        at = motion(t)
        weight = oracle.gravity(at[0])
        forces = np.column_stack([np.diag(oracle.torque(*at)), -weight, -weight * loose, 0.0 * at[0]])
        return np.linalg.solve(oracle.mass(at[0]), forces - oracle.coriolis(*at[:2]) @ v)

    start = np.zeros((robot.n, robot.n + 3))
    start[:, -1] = qd[0]
    kinds = ["residual" if undriven else "torque" for undriven in loose]
    named = [f"{kind}:{name}" for kind, name in zip(kinds, robot.joint_names, strict=True)]
    assert traced.sources == (*named, "gravity", "start")
    *parts, unheld, begun = np.moveaxis(integrated(slope, start), -1, 0)
    limit = OF_PARTS * max(1.0, np.abs(parts).max())
    for s, part in enumerate([*parts, begun]):
        assert np.abs(traced.velocity[::250, :, s, 0] - part).max() <= limit
    borne = robot.trace(q, qd, qdd, TIME, passive=False, weight="borne")
    check_sums(borne, qd)
    assert ("gravity" in borne.sources) == loose.any()
    if loose.any():  # no torque holds the weight of a floating base
        assert np.abs(borne.of("gravity")[::250] - unheld).max() <= limit


def test_each_part_of_a_four_bar_keeps_its_loop_as_sympys_multipliers_say(tmp_path: Path) -> None:
    _, module = made(DATA / "crank_rocker.toml", tmp_path, Options())
    robot = module.load("numpy")
    ties, parts = robot.constraints, lagrange()

    def motion(t: Any) -> tuple[Any, Any, Any]:
        y, yd, ydd = (a[..., :1] for a in sines(1)(t))
        q = ties.closed(y)
        qd = ties.velocity(q, yd)
        return q, qd, ties.acceleration(q, qd, ydd)

    q, qd, qdd = motion(TIME)
    traced = robot.trace(q, qd, qdd, TIME, passive=False)
    check_sums(traced, qd)

    def slope(t: float, v: Any) -> Any:
        at = motion(t)
        values = {name: np.array(f(*at[:2]), float) for name, f in parts.items()}
        mass, coriolis = values["mass"].sum(0), values["coriolis"].sum(0)
        weight = -values["gravity"].sum(0)[:, 0]
        needed = ties.inverse_dynamics(*at)[0]
        forces = np.column_stack([np.eye(3)[0] * needed, weight, 0.0 * weight])
        return held(mass, coriolis, forces, values["A"], values["Ad"], v)

    start = np.zeros((3, 3))
    start[:, -1] = qd[0]
    assert traced.sources == (f"torque:{ties.independent[0]}", "gravity", "start")
    assert ties.independent == robot.joint_names[:1]
    assert relative_error(traced.velocity[::250, ..., 0], integrated(slope, start)) <= OF_PARTS


def test_each_part_of_a_quadruped_on_two_feet_keeps_them_as_pinocchio_says(real: Any) -> None:
    module, robot, oracle = real("solo12", Options(base="floating"))
    feet = ["FL_FOOT", "HR_FOOT"]
    bend = {"HAA": 0.2, "HFE": 0.7, "KFE": -1.3}
    begin = np.array([0.1, 0.2, 0.3, 0.3, -0.2, 0.1, *(bend[name[-3:]] for name in robot.joint_names[6:])])
    ties = robot.constrained(contacts=[module.Contact(foot, "point") for foot in feet], at=begin)
    own = [robot.joint_index(name) for name in ties.independent]

    def motion(t: Any) -> tuple[Any, Any, Any]:
        y, yd, ydd = sines(len(own), 0.1)(t)
        q = ties.closed(begin[own] + y - sines(len(own), 0.1)(0.0)[0], start=begin)
        qd = ties.velocity(q, yd)
        return q, qd, ties.acceleration(q, qd, ydd)

    q, qd, qdd = motion(TIME)
    traced = robot.trace(q, qd, qdd, TIME, passive=False, constraints=ties)
    check_sums(traced, qd)
    model, data = oracle.model, oracle.data
    frames = [model.getFrameId(name, pin.BODY) for name in feet]

    def rows(at: Any) -> tuple[Any, Any]:
        state = oracle._state(*at)
        pin.computeJointJacobiansTimeVariation(model, data, *state[:2])
        pin.updateFramePlacements(model, data)
        told = [
            (
                pin.getFrameJacobian(model, data, frame, pin.LOCAL_WORLD_ALIGNED)[:3],
                pin.getFrameJacobianTimeVariation(model, data, frame, pin.LOCAL_WORLD_ALIGNED)[:3],
            )
            for frame in frames
        ]
        jacobian, rate = (np.concatenate(parts) @ oracle.tie for parts in zip(*told, strict=True))
        return jacobian, rate

    def slope(t: float, v: Any) -> Any:
        at = motion(t)
        jacobian, rate = rows(at)
        torque, weight = oracle.torque(*at), -oracle.gravity(at[0])
        # Torques of the independent joints that come to the same along all motions that the feet allow.
        free = ties.velocity_map(at[0])
        needed = np.zeros((robot.n, len(own)))
        needed[own] = np.diag(free.T @ torque)
        forces = np.column_stack([needed, weight, 0.0 * weight])
        return held(oracle.mass(at[0]), oracle.coriolis(*at[:2]), forces, jacobian, rate, v)

    start = np.zeros((robot.n, len(own) + 2))
    start[:, -1] = qd[0]
    parts = integrated(slope, start)
    assert np.abs(traced.velocity[::250, ..., 0] - parts).max() <= OF_PARTS * max(1.0, np.abs(parts).max())
