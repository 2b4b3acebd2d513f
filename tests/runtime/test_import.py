"""A package stands alone: it imports neither the generator nor SymPy, under whatever name it is found."""

import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from types import ModuleType

import pytest
from linkwise import check_package, generate, read_system, write_package

USE = """
import sys
sys.path.insert(0, {folder!r})
import numpy as np
import {name} as package
for backend in package.BACKENDS:
    robot = package.load(backend)
    q = np.full(3, 0.5)
    if backend != "numpy":
        import torch
        q = torch.from_numpy(q)
    assert robot.partial_torque(q, q, q).shape == (3, 3)
# torch itself brings SymPy along; the package without torch must not.
banned = ("linkwise", "jinja2", "typer") + (() if "torch" in sys.modules else ("sympy",))
found = [name for name in sys.modules if name.split(".")[0] in banned]
assert not found, found
"""


@pytest.mark.parametrize("name", ["planar3", "generated.planar3"])
def test_package_works_under_either_name_without_the_generator(
    name: str, directory_of: Callable[[str], Path], tmp_path: Path
) -> None:
    target = tmp_path / name.replace(".", "/")
    shutil.copytree(directory_of("planar3"), target, ignore=shutil.ignore_patterns("__pycache__"))
    script = USE.format(folder=str(tmp_path), name=name)
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def test_numpy_back_end_needs_numpy_only(directory_of: Callable[[str], Path], tmp_path: Path) -> None:
    shutil.copytree(directory_of("planar3"), tmp_path / "planar3")
    script = USE.format(folder=str(tmp_path), name="planar3").replace("package.BACKENDS", "['numpy']")
    script += "assert 'torch' not in sys.modules and 'sympy' not in sys.modules"
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def test_a_package_says_which_back_end_is_the_fastest_for_many_samples(
    package_of: Callable[[str], ModuleType],
) -> None:
    package = package_of("planar3")
    assert package.FASTEST_FIRST == ("native", "numpy", "torch", "autograd")
    assert set(package.FASTEST_FIRST) == set(package.BACKENDS)


@pytest.mark.parametrize("backend", ["numpy", "torch", "autograd"])
def test_package_of_one_back_end_is_whole(backend: str, tmp_path: Path) -> None:
    write_package(generate(read_system("planar2"), [backend]), tmp_path / "planar2")
    results = check_package(tmp_path / "planar2", 5)
    assert any(result.name.startswith(f"{backend}: tau_ij") for result in results)
    assert not any(result.failed for result in results)
