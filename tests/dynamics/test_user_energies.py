"""Link energies that a user writes in SymPy, against equations of motion written by hand."""

import json
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
import sympy as sp
from conftest import DATA, needs_compiler
from helpers.answers import packed, random_states, relative_error
from helpers.motion_logs import smooth, write_csv
from linkwise import (
    Coordinate,
    LinkEnergy,
    LinkwiseError,
    check_package,
    energy_system,
    generate,
    interpolated,
    read_robot,
    read_system,
    write_package,
)
from linkwise.analysis import analyze
from linkwise.analysis.load_robot import load_robot
from linkwise.analysis.show.page import page_data
from linkwise.emit.c.quantity_table import potential, quantity_lines
from linkwise.graphs import overlay, part_label
from linkwise.package.load import import_package
from linkwise.progress import silent
from linkwise.report import TermQuery, terms_markdown, terms_report
from linkwise.symbolic.chain_rule import lagrangian as lagrangian_of
from linkwise.symbolic.system import EnergySystem
from matplotlib.text import Text
from scipy.interpolate import make_interp_spline

CART, TURNTABLE = str(DATA / "cart_pendulum.py"), str(DATA / "turntable.py")
BACKENDS = ("numpy", "torch", "autograd", *(pytest.param(b, marks=needs_compiler) for b in ("c", "native")))


@pytest.mark.parametrize("backend", BACKENDS)
def test_cart_with_spring_and_pendulum(
    backend: str, directory_of: Callable[[str], Path], package_of: Callable[[str], ModuleType]
) -> None:
    cart, bob, k, r, g = 2.0, 0.3, 40.0, 0.5, 9.81
    q, qd, qdd = random_states(2, 100)
    (x, theta), (_, w), (a, alpha) = q.T, qd.T, qdd.T
    on_cart_by_cart = cart * a + k * x
    on_cart_by_bob = bob * (a + r * (alpha * np.cos(theta) - w**2 * np.sin(theta)))
    on_bob = bob * r * (r * alpha + a * np.cos(theta) + g * np.sin(theta))
    given = packed(package_of(CART), directory_of(CART), backend, q, qd, qdd)
    assert relative_error(given["torque"].T, [on_cart_by_cart, on_cart_by_bob, on_bob]) <= 1e-14


@pytest.mark.parametrize("backend", ["numpy", "torch", "autograd"])
def test_what_a_moving_base_asks_for_is_a_share_of_its_own(
    backend: str, package_of: Callable[[str], ModuleType]
) -> None:
    rate, mass = 1.7, 0.4
    states = random_states(2, 100)
    (x, y), (u, v), (a, b) = (state.T for state in states)
    if backend != "numpy":
        torch = pytest.importorskip("torch")
        states = tuple(torch.from_numpy(state) for state in states)
    dynamics = package_of(TURNTABLE).load(backend)

    quadratic = np.array([-mass * x * v**2, 2 * mass * x * u * v])
    linear = np.array([-2 * mass * rate * v, 2 * mass * rate * u])
    table = linear + np.array([-mass * rate**2 * x, -mass * rate**2 * y])
    inertial = np.array([mass * a, mass * (2 + x**2) * b])
    tau = np.asarray(dynamics.partial_torque(*states))[..., 0].T
    assert relative_error(tau, quadratic + table + inertial) <= 1e-14
    assert dynamics.share_names == ("imposed motion",)
    assert relative_error(np.asarray(dynamics.named_shares(*states[:2]))[:, :, 0, 0].T, table) <= 1e-14

    closing, gradient = (dynamics.propagation(*states, convention=c) for c in ("closing", "gradient"))
    velocity = np.asarray(closing.velocity)[:, :, 0].sum(-1).T
    assert relative_error(velocity, quadratic) <= 1e-14
    velocity = np.asarray(gradient.velocity)[:, :, 0].sum(-1).T
    assert relative_error(velocity, 2 * quadratic + linear) <= 1e-14


@needs_compiler
def test_emitted_c_has_what_is_not_quadratic_too(
    directory_of: Callable[[str], Path], package_of: Callable[[str], ModuleType]
) -> None:
    from helpers.compiled import Compiled

    states = random_states(2, 5)
    given = Compiled(directory_of(TURNTABLE)).decomposition(*states)
    expected = package_of(TURNTABLE).load("numpy").packed(*states)
    assert relative_error(given["linear"], expected.velocity_excess) <= 1e-14
    assert np.abs(given["linear"]).max() > 1.0


X, Y = Coordinate("x", "m"), Coordinate("y")


