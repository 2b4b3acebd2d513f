"""Matrices, gravity, forward dynamics and energies against Pinocchio's: ten real robots, every back end."""

from collections.abc import Callable
from functools import cache
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from answers import random_states, relative_error
from conftest import LOCKED_FINGERS, PANDA, needs_compiler
from linkwise import Options, generate, read_system, write_package
from linkwise.package.load import import_package

pytest.importorskip("pinocchio")

from corpus import ROBOTS

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
    """What a robot says at the same states."""
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
