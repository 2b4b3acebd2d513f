"""C functions of one sample against Pinocchio: frames, mass matrix, forward dynamics, partial impedance."""

import ctypes
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from conftest import needs_compiler
from helpers.compiled import STRICT
from helpers.impedance_in_c import frame_struct, joint_struct, left_jacobian, pointer_to, rotation_vector
from helpers.kept import run_kept
from linkwise import Options, generate, read_system, write_package
from linkwise.package.manifest import Manifest
from linkwise_runtime.structure import passive_sums

pytest.importorskip("pinocchio")

import pinocchio as pin

from numeric.test_kinematics import LARGEST_ERROR, OPTIONS, ROBOTS, WithFrames

pytestmark = needs_compiler


def functions(package: Path) -> ctypes.CDLL:
    """Return the library of the part that has functions for control, and of the sines."""
    objects = [package / f"{part}.o" for part in ("CONTROL", "SINES")]
    for made in objects:
        command = ["gcc", "-std=c99", *STRICT, f"-DLINKWISE_PART={made.stem}", "-c"]
        run_kept([*command, package / "c" / "robot.c"], made)
    run_kept(["gcc", "-shared", *objects, "-lm"], package / "control.so")
    return ctypes.CDLL(str(package / "control.so"))


@pytest.mark.parametrize("robot", OPTIONS)
def test_what_control_needs_is_pinocchios(robot: str, tmp_path: Path) -> None:
    path = next(ROBOTS.rglob(f"{robot}.urdf"))
    system = read_system(path, Options(**OPTIONS[robot]))
    write_package(generate(system, ["c"], "robot", kernel="loops"), tmp_path)
    manifest, library = Manifest.read(tmp_path), functions(tmp_path)
    tree = manifest.tree
    oracle = WithFrames(path, system, OPTIONS[robot])
    errors: dict[str, float] = {}

    def close(what: str, found: Any, expected: Any, size: float = 1.0) -> None:
        error = float(np.abs(found - expected).max() / max(size, np.abs(expected).max()))
        errors[what] = max(errors.get(what, 0.0), error)

    def answer(call: str, shape: tuple[int, ...], *given: Any) -> Any:
        found = np.full(shape, np.nan)
        pointers = [a if isinstance(a, int) else ctypes.c_void_p(a.ctypes.data) for a in (*given, found)]
        getattr(library, f"robot_{call}")(*pointers)
        return found

    def held(call: str, expected: Any, *given: Any) -> Any:
        found = answer(call, expected.shape, *given)
        close(call, found, expected)
        return found

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
        mass = oracle.mass(q)
        held("mass_matrix", mass, q)
        if "allow_unphysical" not in OPTIONS[robot]:
            alone = "forward_dynamics_of_links" if manifest.passive else "forward_dynamics"
            moved = held(alone, oracle.acceleration(q, qd, tau), q, qd, tau)
            taken = float((np.abs(mass) @ np.abs(moved)).max())
            close("torques of accelerations", oracle.torque(q, qd, moved), tau, taken)
            plant = Plant(oracle, manifest.passive, q, qd)
            moved = answer("forward_dynamics", tau.shape, q, qd, tau)
            taken = float((np.abs(plant.inertia) @ np.abs(moved)).max())
            asked = plant.torque(moved) + plant.friction * np.sign(qd)
            close("torques of joints and links", asked, tau, taken)
    assert max(errors.values()) <= LARGEST_ERROR, errors


class Plant:
    """A robot at a state, as Pinocchio and its file have it: H, C times velocities, and the rest."""

    def __init__(self, oracle: WithFrames, passive: Any, q: Any, qd: Any) -> None:
        stiffness, pull, damping, friction, armature = map(np.array, passive_sums(passive, oracle.n))
        self.oracle, self.q, self.qd, self.rest = oracle, q, qd, 0.0 * q
        self.inertia = oracle.mass(q) + np.diag(armature)
        self.other, self.friction = oracle.gravity(q) + stiffness * q + pull + damping * qd, friction

    def felt(self, velocity: Any) -> Any:
        """C v, bilinear in qd and v: a quarter of what qd + v asks for, less that of qd - v."""
        there, back = (
            self.oracle.torque(self.q, v, self.rest) for v in (self.qd + velocity, self.qd - velocity)
        )
        return (there - back) / 4.0

    def torque(self, qdd: Any) -> Any:
        return self.inertia @ qdd + self.felt(self.qd) + self.other


