"""Number of parameter combinations that torques tell, of ten real robots: the rank of Pinocchio's
regressor."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.answers import random_states
from linkwise import Options, generate, read_system, write_package
from linkwise.identification.base_parameters import base_parameters
from linkwise.package.load import open_package
from tools.corpus import ROBOTS

pytest.importorskip("pinocchio")

from numeric.pinocchio_model import PinocchioModel

if not ROBOTS.is_dir():
    pytest.skip("needs real robots: pip install example-robot-data", allow_module_level=True)

RANK = 1e-8
ROBOT: dict[str, tuple[Options, int]] = {
    "panda": (Options(), 48),
    "kinova": (Options(), 36),
    "solo12": (Options(), 68),
    "allegro_left_hand": (Options(allow_unphysical=True), 94),
    "iris_simple": (Options(base="floating"), 10),
    "ur5_robot": (Options(), 36),
    "double_pendulum": (Options(), 6),
    "baxter": (Options(), 97),
    "z1": (Options(), 43),
    "g1_29dof_rev_1_0": (Options(), 189),
}


@pytest.mark.parametrize("name", ROBOT)
def test_base_parameters_are_as_many_as_the_rank_of_pinocchios_regressor(name: str, tmp_path: Path) -> None:
    options, expected = ROBOT[name]
    path = next(ROBOTS.rglob(f"{name}.urdf"))
    system = read_system(path, options)
    write_package(generate(system, ["numpy"], "robot", kernel="loops"), tmp_path / "robot")
    base = base_parameters(open_package(tmp_path / "robot").load("numpy"))
    oracle = PinocchioModel(path, system, options.base == "floating")
    samples = 4 * base.combinations.shape[1] // oracle.n + 4
    states: Any = zip(*random_states(oracle.n, samples), strict=True)
    carried = [
        body.mass > 0 for body in oracle.model.inertias[1:]
    ]  # none between the axes of a floating base
    rows = np.concatenate([oracle.regressor(*state)[:, carried].reshape(oracle.n, -1) for state in states])
    sizes = np.linalg.norm(rows, axis=0)
    shown = sizes > RANK * sizes.max()
    values = np.linalg.svd(rows[:, shown] / sizes[shown], compute_uv=False)
    assert int((values > RANK * values[0]).sum()) == base.count == expected


@pytest.mark.parametrize("name", ["panda", "solo12"])
def test_every_back_end_names_the_same_combinations(name: str, tmp_path: Path) -> None:
    """Links that are built alike ask for equally much of the joints: rounding must not choose among them."""
    system = read_system(next(ROBOTS.rglob(f"{name}.urdf")), ROBOT[name][0])
    names = ("numpy", "torch", "native")
    write_package(generate(system, names, "robot", kernel="loops"), tmp_path / "robot")
    package = open_package(tmp_path / "robot")
    first, *others = (base_parameters(package.load(backend)) for backend in names)
    for other in others:
        assert (other.picked, other.texts()) == (first.picked, first.texts())
        assert other.condition == pytest.approx(first.condition, rel=1e-6)
