"""Partial impedance in C: its formulas in NumPy, the controllers of Python, refusals, and a program."""

import subprocess
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from conftest import DATA, PANDA, needs_compiler
from helpers.compiled import WARNED, name_of
from helpers.impedance_in_c import ImpedanceInC, cancel_formula, formula, frame_formula
from helpers.kept import run_kept
from helpers.urdf_text import chain, joint
from linkwise import generate, read_system, write_package
from linkwise.package.load import import_package
from runtime.test_passive_torque import HAND

from emit.test_emitted_c import strict

pytestmark = needs_compiler
DOCS = Path(__file__).parents[2] / "docs"
GENERATED = Path(__file__).parents[2] / "generated"
TURNTABLE, CRANE = str(DATA / "turntable.py"), str(DATA / "crane.urdf")
ARM = pytest.param(
    str(PANDA),
    marks=pytest.mark.skipif(not PANDA.is_file(), reason="needs real robots: pip install example-robot-data"),
    id="redundant",
)
ROBOTS = [
    pytest.param("planar3 symbolic", id="parameters"),
    pytest.param("planar3 symbolic loops", id="parameters in loops"),
    pytest.param(TURNTABLE, id="energies"),
    pytest.param("torso", id="tree"),
    pytest.param(f"{CRANE} loops", id="slides"),
    pytest.param("hand", id="springs"),
    pytest.param("hand loops", id="springs in loops"),
    ARM,
]
PRECISION = {np.float64: 1e-11, np.float32: 3e-4}
ROWS = ((5,), (3, 4), (2, 4, 3), (4, 0, 5, 1, 3, 2))


@pytest.fixture(scope="module")
def robots(
    directory_of: Callable[[str], Path],
    package_of: Callable[[str], ModuleType],
    tmp_path_factory: pytest.TempPathFactory,
) -> Callable[[str], tuple[Any, ImpedanceInC]]:
    """A robot's model in NumPy, and its C."""
    made: dict[str, tuple[Any, ImpedanceInC]] = {}

    def robot(name: str) -> tuple[Any, ImpedanceInC]:
        if name not in made:
            folder = tmp_path_factory.mktemp("impedance")
            if name.startswith("hand"):
                (folder / "hand.urdf").write_text(HAND)
                kernel = "loops" if name.endswith("loops") else "straight"
                system = read_system(folder / "hand.urdf")
                write_package(generate(system, ["c", "numpy"], kernel=kernel), folder / "hand")
                directory, package = folder / "hand", import_package(folder / "hand")
            else:
                directory, package = directory_of(name), package_of(name)
            model = package.load("numpy")
            parameters = list(model.structure.parameters.values())
            made[name] = model, ImpedanceInC(directory, folder / "made.so", parameters)
        return made[name]

    return robot


def positive(generator: np.random.Generator, n: int) -> Any:
    a = generator.normal(size=(n, n))
    return a @ a.T + np.eye(n)


def wishes(generator: np.random.Generator, n: int, links: int) -> dict[str, dict[str, Any]]:
    """Every form that targets have."""
    by_link = np.broadcast_to(generator.uniform(0.5, 1.5, (1, links, 1)), (n, links, n))
    by_entry = generator.uniform(0.0, 1.0, (n, links, n))
    inertia, damping, stiffness = (positive(generator, n) for _ in range(3))
    turning = generator.normal(size=(n, n))
    turning = turning - turning.T
    return {
        "natural": {},
        "stiff": {"damping": damping, "stiffness": stiffness, "friction_width": 0.2},
        "added": {"friction_width": 0.7, "inertia": inertia, "damping": damping, "stiffness": stiffness},
        "scaled": {"keep_inertia": by_link, "keep_velocity": by_link, "stiffness": stiffness},
        "set": {"keep_inertia": 0.0 * by_link, "inertia": inertia, "keep_velocity": 0.0 * by_link},
        "damped by entries": {"keep_velocity": by_entry, "damping": damping},
        "not symmetric": {"keep_inertia": by_link, "inertia": inertia + turning, "keep_velocity": by_entry},
        "regular": {"keep_inertia": by_entry, "inertia": turning - 3.0 * np.eye(n), "regular": 1},
    }