@pytest.mark.parametrize("factor", [1 / (1 + X.q**2), 1 / (2 + X.q), 3 - 1 / (2 + X.q**2)], ids=str)
def test_graphs_of_quotients_say_what_torques_are(factor: sp.Expr, tmp_path: Path) -> None:
    pytest.importorskip("torch")
    links = [LinkEnergy("a", X.qd**2 / 2 + Y.qd**2 * factor / 2, 0)]
    write_package(generate(energy_system("bead", [X, Y], links), ["autograd"]), tmp_path / "bead")
    robot = import_package(tmp_path / "bead").load("autograd")
    (x, _), (v, w), (_, a) = motion = np.array([[0.7, 0.2], [1.3, -0.4], [0.5, 2.0]])
    # d/dt(qd_y f(x)) = f qdd_y + f' qd_x qd_y
    f, slope = (float(value.subs(X.q, x)) for value in (factor, sp.diff(factor, X.q)))
    assert float(robot.graph(1, 0).evaluate(*motion)) == pytest.approx(f * a + slope * v * w, rel=1e-12)


WITHOUT_FORCE = {
    "a belt": [LinkEnergy("cart", 2 * (X.qd + 3) ** 2 / 2, 2 * X.q**2)],
    "beside others": [
        LinkEnergy("plain", (2 + X.q**2) * Y.qd**2 + X.qd * Y.qd, 0),
        LinkEnergy("sloped", X.qd**2 * (2 + sp.cos(Y.q)) + Y.qd**2 + Y.q * X.qd + X.q * Y.qd, X.q),
        LinkEnergy("puck", (X.qd - 1.7 * Y.q) ** 2 + (Y.qd + 1.7 * X.q) ** 2 * (1 + X.q**2), 0),
        LinkEnergy("spring", 0, 3 * X.q**2 + Y.q),
    ],
}
"""Kinetic energies with terms b(q) . qd that have no force: b is the slope of a function, 3 x or x y."""


@pytest.mark.parametrize("case", WITHOUT_FORCE)
@pytest.mark.parametrize("backend", ["numpy", "autograd", pytest.param("native", marks=needs_compiler)])
def test_terms_linear_in_the_velocities_may_have_no_force(backend: str, case: str, tmp_path: Path) -> None:
    links = WITHOUT_FORCE[case]
    robot = energy_system("robot", [X, Y] if len(links) > 1 else [X], links)
    write_package(generate(robot), tmp_path / "robot")
    states = random_states(len(robot.coordinates), 7)
    motion: Any = states
    if backend == "autograd":
        motion = [pytest.importorskip("torch").from_numpy(state) for state in states]
    answer = import_package(tmp_path / "robot").load(backend).packed(*motion)
    c2, c1, g, h1 = by_sympy(robot, *states)
    pairs = (
        (answer.acceleration, c2),
        (answer.velocity, c1),
        (answer.gravity, g),
        (answer.velocity_excess, h1),
    )
    for found, expected in pairs:
        np.testing.assert_allclose(np.asarray(found), expected, rtol=1e-14, atol=1e-13)


def by_sympy(robot: EnergySystem, q: np.ndarray, qd: np.ndarray, _: np.ndarray) -> list[np.ndarray]:
    """Packed c2, c1, g and h1, the last of links with forces linear in qd, derived in SymPy."""
    x, v = [c.q for c in robot.coordinates], [c.qd for c in robot.coordinates]
    forms: list[list[sp.Expr]] = [[], [], [], []]
    c2, c1, g, h1 = forms
    rest = dict.fromkeys(v, 0)
    for j in range(len(robot.links)):
        path, lagrangian = robot.path(j), lagrangian_of(robot, j)
        slopes_at_rest = []
        for i in path:
            momentum = lagrangian.diff(v[i])
            h = sum(momentum.diff(x[s]) * v[s] for s in path) - lagrangian.diff(x[i])
            slopes = [h.diff(v[k]) for k in path]
            still = [slope.subs(rest) for slope in slopes]
            c2 += [momentum.diff(v[k]) for k in path if k >= i]
            c1 += [(slope - at_rest) / 2 for slope, at_rest in zip(slopes, still, strict=True)]
            g += [h.subs(rest) + sum(one * v[k] for one, k in zip(still, path, strict=True))]
            slopes_at_rest += [-slope for slope in still]
        h1 += slopes_at_rest if any(sp.expand(slope) != 0 for slope in slopes_at_rest) else []
    values = [sp.lambdify([*x, *v], part)(*q.T, *qd.T) for part in forms]
    return [np.array([np.broadcast_to(a, len(q)) for a in part]).reshape(-1, len(q)).T for part in values]


