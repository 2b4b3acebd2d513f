"""The runtime: a library that packages import or carry a copy of, and the types that it gives its user."""

import ast
import os
import re
import subprocess
import sys
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from types import ModuleType
from typing import Any

import linkwise_runtime
import numpy as np
import pytest
from linkwise import check_package, generate, read_system, write_package
from linkwise.emit.backend import BACKENDS
from linkwise.own_runtime import require_own_runtime
from linkwise.package.load import import_package
from linkwise_runtime import version
from linkwise_runtime.arrays.numpy_backend import NumpyBackend
from linkwise_runtime.dynamics import Dynamics
from linkwise_runtime.parameter_values import ParametricBody
from linkwise_runtime.structure import Structure
from linkwise_runtime.targets import FrameImpedance, Natural, Target

torch = pytest.importorskip("torch")

ROOT = Path(__file__).parents[2]
RUNTIME = Path(linkwise_runtime.__file__).parent
FORK = Structure(
    name="fork",
    joint_names=("base", "left", "right"),
    joint_units=("rad", "rad", "m"),
    link_names=("stem", "left", "right"),
    paths=((0,), (0, 1), (0, 2)),
    nonquadratic=(2,),
    parameters={"m": 0.5},
)
ALLOWED = {"numpy", "torch"} | sys.stdlib_module_names


def test_packed_values_are_listed_link_by_link_along_their_paths() -> None:
    assert (FORK.n, FORK.N) == (3, 3)
    assert FORK.layout.torque.tolist() == [[0, 0], [0, 1], [1, 1], [0, 2], [2, 2]]
    assert FORK.layout.acceleration[1:4].tolist() == [[0, 1, 0], [0, 1, 1], [1, 1, 1]]
    assert FORK.layout.velocity_excess.tolist() == [[0, 2, 0], [0, 2, 2], [2, 2, 0], [2, 2, 2]]
    assert tuple(FORK.sizes) == (7, 9, 5, 5, 4)
    assert replace(FORK, nonquadratic=()).sizes.h1 == 0


def test_given_parameters_replace_built_in_ones_by_name() -> None:
    assert FORK.values(None) == {"m": 0.5}
    assert FORK.values({"m": 2.0}) == {"m": 2.0}
    with pytest.raises(ValueError, match="no parameter 'k' in any number; the parameters are m"):
        FORK.values({"k": 1.0})
    with pytest.raises(ValueError, match="no parameter 'k': this package has no parameters; generate it"):
        replace(FORK, parameters={}).values({"k": 1.0})


def test_masses_that_no_body_has_are_refused_unless_they_are_asked_for() -> None:
    stem = ParametricBody("stem", ("m",), lambda values: (values["m"], 1.0, 1.0, 1.0, 0.0, 0.0, 0.0))
    fork = replace(FORK, bodies=(stem,))
    with pytest.raises(ValueError, match="link 'stem' would have"):
        fork.values({"m": -1.0})
    assert fork.values({"m": -1.0}, allow_unphysical=True) == {"m": -1.0}


FILES = sorted(path.relative_to(RUNTIME).as_posix() for path in RUNTIME.rglob("*.py"))


@pytest.mark.parametrize("file", FILES)
def test_the_runtime_imports_numpy_torch_and_its_own_files_only(file: str) -> None:
    path = RUNTIME / file
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom):
            name = node.module or ""
            own = path.parents[max(node.level - 1, 0)].joinpath(*name.split(".")).relative_to(RUNTIME)
            there = {f"{own.as_posix()}.py", f"{own.as_posix()}/__init__.py"} & set(FILES)
            assert there if node.level else name.split(".")[0] in ALLOWED
        elif isinstance(node, ast.Import):
            assert all(alias.name.split(".")[0] in ALLOWED for alias in node.names)


@pytest.mark.parametrize("backend", list(BACKENDS))
def test_a_package_carries_what_its_back_ends_import_and_no_more(backend: str) -> None:
    assert not [path for path in generate(read_system("planar2"), [backend]) if "linkwise_runtime" in path]
    files = generate(read_system("planar2"), [backend], vendor_runtime=True)
    carried = {path for path in files if path.startswith("linkwise_runtime/")}
    for path in carried:
        assert files[path].encode() == (RUNTIME / path.removeprefix("linkwise_runtime/")).read_bytes()
    imported = set()
    for path in (path for path in files if path.endswith(".py")):
        for node in ast.walk(ast.parse(files[path])):
            assert not isinstance(node, ast.ImportFrom) or node.level or "linkwise" not in (node.module or "")
            if isinstance(node, ast.ImportFrom) and node.level:
                folder = Path(path).parents[node.level - 1] / (node.module or "").replace(".", "/")
                names = [folder / alias.name for alias in node.names] if not node.module else [folder]
                for name in names:
                    there = {f"{name.as_posix()}.py", f"{name.as_posix()}/__init__.py"} & set(files)
                    assert there, path
                    imported |= there
    modules = {path for path in carried if path.endswith(".py") and not path.endswith("__init__.py")}
    assert modules <= imported


