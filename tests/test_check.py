"""What `linkwise check` accepts, refuses and leaves out."""

import hashlib
import importlib.util
import json
import os
import py_compile
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import sympy as sp
from conftest import DATA
from linkwise import (
    Coordinate,
    LinkEnergy,
    LinkwiseError,
    Options,
    check_package,
    energy_system,
    generate,
    read_system,
    write_package,
)
from linkwise.package.load import open_package


@pytest.fixture(scope="session")
def planar2(tmp_path_factory: pytest.TempPathFactory) -> Path:
    directory = tmp_path_factory.mktemp("check") / "planar2"
    write_package(generate(read_system("planar2"), ["numpy"]), directory)
    return directory


@pytest.fixture(scope="session")
def every_text(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A package with a text of every kind, which passes."""
    directory = tmp_path_factory.mktemp("every") / "planar2"
    write_package(generate(read_system("planar2"), ["numpy", "autograd", "c", "formulas"]), directory)
    assert set(marks(directory).values()) == {"ok"}
    shutil.rmtree(directory / "__pycache__", ignore_errors=True)
    return directory


@pytest.fixture
def package(planar2: Path, tmp_path: Path) -> Path:
    """A package of one's own to damage."""
    return shutil.copytree(planar2, tmp_path / "planar2", ignore=shutil.ignore_patterns("__pycache__"))


def change_manifest(package: Path, change: Callable[[Any], object]) -> None:
    path = package / "manifest.json"
    data = json.loads(path.read_text())
    change(data)
    path.write_text(json.dumps(data))


def change_file(package: Path, name: str, old: str, new: str, count: int = -1) -> None:
    """Change a file and its hash."""
    text = (package / name).read_text()
    assert old in text
    text = text.replace(old, new, count)
    (package / name).write_text(text)
    digest = hashlib.sha256(text.encode()).hexdigest()
    change_manifest(package, lambda data: data["files"].update({name: digest}))


def marks(directory: Path) -> dict[str, str]:
    return {result.name: result.mark for result in check_package(directory, 10)}


ODD = """schema = 1
name = "odd"
gravity = [0, 0, -9.81]
[[link]]
name = "up $<per"
mass = 1.2
com = [0.1, 0, 0]
inertia = { xx = 0.001, yy = 0.01, zz = 0.011 }
[[joint]]
name = "a joint"
type = "revolute"
parent = "base"
child = "up $<per"
axis = [0, 1, 0]
"""


@pytest.mark.parametrize("parameters", ["symbolic", "nonzero"])
def test_names_that_no_formula_can_hold_are_read_back(parameters: Any, tmp_path: Path) -> None:
    (tmp_path / "odd.toml").write_text(ODD)
    system = read_system(str(tmp_path / "odd.toml"), Options(parameters))
    backends = ["numpy", "formulas"]
    request = {"backends": backends, "parameters": parameters}
    write_package(generate(system, backends, "odd", request), tmp_path / "odd")
    assert set(marks(tmp_path / "odd").values()) == {"ok"}


def test_a_wrong_term_of_a_parameter_that_is_zero_fails(tmp_path: Path) -> None:
    (tmp_path / "odd.toml").write_text(ODD)
    system = read_system(str(tmp_path / "odd.toml"), Options("symbolic"))
    write_package(generate(system, ["numpy"], "odd"), tmp_path / "odd")
    first = "p_c_up___per_z * s1", "p_c_up___per_z * q1", 1
    change_file(tmp_path / "odd", "forms/link_1.py", *first)
    failing = {name for name, mark in marks(tmp_path / "odd").items() if mark == "FAIL"}
    assert "numpy, other parameters: M^j against differences of numpy's torques" in failing


def test_a_result_given_twice_is_computed_once(tmp_path: Path) -> None:
    theta, x = Coordinate("theta"), Coordinate("x", "m")
    links = [LinkEnergy("cart", x.qd**2 + theta.qd**2, 0), LinkEnergy("spring", 0, 4.9 * sp.cos(theta.q))]
    write_package(generate(energy_system("two", [x, theta], links), ["numpy"]), tmp_path / "two")
    assert marks(tmp_path / "two")["manifest"] == "ok"


def test_c_that_ends_the_process_fails(tmp_path: Path) -> None:
    package = tmp_path / "planar2"
    write_package(generate(read_system("planar2"), ["c"]), package)
    change_file(
        package, "c/planar2.c", "    struct block x;\n", "    struct block x;\n    *(volatile int *)0 = 0;\n"
    )
    failing = {result.name: result.detail for result in check_package(package, 10) if not result.passed}
    assert failing == {"c: runs to its end": "it ended the process by SIGSEGV"}


def test_a_singular_mass_matrix_is_not_called_positive_definite(tmp_path: Path) -> None:
    theta, x = Coordinate("theta"), Coordinate("x", "m")
    system = energy_system("one", [x, theta], [LinkEnergy("both", (x.qd + theta.qd) ** 2, 0)])
    write_package(generate(system, ["numpy"]), tmp_path / "one")
    assert marks(tmp_path / "one")["numpy: total mass matrix positive definite"] == "skip"


def test_a_coefficient_that_is_zero_but_for_rounding_passes(tmp_path: Path) -> None:
    theta, length = Coordinate("theta"), 0.7
    vx, vy = (sp.diff(length * f(theta.q), theta.q) * theta.qd for f in (sp.sin, sp.cos))
    bob = LinkEnergy("bob", 1.3 * (vx**2 + vy**2) / 2, -1.3 * 9.81 * length * sp.cos(theta.q))
    system = energy_system("pendulum", [theta], [bob])
    write_package(generate(system, ["numpy", "torch", "autograd"]), tmp_path / "pendulum")
    found = marks(tmp_path / "pendulum")
    assert set(found.values()) == {"ok"}
    assert "numpy: c1 against Lagrangians differentiated" in found


@pytest.mark.parametrize(
    ("old", "new", "failing"),
    [
        ("0.0,  # c1(2, 2, 2)", "1e-7,  # c1(2, 2, 2)", "numpy: c1 against Newton-Euler recursion"),
        (" = 0.005 + ", " = 0.00500001 + ", "numpy: M^j against Newton-Euler recursion"),
    ],
)
def test_a_slightly_wrong_coefficient_fails_all_the_same(
    old: str, new: str, failing: str, package: Path
) -> None:
    change_file(package, "forms/link_2.py", old, new)
    assert marks(package)[failing] == "FAIL"


WRONG = {
    "position gradient": ("forms/link_2.py", "t6 + 0.25 * t5),", "t6 - 0.25 * t5),", "numpy: c0 against"),
    "torques alone": ("forms/link_2.py", "t3,  # tau(2, 2)", "t3 + 1e-7,  # tau(2, 2)", "numpy: all calls"),
    "gravity": ("forms/link_2.py", "t6,  # g(2, 2)", "t7,  # g(2, 2)", "numpy: g against"),
    "energy": (
        "energies/link_2.py",
        "0.6 * u2",
        "0.6000001 * u2",
        "autograd: Lagrangians against the bodies'",
    ),
    "text": ("formulas.txt", "588399*cos(q_1 + q_2)", "588399*cos(q_1 - q_2)", "formulas.txt: tau_ij"),
    "latex": ("formulas.tex", r"\frac{23 \ddot{q}_{2}}", r"\frac{23 \dot{q}_{2}}", "formulas.tex: tau_ij"),
    "last samples of a batch": (
        "c/planar2.c",
        "scatter(samples, 5, C1, c1",
        "scatter(samples, 4, C1, c1",
        "c: planar2_d",
    ),
    "large batches": (
        "c/planar2.c",
        "stream_rows(G, g_block, g + s",
        "stream_rows(G, g_block, g + 0 * s",
        "c: planar2_d",
    ),
    "one link alone": (
        "c/planar2.c",
        "m.sine, m.cosine, c2, c1",
        "m.cosine, m.cosine, c2, c1",
        "c: planar2_link_2f",
    ),
    "beyond the arrays": (
        "c/planar2.c",
        "scatter(samples, 3, G, tau",
        "scatter(8, 3, G, tau",
        "c: planar2_torque",
    ),
    "index": ("c/planar2_index.h", "{2, 2, 2}", "{2, 2, 1}", "c: numbers and indices"),
}


@pytest.mark.parametrize("case", WRONG)
def test_one_wrong_formula_in_any_file_fails(case: str, every_text: Path, tmp_path: Path) -> None:
    file, old, new, failing = WRONG[case]
    package = shutil.copytree(every_text, tmp_path / "planar2")
    change_file(package, file, old, new)
    assert [name for name, mark in marks(package).items() if mark == "FAIL" and name.startswith(failing)]


def test_c_that_does_not_compile_fails_with_the_compilers_words(every_text: Path, tmp_path: Path) -> None:
    package = shutil.copytree(every_text, tmp_path / "planar2")
    change_file(package, "c/planar2.c", "struct block x;", "struct brick x;")
    (result,) = (result for result in check_package(package, 3) if result.name == "c: compiles")
    assert not result.passed
    assert "failed: " in result.detail
    assert "error: " in result.detail


@pytest.mark.parametrize(
    ("error", "mark"),
    [
        ('RuntimeError("gcc failed: error: expected install")', "FAIL"),
        ('OSError("no space")', "FAIL"),
        ('ValueError("strange")', "FAIL"),
        ('ImportError("gone", name=__package__ + ".forms")', "FAIL"),
        ('RuntimeError("needs a C compiler: apt install gcc")', "skip"),
        ('ImportError("No module named torch", name="torch")', "skip"),
    ],
)
def test_only_what_is_missing_here_is_left_out(error: str, mark: str, package: Path) -> None:
    change_file(package, "__init__.py", "    if backend not in", f"    raise {error}\n    if backend not in")
    found = marks(package)
    assert (found.pop("hashes"), found.pop("manifest")) == ("ok", "ok")
    assert found.pop("back ends") == "FAIL"
    assert list(found.values()) == [mark]


def test_a_package_that_cannot_be_imported_or_asked_fails(package: Path) -> None:
    change_file(package, "runtime/dynamics.py", "class Dynamics", "def broken(:\nclass Dynamics")
    assert marks(package) == {"hashes": "ok", "import": "FAIL"}
    change_file(package, "runtime/dynamics.py", "def broken(:\n", "")
    change_file(package, "runtime/dynamics.py", "def partial_torque", "def full_torque")
    assert marks(package)["answers"] == "FAIL"


def test_a_package_that_cannot_be_imported_says_why_and_leaves_no_trace(package: Path) -> None:
    finders = list(sys.meta_path)
    change_file(package, "names.py", "ROBOT =", "1 / 0\nROBOT =", 1)
    for _ in range(2):
        with pytest.raises(LinkwiseError, match=r"cannot be imported \(ZeroDivisionError: division by"):
            open_package(package)
    assert sys.meta_path == finders


def test_closed_forms_of_a_users_energies_are_held_against_their_own_torques(tmp_path: Path) -> None:
    package = tmp_path / "turntable"
    write_package(generate(read_system(str(DATA / "turntable.py")), ["numpy"]), package)
    assert set(marks(package).values()) == {"ok"}
    change_file(package, "forms/link_1.py", "0.5 * (t6 + 1.36)", "0.5 * (t6 + 1.36001)")
    failing = {name for name, mark in marks(package).items() if mark == "FAIL"}
    assert "numpy: c1 against differences of numpy's torques" in failing


def test_energies_that_are_defined_for_some_positions_only_are_checked_there(tmp_path: Path) -> None:
    x = Coordinate("x", "m")
    for name, potential in (("near", sp.sqrt(x.q)), ("nowhere", sp.sqrt(x.q - 4))):
        system = energy_system(name, [x], [LinkEnergy("bead", x.qd**2, potential)])
        write_package(generate(system, ["numpy"]), tmp_path / name)
    assert set(marks(tmp_path / "near").values()) == {"ok"}
    assert marks(tmp_path / "nowhere")["numbers"] == "skip"


@pytest.mark.parametrize("spec", ["planar2", str(DATA / "cart_pendulum.py")])
def test_c_alone_is_compiled_and_held_against_what_there_is(spec: str, tmp_path: Path) -> None:
    write_package(generate(read_system(spec), ["c"], "robot_c"), tmp_path / "robot_c")
    results = check_package(tmp_path / "robot_c", 10)
    assert all(result.passed for result in results)
    assert {"c: robot_c_decomposition_blocksf", "c: robot_c_link_1"} <= {result.name for result in results}


def test_formulas_that_nothing_can_be_held_against_are_left_out(tmp_path: Path) -> None:
    write_package(generate(read_system(str(DATA / "cart_pendulum.py")), ["formulas"]), tmp_path / "cart")
    assert [(r.name, r.mark) for r in check_package(tmp_path / "cart")] == [
        ("hashes", "ok"),
        ("manifest", "ok"),
        ("back ends", "skip"),
        ("formulas.txt: not checked", "skip"),
        ("formulas.tex: not checked", "skip"),
        ("numbers", "skip"),
    ]


def link_to(path: Path) -> None:
    kept = path.rename(path.parents[1] / "elsewhere")
    path.symlink_to(kept)


FAULTS: dict[str, tuple[Callable[[Path], object], str]] = {
    "module": (lambda p: (p / "forms/more.py").touch(), "forms/more.py was added"),
    "modules, in the order of their paths": (
        lambda p: [(p / name).touch() for name in ("z.py", "forms/more.py", "a.py")],
        "a.py was added; forms/more.py was added; z.py was added",
    ),
    "library": (lambda p: (p / "names.so").touch(), "names.so was added"),
    "bytecode of no cache": (lambda p: (p / "forms/link_1.pyc").touch(), "forms/link_1.pyc was added"),
    "name of no cache": (lambda p: plant(p, "names.pyc"), "__pycache__/names.pyc was added"),
    "cache of nothing": (
        lambda p: plant(p, "more.cpython-311.pyc"),
        "__pycache__/more.cpython-311.pyc was added",
    ),
    "change": (lambda p: (p / "names.py").write_text("#"), "names.py was changed"),
    "loss": (lambda p: (p / "names.py").unlink(), "names.py is missing"),
    "link": (lambda p: link_to(p / "names.py"), "names.py is a symbolic link"),
    "link to nothing": (lambda p: (p / "more").symlink_to("nowhere"), "more was added"),
    "pipe": (lambda p: os.mkfifo(p / "forms/pipe"), "forms/pipe was added"),
}


def plant(package: Path, name: str) -> None:
    (package / "__pycache__").mkdir(exist_ok=True)
    (package / "__pycache__" / name).touch()


@pytest.mark.parametrize("case", FAULTS)
def test_files_other_than_the_manifest_lists_fail(case: str, package: Path) -> None:
    damage, message = FAULTS[case]
    damage(package)
    [result] = check_package(package)
    assert (result.name, result.mark, result.detail) == ("hashes", "FAIL", message)


def test_files_behind_a_linked_folder_fail(package: Path) -> None:
    link_to(package / "forms")
    assert "forms/link_1.py is behind the symbolic link forms" in check_package(package)[0].detail


def test_a_linked_package_passes(package: Path, tmp_path: Path) -> None:
    (tmp_path / "link").symlink_to(package)
    assert set(marks(tmp_path / "link").values()) == {"ok"}


STATE = np.array([[0.1, 0.2], [0.0, 0.0], [0.0, 0.0]])


def run_in(package: Path, *options: str) -> str:
    """What a user's Python says that imports the package and calls it, caching what it compiles."""
    script = f"import numpy as np, {package.name} as p; print(p.load().partial_torque(*np.{STATE!r})[0, 0])"
    environment = {k: v for k, v in os.environ.items() if k != "PYTHONDONTWRITEBYTECODE"}
    command = [sys.executable, *options, "-c", script]
    done = subprocess.run(
        command, cwd=package.parent, env=environment, check=True, capture_output=True, text=True
    )
    return done.stdout


@pytest.mark.parametrize("option", ["-O", "-OO", "-B"])
def test_what_python_caches_of_the_package_passes(option: str, package: Path) -> None:
    run_in(package, "-Xno_debug_ranges")
    run_in(package, option)
    assert set(marks(package).values()) == {"ok"}


@pytest.mark.parametrize("mode", list(py_compile.PycInvalidationMode))
def test_a_planted_cache_fails_and_is_never_run(mode: py_compile.PycInvalidationMode, package: Path) -> None:
    right = run_in(package)
    shutil.rmtree(package / "forms/__pycache__")
    source = package / "forms/link_1.py"
    text, times = source.read_text(), (source.stat().st_atime_ns, source.stat().st_mtime_ns)
    source.write_text(text.replace(" = 0.", " = 1.", 1).replace("c1 = xp.cos(q1)", "c1 = xp.sin(q1)"))
    assert source.stat().st_size == len(text.encode()) != source.read_text() != text
    os.utime(source, ns=times)
    py_compile.compile(str(source), invalidation_mode=mode)
    source.write_text(text)
    os.utime(source, ns=times)
    if mode is not py_compile.PycInvalidationMode.CHECKED_HASH:
        assert run_in(package) != right  # it is the planted one that a user's Python runs
        torque = open_package(package).load("numpy").partial_torque(*STATE)[0, 0]
        assert torque == float(right)
    planted = Path(importlib.util.cache_from_source(source)).relative_to(package)
    [result] = check_package(package)
    assert (result.mark, result.detail) == ("FAIL", f"{planted} is not link_1.py compiled, delete it")


def test_a_damaged_cache_fails_and_that_of_another_python_is_told(package: Path) -> None:
    plant(package, "names.cpython-27.pyc")
    assert marks(package).pop("__pycache__") == "skip"
    plant(package, Path(importlib.util.cache_from_source("names.py")).name)
    assert "is not names.py compiled" in check_package(package)[0].detail


@pytest.mark.parametrize("case", ["change", "loss", "link"])
def test_a_package_that_differs_is_not_loaded(case: str, package: Path) -> None:
    damage, message = FAULTS[case]
    damage(package)
    with pytest.raises(LinkwiseError) as caught:
        open_package(package)
    assert str(caught.value) == f"{package}: {message}; generate the robot again"


def test_a_file_changed_after_the_package_was_opened_is_not_run(package: Path) -> None:
    opened = open_package(package)
    for name in [name for name in sys.modules if name.startswith(f"{opened.module.__name__}.forms")]:
        del sys.modules[name]
    (package / "forms/link_1.py").write_text("raise SystemExit")
    with pytest.raises(ImportError, match=r"forms/link_1.py was changed"):
        opened.load("numpy")


def test_a_manifest_that_lists_no_files_fails(package: Path) -> None:
    change_manifest(package, lambda data: data.update(files={}))
    assert check_package(package)[0].detail.startswith("the manifest lists no files; ")


def test_a_manifest_at_odds_with_its_package_is_refused(package: Path) -> None:
    change_manifest(package, lambda data: data["links"].pop())
    assert marks(package) == {"hashes": "ok", "manifest": "FAIL"}
    with pytest.raises(LinkwiseError, match=r"the entry links of manifest.json was changed"):
        open_package(package)
