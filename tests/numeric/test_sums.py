"""Matrices, gravity, forward dynamics and energies against Pinocchio's: ten real robots, every back end."""

import ctypes
import warnings
from collections.abc import Callable
from functools import cache
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from conftest import LOCKED_FINGERS, PANDA, needs_compiler
from helpers.answers import random_states, relative_error
from helpers.compiled import compile_library
from linkwise import Options, generate, read_system, write_package
from linkwise.package.load import import_package

pytest.importorskip("pinocchio")

import pinocchio as pin
from tools.corpus import ROBOTS

from numeric.pinocchio_model import PinocchioModel

if not ROBOTS.is_dir():
    pytest.skip("needs real robots: pip install example-robot-data", allow_module_level=True)

STATES, LARGEST_ERROR = 10, 1e-11
FLOATING = Options(base="floating")
REAL = {
    "kinova": Options(),
    "ur5_robot": Options(),
    "panda": Options(),
    "z1": Options(),
    "laikago": FLOATING,
    "solo12": FLOATING,
    "xarm7": Options(),
    "simple_humanoid": FLOATING,
    "human": FLOATING,
    "talos_reduced": Options(),
}
"""Arms, one of them with a finger that follows the other, legs, whole bodies."""


def path_of(name: str) -> Path:
    return next(ROBOTS.rglob(f"{name}.urdf"))


@cache
def pinocchio_says(name: str) -> dict[str, Any]:
    path, options = (
        (PANDA, Options(lock=LOCKED_FINGERS)) if name == "panda arm" else (path_of(name), REAL[name])
    )
    system = read_system(path, options)
    oracle = PinocchioModel(path, system, options.base == "floating", dict(options.lock))
    states = [*zip(*random_states(oracle.n, STATES), strict=True)]
    energies = [[oracle.energies(q, qd, link) for link in oracle.alone] for q, qd, _ in states]
    return {
        "mass_matrix": np.stack([oracle.mass(q) for q, _, _ in states]),
        "coriolis_matrix": np.stack([oracle.coriolis(q, qd) for q, qd, _ in states]),
        "gravity_torque": np.stack([oracle.gravity(q) for q, _, _ in states]),
        "forward_dynamics": np.stack([oracle.acceleration(*state) for state in states]),
        "energy": np.moveaxis(energies, -1, 0),
    }


def answers_of(robot: Any) -> dict[str, Any]:
    """Return what a robot says at the same states."""
    motion: Any = random_states(robot.n, STATES)
    if robot.backend.takes_tensors:
        torch = pytest.importorskip("torch")
        motion = [torch.from_numpy(a) for a in motion]
    q, qd, tau = motion
    return {
        "mass_matrix": robot.mass_matrix(q),
        "coriolis_matrix": robot.coriolis_matrix(q, qd),
        "gravity_torque": robot.gravity_torque(q),
        "forward_dynamics": robot.forward_dynamics(q, qd, tau, passive=False),
        "energy": robot.energy(q, qd),
    }


@pytest.mark.parametrize("name", REAL)
def test_sums_of_real_robots_are_pinocchios(name: str, tmp_path: Path) -> None:
    system = read_system(path_of(name), REAL[name])
    write_package(generate(system, ["numpy"], "robot", kernel="loops"), tmp_path / "robot")
    robot = import_package(tmp_path / "robot").load("numpy")
    expected = pinocchio_says(name)
    for call, answer in answers_of(robot).items():
        if call == "forward_dynamics":
            assert_accelerations(answer, expected[call], expected["mass_matrix"])
        else:
            assert relative_error(answer, expected[call]) <= LARGEST_ERROR, call


def assert_accelerations(answer: Any, expected: Any, mass: Any) -> None:
    """The torques of both are one, and so are they, as far as the rounding of M lets them be known.

    Next to a base's pitch of 90 degrees its last digit moves accelerations by cond(M) of that.
    """
    torques = [(mass @ np.asarray(a)[..., None])[..., 0] for a in (answer, expected)]
    assert relative_error(*torques) <= LARGEST_ERROR
    known = np.maximum(LARGEST_ERROR, np.finfo(float).eps * np.linalg.cond(mass))
    apart = np.abs(np.asarray(answer) - expected).max(-1)
    assert (apart <= known * np.abs(expected).max(-1)).all()


@pytest.mark.parametrize(
    "backend",
    [
        *(f"{backend} by {kernel}" for backend in ("numpy", "torch") for kernel in ("straight", "rule")),
        "autograd",
        pytest.param("native", marks=needs_compiler),
    ],
)
def test_every_back_end_has_pinocchios_sums(backend: str, package_of: Callable[[str], ModuleType]) -> None:
    name, _, kernel = backend.partition(" by ")
    robot = package_of(str(PANDA)).load(name, kernel=kernel or "auto")
    expected = pinocchio_says("panda arm")
    for call, answer in answers_of(robot).items():
        assert relative_error(answer, expected[call]) <= 1e-13, call


