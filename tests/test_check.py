"""What `linkwise check` accepts, refuses and leaves out."""

import hashlib
import json
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import sympy as sp
from conftest import DATA
from linkwise import (
    Coordinate,
    LinkEnergy,
    LinkwiseError,
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


def change_file(package: Path, name: str, old: str, new: str) -> None:
    """Change a file and its hash."""
    text = (package / name).read_text()
    assert old in text
    text = text.replace(old, new)
    (package / name).write_text(text)
    digest = hashlib.sha256(text.encode()).hexdigest()
    change_manifest(package, lambda data: data["files"].update({name: digest}))


def marks(directory: Path) -> dict[str, str]:
    return {result.name: result.mark for result in check_package(directory, 10)}


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
    assert found.pop("hashes") == "ok"
    assert found.pop("back ends") == "FAIL"
    assert list(found.values()) == [mark]


def test_a_package_that_cannot_be_imported_or_asked_fails(package: Path) -> None:
    change_file(package, "runtime/dynamics.py", "class Dynamics", "def broken(:\nclass Dynamics")
    assert marks(package) == {"hashes": "ok", "import": "FAIL"}
    change_file(package, "runtime/dynamics.py", "def broken(:\n", "")
    change_file(package, "runtime/dynamics.py", "def partial_torque", "def full_torque")
    assert marks(package)["answers"] == "FAIL"


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
        ("back ends", "skip"),
        ("formulas.txt: not checked", "skip"),
        ("formulas.tex: not checked", "skip"),
        ("numbers", "skip"),
    ]


def test_files_beyond_the_manifest_fail(package: Path) -> None:
    (package / "__pycache__").mkdir()
    (package / "__pycache__/names.pyc").write_bytes(b"")
    assert check_package(package, 5)[0].passed
    (package / "forms/more.py").write_text("")
    [result] = check_package(package)
    assert (result.mark, result.detail) == ("FAIL", "forms/more.py was added")


def test_a_manifest_that_lists_no_files_fails(package: Path) -> None:
    change_manifest(package, lambda data: data.update(files={}))
    assert check_package(package)[0].detail.startswith("the manifest lists no files; ")


def bodies(data: Any) -> Any:
    return data["tree"]["bodies"]


DAMAGES: dict[str, tuple[Callable[[Any], object], str]] = {
    **{
        key: (lambda data, key=key: data.pop(key), f"the whole is not an object with {key}")  # type: ignore[misc]
        for key in ("joints", "links", "tree", "request", "files")
    },
    "no joints": (lambda data: data.update(joints=[]), "there must be a joint and a link"),
    "joint": (lambda data: data["joints"].append(3), "joints[2] is not an object"),
    "path": (lambda data: data["links"][0].update(path=[7]), "the path of link 'link1' names a joint"),
    "path of words": (lambda data: data["links"][0].update(path="ab"), "links[0].path is not a list"),
    "request": (lambda data: data.update(request=3), "request is not an object"),
    "gravity": (lambda data: data["tree"].pop("gravity"), "tree is not an object with gravity"),
    "tree of words": (lambda data: data.update(tree="ab"), "tree is not an object"),
    "body": (lambda data: bodies(data).append(None), "tree.bodies[2] is not an object"),
    "mass": (lambda data: bodies(data)[0].update(mass="a"), "tree.bodies[0].mass is not a finite number"),
    "nan": (
        lambda data: bodies(data)[1].update(com=[float("nan"), 0, 0]),
        "tree.bodies[1].com[0] is not a finite number",
    ),
    "rotation": (
        lambda data: bodies(data)[1].update(rotation=[[1]]),
        "tree.bodies[1].rotation is not a list of 3",
    ),
    "coordinate": (lambda data: bodies(data)[1].update(coordinate=5), "body 1 of the tree hangs on no joint"),
    "kind": (lambda data: bodies(data)[1].update(kind=[]), "tree.bodies[1].kind is not 'revolute' or"),
    "parent": (
        lambda data: bodies(data)[1].update(parent=1),
        "the parent of body 1 of the tree is",
    ),
    "link": (lambda data: bodies(data)[1].update(link="hand"), "link 'link2' is not in the tree"),
}


@pytest.mark.parametrize("case", DAMAGES)
def test_a_damaged_manifest_is_named(case: str, package: Path) -> None:
    change, message = DAMAGES[case]
    change_manifest(package, change)
    with pytest.raises(LinkwiseError) as caught:
        check_package(package)
    assert str(caught.value).startswith(f"{package / 'manifest.json'} is damaged: {message}")
    assert str(caught.value).endswith("; generate the robot again")


def test_a_manifest_of_another_version_is_told_apart_from_a_damaged_one(package: Path) -> None:
    change_manifest(package, lambda data: data.update(schema=1))
    with pytest.raises(LinkwiseError, match=r"another version of linkwise \(schema 1, this one reads 2\)"):
        check_package(package)


def test_a_manifest_at_odds_with_its_package_is_refused(package: Path) -> None:
    change_manifest(package, lambda data: data["links"].pop())
    assert marks(package) == {"hashes": "ok", "import": "FAIL"}
    with pytest.raises(LinkwiseError, match=r"does not agree with its manifest.json: .* links"):
        open_package(package)
