"""Packages that `linkwise check` accepts and refuses, and what it leaves out."""

import hashlib
import importlib.util
import json
import os
import py_compile
import re
import shutil
import subprocess
import sys
from collections.abc import Callable
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import sympy as sp
from conftest import DATA, needs_compiler
from helpers.changed_code import change_code
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
from linkwise.check import compiled_c, subject, table
from linkwise.check.as_generated import check_made
from linkwise.check.compare import Entries, compare
from linkwise.check.parametric_tree import changed_values
from linkwise.package.load import load_package, open_package
from linkwise.package.manifest import LARGEST, Manifest, is_too_large
from linkwise.package.write import check_target
from linkwise_runtime.answers.packed import AskedMotion, ReachedMotion
from linkwise_runtime.dynamics import Dynamics
from linkwise_runtime.native.library import TIED
from linkwise_runtime.native.motions import NativeMotions
from linkwise_runtime.version import VERSION


@pytest.fixture(scope="module")
def planar2(tmp_path_factory: pytest.TempPathFactory) -> Path:
    directory = tmp_path_factory.mktemp("check") / "planar2"
    write_package(generate(read_system("planar2"), ["numpy"]), directory)
    return directory


Copy = Callable[..., Path]


@pytest.fixture(scope="module")
def passing(tmp_path_factory: pytest.TempPathFactory) -> Copy:
    """Packages of planar2 for some back ends, which pass; each is made once."""

    @cache
    def made(*backends: str) -> Path:
        directory = tmp_path_factory.mktemp("passing") / "planar2"
        write_package(generate(read_system("planar2"), backends), directory)
        assert set(marks(directory).values()) <= {"ok", "skip"}
        shutil.rmtree(directory / "__pycache__", ignore_errors=True)
        return directory

    return made


@pytest.fixture
def copy_for(passing: Copy, tmp_path: Path) -> Copy:
    """A package for these back ends to damage."""
    return lambda *backends: shutil.copytree(passing(*backends), tmp_path / "planar2")


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


def test_bodies_of_negative_mass_pass_where_they_were_allowed(tmp_path: Path) -> None:
    (tmp_path / "odd.toml").write_text(ODD.replace("mass = 1.2", "mass = -1.2"))
    system = read_system(str(tmp_path / "odd.toml"), Options(allow_unphysical=True))
    write_package(generate(system, ["numpy"], "odd"), tmp_path / "odd")
    found = marks(tmp_path / "odd")
    assert set(found.values()) <= {"ok", "skip"}
    assert found["numpy: total mass matrix positive definite"] == "skip"


PAIR = """schema = 1
name = "pair"
link = [
  { name = "arm", mass = 20, com = [0.3, 0.1, 0.2], inertia = { xx = 1, yy = 1.2, zz = 0.9 } },
  { name = "tip", mass = 1e-6, com = [1e-6, 0, 0], inertia = { xx = 1e-14, yy = 1.2e-14, zz = 1e-14 } },
]
joint = [
  { name = "shoulder", parent = "base", child = "arm", axis = [0, 1, 1] },
  { name = "wrist", parent = "arm", child = "tip", xyz = [0.5, 0, 0], axis = [1, 0, 0] },
]
"""


def test_a_parameter_that_is_zero_is_held_beside_a_tiny_link_too(tmp_path: Path) -> None:
    (tmp_path / "pair.toml").write_text(PAIR)
    system = read_system(str(tmp_path / "pair.toml"), Options("symbolic"))
    write_package(generate(system, ["numpy"], "pair"), tmp_path / "pair")
    assert set(marks(tmp_path / "pair").values()) == {"ok"}
    change_file(tmp_path / "pair", "forms/link_1.py", "= p['I_arm_yz']", "= -p['I_arm_yz']")
    assert marks(tmp_path / "pair")["numpy, other parameters: M^j against Newton-Euler recursion"] == "FAIL"


def test_a_length_that_is_zero_is_changed_as_those_beside_it(tmp_path: Path) -> None:
    wrist = 'xyz = ["L", 0, 0.002]'
    text = PAIR.replace("xyz = [0.5, 0, 0]", wrist).replace("link = [", "parameters = { L = 0 }\nlink = [", 1)
    (tmp_path / "pair.toml").write_text(text)
    system = read_system(str(tmp_path / "pair.toml"), Options("symbolic"))
    write_package(generate(system, ["numpy"], "pair"), tmp_path / "pair")
    manifest = Manifest.read(tmp_path / "pair")
    assert 0 < changed_values(manifest.parameters, manifest)["L"] <= 0.03 * 0.002


def test_formulas_in_steps_are_held_too(tmp_path: Path) -> None:
    write_package(generate(read_system("puma560"), ["formulas"]), tmp_path / "puma560")
    text = (tmp_path / "puma560/formulas.txt").read_text()
    assert re.search(r"^t1 = ", text, re.MULTILINE)
    assert "FAIL" not in marks(tmp_path / "puma560").values()


@pytest.mark.parametrize("parameters", ["symbolic", "nonzero"])
def test_names_that_no_formula_can_hold_are_read_back(parameters: Any, tmp_path: Path) -> None:
    (tmp_path / "odd.toml").write_text(ODD)
    system = read_system(str(tmp_path / "odd.toml"), Options(parameters))
    backends = ["numpy", "formulas"]
    write_package(generate(system, backends, "odd"), tmp_path / "odd")
    assert set(marks(tmp_path / "odd").values()) == {"ok"}


CONSTANTS = {
    "of their own name": sp.GoldenRatio * sp.erf(1) + sp.EulerGamma * sp.zeta(3) + sp.Catalan**2,
    "of functions": sp.sin(1) + sp.pi**2 + sp.E**2 + sp.sqrt(2) + sp.Rational(1, 3) ** sp.Rational(1, 3),
    "of many digits": sp.Rational(10**400, 10**399 + 1) + sp.Integer(10**20) / 10**19,
}