@pytest.mark.parametrize("dtype", PRECISION, ids=["double", "float"])
@pytest.mark.parametrize("robot", ROBOTS)
def test_torques_and_accelerations_of_joints_are_the_formulas(robot: str, dtype: Any, robots: Any) -> None:
    model, c = robots(robot)
    generator = np.random.default_rng(3)
    errors: dict[str, float] = {}
    for _ in range(3):
        for form, wanted in wishes(generator, model.n, model.N).items():
            q, qd, q_d, qd_d, qdd_d, task, external = generator.uniform(-1.0, 1.0, (7, model.n))
            for to, pushed in (((q_d, qd_d, qdd_d), (task, external)), ((q_d, None, None), (None, None))):
                qdd, tau = formula(model, q, qd, wanted, to, *pushed)
                follows = np.full(model.n, 7.0, dtype)
                refused, found = c.joints(q, qd, wanted, to, *pushed, dtype=dtype)
                solved, again = c.joints(q, qd, wanted, to, *pushed, dtype=dtype, follows=follows)
                assert (refused, solved) == (0, 0), form
                for is_of, of in ((found, tau), (again, tau), (follows, qdd)):
                    error = np.abs(is_of - of).max() / max(1.0, np.abs(of).max())
                    errors[form] = max(errors.get(form, 0.0), error)
    assert max(errors.values()) <= PRECISION[dtype], errors


@pytest.mark.parametrize("dtype", PRECISION, ids=["double", "float"])
@pytest.mark.parametrize("robot", ROBOTS)
def test_what_is_cancelled_at_an_acceleration_is_the_formula(robot: str, dtype: Any, robots: Any) -> None:
    model, c = robots(robot)
    generator = np.random.default_rng(11)
    for wanted in wishes(generator, model.n, model.N).values():
        q, qd, qdd, task = generator.uniform(-1.0, 1.0, (4, model.n))
        wanted = {name: given for name, given in wanted.items() if name != "stiffness"}
        for asked, beside in ((wanted, task), (wanted, None), (None, task)):
            tau = cancel_formula(model, q, qd, qdd, asked or {}, beside)
            found = c.cancelled(q, qd, qdd, asked, beside, dtype)
            assert np.abs(found - tau).max() <= PRECISION[dtype] * max(1.0, np.abs(tau).max())


@pytest.mark.parametrize("dtype", PRECISION, ids=["double", "float"])
@pytest.mark.parametrize("robot", [p for p in ROBOTS if p.id != "energies"])
def test_torques_and_accelerations_of_a_frame_are_the_formulas(robot: str, dtype: Any, robots: Any) -> None:
    model, c = robots(robot)
    frame, generator = model.kinematics.frames[-1], np.random.default_rng(5)
    errors: dict[tuple[int, ...], float] = {}
    for rows in ROWS:
        q, qd, q_d, qd_d, qdd_d, external = generator.uniform(-1.0, 1.0, (6, model.n))
        j = model.kinematics.jacobian(q, frame, [0.1, 0.2, -0.1])[list(rows)]
        if np.linalg.matrix_rank(j, tol=1e-2) < len(rows):
            continue
        pose = model.kinematics.pose(q + generator.uniform(-0.5, 0.5, model.n), frame)
        target = (pose, *generator.uniform(-1.0, 1.0, (2, 6)))
        inertia, damping, stiffness = (positive(generator, len(rows)) for _ in range(3))
        stiff = {"damping": damping, "stiffness": stiffness}
        for form in ({}, stiff, {"keep_inertia": 0.0, "inertia": inertia, "keep_velocity": 0.0, **stiff}):
            wanted = {**form, "rows": rows, "point": [0.1, 0.2, -0.1]}
            for posture in list(wishes(generator, model.n, model.N).values())[:4]:
                given = (wanted, target, posture, (q_d, qd_d, qdd_d), external)
                qdd, tau = frame_formula(model, q, qd, frame, *given)
                follows = np.full(model.n, 7.0, dtype)
                refused, found = c.frame(q, qd, frame, *given, dtype=dtype, follows=follows)
                assert refused == 0
                for is_of, of in ((found, tau), (follows, qdd)):
                    error = np.abs(is_of - of).max() / max(1.0, np.abs(of).max())
                    errors[rows] = max(errors.get(rows, 0.0), error)
    assert errors
    assert max(errors.values()) <= 10 * PRECISION[dtype], errors


