"""C functions of one sample against Pinocchio: frames, mass matrix, forward dynamics of real robots."""

import ctypes
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from compiled import STRICT
from conftest import needs_compiler
from linkwise import Options, generate, read_system, write_package
from linkwise.package.manifest import Manifest

pytest.importorskip("pinocchio")

import pinocchio as pin

from numeric.test_kinematics import LARGEST_ERROR, OPTIONS, ROBOTS, WithFrames

pytestmark = needs_compiler


def functions(package: Path) -> ctypes.CDLL:
    """Those of the part that has them, and of the sines."""
    made = str(package / "control.so")
    source, objects = str(package / "c" / "robot.c"), []
    for part in ("CONTROL", "SINES"):
        objects.append(str(package / f"{part}.o"))
        command = ["gcc", "-std=c99", *STRICT, f"-DLINKWISE_PART={part}", "-c", source, "-o", objects[-1]]
        subprocess.run(command, check=True)
    subprocess.run(["gcc", "-shared", *objects, "-lm", "-o", made], check=True)
    return ctypes.CDLL(made)


@pytest.mark.parametrize("robot", OPTIONS)
def test_what_control_needs_is_pinocchios(robot: str, tmp_path: Path) -> None:
    path = next(ROBOTS.rglob(f"{robot}.urdf"))
    system = read_system(path, Options(**OPTIONS[robot]))
    write_package(generate(system, ["c"], "robot", kernel="loops"), tmp_path)
    tree, library = Manifest.read(tmp_path).tree, functions(tmp_path)
    oracle = WithFrames(path, system, OPTIONS[robot])
    errors: dict[str, float] = {}

    def held(call: str, expected: Any, *given: Any) -> None:
        found = np.full(expected.shape, np.nan)
        pointers = [a if isinstance(a, int) else ctypes.c_void_p(a.ctypes.data) for a in (*given, found)]
        getattr(library, f"robot_{call}")(*pointers)
        error = float(np.abs(found - expected).max() / max(1.0, np.abs(expected).max()))
        errors[call] = max(errors.get(call, 0.0), error)

    assert tree is not None
    origin = np.zeros(3)
    for q, qd, tau in np.random.default_rng(0).uniform(-2.0, 2.0, (3, 3, oracle.n)):
        oracle.at(q, qd, tau)
        for f, frame in enumerate(tree.frames):
            if oracle.model.existFrame(frame.name, pin.BODY):
                expected = oracle.frame(frame.name)
                held("pose", expected["pose"], f, q)
                held("jacobian", expected["jacobian"], f, origin, q)
                held("jacobian_rate", expected["rate"], f, origin, q, qd)
        held("mass_matrix", oracle.mass(q), q)
        if "allow_unphysical" not in OPTIONS[robot]:
            held("forward_dynamics", oracle.acceleration(q, qd, tau), q, qd, tau)
    assert max(errors.values()) <= LARGEST_ERROR, errors