A, B = sp.symbols("a b")


def puck(kinetic: sp.Expr, potential: sp.Expr = sp.S.Zero) -> object:
    return energy_system("puck", [Coordinate("x", "m")], [LinkEnergy("disc", kinetic, potential)])


@pytest.mark.parametrize(
    ("kinetic", "potential", "stored", "share"),
    [
        (X.qd**2 / 2 + 3 * X.q**2, 0, 0, ("imposed motion", 3 * X.q**2)),
        (X.qd**2 / 2, {"magnet": -5 * X.q * X.qd}, 0, ("magnet", 5 * X.q * X.qd)),
        (X.qd**2 / 2, 3 * X.q**2, 3 * X.q**2, ("potential", 0)),
        ((X.qd - 2) ** 2 / 2 - 2, 3 * X.q**2, 3 * X.q**2, ("imposed motion", -2 * X.qd)),
    ],
    ids=["kinetic at rest", "potential in motion", "neither", "both"],
)
def test_kinetic_is_what_moves_and_potential_what_does_not(
    kinetic: sp.Expr, potential: object, stored: object, share: tuple[str, object]
) -> None:
    (disc,) = energy_system("puck", [X], [LinkEnergy("disc", kinetic, potential)]).links
    assert (sp.expand(disc.kinetic), sp.expand(disc.potential)) == (X.qd**2 / 2, stored)
    assert (disc.shares[-1].name, sp.expand(disc.shares[-1].motion)) == share


def test_a_degree_that_is_no_mechanics_is_refused() -> None:
    with pytest.raises(LinkwiseError, match=f"link 'disc': its kinetic energy has degree {10**9} in the vel"):
        puck(Coordinate("x", "m").qd ** 10**9)


def test_energy_that_is_not_a_polynomial_in_the_velocities_is_refused() -> None:
    with pytest.raises(LinkwiseError, match="its kinetic energy is no polynomial in the velocities"):
        puck(sp.sin(Coordinate("x", "m").qd))


def test_unknown_symbol_is_refused_by_name() -> None:
    with pytest.raises(
        LinkwiseError, match=r"link 'disc': the symbol mu is neither .* nor among `parameters`"
    ):
        puck(sp.Symbol("mu") * Coordinate("x", "m").qd ** 2)


@pytest.mark.parametrize("symbolic", [False, True])
def test_two_parameters_of_one_name_are_refused(symbolic: bool) -> None:
    x = Coordinate("x", "m")
    m, m2 = sp.Symbol("m"), sp.Symbol("m", positive=True)
    links = [LinkEnergy("a", m * x.qd**2 / 2, m2 * x.q)]
    with pytest.raises(
        LinkwiseError, match=r"^the parameters called m are 2 different symbols, told apart by"
    ):
        energy_system("puck", [x], links, {m: 1.0, m2: 5.0}, symbolic)
    with pytest.raises(LinkwiseError, match=r"^link 'a': the symbol m is not the one among `parameters`"):
        energy_system("puck", [x], links, {m: 1.0}, symbolic)


@pytest.mark.parametrize(
    ("potential", "message"),
    [
        (sp.nan, "link 'disc': it holds NaN or infinity"),
        (sp.oo * X.q, "link 'disc': it holds NaN or infinity"),
        (-sp.oo, "link 'disc': it holds NaN or infinity"),
        (X.q / (A - B), "link 'disc': it holds NaN or infinity"),
        (sp.sqrt(-A) * X.q, "link 'disc': it holds the imaginary unit"),
        (sp.I * X.q, "link 'disc': it holds the imaginary unit"),
        (sp.asin(2) * X.q + 1, r"link 'disc': it holds asin\(2\), which is not a real number"),
        (10**309 * X.q, "link 'disc': it holds a number beyond 1e308"),
        (None, "link 'disc': its potential energy is None; give a SymPy expression"),
        ("x", "link 'disc': its potential energy is 'x'; give a SymPy expression"),
        (True, "link 'disc': its potential energy is True; give a SymPy expression"),
    ],
    ids=str,
)
@pytest.mark.parametrize("symbolic", [False, True])
def test_energy_that_is_no_real_number_is_refused(potential: object, message: str, symbolic: bool) -> None:
    links = [LinkEnergy("disc", X.qd**2, potential)]
    with pytest.raises(LinkwiseError, match=f"^{message}"):
        energy_system("puck", [X], links, {A: 2.0, B: 2.0}, symbolic)


