"""Sources that `linkwise check` holds packages against: recursion, magnitudes, differences, readers of
formulas."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
import sympy as sp
from conftest import DATA, needs_compiler
from linkwise import (
    Coordinate,
    LinkEnergy,
    Options,
    energy_system,
    generate,
    read_system,
    write_package,
)
from linkwise.check.compare import ROUNDINGS, Entries, IndexRows, compare
from linkwise.check.frame_checks import frame_calls, frame_reference
from linkwise.check.parametric_tree import check_numbers, tree_with
from linkwise.expression.expression_graph import FUNCTIONS
from linkwise.oracle.energies import TextTerms, energy_reference, states_of_energies
from linkwise.oracle.formula_text import NAMES, NUMPY, TextFormula, Unreadable, torch_functions
from linkwise.oracle.latex_reader import LatexReader
from linkwise.oracle.magnitudes import Magnitudes
from linkwise.oracle.newton_euler import NewtonEuler
from linkwise.oracle.reference import (
    STIFF,
    Reference,
    body_reference,
    link_sizes,
    states_of_torques,
    torque_reference,
)
from linkwise.oracle.states import States, random_states, states_where
from linkwise.package.entries import EnergyEntry, JointEntry, ShareEntry
from linkwise.package.manifest import Manifest
from linkwise.symbolic.definition import formula_texts, joint_tree

CART = str(DATA / "cart_pendulum.py")
LEG, TURNTABLE = str(DATA / "leg.toml"), str(DATA / "turntable.py")
EPSILON = 2.0**-52


def hinges(count: int) -> list[JointEntry]:
    """Joints without limits."""
    return [JointEntry(f"q{k + 1}", "rad") for k in range(count)]


def sources(directory: Path) -> tuple[NewtonEuler, Magnitudes]:
    manifest = Manifest.read(directory)
    assert manifest.tree is not None
    return NewtonEuler(manifest, manifest.tree), Magnitudes(manifest, manifest.tree)


@pytest.fixture(scope="module")
def leg(directory_of: Callable[[str], Path]) -> tuple[NewtonEuler, Magnitudes]:
    """Return the robot of a leg of slides and hinges."""
    return sources(directory_of(LEG))


def test_magnitudes_bound_the_torques_and_energies_that_they_are_of(
    leg: tuple[NewtonEuler, Magnitudes],
) -> None:
    recursion, magnitudes = leg
    rng = np.random.default_rng(0)
    for scales in ((1.0, 0.0, 0.0), (1.0, 2.0, 0.0), (1.0, 0.0, 3.0), (9.0, 5.0, 4.0)):
        motion = [s * rng.uniform(-1.0, 1.0, (200, 6)) for s in scales]
        sizes = [np.abs(m) for m in motion]
        for gravity in (True, False):
            tau = np.abs(recursion.partial_torque(*motion, gravity=gravity))
            bound = magnitudes.partial_torque(*sizes, gravity=gravity)
            assert (tau <= bound).all()
            assert bound.max() <= 1e4 * tau.max() * max(1.0, sizes[0].max() / np.pi)
        kinetic, potential = recursion.energies(*motion[:2])
        assert (kinetic + np.abs(potential) <= magnitudes.lagrangian(*sizes[:2])).all()


def test_magnitudes_grow_with_the_square_of_the_velocities(leg: tuple[NewtonEuler, Magnitudes]) -> None:
    _, magnitudes = leg
    q, qd = np.random.default_rng(1).uniform(0.5, 1.0, (2, 3, 6))
    once, twice = (magnitudes.partial_torque(q, s * qd, 0 * q, gravity=False) for s in (1.0, 2.0))
    np.testing.assert_allclose(twice, 4 * once)
    rest, once, twice = (magnitudes.lagrangian(q, s * qd) for s in (0.0, 1.0, 2.0))
    np.testing.assert_allclose(twice - rest, 4 * (once - rest))


def test_energies_of_the_recursion_change_by_the_power_of_its_torques(
    leg: tuple[NewtonEuler, Magnitudes],
) -> None:
    recursion, _ = leg
    q, qd, qdd = random_states(hinges(6), 20).motion
    tau, t = recursion.partial_torque(q, qd, qdd), 1e-4
    later, before = (recursion.energies(q + s * qd + 0.5 * s * s * qdd, qd + s * qdd) for s in (t, -t))
    rate = (sum(later) - sum(before)) / (2 * t)
    np.testing.assert_allclose(np.einsum("sij,si->sj", tau, qd), rate, rtol=1e-6, atol=1e-4)


def same(one: Reference, other: Reference, tolerance: float) -> None:
    for what, value in one.values.items():
        np.testing.assert_allclose(other.values[what], value, rtol=tolerance, atol=tolerance, err_msg=what)


def test_two_references_of_one_robot_agree(
    directory_of: Callable[[str], Path], package_of: Callable[[str], ModuleType]
) -> None:
    states, package = random_states(hinges(3), 5), package_of("planar3")
    by_bodies = body_reference(*sources(directory_of("planar3")), states)
    same(by_bodies, torque_reference("it", package.load("numpy").partial_torque, states), 1e-7)


def test_energies_and_differences_of_torques_agree(
    directory_of: Callable[[str], Path], package_of: Callable[[str], ModuleType]
) -> None:
    cart, states = package_of(CART), random_states(hinges(2), 5)
    by_torque = torque_reference("it", cart.load("numpy").partial_torque, states)
    found = written_reference(directory_of(CART), states)
    for what, value in by_torque.values.items():
        np.testing.assert_allclose(found.values[what], value, rtol=1e-7, atol=1e-7, err_msg=what)


def test_what_is_linear_in_the_velocities_is_told_apart(directory_of: Callable[[str], Path]) -> None:
    states = random_states(hinges(2), 5)
    found = written_reference(directory_of(TURNTABLE), states)
    np.testing.assert_allclose(found.values["h1"][:, 0, 0, 1], 2 * 0.4 * 1.7)
    np.testing.assert_allclose(found.values["h1"][:, 1, 0, 0], -2 * 0.4 * 1.7)


def written_reference(directory: Path, states: States) -> Reference:
    energies = Manifest.read(directory).energies
    assert energies is not None
    names = list(dict.fromkeys(share.name for link in energies.links for share in link.shares))
    terms = [TextTerms(link, ["x", "y"], "", {}) for link in energies.links]
    return energy_reference(terms, [], names, states)


def test_states_that_energies_are_not_defined_for_are_left_out() -> None:
    def torque(q: Any, qd: Any, qdd: Any) -> Any:
        with np.errstate(invalid="ignore", divide="ignore"):
            return (np.log(q) + qdd)[:, :, None]

    states = random_states(hinges(1), 40)
    with np.errstate(invalid="ignore"):
        reference = torque_reference("it", torque, states)
    assert 5 < len(reference.states.q) < 40
    np.testing.assert_allclose(reference.values["c0"][:, 0, 0, 0], 1 / reference.states.q[:, 0], rtol=1e-8)
    assert (reference.states.q > 0).all()
    assert len(reference.values["c0"]) == len(reference.states.q)


@pytest.mark.parametrize("size", [1e-4, 1.0, 1e4])
def test_states_on_a_corner_are_left_out_whatever_the_size_of_torques(size: float, tmp_path: Path) -> None:
    """Dry friction, of which a joint at rest has no one value, is as large as inertia and spring."""
    x = Coordinate("x", "m")
    rubbing = LinkEnergy("it", size * x.qd**2, size * x.q**2, size * sp.Abs(x.qd))
    write_package(generate(energy_system("rubbing", [x], [rubbing]), ["numpy"]), tmp_path / "it")
    manifest = Manifest.read(tmp_path / "it")
    assert manifest.energies is not None
    names = list(dict.fromkeys(share.name for link in manifest.energies.links for share in link.shares))
    terms = [TextTerms(link, ["x"], "", {}) for link in manifest.energies.links]
    found = states_of_energies(terms, names, manifest.joints, 40)
    assert found.tried - len(found.states.q) == (random_states(manifest.joints, 40).qd == 0).sum() > 0
    assert np.abs(found.states.qd).min() > 1e-7


def test_states_are_looked_for_where_energies_are_defined() -> None:
    def torque(q: Any, qd: Any, qdd: Any) -> Any:
        with np.errstate(invalid="ignore"):
            return (np.sqrt(q - 4) + np.arcsin(q[:, ::-1] / 0.01) * qd)[:, :, None]

    found = states_of_torques(torque, hinges(2), 30)
    assert found.tried > 34
    assert not len(found.states.q)  # both coordinates are wanted in either range
    above = states_where(lambda states: (states.q > [4.0, -0.01]).all(axis=1), hinges(2), 30)
    assert len(above.states.q) == 34
    assert above.tried > 34
    everywhere = states_where(lambda states: np.ones(len(states.q), bool), hinges(2), 30)
    assert (len(everywhere.states.q), everywhere.tried) == (34, 34)


def energies_of(kinetic: str, potential: str) -> tuple[list[Any], list[Any]]:
    share = ShareEntry("spring", potential, "0", "0", {})
    entry = EnergyEntry("bead", kinetic, 2, (share,))
    exact, *noisy = ([TextTerms(entry, ["x"], "", {"k": 3.0}, noise)] for noise in (None, 1, 2))
    return exact, noisy


def test_a_coefficient_counts_as_what_it_makes_of_the_largest_rates() -> None:
    states = States(np.zeros((2, 1)), np.array([[0.5], [2.0]]), np.array([[4.0], [0.1]]))
    values = {"tau": np.array([[[1.0]], [[8.0]]]), "c2": np.array([[[[0.5]]], [[[0.5]]]])}
    sizes = link_sizes(values, states)
    np.testing.assert_array_equal(sizes["tau"].ravel(), [STIFF * 2.0, STIFF * 8.0])  # of 0.5 · 4 and of 8
    np.testing.assert_array_equal(sizes["c2"].ravel(), [STIFF * 0.5, STIFF * 2.0])


def test_noise_tells_what_cancels() -> None:
    pytest.importorskip("torch")
    exact, noisy = energies_of("0.5*qd_1**2", "k*((1000.0 + q_1)**2 - 1000.0**2)/2")
    states = random_states(hinges(1), 20)
    reference = energy_reference(exact, noisy, ["spring"], states)
    np.testing.assert_allclose(reference.values["g"][:, 0, 0], 3 * (1000 + states.q[:, 0]), rtol=1e-14)
    assert reference.lagrangian is not None
    value, scale = reference.lagrangian
    assert (scale[np.abs(states.q[:, 0]) > 0] > 1e5).all()
    assert np.abs(value).max() < 1e5


def test_energies_that_are_huge_somewhere_are_held_elsewhere_too() -> None:
    pytest.importorskip("torch")
    exact, noisy = energies_of("0.5*qd_1**2", "exp(20*(q_1 - 1)) + 4*q_1**2")
    wrong, _ = energies_of("0.5*qd_1**2", "exp(20*(q_1 - 1)) + 4.00001*q_1**2")
    found = states_of_energies(exact, ["spring"], hinges(1), 50)
    reference, other = (energy_reference(one, noisy, ["spring"], found.states) for one in (exact, wrong))
    entry = Entries("g", other.values["g"], reference.values["g"], reference.scales["g"])
    assert compare("g", [entry]).failed


def test_random_states_are_apart_from_zero_in_every_quadrant_and_some_at_rest() -> None:
    q, qd, qdd = random_states(hinges(3), 100).motion
    assert len(q) == 104
    assert all((np.abs(x[:100]) >= 0.25).all() for x in (qd, qdd))
    for k in range(3):
        assert set(np.floor(q[:100, k] / (np.pi / 2))) == {-2, -1, 0, 1}
        assert {-1.0, 1.0} == set(np.sign(qd[:100, k])) == set(np.sign(qdd[:100, k]))
    assert [[bool(x[row].any()) for x in (q, qd, qdd)] for row in range(100, 104)] == [
        [False, False, False],
        [True, False, False],
        [True, True, False],
        [True, False, True],
    ]
    assert all((x.astype(np.float32) == x).all() for x in (q, qd, qdd))
    np.testing.assert_array_equal(random_states(hinges(3), 100).q, q)


def entries(error: float, place: int, small: float, scale: float = 1.0) -> Entries:
    expected = np.array([[100.0, small], [50.0, -0.5 * small]])
    value = expected.copy()
    value[1, place] += error
    return Entries("c1", value, expected, np.array([100.0, scale]))


def test_a_value_is_measured_by_its_own_size() -> None:
    assert compare("c1", [entries(0.9e-9 * 50.0, 0, 1e-3)]).held
    assert compare("c1", [entries(1.1e-9 * 50.0, 0, 1e-3)]).failed
    assert compare("c1", [entries(0.9e-9 * 5e-4, 1, 1e-3)]).held
    wrong = compare("c1", [entries(0.0, 0, 1.0), entries(1.1e-9 * 5e-4, 1, 1e-3)])
    assert wrong.failed
    assert wrong.detail == "largest relative error 1.1e-09 at c1(2)"


def test_a_value_that_is_zero_but_for_rounding_is_measured_by_what_it_is_summed_from() -> None:
    rounding = ROUNDINGS * EPSILON
    assert compare("c1", [entries(0.9 * rounding, 1, 0.0)]).held
    assert compare("c1", [entries(1.1 * rounding, 1, 0.0)]).failed
    assert compare("c1", [entries(9 * rounding, 1, 0.0, scale=10.0)]).held
    assert compare("c1", [entries(1e-300, 1, 0.0, scale=0.0)], tolerance=1e-9).failed


@pytest.mark.parametrize("wrong", [np.nan, np.inf])
def test_an_answer_that_is_no_number_fails(wrong: float) -> None:
    assert compare("c1", [entries(wrong, 0, 1.0)]).failed


def test_another_shape_is_named() -> None:
    result = compare("c1", [Entries("c1", np.zeros((2, 3)), np.zeros((2, 2)), np.zeros(2))])
    assert (result.held, result.detail) == (False, "c1 has shape (2, 3) instead of (2, 2)")
    assert compare("c1", [Entries("c1", np.zeros((0, 2)), np.zeros((0, 2)), np.zeros(2))]).error == 0.0


def test_packed_values_go_link_by_link_then_by_joint_then_by_cause() -> None:
    rows = IndexRows.of_paths([(0,), (0, 2)], linear=[1])
    assert rows.tau.tolist() == [[0, 0], [0, 1], [2, 1]]
    assert rows.c1.tolist() == [[0, 0, 0], [0, 1, 0], [0, 1, 2], [2, 1, 0], [2, 1, 2]]
    assert rows.c2.tolist() == [[0, 0, 0], [0, 1, 0], [0, 1, 2], [2, 1, 2]]
    assert rows.h1.tolist() == rows.c1.tolist()[1:]


LATEX = {
    "q_{1} ": 2.0,
    r"- \frac{3 \dot{q}_{1} q_{12}^{2} \sin{\left(q_{1} + q_{12} \right)}}{80} + 2": -3
    * 5
    * 49
    * np.sin(9)
    / 80
    + 2,
    r"1.5 \cdot 10^{-3} q_{1} - \left(q_{1} - 1\right)^{2}": 0.003 - 1,
    r"\sin^{2}{\left(q_{1} \right)} \cos{\left(q_{1} \right)}": np.sin(2) ** 2 * np.cos(2),
    r"\sqrt{q_{1}} + \sqrt[3]{q_{12}} + \frac{1}{\sqrt{q_{12}}}": 2**0.5 + 7 ** (1 / 3) + 7**-0.5,
    r"e^{- q_{1}} + \pi \log{\left(\left|{- q_{1}}\right| \right)}": np.exp(-2) + np.pi * np.log(2),
    r"\operatorname{atan}{\left(q_{1} \right)} + \tanh{\left(q_{12} \right)}": np.arctan(2) + np.tanh(7),
}


def latex(text: str) -> float:
    symbols = {"q_{1}": 2.0, "q_{12}": 7.0, r"\dot{q}_{1}": 5.0, r"\pi": np.pi, "e": np.e}
    return float(LatexReader(text, symbols, NUMPY).value())


@pytest.mark.parametrize("text", LATEX)
def test_latex_is_read_as_the_formula_it_shows(text: str) -> None:
    assert latex(text) == pytest.approx(LATEX[text], rel=1e-14)


@pytest.mark.parametrize(
    "text", ["q_{1} +", "q_{2}", r"\frac{1}", r"\foo{q_{1}}", "(q_{1})", "q_{1}}", r"\left(q_{1}", ""]
)
def test_latex_that_is_no_formula_is_refused(text: str) -> None:
    with pytest.raises(Unreadable):
        latex(text)


def test_formulas_of_bodies_give_their_numbers_and_others_for_other_parameters(tmp_path: Path) -> None:
    system = read_system("planar2", Options("symbolic"))
    values = {symbol.name: value for symbol, value in system.parameters.items()}
    tree, formulas = joint_tree(system), formula_texts(system)
    assert tree is not None
    assert tree_with(tree, formulas, values) == tree
    assert tree_with(tree, formulas, values | {"l_1": 0.4}).joints[1].translation == (0.4, 0.0, 0.0)
    write_package(generate(system, ["numpy"]), tmp_path / "arm")
    package = Manifest.read(tmp_path / "arm")
    assert (package.tree, package.formulas) == (tree, formulas)
    wrong = replace(package, formulas=formulas | {"links[1].com[0]": "1.001*r_2"})
    told = check_numbers("parameters", wrong, values)
    assert (told.failed, told.detail) == (True, "com of link 'link2'")


def test_text_is_read_as_the_formula_it_shows() -> None:
    values = {"q_1": 2.0, "c": 7.0}
    found = TextFormula("-q_1**2/3 + 2.5e-1*(c - q_1 - 1)*sqrt(c) - 1/q_1 + pi").value(values)
    assert found == pytest.approx(-4 / 3 + 0.25 * 4 * 7**0.5 - 0.5 + np.pi, rel=1e-14)
    long = " - ".join(["q_1*sin(c)"] * 20_000)
    assert TextFormula(long).value(values) == pytest.approx(-19_998 * 2 * np.sin(7), rel=1e-9)
    assert TextFormula(long).names() == {"q_1", "c"}


@pytest.mark.parametrize(
    "text",
    [
        "q_1 +",
        "q_2",
        "q_1 if c else 0",
        "__import__('os')",
        "sin(q_1, c)",
        "q_1.real",
        "True",
        "q_1 # + c",
        "\uff51_1",
        f"{10**400}*q_1",
        "1/0",
        "(" * 9_999,
        "",
        "Piecewise(q_1)",
        "Piecewise((q_1, q_1 < 0))",
        "Piecewise((q_1, c), (2, True))",
    ],
)
def test_text_that_is_no_formula_is_refused(text: str) -> None:
    with pytest.raises(Unreadable):
        TextFormula(text).value({"q_1": 2.0, "c": 7.0})


def test_every_function_of_energies_can_be_read_back() -> None:
    torch = pytest.importorskip("torch")
    assert {name.capitalize() if name == "abs" else name for name in FUNCTIONS} <= set(NAMES)
    for name in NAMES:
        found = torch_functions()[name](torch.tensor(0.3, dtype=torch.float64))
        assert float(found) == pytest.approx(NUMPY[name](0.3), rel=1e-14)


@needs_compiler
def test_writing_beside_an_array_is_noticed_on_either_side(tmp_path: Path) -> None:
    from linkwise.check.compiled_c import CompiledPackage, Prototype

    at = Prototype("at", "double", "count", ("q",), ("c2",))
    (tmp_path / "x.h").write_text(at.declaration("x"))
    (tmp_path / "x.c").write_text(
        "void x_at(unsigned long n, const double *q, double *c2) { c2[(int)q[0]] = n; }\n"
    )
    (tmp_path / "xf.c").write_text("")
    compiled = CompiledPackage("x", tmp_path, 1)
    for place, shift in ((0, 0), (2, 1), (-1, 0), (3, 1), (40, 0), (-40, 0)):
        found = compiled.call(at, 7, {"q": np.array([float(place)])}, {"c2": 3}, shift)
        assert (found is not None) == (0 <= place < 3)
        if found is not None:
            assert found["c2"][place] == 7.0
            assert np.isnan(np.delete(found["c2"], place)).all()


def test_a_frame_a_nanometre_off_is_found(
    directory_of: Callable[[str], Path], package_of: Callable[[str], ModuleType]
) -> None:
    manifest = Manifest.read(directory_of("planar3"))
    assert manifest.tree is not None
    model, states = package_of("planar3").load("numpy"), random_states(hinges(3), 20)
    right = frame_calls("numpy", model, frame_reference(manifest, manifest.tree, states))
    assert not any(result.failed for result in right)
    x, y, z = manifest.tree.frames[-1].translation
    frames = (*manifest.tree.frames[:-1], replace(manifest.tree.frames[-1], translation=(x, y + 1e-9, z)))
    off = frame_reference(manifest, replace(manifest.tree, frames=frames), states)
    wrong = frame_calls("numpy", model, off)
    assert [result.held for result in wrong] == [False] * 3 + [True], "the centre of mass has no frame"