@pytest.mark.parametrize("robot", [name for name in OPTIONS if "allow_unphysical" not in OPTIONS[name]])
def test_impedance_is_what_pinocchios_matrices_say(robot: str, tmp_path: Path) -> None:
    path = next(ROBOTS.rglob(f"{robot}.urdf"))
    system = read_system(path, Options(**OPTIONS[robot]))
    write_package(generate(system, ["c"], "robot", kernel="loops"), tmp_path)
    manifest, library = Manifest.read(tmp_path), functions(tmp_path)
    tree = manifest.tree
    oracle = WithFrames(path, system, OPTIONS[robot])
    assert tree is not None
    generator, n = np.random.default_rng(1), oracle.n
    names = [frame.name for frame in tree.frames]
    frame = next(name for name in reversed(names) if oracle.model.existFrame(name, pin.BODY))
    rows = np.array([3, 4, 5, 0, 1, 2] if n > 6 else [4, 5, 3])

    def command(function: str, *given: Any) -> Any:
        found, kept = np.full(n, np.nan), list[Any]()
        pointers = [pointer_to(a, float, kept) for a in (*given, found, None)]  # the last one is of qdd
        pointers[-2] = ctypes.c_void_p(found.ctypes.data)
        assert getattr(library, f"robot_{function}")(*pointers) == 0
        return found

    def held(found: Any, expected: Any) -> None:
        assert np.abs(found - expected).max() <= 1e-10 * np.abs(expected).max()

    def positive(size: int) -> Any:
        a = generator.normal(size=(size, size))
        return a @ a.T + np.eye(size)

    for q, qd, q_d, qd_d, qdd_d, external in generator.uniform(-1.0, 1.0, (3, 6, n)):
        plant, (inertia, damping, stiffness) = (
            Plant(oracle, manifest.passive, q, qd),
            (positive(n) for _ in range(3)),
        )
        wanted = {"inertia": inertia, "damping": damping, "stiffness": stiffness}
        pull = external - plant.felt(qd - qd_d) - damping @ (qd - qd_d) - stiffness @ (q - q_d)
        qdd = qdd_d + np.linalg.solve(plant.inertia + inertia, pull)
        struct, kept = joint_struct(wanted, float)
        to = (q_d, qd_d, qdd_d)
        found = command("partial_impedance", q, qd, struct, *to, None, external)
        held(found, plant.torque(qdd) - external)

        oracle.at(q_d, qd, qdd)
        target = oracle.frame(frame)["pose"].copy()
        oracle.at(q, qd, qdd)
        here = oracle.frame(frame)
        j, rate = here["jacobian"][rows], here["rate"][rows]
        dual = np.linalg.solve(plant.inertia, j.T) @ np.linalg.inv(j @ np.linalg.solve(plant.inertia, j.T))
        inverse = j @ np.linalg.solve(plant.inertia, j.T)
        along = dual @ (j @ qd)
        natural = dual.T @ plant.felt(along) - np.linalg.solve(inverse, rate @ along)
        theta = rotation_vector(here["pose"][:3, :3] @ target[:3, :3].T)
        whole = np.eye(6)
        whole[:3, :3] = np.linalg.inv(left_jacobian(theta))
        x = np.r_[theta, here["pose"][:3, 3] - target[:3, 3]][rows]
        gains = positive(len(rows))
        spring = whole[np.ix_(rows, rows)].T @ gains @ x
        moved = inverse @ (dual.T @ external - natural - gains @ (j @ qd) - spring)
        of_frame, kept_too = frame_struct(
            names.index(frame), {"rows": rows, "stiffness": gains, "damping": gains}, float
        )
        found = command("frame_partial_impedance", q, qd, struct, *to, of_frame, target, None, None, external)
        held(found, plant.torque(qdd + dual @ (moved - rate @ qd - j @ qdd)) - external)
        assert kept
        assert kept_too