HEAD = "from linkwise import *\nimport sympy as sp\nx = Coordinate('x')\n"
GOOD = HEAD + "coordinates = [x]\nlinks = [LinkEnergy('a', x.qd**2, 0)]\n"
FILES = {
    "exit": (GOOD + "import sys; sys.exit(0)", "running the file failed in line 6: SystemExit: 0"),
    "raised": (
        HEAD + "def f(a):\n    return a / 0\nf(1)",
        "running the file failed in line 5: ZeroDivisionError: d",
    ),
    "raised beyond": (
        HEAD + "\nsp.Symbol(3)",
        "running the file failed in line 5: TypeError: name should be",
    ),
    "raised without a word": (HEAD + "assert 0", "running the file failed in line 4: AssertionError"),
    "raised with words that cannot be said": (
        HEAD + "class Z(Exception):\n    def __str__(self):\n        raise ValueError('x')\nraise Z",
        "running the file failed in line 7: Z",
    ),
    "no Python": (HEAD + "x = = 1\n", "running the file failed in line 4: SyntaxError: invalid syntax"),
    "number": (GOOD + "coordinates = [Coordinate(3)]", "line 6: the coordinate name 3 is not a string"),
    "twice": (
        GOOD + "coordinates = [x, x]",
        "line 3: the coordinate name 'x' is used twice; give each its own",
    ),
    "blank": (
        GOOD + "coordinates = [Coordinate(' ')]",
        "line 6: the coordinate name ' ' is empty; give each its own",
    ),
    "own words": (GOOD + "raise LinkwiseError('in my own words')", "line 6: in my own words"),
    "unit": (
        GOOD + "coordinates = [Coordinate('x', 'deg')]",
        "line 6: coordinate 'x' has the unit 'deg'; give rad",
    ),
    "link": (GOOD + "links = [LinkEnergy(None, x.qd**2, 0)]", "line 6: the link name None is not a string"),
    "name": (GOOD + "name = 3", "line 6: `name` is 3; give the robot's name"),
    "no links": (HEAD + "coordinates = [x]", "the file must define 'links', a list of linkwise.LinkEnergy"),
    "one of two": (
        GOOD + "links += [3]",
        "line 6: the file must define 'links', a list of linkwise.LinkEnergy",
    ),
    "list": (GOOD + "parameters = [3]", "line 6: `parameters` must be a dictionary of SymPy symbols"),
    "text": (GOOD + "parameters = {'m': 1}", "line 6: `parameters` must be a dictionary of SymPy symbols"),
    "digits": (
        GOOD + "parameters = {sp.Symbol('m'): '1'}",
        "line 6: parameter m is '1'; give a number, without quotes",
    ),
    "word": (
        GOOD + "parameters = {sp.Symbol('m'): [1]}",
        "line 6: parameter m has no value as a real number",
    ),
    "a name that nobody reads": (
        GOOD + "k = sp.Symbol('k')\ndissipation = k * x.qd**2 / 2",
        "'dissipation' in line 7 would count for nothing: linkwise reads ",
    ),
    "a function that nobody calls": (
        GOOD + "def forces(q, qd):\n    return -qd\n",
        "'forces' in line 6 would count for nothing: linkwise reads ",
    ),
    "a name added to": (
        GOOD + "if x:\n    damping: list = []\n    damping += [3]",
        "'damping' in line 7 would count for nothing: linkwise reads ",
    ),
    "a name made of itself": (
        GOOD + "damping = 0\ndamping = damping + x.qd**2",
        "'damping' in line 6 would count for nothing: linkwise reads ",
    ),
    "a table that is filled": (
        GOOD + "damping = {}\ndamping['x'] = 3",
        "'damping' in line 6 would count for nothing: linkwise reads ",
    ),
    "names of several": (
        GOOD + "damping, friction = 1, 2",
        "'damping' in line 6 would count for nothing: linkwise reads ",
    ),
    "a name of a list": (
        GOOD + "shown = [*links, friction := x.qd**2]\nprint(shown)",
        "'friction' in line 6 would count for nothing: linkwise reads ",
    ),
    "a name of what is opened": (
        GOOD + "with open(__file__) as friction:\n    pass",
        "'friction' in line 6 would count for nothing: linkwise reads ",
    ),
    "a name misspelt": (
        GOOD + "parametres = {sp.Symbol('m'): 1.0}",
        "'parametres' in line 6 would count for nothing: linkwise reads parameters, ",
    ),
    "a link's own mistake": (
        GOOD + "links = [\n    LinkEnergy('b', 0, x.q),\n    LinkEnergy('a', sp.Symbol('mu') * x.qd**2),\n]",
        "line 8: link 'a': the symbol mu is neither a coordinate",
    ),
    "complex": (
        GOOD + "parameters = {sp.Symbol('m'): sp.I}",
        "line 6: parameter m has no value as a real number",
    ),
    "huge": (
        GOOD + "parameters = {sp.Symbol('m'): 10**400}",
        "line 6: parameter m has no value as a real number",
    ),
    "infinite": (GOOD + "parameters = {sp.Symbol('m'): sp.oo}", "line 6: parameter m has NaN or infinity"),
    "without velocity": (
        GOOD + "y = Coordinate('y')\ncoordinates = [x, y]\nlinks += [LinkEnergy('b', 0, x.q * y.q)]",
        "line 6: coordinate 'y' is without velocity: no kinetic energy has it",
    ),
    "without velocity, as a function": (
        HEAD + "t = sp.Symbol('t'); del x\nu, w = sp.Function('x')(t), sp.Function('y')(t)\n"
        "coordinates = {\n    u: 'm',\n    w: 'm',\n}\nlinks = [LinkEnergy('a', u.diff(t) ** 2, u * w)]",
        "line 8: coordinate 'y' is without velocity",
    ),
    "without a mass": (
        GOOD + "m = sp.Symbol('m')\nparameters = {m: 0}\nlinks = [LinkEnergy('a', m * x.qd**2, x.q)]",
        "line 3: coordinate 'x' is without velocity: no kinetic energy has it (a mass of zero gives none)",
    ),
    "time in a constant": (
        GOOD + "t, k = sp.symbols('t k_1')\ntime = t\nparameters = {\n    k: 2 * t,\n}",
        "line 9: parameter k_1 is a constant, and its value 2*t depends on time t; write that in",
    ),
    "motion in a constant": (
        GOOD + "k = sp.Symbol('k')\nparameters = {}\nparameters[k] = x.q",
        "line 8: parameter k is a constant, and its value x depends on x; write that in",
    ),
    "a time that is another symbol to SymPy": (
        HEAD + "del x\nt, time = sp.symbols('t', real=True), sp.Symbol('t')\nu = sp.Function('x')(time)\n"
        "coordinates = {\n    u: 'm',\n}\nlinks = [LinkEnergy('a', u.diff(t) ** 2, u**2)]",
        "line 5: `t` is another symbol than the t of which x(t) is a function, as their assumptions differ",
    ),
    "two links of one name": (
        GOOD + "links += [LinkEnergy('a', x.qd**2)]",
        "line 6: the link name 'a' is used twice",
    ),
    "an input that is a coordinate": (
        GOOD + "inputs = [x.q]",
        "line 6: the input x is a coordinate or its velocity too",
    ),
    "a function without a closed form": (
        GOOD + "links += [\n    LinkEnergy('b', 0, sp.erf(x.q)),\n]",
        "line 7: link 'b': the function erf is not supported; use one of",
    ),
    "pieces without an end": (
        GOOD + "links += [LinkEnergy('b', 0, sp.Piecewise((x.q**2, x.q > 0)))]",
        "line 6: link 'b': a Piecewise has no value where none of its conditions is true",
    ),
    "one name for two shares": (
        GOOD + "links += [LinkEnergy('b', 0, {'s': x.q**2}, {'s': x.qd**2})]",
        "line 6: link 'b': its potential and its dissipation are both called 's', and would be one share",
    ),
    "a system that is none": (GOOD + "system = 3", "line 6: `system` is 3; give what linkwise.from_sympy"),
    "raised by linkwise": (
        GOOD + "links += [LinkEnergy('b', 0, interpolated(x.q, [0], [1]))]",
        "line 6: a table of degree 3 needs 4 places, and has 1",
    ),
    "of a call in the file": (
        HEAD + "system = energy_system(\n    'a',\n    [x],\n    [LinkEnergy('a', x.qd**2)],\n"
        "    {sp.Symbol('m'): 'a'},\n)",
        "line 4: parameter m is 'a'; give a number",
    ),
}