POLE = np.pi / 2 - np.array([1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7])
"""Pitches of a floating base, ever nearer to where yaw and roll turn about one axis."""


def on_a_free_flyer(path: Path, names: tuple[str, ...], q: Any, qd: Any, tau: Any) -> Any:
    """Accelerations of coordinates by Pinocchio's free flyer, which has no pole; nothing drives the base.

    The base's angular velocity in its axes is w = E (yaw', pitch', roll').
    """
    model = pin.buildModelFromUrdf(str(path), pin.JointModelFreeFlyer())
    joints = [model.joints[model.getJointId(name)] for name in names[6:]]
    yaw, pitch, roll = q[3:6]
    turn = pin.rpy.rpyToMatrix(roll, pitch, yaw)
    (sp, cp), (sr, cr) = ((np.sin(a), np.cos(a)) for a in (pitch, roll))
    e = np.array([[-sp, 0, 1], [cp * sr, cr, 0], [cp * cr, -sr, 0]])
    by_pitch = np.array([[-cp, 0, 0], [-sp * sr, 0, 0], [-sp * cr, 0, 0]])
    by_roll = np.array([[0, 0, 0], [cp * cr, -sr, 0], [-cp * sr, -cr, 0]])
    w = e @ qd[3:6]
    place, speed, force = np.zeros(model.nq), np.zeros(model.nv), np.zeros(model.nv)
    place[:7] = [*q[:3], *pin.Quaternion(turn).coeffs()]
    speed[:6] = [*(turn.T @ qd[:3]), *w]
    for k, joint in enumerate(joints, 6):
        place[joint.idx_q], speed[joint.idx_v], force[joint.idx_v] = q[k], qd[k], tau[k]
    found = pin.aba(model, model.createData(), place, speed, force)
    turning = found[3:6] - (by_pitch * qd[4] + by_roll * qd[5]) @ qd[3:6]
    yawing = (sr * turning[1] + cr * turning[2]) / cp
    base = [*(turn @ (found[:3] + np.cross(w, speed[:3]))), yawing, cr * turning[1] - sr * turning[2]]
    return np.array([*base, turning[0] + sp * yawing, *(found[joint.idx_v] for joint in joints)])


def told(robot: Any, motion: Any) -> tuple[Any, str]:
    """Accelerations and what is warned of, or none of them and why."""
    if robot.backend.takes_tensors:
        motion = map(pytest.importorskip("torch").from_numpy, motion)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        try:
            return robot.forward_dynamics(*motion), "".join(str(w.message) for w in caught)
        except ValueError as error:
            return None, str(error)


@needs_compiler
@pytest.mark.parametrize(("kind", "silent_at"), [("float64", 4), ("float32", 1)])
def test_near_a_bases_pole_accelerations_are_right_or_it_is_said(
    kind: str, silent_at: int, tmp_path: Path
) -> None:
    write_package(generate(read_system(path_of("solo12"), FLOATING), kernel="loops"), tmp_path / "solo")
    compile_library(tmp_path / "solo", tmp_path / "solo.so")
    in_c = ctypes.CDLL(str(tmp_path / "solo.so"))
    function = in_c.solo_forward_dynamics if kind == "float64" else in_c.solo_forward_dynamicsf
    robots = [import_package(tmp_path / "solo").load(name) for name in ("numpy", "torch", "native")]
    half, silent = 10.0 * float(np.finfo(kind).eps) ** 0.5, []
    for pitch in POLE:
        motion = q, _, tau = [a[0].astype(kind) for a in random_states(18, 1)]
        q[4], tau[:6] = pitch, 0.0
        exact = on_a_free_flyer(path_of("solo12"), robots[0].joint_names, *(a.astype(float) for a in motion))
        qdd = np.full_like(q, 7.0)
        status = function(*(ctypes.c_void_p(a.ctypes.data) for a in (*motion, qdd)))
        assert (qdd == 7.0).all() if status > 0 else relative_error(qdd, exact) <= (0.1 if status else half)
        assert status in (0, -6, 6)
        silent.append(status == 0)
        for robot in robots:
            found, message = told(robot, motion)
            assert ("base_yaw, base_roll" in message) == bool(message) == bool(status)
            if found is not None:
                assert relative_error(found, exact) <= (0.1 if message else half)
                assert ("nearly singular" in message) == bool(message)
    # By a digit less of distance, two digits less of accelerations are known.
    assert silent == [True] * silent_at + [False] * (len(POLE) - silent_at)
