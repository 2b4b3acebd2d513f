"""A package that is generated anew while Python runs is not mixed with the one that was imported."""

import importlib
from pathlib import Path

import numpy as np
import pytest
from linkwise import generate, kept_package, read_system, write_package

ROD = """
schema = 1
name = "anew_rod"
link = [{{ name = "rod", mass = {mass}, com = [0.5, 0, 0] }}]
joint = [{{ name = "hinge", parent = "base", child = "rod", axis = [0, 1, 0] }}]
"""


def written(folder: Path, mass: float) -> Path:
    """A package of a rod of this mass, whose inertia about its hinge is a quarter of that."""
    (folder / "rod.toml").write_text(ROD.format(mass=mass), encoding="utf-8")
    write_package(generate(read_system(folder / "rod.toml"), ["numpy", "autograd"]), folder / "anew_rod")
    return folder / "anew_rod"


def test_a_package_generated_anew_is_refused_until_python_starts_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.syspath_prepend(str(tmp_path))
    written(tmp_path, 1.0)
    package = importlib.import_module("anew_rod")
    robot = package.load("numpy")
    written(tmp_path, 2.0)
    told = "^anew_rod was generated anew after it was imported; start Python again to use it$"
    for asked in (lambda: package.load("numpy"), lambda: package.load("autograd"), package.bodies):
        with pytest.raises(RuntimeError, match=told):
            asked()
    with pytest.raises(RuntimeError, match=told):
        importlib.reload(package)
    np.testing.assert_allclose(robot.mass_matrix([0.0]), [[0.25]], rtol=1e-15)
    written(tmp_path, 1.0)
    np.testing.assert_allclose(package.load("numpy").mass_matrix([0.0]), [[0.25]], rtol=1e-15)


def test_a_kept_package_loads_what_is_there_now(tmp_path: Path) -> None:
    for mass in (1.0, 2.0):
        robot = kept_package(written(tmp_path, mass)).load("numpy")
        np.testing.assert_allclose(robot.mass_matrix([0.0]), [[mass / 4]], rtol=1e-15)