@pytest.mark.parametrize("case", FILES)
def test_defect_of_a_python_file_is_named(case: str, tmp_path: Path) -> None:
    text, message = FILES[case]
    (tmp_path / "bad.py").write_text(text)
    with pytest.raises(LinkwiseError) as caught:
        read_system(tmp_path / "bad.py")
    assert str(caught.value).startswith(f"{tmp_path / 'bad.py'}: {message}")


@pytest.mark.parametrize(
    ("kinetic", "told"),
    [
        (sp.Symbol("m") * X.qd**2 * (1 + X.q**2), []),
        (sp.Symbol("m") * X.q**2, [("odd", "kinetic energies without any velocity")]),
        (-sp.Symbol("m") * X.qd**2, [("odd", "kinetic energies that are negative")]),
        (-sp.pi * X.qd**2 / 2, [("odd", "kinetic energies that are negative")]),
        (X.q * X.qd**2 / 2, []),  # of a chain that has fallen by X, which is above 0
        (sp.S.Zero, []),
    ],
)
@pytest.mark.parametrize("symbolic", [False, True])
def test_a_kinetic_energy_that_is_probably_a_mistake_is_told(
    kinetic: sp.Expr, told: list[tuple[str, str]], symbolic: bool
) -> None:
    links = [LinkEnergy("disc", X.qd**2), LinkEnergy("odd", kinetic, X.q**2)]
    notes = energy_system("puck", [X], links, {sp.Symbol("m"): 2.0}, symbolic).notes
    assert [(note.subject, note.effect.partition(",")[0]) for note in notes] == told