@pytest.mark.parametrize("case", CONSTANTS)
@pytest.mark.parametrize("symbolic", [False, True])
def test_constants_of_energies_are_read_back(case: str, symbolic: bool, tmp_path: Path) -> None:
    x, k = Coordinate("x", "m"), sp.Symbol("k")
    links = [LinkEnergy("a", k * x.qd**2, CONSTANTS[case] * sp.sin(x.q) + k * x.q * CONSTANTS[case])]
    system = energy_system("constant", [x], links, {k: 2.0}, symbolic)
    write_package(generate(system, ["numpy", "formulas"]), tmp_path / "constant")
    assert set(marks(tmp_path / "constant").values()) == {"ok"}


WORDS = ("lambda", "None", "True", "in", "tanh", "sign", "Abs", "sqrt", "pi", "e", "q1", "q_1", "tau11")
ALIKE = ("p_m_1", "m1", "m_1", "p_p_m_1")


def test_parameters_may_be_called_like_words_and_functions_of_formulas(tmp_path: Path) -> None:
    x = Coordinate("x", "m")
    values = {sp.Symbol(name): 0.3 + 0.05 * k for k, name in enumerate((*WORDS, *ALIKE))}
    terms = sum(symbol * sp.cos((k + 1) * x.q) for k, symbol in enumerate(values))
    slope = sp.tanh(sp.Symbol("tanh") * x.q) * sp.Symbol("lambda")
    links = [LinkEnergy("bead", x.qd**2 * sum(values), terms + slope)]
    package = tmp_path / "words"
    write_package(generate(energy_system("words", [x], links, values, True), ["numpy", "formulas"]), package)
    assert set(marks(package).values()) == {"ok"}
    latex = (package / "formulas.tex").read_text()
    assert r"p_{\mathrm{lambda}} is parameter 'lambda'." in latex
    assert r"p_{\mathrm{q1}} is parameter 'q1'." in latex
    assert r"p_{\mathrm{tau11}} is parameter 'tau11'." in latex


@pytest.mark.parametrize("name", ["tanh", "sign", "Abs", "sqrt"])
def test_a_mass_may_be_called_like_functions_of_formulas(name: str, tmp_path: Path) -> None:
    parameters = f"[parameters]\n{name} = 1.2\n[[link]]"
    text = ODD.replace("mass = 1.2", f'mass = "{name}"').replace("[[link]]", parameters)
    (tmp_path / "odd.toml").write_text(text)
    system = read_system(str(tmp_path / "odd.toml"), Options("symbolic"))
    write_package(generate(system, ["numpy", "formulas"], "odd"), tmp_path / "odd")
    assert set(marks(tmp_path / "odd").values()) == {"ok"}


def test_a_wrong_term_of_a_parameter_that_is_zero_fails(tmp_path: Path) -> None:
    (tmp_path / "odd.toml").write_text(ODD)
    system = read_system(str(tmp_path / "odd.toml"), Options("symbolic"))
    write_package(generate(system, ["numpy"], "odd"), tmp_path / "odd")
    first = "p_c_up___per_z * f1_c2_y", "p_c_up___per_z * q1", 1
    change_file(tmp_path / "odd", "forms/link_1.py", *first)
    failing = {name for name, mark in marks(tmp_path / "odd").items() if mark == "FAIL"}
    assert "numpy, other parameters: M^j against Newton-Euler recursion" in failing


def test_a_fault_in_one_derivation_shows_against_the_others(tmp_path: Path) -> None:
    write_package(generate(read_system("planar2"), ["numpy"]), tmp_path / "planar2")
    change_file(tmp_path / "planar2", "forms/link_2.py", "g_2,  # g(2, 2)", "g_1,  # g(2, 2)")
    details = {
        result.name: result.detail for result in check_package(tmp_path / "planar2", 10) if result.failed
    }
    assert details["derivations: closed forms (by the rigid rule) against rule"].endswith(" at g(2, 2)")


def test_a_result_given_twice_is_computed_once(tmp_path: Path) -> None:
    theta, x = Coordinate("theta"), Coordinate("x", "m")
    links = [LinkEnergy("cart", x.qd**2 + theta.qd**2, 0), LinkEnergy("spring", 0, 4.9 * sp.cos(theta.q))]
    write_package(generate(energy_system("two", [x, theta], links), ["numpy"]), tmp_path / "two")
    assert marks(tmp_path / "two")["manifest"] == "ok"


@pytest.fixture
def unread(monkeypatch: pytest.MonkeyPatch) -> None:
    """No text is read before it runs, as if what is wrong were written within the grammar."""
    monkeypatch.setattr("linkwise.check.as_generated.foreign", lambda directory, manifest: [])
    monkeypatch.setattr("linkwise.package.importer.foreign_text", lambda *text: None)
    monkeypatch.setattr("linkwise.package.load.foreign", lambda *listed: [])


