"""The emitted C compiles without a warning and says what NumPy says, in either precision, for any count."""

import shutil
from collections.abc import Callable
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from answers import random_states, relative_error
from compiled import Compiled, compile_library
from conftest import DATA, needs_compiler

pytestmark = needs_compiler
ROBOTS = ["planar3", "planar3 symbolic", "puma560", str(DATA / "turntable.py")]


@pytest.mark.parametrize("compiler", ["gcc", "clang"])
@pytest.mark.parametrize("robot", ROBOTS, ids=["planar3", "symbolic", "puma560", "energies"])
def test_it_compiles_without_a_warning(
    robot: str, compiler: str, directory_of: Callable[[str], Path], tmp_path: Path
) -> None:
    if shutil.which(compiler) is None:
        pytest.skip(f"no {compiler}")
    compile_library(directory_of(robot), tmp_path / "library.so", compiler)


@pytest.mark.parametrize("dtype", [np.float64, np.float32])
def test_it_says_what_numpy_says_for_any_count(
    dtype: type, directory_of: Callable[[str], Path], package_of: Callable[[str], ModuleType]
) -> None:
    library, robot = Compiled(directory_of("puma560")), package_of("puma560").load("numpy")
    tolerance = 1e-13 if dtype is np.float64 else 1e-5
    for count in (1, 2, 16, 37):
        states = tuple(m.astype(dtype) for m in random_states(6, count))
        exact = tuple(m.astype(float) for m in states)
        expected, given = robot.packed(*exact), library.decomposition(*states)
        for field in ("acceleration", "velocity", "gravity", "torque"):
            assert relative_error(given[field], getattr(expected, field)) <= tolerance, (count, field)
        assert relative_error(library.torque(*states), expected.torque) <= tolerance, count
        slopes = robot.position_gradient(*exact)[:, *robot.layout.velocity.T]
        assert relative_error(library.position_gradient(*states), slopes) <= tolerance, count
    assert library.decomposition(*(m[:0] for m in states))["torque"].shape[0] == 0


def test_it_takes_run_time_parameters(
    directory_of: Callable[[str], Path], package_of: Callable[[str], ModuleType]
) -> None:
    package = package_of("planar3 symbolic")
    heavier = {name: 1.5 * value for name, value in package.parameters.items()}
    library = Compiled(directory_of("planar3 symbolic"), parameters=list(heavier.values()))
    states = random_states(3, 21)
    expected = package.load("numpy", parameters=heavier).packed(*states)
    assert relative_error(library.torque(*states), expected.torque) <= 1e-13
    assert relative_error(library.decomposition(*states)["velocity"], expected.velocity) <= 1e-13