def test_a_system_is_told_in_a_line_and_its_statics_by_a_note() -> None:
    system = energy_system("puck", [X], [LinkEnergy("spring", 0, X.q**2)])
    assert repr(system) == "<energies of puck: coordinates x; links spring>"
    (note,) = system.notes
    assert (note.subject, note.effect.partition(",")[0]) == ("puck", "no kinetic energy")


@pytest.mark.parametrize(
    "more",
    [
        {"links": [LinkEnergy("damped", 0, Y.q**2, Y.qd**2)]},
        {"links": [LinkEnergy("driven", 0, forces={Y: sp.Symbol("c") * Y.qd})]},
        {"constraints": {"gear": Y.q - 3 * X.q}},
    ],
    ids=["dissipation", "force", "constraint"],
)
def test_a_coordinate_without_mass_is_taken_where_something_else_has_its_velocity(
    more: dict[str, Any],
) -> None:
    links = [LinkEnergy("disc", X.qd**2), *more.get("links", [])]
    constraints = more.get("constraints")
    made = energy_system("puck", [X, Y], links, {sp.Symbol("c"): 2.0}, constraints=constraints)
    assert made.coordinates == (X, Y)


def test_a_symbol_called_like_time_that_nothing_is_derived_by_is_let_be(tmp_path: Path) -> None:
    other = "del x\nt, time = sp.symbols('t', real=True), sp.Symbol('t')\n_shown = sp.sin(2 * t)\n"
    function = "u = sp.Function('x')(time)\ncoordinates = {u: 'm'}\n"
    (tmp_path / "a.py").write_text(f"{HEAD}{other}{function}links = [LinkEnergy('a', u.diff(time) ** 2)]")
    assert read_system(tmp_path / "a.py").notes == ()


def test_a_python_file_is_no_robot_and_what_reads_it_is_told(tmp_path: Path) -> None:
    (tmp_path / "puck.py").write_text(GOOD)
    with pytest.raises(
        LinkwiseError, match=r"puck.py: a Python file holds energies.*linkwise.read_system reads"
    ):
        read_robot(tmp_path / "puck.py")


def test_what_a_python_file_uses_itself_is_its_own_matter(tmp_path: Path) -> None:
    own = (
        "import math\nm, unused = sp.symbols('m unused')\nk = 3\nfor turn in range(2):\n    last = turn\n"
        "def spring(a):\n    stiffness = k * last\n    return stiffness * a**2\n_note = 'mine'\n"
        "links += [LinkEnergy('spring', 0, spring(x.q) * m)]\nname = 'mine'\nparameters = {m: 2.0}\n"
        "if __name__ == '__main__':\n    shown = links\n"
    )
    (tmp_path / "own.py").write_text(GOOD + own)
    assert read_system(tmp_path / "own.py").link_names == ("a", "spring")


@pytest.mark.parametrize(
    ("exponent", "parameters"), [(2.0, {}), (A, {A: 2}), (-A, {A: 2.0}), (2 * A + 0.5, {A: 1.25})], ids=str
)
@pytest.mark.parametrize("backend", ["numpy", "autograd"])
def test_a_whole_power_that_is_written_with_a_point_is_one_for_negative_positions_too(
    exponent: object, parameters: dict[sp.Symbol, float], backend: str, tmp_path: Path
) -> None:
    link = LinkEnergy("disc", X.qd**2.0 / 2, X.q**exponent)
    write_package(generate(energy_system("puck", [X], [link], parameters), [backend]), tmp_path / "puck")
    states = np.array([[[-1.7], [0.4]], [[0.3], [-0.2]], [[2.0], [1.0]]])
    if backend == "autograd":
        states = pytest.importorskip("torch").from_numpy(states)
    found = np.asarray(import_package(tmp_path / "puck").load(backend).partial_torque(*states))
    n = float(sp.sympify(exponent).subs(parameters))
    expected = [2.0 + n * (-1.7) ** (n - 1), 1.0 + n * 0.4 ** (n - 1)]
    assert found.ravel().tolist() == pytest.approx(expected, rel=1e-14)