@pytest.mark.usefixtures("unread")
def test_c_that_ends_the_process_fails(tmp_path: Path) -> None:
    package = tmp_path / "planar2"
    write_package(generate(read_system("planar2"), ["c"]), package)
    room = "    struct waiting room;\n"
    change_file(package, "c/planar2.c", room, room + "    *(volatile int *)0 = 0;\n")
    failing = {result.name: result.detail for result in check_package(package, 10) if result.failed}
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
    assert "numpy: c1 against energies differentiated" in found


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
    "gravity": ("forms/link_2.py", "g_2,  # g(2, 2)", "g_1,  # g(2, 2)", "numpy: g against"),
    "energy": (
        "energies/link_2.py",
        '"mass": 0.6,',
        '"mass": 0.6000001,',
        "autograd: Lagrangians against the energies",
    ),
    "axes out of the plane": (
        "energies/link_2.py",
        "(0.0, 0.0, 1.0),\n)",
        "(0.0, 1e-06, 1.0),\n)",
        "autograd: numbers of links as",
    ),
    "place out of the plane": (
        "energies/link_2.py",
        '"place": (0.25, 0.0, 0.0)',
        '"place": (0.25, 0.0, 1e-06)',
        "autograd: numbers of links as",
    ),
    "a moment that no torque tells": (
        "c/planar2_tree.h",
        "{R(0.0), R(0.005), R(0.005), ",
        "{R(1e-06), R(0.005), R(0.005), ",
        "c: numbers, indices",
    ),
    "sign before a number": (
        "c/planar2_tree.h",
        "{R(0.0), R(0.005), R(0.005), ",
        "{R(0.0), -R(0.005), R(0.005), ",
        "c: numbers, indices",
    ),
    "place of no joint": (
        "energies/link_2.py",
        'places = {1: "place"}',
        "places = {}",
        "autograd: numbers of links as",
    ),
    "text": ("formulas.txt", "588399*cos(q_1 + q_2)", "588399*cos(q_1 - q_2)", "formulas.txt: tau_ij"),
    "latex": ("formulas.tex", r"\frac{23 \ddot{q}_{2}}", r"\frac{23 \dot{q}_{2}}", "formulas.tex: tau_ij"),
    "last samples of a batch": (
        "c/planar2.c",
        "put_rows(samples, C1, large, r[t].c1",
        "put_rows(samples - (samples < BLOCK), C1, large, r[t].c1",
        "c: planar2_d",
    ),
    "large batches": (
        "c/planar2.c",
        "put_rows(samples, G, large, r[t].g, g + at",
        "put_rows(samples, G, large, r[t].g, g + 0 * at",
        "c: planar2_d",
    ),
    "large batches with their zeros": (
        "c/planar2.c",
        "s + t * BLOCK, samples_of(count - s, t), &wait, to)",
        "s + 0 * BLOCK, samples_of(count - s, t), &wait, to)",
        "c: planar2_coefficients",
    ),
    "one link alone": (
        "c/planar2.c",
        "m.sine, m.cosine, c2, c1",
        "m.cosine, m.cosine, c2, c1",
        "c: planar2_link_2f",
    ),
    "beyond the arrays": (
        "c/planar2.c",
        "scatter(samples, 3, G, r[t].tau",
        "scatter(8, 3, G, r[t].tau",
        "c: planar2_torque",
    ),
    "index": ("c/planar2_index.h", "{2, 2, 2}", "{2, 2, 1}", "c: numbers, indices"),
}


@needs_compiler
@pytest.mark.parametrize("case", ["stops short", "is wrong"])
def test_a_simulation_in_c_that_stops_short_or_is_wrong_fails(
    case: str, passing: Copy, monkeypatch: pytest.MonkeyPatch
) -> None:
    package, whole = passing("native"), NativeMotions.moved

    def moved(self: NativeMotions, asked: AskedMotion) -> ReachedMotion:
        found = whole(self, asked)
        assert found is not None
        if case == "is wrong":
            return found._replace(work=found.work * (1.0 + 1e-6))
        return ReachedMotion(*(a[:2] for a in found))

    monkeypatch.setattr(NativeMotions, "moved", moved)
    (failed,) = (result for result in check_package(package, 3) if result.failed)
    assert failed.name == "native: a simulated motion against Newton-Euler recursion"
    assert (failed.detail == "C stops at instant 2 of 3") == (case == "stops short")


FRAME = {
    "a continued formula": ("formulas.txt", "\ntau_2_2 =", "\n    + 5*q_2\ntau_2_2 =", 13),
    "a joint exchanged": ("formulas.txt", "q_1 is joint 'joint1'", "q_1 is joint 'joint2'", 4),
    "qd and qdd exchanged": ("formulas.txt", "qd_1 and qdd_1", "qdd_1 and qd_1", 4),
    "a wrong link": ("formulas.txt", "Link 2 is 'link2'", "Link 2 is 'link1'", 7),
    "something behind": ("formulas.txt", "/800000\n", "/800000\n*0", 10),
    "a line's other end": ("formulas.txt", "in N m (N)", "in N m\r(N)", 1),
    "a further display": ("formulas.tex", "\n\\[ \\tau_{12}", "\n\\[ + 5 q_{2} \\]\n\\[ \\tau_{12}", 8),
    "a joint exchanged in latex": ("formulas.tex", "q_1 is joint 'joint1'", "q_1 is joint 'joint2'", 3),
    "a line too few": ("formulas.tex", "% Link 2 is 'link2'.\n", "", 6),
}


@pytest.mark.parametrize("case", FRAME)
def test_every_line_beside_the_formulas_is_read(case: str, copy_for: Copy) -> None:
    file, old, new, line = FRAME[case]
    package = copy_for("numpy", "formulas")
    change_file(package, file, old, new)
    wrong = [(result.name, result.detail) for result in check_package(package, 3) if result.failed]
    assert wrong == [(f"{file}: lines", f"line {line} is not what linkwise writes there")]


def test_lines_of_another_versions_formulas_are_not_compared(
    passing: Copy, monkeypatch: pytest.MonkeyPatch
) -> None:
    package = passing("numpy", "formulas")
    monkeypatch.setattr("linkwise.check.formula_texts.VERSION", "0.0.1")
    found = {result.name: result for result in check_package(package, 3)}
    for name in ("formulas.txt: lines", "formulas.tex: lines"):
        assert found[name].mark == "skip"
        assert "which is not at hand to compare with" in found[name].detail


def test_formulas_of_ten_links_are_told_apart(tmp_path: Path) -> None:
    x, y = Coordinate("x", "m"), Coordinate("y", "m")
    links = [LinkEnergy(f"{k}", k * (x.qd**2 + y.qd**2), 0) for k in range(1, 12)]
    write_package(generate(energy_system("ten", [x, y], links), ["formulas"]), tmp_path / "ten")
    assert "FAIL" not in marks(tmp_path / "ten").values()


FOR = {"forms": ["numpy"], "energies": ["autograd"], "c": ["c"], "formulas": ["numpy", "formulas"]}
"""The back ends whose package has these files."""


@pytest.mark.parametrize("case", WRONG)
def test_one_wrong_formula_in_any_file_fails(case: str, copy_for: Copy) -> None:
    file, old, new, failing = WRONG[case]
    package = copy_for(*FOR[re.split(r"[/.]", file)[0]])
    change_file(package, file, old, new)
    assert [name for name, mark in marks(package).items() if mark == "FAIL" and name.startswith(failing)]