def test_a_new_back_end_is_one_entry_of_the_registry(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    numpy = BACKENDS["numpy"]
    assert numpy.loading is not None
    loading = replace(numpy.loading, speed=9)
    monkeypatch.setitem(BACKENDS, "mirror", replace(numpy, name="mirror", doc="a copy", loading=loading))
    write_package(generate(read_system("planar2"), ["numpy", "mirror"]), tmp_path / "planar2")
    package = import_package(tmp_path / "planar2")
    assert package.BACKENDS == package.FASTEST_FIRST == ("numpy", "mirror")
    assert "mirror: a copy" in package.load.__doc__
    found = {result.name for result in check_package(tmp_path / "planar2", 5) if result.held}
    assert "mirror: tau_ij against Newton-Euler recursion" in found


def test_packed_values_and_their_indices_have_the_same_fields(
    package_of: Callable[[str], ModuleType],
) -> None:
    package = package_of("planar3")
    answer = package.load("numpy").packed(*np.ones((3, 4, 3)))
    assert isinstance(answer, package.Packed)
    assert answer._fields == package.Layout._fields


class Pendulum:
    """Closed forms of a point mass m on a rod of length 1, as a generated forms/link_1.py has them."""

    def decomposition(self, xp: Any, q: Any, qd: Any, qdd: Any, p: Mapping[str, Any]) -> tuple[Any, ...]:
        gravity = 9.81 * p["m"] * xp.sin(q[..., 0])
        return (p["m"],), (0.0,), (gravity,), (p["m"] * qdd[..., 0] + gravity,)

    def torque(self, xp: Any, q: Any, qd: Any, qdd: Any, p: Mapping[str, Any]) -> tuple[Any, ...]:
        return self.decomposition(xp, q, qd, qdd, p)[3]  # type: ignore[no-any-return]

    def position_gradient(self, xp: Any, q: Any, qd: Any, qdd: Any, p: Mapping[str, Any]) -> tuple[Any, ...]:
        return (9.81 * p["m"] * xp.cos(q[..., 0]),)


ROD = Structure("rod", ("hinge",), ("rad",), ("mass",), ((0,),), (), {"m": 0.5})


def pendulum(backend: str) -> Dynamics:
    """The pendulum on one of the back ends, put together by hand."""
    if backend == "numpy":
        return Dynamics(ROD, NumpyBackend(ROD, [Pendulum()], ROD.values(None)), pendulum, (backend,))
    from linkwise_runtime.arrays.torch_backend import TorchBackend
    from linkwise_runtime.lagrangians.dynamics_module import DynamicsModule, backend_of_links
    from linkwise_runtime.lagrangians.partial_lagrangian import PartialLagrangian

    class Lagrangian(PartialLagrangian):
        path = (0,)

        def kinetic(self, q: Any, qd: Any, p: Any) -> Any:
            return 0.5 * p["m"] * qd[0] ** 2

        def potential(self, q: Any, p: Any) -> Any:
            return -9.81 * p["m"] * torch.cos(q[0])

    if backend == "torch":
        return Dynamics(ROD, TorchBackend(ROD, [Pendulum()], ROD.values(None)), pendulum, (backend,))
    made = backend_of_links(ROD, [Lagrangian], ROD.values(None))
    return DynamicsModule(ROD, made, pendulum, (backend,))


@pytest.mark.parametrize("batch", [(), (4,), (2, 3)])
@pytest.mark.parametrize("backend", ["numpy", "torch", "autograd"])
def test_a_pendulum_is_that_of_the_textbook(backend: str, batch: tuple[int, ...]) -> None:
    robot = pendulum(backend)
    motion = np.random.default_rng(3).uniform(-2.0, 2.0, (3, *batch, 1))
    q, _, qdd = motion
    given = [torch.from_numpy(m) for m in motion] if robot.backend.takes_tensors else list(motion)
    np.testing.assert_allclose(robot.inverse_dynamics(*given), 0.5 * (qdd + 9.81 * np.sin(q)), rtol=1e-12)
    mass, c1, gravity = robot.coefficients(*given[:2])
    np.testing.assert_allclose(mass, np.full((*batch, 1, 1, 1), 0.5), rtol=1e-15)
    np.testing.assert_allclose(c1, np.zeros((*batch, 1, 1, 1)), atol=1e-15)
    np.testing.assert_allclose(gravity[..., 0], 0.5 * 9.81 * np.sin(q), rtol=1e-12)
    stiffness = robot.position_gradient(*given)[..., 0, 0]
    np.testing.assert_allclose(stiffness, 0.5 * 9.81 * np.cos(q), rtol=1e-12)


@pytest.mark.parametrize("call", ["packed", "packed_torque", "position_gradient"])
def test_lagrangians_are_differentiated_a_part_of_a_large_batch_at_a_time(
    call: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    from linkwise_runtime.lagrangians import autograd_backend

    robot = pendulum("autograd")
    robot.backend.parameters["m"] = torch.rand(2, 1, dtype=torch.float64, requires_grad=True)
    motion = torch.rand(3, 2, 5, 1, dtype=torch.float64)
    whole = getattr(robot, call)(*motion)
    monkeypatch.setattr(autograd_backend, "AT_A_TIME", 3)
    for one, other in zip(whole, getattr(robot, call)(*motion), strict=True):
        torch.testing.assert_close(one, other, rtol=1e-15, atol=0.0)
        assert other.requires_grad == bool(other.numel()) or call == "packed"


def test_what_a_link_hands_on_is_worked_out_once_for_all_that_it_carries() -> None:
    from linkwise_runtime.lagrangians.dynamics_module import backend_of_links
    from linkwise_runtime.lagrangians.lanes import carried
    from linkwise_runtime.lagrangians.partial_lagrangian import PartialLagrangian

    calls = []

    class First(PartialLagrangian):
        path = (0,)

        @carried
        def speed(self, q: Any, qd: Any) -> Any:
            calls.append(tuple(qd[0].shape))
            return (torch.cos(q[0]) * qd[0],)

        def kinetic(self, q: Any, qd: Any, p: Any) -> Any:
            return 0.5 * self.speed(q, qd)[0] ** 2

        def potential(self, q: Any, p: Any) -> Any:
            return 0.0

    class Second(First):
        path = (0, 1)
        parent = First

        @carried
        def onward(self, q: Any, qd: Any) -> Any:
            return (self.before.speed(q, qd)[0] + qd[1],)

        def kinetic(self, q: Any, qd: Any, p: Any) -> Any:
            return 0.5 * self.onward(q, qd)[0] ** 2

    class Third(Second):
        parent = First

    q, qd = torch.tensor([0.3, 0.1]), torch.tensor([2.0, 0.5])
    kinds = (First, Second, Third)
    tripod = replace(
        FORK, joint_names=FORK.joint_names[:2], paths=tuple(kind.path for kind in kinds), nonquadratic=()
    )
    c2, c1, *_ = backend_of_links(tripod, kinds, {}).decomposition(q, qd, qd)
    assert calls == [(5,)]
    x, slope = np.cos(0.3), -np.sin(0.3) * 2.0
    np.testing.assert_allclose(c2, [x * x, x * x, x, 1, x * x, x, 1], rtol=1e-6)
    both = [x * slope, 0, slope, 0]
    np.testing.assert_allclose(c1, [x * slope, *both, *both], rtol=1e-6)


def test_an_energy_off_its_path_is_refused() -> None:
    from linkwise_runtime.lagrangians.dynamics_module import backend_of_links
    from linkwise_runtime.lagrangians.partial_lagrangian import PartialLagrangian

    class Stray(PartialLagrangian):
        path = (1,)

        def kinetic(self, q: Any, qd: Any, p: Any) -> Any:
            return qd[0] ** 2

    alone = replace(FORK, link_names=("stray",), paths=((1,),), nonquadratic=())
    with pytest.raises(ValueError, match=r"asks for coordinate 0, which is not on its path \(1,\)"):
        backend_of_links(alone, [Stray], {}).torque(*torch.zeros(3, 3))


def test_a_parameter_may_be_an_array_of_one_value_a_sample() -> None:
    masses = np.array([0.5, 1.0, 2.0])
    robot = Dynamics(ROD, NumpyBackend(ROD, [Pendulum()], {"m": masses}), pendulum, ("numpy",))
    torque = robot.inverse_dynamics(*(np.zeros((3, 1)), np.zeros((3, 1)), np.ones((3, 1))))
    np.testing.assert_allclose(torque[:, 0], masses)


USER = """
from typing import Any

import numpy as np
import planar2
import torch
from numpy.typing import NDArray

Arrays = NDArray[Any]


def of_arrays(robot: planar2.Dynamics, q: NDArray[np.float64]) -> Arrays:
    coefficients: planar2.Coefficients[Arrays] = robot.coefficients(q, q)
    closing: planar2.Propagation[Arrays] = robot.propagation(q, q, q)
    gradient: planar2.GradientPropagation[Arrays] = robot.propagation(q, q, q, convention="gradient")
    packed: planar2.Packed[NDArray[np.float64]] = robot.packed(q, q, q)
    masked = robot.masked(q, q, q, [[0, 0], [1, 1], [1, 1]])
    rows: NDArray[np.intp] = robot.layout.acceleration
    names: tuple[str, ...] = robot.joint_names + planar2.link_names
    print(coefficients.velocity.shape, closing.convention, gradient.gravity, packed.torque)
    print(masked, rows, names)
    return robot.partial_torque(q, q, q)


def of_tensors(q: torch.Tensor) -> torch.Tensor:
    robot = planar2.load("torch", {})
    stiffness: torch.Tensor = robot.position_gradient(q, q, q)
    return robot.coefficients(q, q).acceleration.sum() + stiffness.sum() + robot.inverse_dynamics(q, q, q)


def of_links(q: torch.Tensor) -> torch.Tensor:
    learned = planar2.load("autograd", requires_grad="mass")
    energy: torch.Tensor = learned.links["link2"](q, q)
    rows = [link.torque(q, q, q) for link in learned.links]
    learned.links[0].coefficients(q)  # ERROR
    return torch.stack(rows).sum() + energy.sum() + learned.values["m"] + learned.inverse_dynamics(q, q, q)


robot = planar2.load()
robot.links  # ERROR
tau = robot.partial_torque(np.zeros(2), np.zeros(2), np.zeros(2))
reveal_type(tau)
robot.partial_torques  # ERROR
robot.partial_torque("q", "qd", "qdd")  # ERROR
planar2.load(backend=1)  # ERROR
"""


def test_a_package_and_its_user_are_typed_strictly(tmp_path: Path) -> None:
    pytest.importorskip("mypy")
    write_package(generate(read_system("planar2"), ["numpy", "torch", "autograd"]), tmp_path / "planar2")
    assert (tmp_path / "planar2/py.typed").is_file()
    (tmp_path / "user.py").write_text(USER)
    # The project's own settings and cache, so that NumPy and torch are read once, by `make lint` say.
    shared = ("--config-file", str(ROOT / "pyproject.toml"), "--cache-dir", str(ROOT / ".mypy_cache"))
    command = [sys.executable, "-m", "mypy", "--strict", *shared]
    environment = os.environ | {"MYPYPATH": f"{tmp_path}{os.pathsep}{RUNTIME.parent}"}
    done = subprocess.run(
        [*command, "user.py", "planar2"],
        cwd=tmp_path,
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )
    expected = [f"user.py:{at}" for at, line in enumerate(USER.splitlines(), 1) if line.endswith("# ERROR")]
    found = [line for line in done.stdout.splitlines() if ": error:" in line]
    assert [line.split(": error:")[0] for line in found] == expected, done.stdout + done.stderr
    assert "numpy.ndarray[tuple[Any, ...], numpy.dtype[Any]]" in done.stdout


@pytest.mark.parametrize("made_for", ["4.2.9", "4.4.0", "5.3.0", "4.3.1", "4.3", "none"])
def test_a_runtime_runs_packages_of_its_own_minor_version_up_to_its_own_patch(
    made_for: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(version, "VERSION", "4.3.0")
    version.require("4.3.0")
    with pytest.raises(
        ImportError, match=rf"^this package is made for linkwise_runtime {made_for}, but 4\.3\.0"
    ):
        version.require(made_for)
    monkeypatch.setattr(version, "VERSION", "4.3.3")
    version.require("4.3.2")


def test_what_targets_leave_open_is_natural_and_at_rest() -> None:
    assert Natural() == (1.0, None)
    assert FrameImpedance("hand")[1:] == (
        Natural(),
        Natural(),
        0.0,
        ("rx", "ry", "rz", "x", "y", "z"),
        (0.0,) * 3,
    )
    assert Target() == (None,) * 6


def test_another_runtime_in_the_place_of_linkwises_own_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("importlib.metadata.version", lambda name: "10.1.0")
    told = f"^linkwise 10.1.0 finds linkwise_runtime {version.VERSION} in its place; install linkwise again"
    with pytest.raises(ImportError, match=told):
        require_own_runtime.__wrapped__()


def test_a_python_without_its_lock_is_refused_in_one_line() -> None:
    start = "import sys; sys._is_gil_enabled = lambda: False; from linkwise.__main__ import main; main()"
    ended = subprocess.run([sys.executable, "-c", start], capture_output=True, text=True, check=False)
    assert ended.returncode == 2
    assert re.fullmatch(r"linkwise: error: linkwise has never .* PYTHON_GIL=1 .*\n", ended.stderr)