@pytest.mark.parametrize("exponent", [sp.Rational(3, 2), sp.Rational(5, 2), 2.3])
@pytest.mark.parametrize(
    "backend", ["numpy", "torch", "autograd", pytest.param("native", marks=needs_compiler)]
)
def test_a_spring_of_any_power_is_slack_where_it_begins(exponent: Any, backend: str, tmp_path: Path) -> None:
    """Hertz's contact, k d^(5/2), and others: at d = 0 the force is 0, and not unknown."""
    link = LinkEnergy("disc", X.qd**2, 3 * sp.Max(0, X.q) ** exponent + sp.Abs(X.q) ** exponent)
    write_package(generate(energy_system("puck", [X], [link]), [backend]), tmp_path / "puck")
    states = np.array([[[0.0], [0.2], [-0.2]], *np.zeros((2, 3, 1))])
    if backend in ("torch", "autograd"):
        states = pytest.importorskip("torch").from_numpy(states)
    robot = import_package(tmp_path / "puck").load(backend)
    n = float(exponent)
    force = n * 0.2 ** (n - 1)
    assert np.ravel(robot.partial_torque(*states)) == pytest.approx([0.0, 4 * force, -force], abs=1e-14)
    assert not [result for result in check_package(tmp_path / "puck", 20) if result.failed]


def test_a_half_power_that_is_written_with_a_point_is_a_root() -> None:
    text = generate(puck(X.qd**2, (X.q**2 + 1) ** 1.5), ["numpy"])["forms/link_1.py"]  # type: ignore[arg-type]
    assert "log" not in text


@pytest.mark.parametrize("potential", [X.q**A, sp.cos(X.q) * (X.q - B) ** (2 * A), A**B * X.q], ids=str)
def test_a_parameter_as_exponent_is_refused_where_the_base_may_be_negative(potential: sp.Expr) -> None:
    links, values = [LinkEnergy("disc", X.qd**2, potential)], {A: 2.0, B: 2.0}
    message = (
        r"^link 'disc': .* has parameters in its exponent, .* numbers for the parameters, .*positive=True"
    )
    with pytest.raises(LinkwiseError, match=message):
        energy_system("puck", [X], links, values, symbolic=True)
    generate(energy_system("puck", [X], links, values), ["numpy"])


@pytest.mark.parametrize("potential", [(X.q**2 + 1) ** A, sp.exp(X.q) ** A, 2**X.q, B**X.q], ids=str)
def test_an_exponent_is_taken_where_the_power_is_that_of_a_logarithm(potential: sp.Expr) -> None:
    links, values = [LinkEnergy("disc", X.qd**2, potential)], {A: 2.0, B: 2.0}
    assert generate(energy_system("puck", [X], links, values, symbolic=True), ["numpy"])


def test_unsupported_function_is_refused_by_name() -> None:
    x = Coordinate("x", "m")
    system = puck(x.qd**2, sp.gamma(x.q))
    with pytest.raises(LinkwiseError, match="link 'disc': the function gamma is not supported"):
        generate(system)  # type: ignore[arg-type]


def test_parameters_of_a_python_file_stay_symbols_on_request() -> None:
    from linkwise import Options

    system = read_system(CART, Options("symbolic"))
    assert {symbol.name: value for symbol, value in system.parameters.items()} == {
        "M": 2.0,
        "m": 0.3,
        "k": 40.0,
        "r": 0.5,
        "g": 9.81,
    }


def test_parameters_that_no_energy_has_are_left_out() -> None:
    x, used, unused = Coordinate("x", "m"), sp.Symbol("used"), sp.Symbol("unused")
    links = [LinkEnergy("disc", used * x.qd**2, 0)]
    system = energy_system("puck", [x], links, {used: 1.0, unused: 2.0}, symbolic=True)
    assert system.parameters == {used: 1.0}
    assert system.request == {"parameters": "symbolic"}
    assert energy_system("puck", [x], links, {used: 1.0}).request == {"parameters": "numeric"}