@needs_compiler
def test_what_controllers_answer_is_measured_by_magnitudes(
    passing: Copy, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Measured by less than nothing, every answer would pass."""

    def measured(*given: Any) -> Entries:
        entries = Entries(*given)
        assert (entries.scale >= 0).all(), entries.what
        return entries

    monkeypatch.setattr("linkwise.check.control_functions.Entries", measured)
    assert set(marks(passing("c")).values()) <= {"ok", "skip"}


@needs_compiler
def test_what_runs_c_that_is_wrong_is_not_called(tmp_path: Path) -> None:
    package = tmp_path / "planar2"
    write_package(generate(read_system("planar2"), ["native"]), package)
    file, old, new, _ = WRONG["one link alone"]
    change_file(package, file, old, new)
    found = marks(package)
    assert (found["c: planar2_link_2"], found["native: not called"]) == ("FAIL", "skip")


@pytest.mark.usefixtures("unread")
def test_c_that_does_not_compile_fails_with_the_compilers_words(copy_for: Copy) -> None:
    package = copy_for("c")
    change_file(package, "c/planar2.c", "struct block x[TILE];", "struct brick x[TILE];")
    (result,) = (result for result in check_package(package, 3) if result.name == "c: compiles")
    assert result.failed
    assert "failed: " in result.detail
    assert "error: " in result.detail


def test_a_length_that_belongs_to_another_joint_fails_though_both_are_alike(tmp_path: Path) -> None:
    write_package(generate(read_system("planar3"), ["autograd"]), tmp_path / "arm")
    change_file(tmp_path / "arm", "energies/link_2.py", 'places = {1: "place"}', 'places = {2: "place"}')
    failing = {name for name, mark in marks(tmp_path / "arm").items() if mark == "FAIL"}
    told = (
        "numbers of links as the manifest has them",
        "other numbers of links against Newton-Euler recursion",
    )
    assert failing == {f"autograd: {name}" for name in told}


@needs_compiler
@pytest.mark.usefixtures("unread")
@pytest.mark.parametrize(
    ("old", "new", "fault"),
    [
        ("void planar2_torque(", "void planar2_torque (", "planar2_torque is declared otherwise"),
        ("const double *q, const double *qd,", "const double *qd, const double *q,", "is declared otherwise"),
        (
            "double *tau);",
            "double *tau); void planar2_power(void);",
            "planar2_power is declared, and there is",
        ),
        ("void planar2_link_2f(", "void link_2f(", "planar2_link_2f is not declared"),
        ('"joint1",', '"joint7",', "the names of the joints are wrong"),
        (
            "planar2_lower_limit[PLANAR2_JOINTS] = {-",
            "planar2_lower_limit[PLANAR2_JOINTS] = {",
            "the lower limits",
        ),
        (
            "planar2_upper_limit[PLANAR2_JOINTS] = {H",
            "planar2_upper_limit[PLANAR2_JOINTS] = {-H",
            "the upper limits",
        ),
        (
            "velocity_limit[PLANAR2_JOINTS] = {HUGE_VAL",
            "velocity_limit[PLANAR2_JOINTS] = {1.0",
            "the velocity limits",
        ),
        (
            "effort_limit[PLANAR2_JOINTS] = {HUGE_VAL,",
            "effort_limit[PLANAR2_JOINTS] = {",
            "the effort limits",
        ),
        ("float arm[3];", "float arm[2];", "the type planar2_contactf is not"),
        ("size_t *reached;", "long *reached;", "the type planar2_simulation is not"),
    ],
)
def test_a_header_that_says_something_else_fails(old: str, new: str, fault: str, copy_for: Copy) -> None:
    package = copy_for("c")
    change_file(package, "c/planar2.h", old, new)
    found = {result.name: result for result in check_package(package, 3)}
    headers = found["c: numbers, indices, types and functions of the headers"]
    assert headers.failed
    assert fault in headers.detail


@needs_compiler
@pytest.mark.parametrize("new", ["{2,2,2}, {2, 2, 2}", "{2, 2, 02}", "{2, 2, 2, 2}", "{2, 2}", ""])
def test_a_table_of_indices_has_these_rows_and_nothing_else(new: str, copy_for: Copy) -> None:
    package = copy_for("c")
    change_file(package, "c/planar2_index.h", "{2, 2, 2}", new)
    found = {result.name: result for result in check_package(package, 3)}
    assert (
        found["c: numbers, indices, types and functions of the headers"].detail
        == "the indices of c2 are wrong"
    )


@needs_compiler
def test_all_that_a_package_has_is_held(passing: Copy) -> None:
    package = passing("numpy", "c")
    found = marks(package)
    assert set(found.values()) == {"ok"}
    headers = "".join(path.read_text() for path in (package / "c").glob("planar2*.h"))
    functions = set(re.findall(r"^\w+ (planar2_\w+)\(", headers, re.MULTILINE))
    called = {name.removeprefix("c: ") for name in found if name.startswith("c: planar2_")}
    not_called = {"frame_partial_impedance", *(name for name in TIED if not name.endswith("_of_links"))}
    assert functions - called == {f"planar2_{name}{real}" for name in not_called for real in ("", "f")}
    for what in ("M^j", "c1", "g", "tau_ij", "c0", "regressors", "poses of frames", "a simulated motion"):
        assert f"numpy: {what} against Newton-Euler recursion" in found
    for what in ("sums over the links", "passive torques of the joints", "regressors in single precision"):
        assert {f"numpy: {what}", f"numpy by rule: {what}"} <= set(found)


@needs_compiler
def test_want_of_memory_speaks_neither_for_a_package_nor_against_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(*_: Any) -> Any:
        yield from ()
        raise RuntimeError("DefaultCPUAllocator: can't allocate memory")

    def unmapped(*_: Any) -> Any:
        raise OSError("checked.so: failed to map segment from shared object")

    write_package(generate(read_system("planar1"), ["numpy", "c"]), tmp_path / "arm")
    monkeypatch.setattr(table, "frame_calls", full)
    monkeypatch.setattr(compiled_c.ctypes, "CDLL", unmapped)
    found = {result.name: result.mark for result in check_package(tmp_path / "arm", 3)}
    assert (found["numpy: frames"], found["c: not checked"]) == ("skip", "skip")
    assert "FAIL" not in found.values()


@needs_compiler
def test_c_that_does_not_end_fails(copy_for: Copy, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(subject, "LEAST_SECONDS", 1)
    monkeypatch.setattr(subject, "TIMES", 0)
    package = copy_for("c")
    change_file(package, "c/link_1.h", "        /* Inputs. */\n", "        for (;;) { }\n", 1)
    (wrong,) = (result for result in check_package(package, 3) if result.failed)
    assert (wrong.name, wrong.detail) == ("c: runs to its end", "it took more than 1 s")


def test_an_error_that_quotes_such_words_from_a_package_is_its_fault(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refused(*_: Any) -> Any:
        yield from ()
        raise ValueError("joint 'allocate memory' does not close")

    write_package(generate(read_system("planar1"), ["numpy"]), tmp_path / "arm")
    monkeypatch.setattr(table, "frame_calls", refused)
    found = {result.name: result.mark for result in check_package(tmp_path / "arm", 3)}
    assert found["numpy: frames"] == "FAIL"


def test_where_nothing_is_compared_nothing_is_held() -> None:
    assert compare("nothing", []).mark == "skip"
    assert compare("no numbers", [Entries("c0", np.zeros((3, 0)), np.zeros((3, 0)), 1.0)]).mark == "ok"


@needs_compiler
def test_a_c_function_is_called_whether_or_not_its_header_declares_it(copy_for: Copy) -> None:
    package = copy_for("c")
    text = (package / "c/planar2.h").read_text()
    for prototype in re.findall(r"void planar2_link_2f?\([^;]*;", text):
        change_file(package, "c/planar2.h", prototype, "")
    results = {result.name: result.held for result in check_package(package, 3)}
    assert results["c: planar2_link_2"]
    change_file(package, "c/planar2.c", "void API(link_2)(", "static void API(link_2)(")
    (wrong,) = (r for r in check_package(package, 3) if r.name == "c: planar2_link_2")
    assert (wrong.held, wrong.detail) == (False, "there is no such function")


@pytest.mark.usefixtures("unread")
@pytest.mark.parametrize(
    ("error", "mark"),
    [
        ('RuntimeError("gcc failed: error: expected install")', "FAIL"),
        ('OSError("no space")', "FAIL"),
        ('ValueError("strange")', "FAIL"),
        ('ImportError("gone", name=__package__ + ".forms")', "FAIL"),
        ('RuntimeError("needs a C compiler: apt install gcc")', "skip"),
        ('RuntimeError("cannot make the cache /x: No space left; set LINKWISE_CACHE to another")', "skip"),
        ('ImportError("No module named torch", name="torch.func")', "skip"),
        ('ImportError("No module named torchh", name="torchh")', "FAIL"),
        ('ImportError("cannot import Anyy", name="typing")', "FAIL"),
        ("SystemExit(0)", "FAIL"),
    ],
)
def test_only_what_is_missing_here_is_left_out(
    error: str, mark: str, package: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("linkwise.check.answers.find_spec", lambda name: None)
    change_file(package, "forms/__init__.py", "from .", f"raise {error}\nfrom .", 1)
    found = marks(package)
    assert {found.pop(name) for name in ("hashes", "texts", "manifest", "made")} == {"ok"}
    assert found.pop("back ends") == "FAIL"
    assert list(found.values()) == [mark]


@pytest.mark.usefixtures("unread")
def test_a_package_that_cannot_be_imported_or_asked_fails(
    package: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    change_file(package, "names.py", "ROBOT = ", "def broken(:\nROBOT = ")
    assert marks(package) == {"hashes": "ok", "texts": "ok", "import": "FAIL"}
    change_file(package, "names.py", "def broken(:\n", "")
    monkeypatch.delattr(Dynamics, "partial_torque")
    assert marks(package)["numpy: coefficients and torques"] == "FAIL"


@pytest.mark.usefixtures("unread")
def test_a_library_that_is_here_is_not_called_missing(package: Path) -> None:
    pytest.importorskip("torch")
    change_file(package, "forms/link_1.py", "from collections", "from torch import Tensorr\nfrom collections")
    assert marks(package)["numpy: loads"] == "FAIL"


@pytest.mark.usefixtures("unread")
@pytest.mark.parametrize(
    ("file", "old", "failing"),
    [
        ("names.py", "ROBOT = ", "import"),
        ("forms/link_1.py", "def decomposition(", "numpy: loads"),
        ("forms/link_1.py", "    return ", "numpy: coefficients and torques"),
    ],
)
def test_a_package_that_ends_the_process_fails(file: str, old: str, failing: str, package: Path) -> None:
    indent = old[: len(old) - len(old.lstrip())]
    change_file(package, file, old, f"{indent}raise SystemExit(0)\n{old}", 1)
    found = {result.name: result.detail for result in check_package(package, 3) if result.failed}
    assert found[failing] == "LinkwiseError: its code would end this process by SystemExit(0)"
    if failing == "import":
        with pytest.raises(LinkwiseError, match=r"cannot be imported .*SystemExit\(0\)"):
            open_package(package)


@pytest.mark.usefixtures("unread")
def test_a_package_that_cannot_be_imported_says_why_and_leaves_no_trace(package: Path) -> None:
    finders = list(sys.meta_path)
    change_file(package, "names.py", "ROBOT =", "1 / 0\nROBOT =", 1)
    for _ in range(2):
        with pytest.raises(LinkwiseError, match=r"cannot be imported \(ZeroDivisionError: division by"):
            open_package(package)
    assert sys.meta_path == finders


def test_closed_forms_are_held_against_the_energies_that_a_user_wrote(tmp_path: Path) -> None:
    package = tmp_path / "turntable"
    write_package(generate(read_system(str(DATA / "turntable.py")), ["numpy"]), package)
    assert set(marks(package).values()) == {"ok"}
    change_file(package, "forms/link_1.py", "0.5 * (qd1 * t2)", "0.500001 * (qd1 * t2)")
    failing = {name for name, mark in marks(package).items() if mark == "FAIL"}
    assert "numpy: c1 against energies differentiated" in failing


def test_an_energy_that_is_not_the_one_that_a_user_wrote_fails(tmp_path: Path) -> None:
    package = tmp_path / "turntable"
    write_package(generate(read_system(str(DATA / "turntable.py")), ["numpy"]), package)
    change_file(package, "forms/link_1.py", "0.2 * (qd1 * qd1) + 0.5", "0.200001 * (qd1 * qd1) + 0.5")
    failing = [name for name, mark in marks(package).items() if mark == "FAIL"]
    assert failing == [
        "numpy: energies of the links",
        "numpy: a simulated motion against energies differentiated",
    ]


def test_power_that_comes_from_elsewhere_than_joints_is_held_against_the_energies(tmp_path: Path) -> None:
    package, hoop = tmp_path / "hoop", DATA.parents[1] / "examples" / "energies" / "bead_on_hoop.py"
    write_package(generate(read_system(str(hoop)), ["numpy"]), package)
    assert set(marks(package).values()) == {"ok"}
    change_file(package, "forms/link_1.py", "-(qd1 * (0.002 * qd1)", "-(qd1 * (0.002001 * qd1)")
    failing = [name for name, mark in marks(package).items() if mark == "FAIL"]
    assert failing == ["numpy: a simulated motion against energies differentiated"]


def test_a_lagrangian_that_is_not_the_one_that_a_user_wrote_fails(tmp_path: Path) -> None:
    package = tmp_path / "turntable"
    write_package(generate(read_system(str(DATA / "turntable.py")), ["autograd"]), package)
    assert set(marks(package).values()) == {"ok"}
    change_file(package, "energies/link_1.py", "(0.68 * q2)", "(0.680001 * q2)")
    failing = {name for name, mark in marks(package).items() if mark == "FAIL"}
    assert {
        "autograd: Lagrangians against the energies",
        "autograd: h1 against energies differentiated",
    } <= failing


@pytest.mark.usefixtures("unread")
@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("_times(slope, 0.5)", "_times(slope, 0.4)"),
        ("self._at(self.inertia, k), self._qdd[k]) if m != 1", "0.0, 0.0) if m != 1"),
    ],
    ids=["a wrong factor", "a part left out"],
)
def test_graphs_of_parts_are_run_against_the_recursion(
    old: str, new: str, passing: Copy, monkeypatch: pytest.MonkeyPatch
) -> None:
    package = passing("autograd")
    change_code(monkeypatch, import_module("linkwise_runtime.lagrangians.recorded_torques"), old, new)
    failing = {name for name, mark in marks(package).items() if mark == "FAIL"}
    assert failing == {"autograd: graphs of parts of tau_ij against Newton-Euler recursion"}


def test_without_torch_a_users_energies_are_held_against_their_own_torques_which_is_said(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("linkwise.check.subject.find_spec", lambda name: None)
    package = tmp_path / "cart_pendulum"
    write_package(generate(read_system(str(DATA / "cart_pendulum.py")), ["numpy"]), package)
    found = marks(package)
    assert (
        found["energies: not held against their text"],
        found["numpy: c1 against differences of numpy's torques"],
    ) == ("skip", "ok")
    change_file(package, "forms/link_2.py", "-0.5 * (t9 + t14)", "-0.501 * (t9 + t14)")
    assert marks(package)["numpy: c1 against differences of numpy's torques"] == "FAIL"


def test_without_torch_what_is_not_quadratic_in_the_velocities_is_held_against_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Differences cannot tell a magnet's share from c1."""
    monkeypatch.setattr("linkwise.check.subject.find_spec", lambda name: None)
    write_package(generate(read_system(str(DATA / "turntable.py")), ["numpy"]), tmp_path / "turntable")
    found = marks(tmp_path / "turntable")
    assert found["energies: not held against their text"] == "skip"
    assert not any("against" in name and "text" not in name for name in found)


@pytest.fixture(scope="module")
def of_parameters(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A package all of whose numbers are run-time parameters."""
    directory = tmp_path_factory.mktemp("parameters") / "odd"
    (directory.parent / "odd.toml").write_text(ODD)
    write_package(
        generate(read_system(str(directory.parent / "odd.toml"), Options("symbolic")), ["numpy"]), directory
    )
    assert set(marks(directory).values()) == {"ok"}
    shutil.rmtree(directory / "__pycache__", ignore_errors=True)
    return directory


@pytest.fixture(scope="module")
def loaded_with_parameters(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a package with run-time parameters on three back ends."""
    directory = tmp_path_factory.mktemp("loaded") / "odd"
    (directory.parent / "odd.toml").write_text(ODD)
    system = read_system(str(directory.parent / "odd.toml"), Options("symbolic"))
    write_package(generate(system, ["numpy", "torch", "autograd"]), directory)
    return directory


@pytest.mark.parametrize(
    ("file", "old", "new", "failing"),
    [
        (
            "forms/link_1.py",
            "p_m_up___per = p['m_up $<per']",
            "p_m_up___per = 1.2",
            "numpy, other parameters: g against Newton-Euler recursion",
        ),
        (
            "names.py",
            "p['I_up $<per_yy']",
            "p['I_up $<per_zz']",
            "parameters, other parameters: bodies that load looks at",
        ),
        ("names.py", "('m_up $<per', ", "(", "parameters: bodies that load looks at"),
        (
            "tree.py",
            "p['m_up $<per']",
            "0.0 * p['m_up $<per'] + 1.2",
            "numpy by rule, other parameters: g against Newton-Euler recursion",
        ),
    ],
)
def test_what_is_right_for_the_parameters_own_values_alone_fails(
    file: str, old: str, new: str, failing: str, of_parameters: Path, tmp_path: Path
) -> None:
    package = shutil.copytree(of_parameters, tmp_path / "odd")
    change_file(package, file, old, new)
    assert marks(package)[failing] == "FAIL"


@pytest.fixture
def standing_alone(tmp_path: Path) -> Path:
    """A package that carries its runtime."""
    package = tmp_path / "planar2"
    write_package(generate(read_system("planar2"), ["numpy"], vendor_runtime=True), package)
    assert not any(result.failed for result in check_package(package, 3))
    return package


def test_a_runtime_file_that_is_not_linkwises_own_fails(standing_alone: Path) -> None:
    change_file(standing_alone, "linkwise_runtime/arguments.py", "import ", "import  ", 1)
    wrong = [result for result in check_package(standing_alone, 3) if result.failed]
    assert [(result.name, result.detail.split(" is ")[0]) for result in wrong] == [
        ("texts", "linkwise_runtime/arguments.py")
    ]


def test_a_file_of_the_runtime_that_a_package_needs_and_has_not_fails(standing_alone: Path) -> None:
    (standing_alone / "linkwise_runtime/robot_axes.py").unlink()
    change_manifest(standing_alone, lambda data: data["files"].pop("linkwise_runtime/robot_axes.py"))
    (wrong,) = (result for result in check_package(standing_alone, 3) if result.failed)
    assert (wrong.name, wrong.detail) == ("made", "linkwise_runtime/robot_axes.py is missing")


@pytest.mark.parametrize("file", ["c/extra.h", "c/linkwise/extra.h"])
def test_a_header_that_nothing_includes_fails(file: str, tmp_path: Path) -> None:
    package = tmp_path / "planar2"
    write_package(generate(read_system("planar2"), ["c"]), package)
    (package / file).write_text("static int x;\n")
    digest = hashlib.sha256((package / file).read_bytes()).hexdigest()
    change_manifest(package, lambda data: data["files"].update({file: digest}))
    (wrong,) = (result for result in check_package(package, 3) if result.failed)
    assert (wrong.name, wrong.detail) == ("made", f"{file} is needed by nothing")


def test_a_listed_file_of_the_runtime_that_linkwise_does_not_have_fails(standing_alone: Path) -> None:
    file, package = "linkwise_runtime/deep/helper.py", standing_alone
    (package / file).parent.mkdir()
    (package / file).touch()
    digest = hashlib.sha256(b"").hexdigest()
    change_manifest(package, lambda data: data["files"].update({file: digest}))
    (wrong,) = (result for result in check_package(package, 3) if result.failed)
    assert (wrong.name, wrong.detail.split(" is ")[0]) == ("texts", file)


@pytest.mark.usefixtures("unread")
@pytest.mark.parametrize(
    ("file", "old", "new"),
    [
        ("__init__.py", '"autograd": _autograd', '"autograd": _torch'),
        ("__init__.py", '    "numpy",\n    "torch",\n', '    "torch",\n    "numpy",\n'),
        ("__init__.py", "joint_names = ROBOT.joint_names", "joint_names = ROBOT.link_names"),
        ("__init__.py", "asked, check_finite)", "asked, False)"),
        ("__init__.py", "asked = backend,", "asked = 'torch',"),
        ("__init__.py", "(parameters, allow_unphysical)", "(parameters, True)"),
        ("__init__.py", "m_LINK is a mass", 'm_LINK is"""\n    allow_unphysical = True\n    """'),
        (
            "names.py",
            "from linkwise_runtime.structure import",
            "from linkwise_runtime.arguments import *; from linkwise_runtime.structure import",
        ),
        ("names.py", "            lambda p: (", "            lambda p: 1 and ("),
        ("tree.py", "lambda xp, p: ", "lambda xp, p: 1.0 * "),
        ("tree.py", "RULE = RigidRule(TREE)", "RULE = RigidRule(TREE) or None"),
    ],
)
def test_a_package_that_is_loaded_otherwise_fails(
    file: str, old: str, new: str, loaded_with_parameters: Path, tmp_path: Path
) -> None:
    package = shutil.copytree(loaded_with_parameters, tmp_path / "odd")
    change_file(package, file, old, new, 1)
    result = check_made(load_package(package, Manifest.read(package)))
    assert result.failed
    assert f"{file} is not what linkwise {VERSION} makes of the manifest" in result.detail


def test_of_another_version_it_is_said_what_was_not_checked(package: Path) -> None:
    change_file(package, "__init__.py", f"linkwise {VERSION}", "linkwise 0.0.9")
    change_manifest(package, lambda data: data["generator"].update(linkwise="0.0.9"))
    data = json.loads((package / "manifest.json").read_text())
    text = json.dumps(data["generator"], sort_keys=True)
    digest = hashlib.sha256(text.encode()).hexdigest()
    change_manifest(package, lambda data: data["checksums"].update(generator=digest))
    (made,) = (result for result in check_package(package, 3) if result.name == "made")
    assert made.mark == "skip"
    assert made.detail.startswith(
        "__init__.py, names.py, tree.py and what it carries of the runtime were not"
    )


def test_energies_that_are_defined_for_some_positions_only_are_checked_there(tmp_path: Path) -> None:
    x = Coordinate("x", "m")
    for name, potential in (
        ("near", sp.sqrt(x.q)),
        ("far", sp.log(x.q - 4)),
        ("nowhere", sp.sqrt(-1 - x.q**2)),
    ):
        system = energy_system(name, [x], [LinkEnergy("bead", x.qd**2, potential)])
        write_package(generate(system, ["numpy"]), tmp_path / name)
    for name in ("near", "far"):
        found = {result.name: result for result in check_package(tmp_path / name, 10)}
        assert {result.mark for result in found.values()} == {"ok"}
        assert found["energies: are defined"].detail.startswith(
            "numbers at 14 of " if name == "far" else "numbers at "
        )
    wrong = {result.name: result.detail for result in check_package(tmp_path / "nowhere") if result.failed}
    assert wrong == {"energies: are defined": "numbers at 0 of 4108 random states: too few to prove anything"}


@pytest.mark.parametrize("spec", ["planar2", "planar8", str(DATA / "cart_pendulum.py")])
def test_c_alone_is_compiled_and_held_against_what_there_is(spec: str, tmp_path: Path) -> None:
    write_package(generate(read_system(spec), ["c"], "robot_c"), tmp_path / "robot_c")
    results = check_package(tmp_path / "robot_c", 10)
    assert not any(result.failed for result in results)
    assert {"c: robot_c_decomposition_blocksf", "c: robot_c_link_1"} <= {result.name for result in results}


@pytest.mark.usefixtures("unread")
def test_off_the_path_not_even_rounding_passes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    package = tmp_path / "cart"
    write_package(generate(read_system(str(DATA / "cart_pendulum.py")), ["numpy"]), package)
    assert marks(package)["numpy: tau_ij = 0 off the path"] == "ok"
    zeros = "np.zeros((*batch, values.shape[-1] + 1), values.dtype)"
    tables = import_module("linkwise_runtime.answers.packed")
    change_code(monkeypatch, tables, zeros, f"{zeros} + 1e-18")
    assert marks(package)["numpy: tau_ij = 0 off the path"] == "FAIL"


def test_numbers_too_large_for_single_precision_are_told(tmp_path: Path) -> None:
    x = Coordinate("x", "m")
    system = energy_system("heavy", [x], [LinkEnergy("star", 1e20 * x.qd**2, 0)])
    write_package(generate(system, ["numpy"]), tmp_path / "heavy")
    found = marks(tmp_path / "heavy")
    skipped = {name for name, mark in found.items() if mark == "skip"}
    assert skipped == {
        "numpy: single precision",
        "numpy: sums in single precision",
        "numpy: Christoffel symbols in single precision",
        "numpy: induced accelerations in single precision",
    }
    assert set(found.values()) == {"ok", "skip"}


def test_energies_are_held_where_numbers_can_be_computed_with(tmp_path: Path) -> None:
    """Masses of 1e-200 and 1e200 have inverses, and squares, that are no numbers any more."""
    x, y = Coordinate("x", "m"), Coordinate("y", "m")
    kinetic = sp.exp(1000 * x.q) * x.qd**2 / 2 + y.qd**2
    system = energy_system("steep", [x, y], [LinkEnergy("it", kinetic, sp.exp(sp.exp(sp.exp(x.q))))])
    write_package(generate(system, ["numpy"]), tmp_path / "steep")
    found = marks(tmp_path / "steep")
    assert "FAIL" not in found.values()
    assert found["numpy: induced accelerations in single precision"] == "ok"


def test_formulas_alone_are_held_against_the_energies(tmp_path: Path) -> None:
    write_package(generate(read_system(str(DATA / "cart_pendulum.py")), ["formulas"]), tmp_path / "cart")
    assert [(r.name, r.mark) for r in check_package(tmp_path / "cart")] == [
        ("hashes", "ok"),
        ("texts", "ok"),
        ("manifest", "ok"),
        ("made", "ok"),
        ("back ends", "skip"),
        ("formulas.txt: lines", "ok"),
        ("formulas.txt: tau_ij against energies differentiated", "ok"),
        ("formulas.tex: lines", "ok"),
        ("formulas.tex: tau_ij against energies differentiated", "ok"),
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


def test_a_file_that_is_larger_than_any_of_a_package_is_not_read(package: Path) -> None:
    """Nor hashed to its end."""
    run_in(package)
    for path in ("names.py", Path(importlib.util.cache_from_source("tree.py"))):
        os.truncate(package / path, 1 << 34)
    has = "has 17,179,869,184 bytes, and no file of a package has more than 268,435,456"
    with pytest.raises(LinkwiseError) as caught:
        open_package(package)
    assert str(caught.value) == f"{package}: names.py {has}; generate the robot again"
    [result] = check_package(package)
    caches = [f"__pycache__/{name}.{sys.implementation.cache_tag}.pyc" for name in ("names", "tree")]
    names, tree = (
        f"{cache} is not {Path(cache).name.split('.')[0]}.py compiled, delete it" for cache in caches
    )
    assert result.detail == f"names.py {has}; {names}; {tree}"


def test_a_file_may_be_as_large_as_the_largest(tmp_path: Path) -> None:
    for more, found in ((0, False), (1, True)):
        (tmp_path / "file").touch()
        os.truncate(tmp_path / "file", LARGEST + more)
        assert is_too_large(tmp_path / "file") == found


def test_a_manifest_that_is_larger_than_any_is_not_read_in_search_of_a_package(tmp_path: Path) -> None:
    (tmp_path / "manifest.json").touch()
    os.truncate(tmp_path / "manifest.json", 1 << 40)
    check_target(tmp_path / "planar2", "planar2")


def test_a_pipe_among_what_python_caches_is_not_waited_for(package: Path) -> None:
    (package / "__pycache__").mkdir()
    os.mkfifo(package / importlib.util.cache_from_source("names.py"))
    assert "is not names.py compiled" in check_package(package)[0].detail


def test_files_behind_a_linked_folder_fail(package: Path) -> None:
    link_to(package / "forms")
    assert "forms/link_1.py is behind the symbolic link forms" in check_package(package)[0].detail


def test_a_linked_package_passes(package: Path, tmp_path: Path) -> None:
    (tmp_path / "link").symlink_to(package)
    assert set(marks(tmp_path / "link").values()) == {"ok"}


STATE = np.array([[0.1, 0.2], [0.0, 0.0], [0.0, 0.0]])


def run_in(package: Path, *options: str) -> str:
    """Return what a user's Python says that imports the package and calls it, caching what it compiles."""
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
    source.write_text(text.replace(" = 0.", " = 1.", 1).replace("cos1 = xp.cos(q1)", "cos1 = xp.sin(q1)"))
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
    for version in ("27", "38", "33", "39"):
        plant(package, f"names.cpython-{version}.pyc")
    told = next(result for result in check_package(package, 3) if result.name == "__pycache__")
    assert told.mark == "skip"
    assert re.findall(r"cpython-[0-9]+", told.detail) == [f"cpython-{v}" for v in ("27", "33", "38", "39")]
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
    change_manifest(package, lambda data: data["links"][0].update(operations=1))
    assert marks(package) == {"hashes": "ok", "texts": "ok", "manifest": "FAIL"}
    with pytest.raises(LinkwiseError, match=r"the entry links of manifest.json was changed"):
        open_package(package)
