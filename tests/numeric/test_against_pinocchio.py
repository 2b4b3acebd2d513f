"""Every back end, and C in loops, against Pinocchio: matrices, gravity, torques, gradients of each link."""

from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest
from conftest import DATA, PANDA, needs_compiler
from helpers.answers import packed, random_states, relative_error

pytest.importorskip("pinocchio")

from numeric import oracle_models

STATES = 1000
LARGEST_ERROR = 1e-14
MODELS: dict[str, Callable[[], Any]] = {
    "planar3": oracle_models.planar3,
    "puma560": oracle_models.puma560,
    str(PANDA): lambda: oracle_models.panda(PANDA),
    str(DATA / "level_arm.toml"): oracle_models.level_arm,
}
KNOWN: dict[str, dict[str, Any]] = {}


def pinocchio_says(robot: str, joints: tuple[str, ...]) -> dict[str, Any]:
    if robot not in KNOWN:
        states = random_states(len(joints), STATES)
        KNOWN[robot] = oracle_models.decomposition(MODELS[robot](), joints, *states)
    return KNOWN[robot]


@pytest.mark.parametrize(
    "backend",
    [
        *(f"{backend} by {kernel}" for backend in ("numpy", "torch") for kernel in ("straight", "rule")),
        "autograd",
        *(pytest.param(b, marks=needs_compiler) for b in ("c", "c loops", "native")),
    ],
)
@pytest.mark.parametrize("robot", MODELS, ids=["planar3", "puma560", "panda", "level_arm"])
def test_decomposition_of_every_link_is_pinocchios(
    robot: str,
    backend: str,
    directory_of: Callable[[str], Path],
    package_of: Callable[[str], ModuleType],
) -> None:
    package = package_of(robot)
    dynamics = package.load("numpy")
    states = random_states(dynamics.n, STATES)
    expected = pinocchio_says(robot, dynamics.joint_names)
    directory = directory_of(f"{robot} loops" if backend == "c loops" else robot)
    given = packed(package, directory, backend.removesuffix(" loops"), *states)
    for field in expected:
        rows = getattr(dynamics.layout, "velocity" if field == "position_gradient" else field)
        error = relative_error(given[field], expected[field][:, *rows.T])
        assert error <= LARGEST_ERROR, f"{field}: {error:.1e}"