@pytest.mark.parametrize(("file", "told"), [("turntable.py", True), ("cart_pendulum.py", False)])
def test_the_header_explains_linear_terms_where_there_are_some(file: str, told: bool) -> None:
    system = read_system(str(DATA / file))
    table = generate(system, ["c"])[f"c/{system.name}.h"].partition("An array holds")[0]
    assert ("not all terms are quadratic in qd" in table) == told


@pytest.mark.parametrize(("robot", "word"), [(TURNTABLE, "imposed motion"), ("planar3", "gravity")])
def test_what_energies_give_at_rest_is_called_gravity_only_where_it_is(
    robot: str, word: str, directory_of: Callable[[str], Path], tmp_path: Path
) -> None:
    package = directory_of(robot)
    joints = load_robot(package).joints
    log = write_csv(tmp_path / "log.csv", smooth(40, len(joints)), joints)
    analysis = analyze(log, package, induced=["joints"])
    symbolic = read_system(robot)
    model = import_package(package).load("autograd")
    graph = overlay(model, 0, 0, model.graph_parts(0, 0))
    query = TermQuery(joint=None, order=0)
    page = json.loads(page_data(analysis))
    said = {name: _texts(analysis.figure(name)) for name in ("causes", "shares", "induced")} | {
        "page": [page["potential"]],
        "page, induced": [curve["label"] for curve in page["sourced"][0]["curves"]],
        "notebook": [analysis._repr_html_().replace("<td>", " ")],
        "graph": [part_label(graph, at) for at in range(len(graph.parts))],
        "terms": [terms_markdown(terms_report(symbolic, query, 10**6, False, silent))],
        "C": [*quantity_lines(symbolic, nonquadratic=False), potential(symbolic)],
    }
    for place, texts in said.items():
        if place != "notebook":  # which has the largest cause alone
            assert any(word in text for text in texts), place
        assert word == "gravity" or not any("gravity" in text for text in texts), place
    meanings = [column["meaning"] for column in analysis.record()["columns"]]
    assert word == "gravity" or not any("gravity" in meaning for meaning in meanings)


def _texts(figure: Any) -> list[str]:
    return [text.get_text() for text in figure.findobj(Text)]


def test_a_table_is_the_spline_through_it_and_goes_on_beyond(tmp_path: Path) -> None:
    places, values = np.array([-1.0, -0.2, 0.5, 1.1, 2.0]), np.array([0.3, -0.1, 0.4, 1.0, 0.2])
    for degree in (1, 3):
        spring = interpolated(X.q, places, values, degree)
        system = energy_system("table", [X], [LinkEnergy("a", X.qd**2 / 2, {"spring": spring})])
        write_package(generate(system, ["numpy"]), tmp_path / f"table{degree}")
        robot = import_package(tmp_path / f"table{degree}").load("numpy")
        q = np.linspace(-1.4, 2.4, 39)[:, None] + 0.013
        expected = make_interp_spline(places, values, degree)
        np.testing.assert_allclose(robot.energy(q, 0 * q).potential[:, 0], expected(q)[:, 0], atol=1e-13)
        slopes = expected.derivative()(q)
        np.testing.assert_allclose(robot.inverse_dynamics(q, 0 * q, 0 * q), slopes, atol=1e-12)
        assert not [result for result in check_package(tmp_path / f"table{degree}") if result.failed]


@pytest.mark.parametrize(
    ("given", "message"),
    [
        (([0, 1, 2, 3], [0, 1, 2]), "as many finite values as places"),
        (([0, 1, 1, 3], [0, 1, 2, 3]), "do not ascend"),
        (([0, 1, 2], [0, 1, 2]), "a table of degree 3 needs 4 places, and has 3"),
        (([0, 1, 2, 3], [0, 1, 2, "a"]), "a table needs numbers"),
        (([0, 1, 2, 3], [0, 1, 2, 3], 0), "the degree of a table is 0"),
    ],
)
def test_what_is_no_table_is_told(given: tuple[Any, ...], message: str) -> None:
    with pytest.raises(LinkwiseError, match=message):
        interpolated(X.q, *given)


def test_powers_and_products_of_velocities_read_as_such() -> None:
    theta, m = Coordinate("theta"), sp.Symbol("m")
    assert str(m * theta.qd**2 / 2) == "m*(d(theta)/dt)**2/2"
    assert str(1 / theta.qdd) == "1/(d²(theta)/dt²)"
    assert sp.latex([theta.qd, theta.qdd]) == r"\left[ \dot{\theta}, \  \ddot{\theta}\right]"
    assert sp.pretty(m * theta.qd) == "m⋅(d(theta)/dt)"
    assert str(theta.qd) == "d(theta)/dt"