def test_they_are_the_torques_of_the_controllers_in_python(robots: Any, package_of: Any) -> None:
    """Targets are given as a user of Python gives them."""
    model, c = robots("torso")
    package, generator = package_of("torso"), np.random.default_rng(7)
    n, shape = model.n, (model.n, model.N, model.n)
    q, qd, q_d, qd_d, qdd_d, external = generator.uniform(-1.0, 1.0, (6, n))
    stiffness, plus, scale = (
        np.diag(generator.uniform(1.0, 9.0, n)),
        positive(generator, n),
        np.full(model.N, 0.5),
    )
    half = package.Natural(scale=0.5, plus=plus)
    controller = model.partial_impedance(inertia=half, damping=half, stiffness=stiffness)
    kept = np.broadcast_to(scale[:, None], shape)
    given = {
        "keep_inertia": kept,
        "inertia": plus,
        "keep_velocity": kept,
        "damping": plus,
        "stiffness": stiffness,
    }
    tau = controller(q, qd, package.Target(q_d, qd_d, qdd_d), external)
    found = c.joints(q, qd, given, (q_d, qd_d, qdd_d), None, external)[1]
    np.testing.assert_allclose(found, tau, rtol=0, atol=1e-11)
    path = model.structure.paths[-1]
    cancelled = [(path[0], model.N - 1, path[-1], order) for order in (1, 2)]
    weights = np.ones(shape)
    weights[path[0], -1, path[-1]] = 0.0
    given = {"keep_inertia": weights, "keep_velocity": weights, "regular": 1}
    tau = model.cancel(cancelled)(q, qd, q_d, external)
    np.testing.assert_allclose(
        c.joints(q, qd, given, task=q_d, external=external)[1], tau, rtol=0, atol=1e-11
    )
    frame, rows = model.kinematics.frames[-1], ("x", "y")
    wanted = package.FrameImpedance(frame, stiffness=50.0, damping=8.0, rows=rows)
    pose = model.kinematics.pose(q_d, frame)
    tau = model.partial_impedance(stiffness=stiffness, frame=wanted)(
        q, qd, package.Target(q_d, pose=pose), external
    )
    given = {"rows": (3, 4), "keep_velocity": 0.0, "damping": 8.0 * np.eye(2), "stiffness": 50.0 * np.eye(2)}
    found = c.frame(
        q, qd, frame, given, (pose, None, None), {"stiffness": stiffness}, (q_d, None, None), external
    )[1]
    np.testing.assert_allclose(found, tau, rtol=0, atol=1e-11)


@pytest.mark.parametrize("angle", [-1e-6, 3e-5, 1e-4, -3e-4, 2e-3, 0.0099, -0.02, 0.3])
def test_a_frame_is_pulled_by_its_angle_however_small(angle: float, robots: Any, package_of: Any) -> None:
    """The turn from the target is, in a plane, the sum of the joints' ways."""
    model, c = robots("planar3 symbolic")
    package, (q, qd) = package_of("planar3 symbolic"), np.array([[0.3, -0.7, 0.9], [0.0, 0.0, 0.0]])
    frame, pose = model.kinematics.frames[-1], model.kinematics.pose(q - [0.0, 0.0, angle], "link3")
    given, target = {"rows": (2,), "stiffness": 1e4 * np.eye(1)}, (pose, None, None)
    in_c = c.frame(q, qd, frame, given, target)[1]
    wanted = package.FrameImpedance(frame, stiffness=1e4, rows=("rz",))
    in_python = model.partial_impedance(frame=wanted)(q, qd, package.Target(pose=pose))
    # C takes a sine for the angle next to 0.
    for found, digits in ((in_c, 1e-8), (in_python, 1e-11)):
        pull = (found - model.gravity_torque(q)) / 1e4
        np.testing.assert_allclose(pull, -angle * np.ones(3), rtol=digits, atol=1e-15)


@pytest.mark.parametrize(
    "robot", ["torso", "planar3 symbolic", TURNTABLE], ids=["rigid", "parameters", "energies"]
)
@pytest.mark.parametrize("dtype", PRECISION, ids=["double", "float"])
def test_a_joint_whose_inertia_cannot_be_is_told(robot: str, dtype: Any, robots: Any) -> None:
    model, c = robots(robot)
    n = model.n
    q, qd = 0.3 + 0.1 * np.arange(2 * n).reshape(2, n)
    none = np.zeros((n, model.N, n))
    for at in range(n):
        inertia = np.eye(n)
        inertia[at, at] = -1.0
        entries = np.ones_like(none)
        entries[at] = entries[:, :, at] = 0.0
        skew = np.eye(n)
        skew[at, at - 1] = 9.0
        for wanted, number in (
            ({"keep_inertia": none, "inertia": inertia}, at + 1),
            ({"keep_inertia": entries}, at + 1),
            ({"keep_inertia": entries, "regular": 1}, None),
            ({"keep_inertia": none, "inertia": skew}, max(at, (at - 1) % n) + 1),
        ):
            refused, tau = c.joints(q, qd, wanted, dtype=dtype)
            assert 0 < refused <= n
            assert number in (None, refused)
            assert (tau == 7.0).all()
        refused, tau = c.joints(q, qd, {"keep_inertia": none, "inertia": inertia, "regular": 1}, dtype=dtype)
        assert refused == 0
    lost = q.copy()
    lost[-1] = np.nan
    assert c.joints(lost, qd, dtype=dtype)[0] > 0
    assert c.joints(lost, qd, {"inertia": np.eye(n)}, dtype=dtype)[0] > 0


@pytest.mark.parametrize("dtype", PRECISION, ids=["double", "float"])
def test_a_row_along_which_a_frame_cannot_move_is_told(dtype: Any, robots: Any) -> None:
    """A planar arm moves along x and z, and turns about y; stretched out it does not move along itself."""
    model, c = robots("planar3 symbolic")
    frame, q = model.kinematics.frames[-1], np.array([0.3, 0.5, -0.9])
    moves = np.abs(model.kinematics.jacobian(q, frame)).max(1) > 1e-9
    still, first = np.flatnonzero(~moves).tolist(), np.flatnonzero(moves).tolist()
    assert len(still) == 3
    for rows, number in (
        (first, 0),
        ([first[0], still[0]], -2),
        ([still[1]], -1),
        ([still[2], first[1]], -1),
    ):
        refused, tau = c.frame(q, q, frame, {"rows": rows}, dtype=dtype)
        assert refused == number
        assert (tau == 7.0).all() == bool(number)
    assert c.frame([0.3, 0.0, 0.0], q, frame, {"rows": first[1:]}, dtype=dtype)[0] == -2
    posture = {"inertia": np.diag([0.0, -1e3, 0.0])}
    assert c.frame(q, q, frame, {"rows": first}, posture=posture, dtype=dtype)[0] == 2
    wanted = {"rows": first, "inertia": np.diag([0.0, 0.0, -1e6])}
    assert c.frame(q, q, frame, wanted, dtype=dtype)[0] == -3


@pytest.mark.parametrize("dtype", PRECISION, ids=["double", "float"])
def test_a_frame_half_a_turn_away_is_told(dtype: Any, robots: Any) -> None:
    model, c = robots("planar3 symbolic")
    frame, q = model.kinematics.frames[-1], np.array([0.3, 0.5, -0.9])
    turns = next(r for r in range(3) if np.abs(model.kinematics.jacobian(q, frame)[r]).max() > 0.5)
    wanted = {"rows": [turns], "stiffness": np.eye(1)}
    for away, number in ((np.pi, -7), (np.pi - 1e-2, 0), (-np.pi + 1e-2, 0), (0.0, 0)):
        pose = model.kinematics.pose(q - [0.0, 0.0, away], frame)
        refused, found = c.frame(q, 0.0 * q, frame, wanted, (pose, None, None), dtype=dtype)
        assert refused == number
        if not number:
            given = (wanted, (pose, None, None), {}, (None, None, None), None)
            tau = frame_formula(model, q, 0.0 * q, frame, *given)[1]
            np.testing.assert_allclose(found, tau, rtol=0, atol=100 * PRECISION[dtype])


def test_equations_of_nine_joints_stay_within_their_arrays(tmp_path: Path) -> None:
    """The equations' rows have 15 numbers, which are filled up to 16; too large an index ends the process."""
    system = read_system("planar9")
    write_package(generate(system, ["c", "numpy"], kernel="loops"), tmp_path / "planar9")
    checked = ("-fsanitize=bounds", "-fsanitize-undefined-trap-on-error")
    c = ImpedanceInC(tmp_path / "planar9", tmp_path / "planar9.so", flags=checked)
    model = import_package(tmp_path / "planar9").load("numpy")
    q, qd = np.linspace(0.1, 0.9, 9), np.linspace(-0.5, 0.5, 9)
    given = ({"rows": [3, 4]}, (model.kinematics.pose(q, 9), None, None), {}, (None, None, None), None)
    refused, found = c.frame(q, qd, model.kinematics.frames[9], *given)
    assert refused == 0
    np.testing.assert_allclose(
        found, frame_formula(model, q, qd, model.kinematics.frames[9], *given)[1], rtol=1e-11
    )
    twice = {"inertia": np.eye(9)}
    found = c.cancelled(q, qd, q, twice)
    np.testing.assert_allclose(found, cancel_formula(model, q, qd, q, twice, None), rtol=1e-11)


def test_an_arm_of_parallel_slides_has_one_motion_too_many(tmp_path: Path) -> None:
    """The mass matrix is regular, and the hand moves along one axis by two of the slides."""
    slides = [joint("ab"[k] + "bc"[k], "ab"[k], "bc"[k], type="prismatic", rpy="0 0 0") for k in (0, 1)]
    (tmp_path / "slides.urdf").write_text(chain(*slides))
    write_package(generate(read_system(tmp_path / "slides.urdf"), ["c", "numpy"]), tmp_path / "slides")
    c = ImpedanceInC(tmp_path / "slides", tmp_path / "slides.so")
    at = np.array([0.3, 0.4])
    assert c.frame(at, at, "c", {"rows": [4]})[0] == 0
    assert c.frame(at, at, "c", {"rows": [4, 5]})[0] == -2


def test_a_turn_that_is_rounding_alone_is_no_turn(tmp_path: Path) -> None:
    """Slides tilt by 0.3 and 0.4 rad about y, and the hinge by -0.7: it turns about the vertical."""
    tilts = [("ab", "prismatic", 0.3), ("bc", "prismatic", 0.4), ("cd", "revolute", -0.7)]
    joints = [joint(n, *n, type=kind, axis="0 0 1", rpy=f"0 {tilt} 0") for n, kind, tilt in tilts]
    (tmp_path / "tilted.urdf").write_text(chain(*joints))
    write_package(generate(read_system(tmp_path / "tilted.urdf"), ["c", "numpy"]), tmp_path / "tilted")
    c, at = ImpedanceInC(tmp_path / "tilted", tmp_path / "tilted.so"), np.array([0.1, 0.2, 0.3])
    model = import_package(tmp_path / "tilted").load("numpy")
    turn = model.kinematics.jacobian(at, "d")[:3, 2]
    assert 0.0 < abs(turn[0]) < 1e-15
    assert c.frame(at, at, "d", {"rows": [2]})[0] == 0
    for rows in ([0], [1]):
        assert c.frame(at, at, "d", {"rows": rows})[0] == -1


@pytest.mark.parametrize(
    "robot", ["torso", f"{CRANE} loops", TURNTABLE], ids=["straight", "loops", "energies"]
)
def test_nothing_is_allocated(robot: str, directory_of: Callable[[str], Path], tmp_path: Path) -> None:
    name, made = name_of(directory_of(robot)), tmp_path / "made.o"
    run_kept(["gcc", "-std=c99", *WARNED, "-c", directory_of(robot) / "c" / f"{name}.c"], made)
    lines = subprocess.run(["nm", made], check=True, capture_output=True, text=True).stdout.splitlines()
    defined = {line.split()[-1] for line in lines if " T " in line}
    taken = {line.split()[-1] for line in lines if " U " in line}
    assert f"{name}_partial_impedance" in defined
    assert (f"{name}_frame_partial_impedance" in defined) == (robot != TURNTABLE)
    assert not {"malloc", "calloc", "realloc", "free"} & taken
    assert not [line for line in lines if " B " in line or " b " in line or " D " in line], "it has no state"


@pytest.mark.ship
@pytest.mark.parametrize("compiler", ["gcc", "clang"])
def test_the_control_loop_of_the_docs_runs_without_a_system_call(compiler: str, tmp_path: Path) -> None:
    source, made = DOCS / "control_loop.c", tmp_path / "control_loop"
    command, *flags = strict(compiler)
    robot = GENERATED / "puma560/c"
    run_kept([command, *flags, *WARNED, "-O2", f"-I{robot}", source, robot / "puma560.c", "-lm"], made)
    if compiler != "gcc":
        return
    said = subprocess.run([made], check=True, capture_output=True, text=True).stdout.splitlines()
    pushed = next(line.split() for line in said if line.startswith("  1.75 s"))
    asked = float(said[-3].split()[-2])
    assert float(pushed[5]) == pytest.approx(asked, rel=0.02), "it gives way as a spring does"
    assert "a control step takes" in said[-1]
    sealed = subprocess.run([made, "--sealed"], check=False, capture_output=True, text=True)
    if sealed.returncode == 2:
        pytest.skip("needs a Linux that lets programs be sealed by seccomp")
    assert (sealed.returncode, sealed.stdout) == (0, "a million steps, and no system call\n")
