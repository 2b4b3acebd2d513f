"""Shares with names: potentials, dissipation, forces, imposed motions; and kinetic energies of any degree.

Held against SymPy's LagrangesMethod, equations by hand, and motions by SciPy.
"""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import sympy as sp
from conftest import needs_compiler
from helpers.answers import random_states, relative_error
from helpers.motion_logs import smooth, write_csv
from linkwise import (
    Coordinate,
    LinkEnergy,
    LinkwiseError,
    check_package,
    energy_system,
    generate,
    write_package,
)
from linkwise.analysis import Reading, analyze
from linkwise.analysis.load_robot import load_robot
from linkwise.analysis.show.page import page_data
from linkwise.escape import column_part
from linkwise.package.load import import_package
from linkwise.symbolic.moving_bodies import Particle, RigidBody
from linkwise.symbolic.system import EnergySystem
from matplotlib.text import Text
from sympy.physics.mechanics import LagrangesMethod, ReferenceFrame, dynamicsymbols

BACKENDS = ("numpy", "torch", "autograd", pytest.param("native", marks=needs_compiler))
T = dynamicsymbols._t
X, THETA, PUSH = dynamicsymbols("x theta F")
M, m, r, k, b, w, B, g = sp.symbols("M m r k b w B g", positive=True)
VALUES = {M: 2.0, m: 0.3, r: 0.5, k: 40.0, b: 0.8, w: 2.3, B: 0.7, g: 9.81}


def crane() -> EnergySystem:
    """A cart on a spring and a damper, pushed, whose pendulum hangs from a point that is shaken."""
    hung = [X + r * sp.sin(THETA) + sp.sin(w * T) / 10, -r * sp.cos(THETA)]
    cart = LinkEnergy(
        "cart",
        M * X.diff(T) ** 2 / 2,
        {"spring": k * X**2 / 2, "magnet": B * THETA * X.diff(T)},
        {"damper": b * X.diff(T) ** 2 / 2},
        {"push": {X: PUSH}},
    )
    bob = Particle("bob", m, hung, gravity=[0, -g])
    return energy_system("crane", {X: "m", THETA: "rad"}, [cart, bob], VALUES, inputs=[PUSH])


def loaded(system: EnergySystem, folder: Path, backend: str) -> Any:
    write_package(generate(system, [backend]), folder / system.name)
    return import_package(folder / system.name).load(backend)


def values_of(array: Any) -> Any:
    return array.detach().numpy() if hasattr(array, "detach") else array


def given(backend: str, *states: Any) -> Any:
    if backend in ("numpy", "native"):
        return states
    return [pytest.importorskip("torch").from_numpy(state) for state in states]


@pytest.mark.parametrize("backend", BACKENDS)
def test_torques_are_those_of_sympys_lagranges_method(backend: str, tmp_path: Path) -> None:
    hung = sp.Matrix([X + r * sp.sin(THETA) + sp.sin(w * T) / 10, -r * sp.cos(THETA)]).diff(T)
    kinetic = M * X.diff(T) ** 2 / 2 + m * (hung.T * hung)[0] / 2
    potential = k * X**2 / 2 + B * THETA * X.diff(T) - m * g * r * sp.cos(THETA)
    world = ReferenceFrame("N")
    forces = [(world, 0 * world.x)]
    whole = LagrangesMethod(kinetic - potential, [X, THETA], forcelist=forces, frame=world)
    equations = whole.form_lagranges_equations() + sp.Matrix([b * X.diff(T) - PUSH, 0])
    symbols = sp.symbols("x0:2 v0:2 a0:2")
    named = {q.diff(T, n): symbols[2 * n + i] for n in (2, 1, 0) for i, q in enumerate((X, THETA))}
    exact = sp.lambdify([*symbols, T, PUSH], list(equations.xreplace(named).xreplace(VALUES)))
    robot = loaded(crane(), tmp_path, backend)
    for t, force in ((0.0, 0.0), (0.37, -5.0)):
        states = random_states(2, 20)
        expected = np.array([exact(*np.concatenate(s), t, force) for s in zip(*states, strict=True)])
        moved = robot.at(t=t, F=force)
        tau = values_of(moved.inverse_dynamics(*given(backend, *states)))
        assert relative_error(tau, expected) <= 1e-12


@pytest.mark.parametrize("backend", BACKENDS)
def test_each_share_is_told_by_its_name_and_all_sum_up(backend: str, tmp_path: Path) -> None:
    robot = loaded(crane(), tmp_path, backend).at(t=0.37, F=-5.0)
    q, qd, qdd = random_states(2, 20)
    motion = given(backend, q, qd, qdd)
    shares = dict(
        zip(robot.share_names, np.moveaxis(values_of(robot.named_shares(*motion[:2])), -1, 0), strict=True)
    )
    (x, theta), (v, omega), zero = q.T, qd.T, 0.0 * q.T[0]
    shaken = -0.1 * 2.3**2 * np.sin(2.3 * 0.37)  # the point's acceleration
    expected = {
        "spring": ([40.0 * x, zero], [zero, zero]),
        "magnet": ([-0.7 * omega, 0.7 * v], [zero, zero]),
        "damper": ([0.8 * v, zero], [zero, zero]),
        "push": ([zero + 5.0, zero], [zero, zero]),
        "gravity": ([zero, zero], [zero, 0.3 * 9.81 * 0.5 * np.sin(theta)]),
        "imposed motion": ([zero, zero], [zero + 0.3 * shaken, 0.3 * 0.5 * np.cos(theta) * shaken]),
    }
    assert shares.keys() == expected.keys()
    for name, by_link in expected.items():
        assert relative_error(shares[name], np.moveaxis(np.array(by_link), 0, -1).swapaxes(0, 1)) <= 1e-12, (
            name
        )
    parts = robot.propagation(*motion)
    named = robot.named_shares(*motion[:2]).sum(-1)
    whole = parts.acceleration.sum(-1) + parts.velocity.sum(-1) + named
    assert relative_error(values_of(whole), values_of(robot.partial_torque(*motion))) <= 1e-13


@pytest.mark.parametrize("backend", BACKENDS)
def test_velocity_forces_of_degree_four_are_owned_in_equal_parts(backend: str, tmp_path: Path) -> None:
    x, y = Coordinate("x", "m"), Coordinate("y", "m")
    kinetic = x.qd**2 / 2 + y.qd**2 / 2 + x.q * x.qd**2 * y.qd**2 / 4 + y.q * x.qd**3 / 6
    robot = loaded(energy_system("quartic", [x, y], [LinkEnergy("it", kinetic)]), tmp_path, backend)
    q, qd, qdd = random_states(2, 20)
    parts = robot.propagation(*given(backend, q, qd, qdd))
    (u, v), by = qd.T, values_of(parts.velocity)[:, :, 0]
    # h_x = u (u v^2/2) + v u^2/2 - u^2 v^2/4 = u^2 v^2/4 + u^2 v/2, of which x has two of four factors, then
    # two of three; h_y = u (u^2 v/2) - u^3/6, three of four, and all of the last.
    first, second = u**2 * v**2 / 4, u**2 * v / 2
    assert (
        relative_error(by[:, 0], np.stack([first / 2 + 2 * second / 3, first / 2 + second / 3], -1)) <= 1e-13
    )
    third = u**3 * v / 2
    assert relative_error(by[:, 1], np.stack([3 * third / 4 - u**3 / 6, third / 4], -1)) <= 1e-13
    slopes = values_of(robot.propagation(*given(backend, q, qd, qdd), convention="gradient").velocity)
    for k in range(2):  # what counts is not h alone, as c2 has velocities in it, too
        step = 1e-6 * np.eye(2)[k]
        ends = [values_of(robot.inverse_dynamics(*given(backend, q, qd + s * step, qdd))) for s in (1, -1)]
        slope = (ends[0] - ends[1]) / 2e-6
        np.testing.assert_allclose(slopes[:, :, 0, k], slope * qd[:, [k]], rtol=0, atol=1e-7)
    kinetic = u**2 / 2 + v**2 / 2 + q[:, 0] * u**2 * v**2 / 4 + q[:, 1] * u**3 / 6
    # dK/dqd . qd - K, which torques change; of degree two it is K
    expected = kinetic + 2 * q[:, 0] * u**2 * v**2 / 4 + q[:, 1] * u**3 / 6
    assert relative_error(values_of(robot.energy(*given(backend, q, qd)).kinetic)[:, 0], expected) <= 1e-13
    with pytest.raises(ValueError, match="more than two velocities at once, and no Christoffel symbols"):
        robot.christoffel(*given(backend, q))


def test_an_imposed_motion_counts_at_every_degree(tmp_path: Path) -> None:
    """(x' + cos t)^4 / 4 + x'^2, by SymPy's LagrangesMethod."""
    kinetic = (X.diff(T) + sp.cos(T)) ** 4 / 4 + X.diff(T) ** 2
    whole = LagrangesMethod(kinetic, [X]).form_lagranges_equations()
    named = {X.diff(T, 2): sp.Symbol("a"), X.diff(T): sp.Symbol("v")}
    exact = sp.lambdify([*named.values(), T], whole[0].xreplace(named))
    robot = loaded(energy_system("shaken", {X: "m"}, [LinkEnergy("it", kinetic)]), tmp_path, "numpy")
    q, qd, qdd = random_states(1, 20)
    tau = robot.at(t=0.37).inverse_dynamics(q, qd, qdd)
    assert relative_error(tau[:, 0], exact(qdd[:, 0], qd[:, 0], 0.37)) <= 1e-12


@pytest.mark.parametrize("system", [crane, lambda: rolling_in_pieces()], ids=["crane", "pieces"])
def test_check_proves_every_back_end(system: Any, tmp_path: Path) -> None:
    pytest.importorskip("torch")
    write_package(generate(system()), tmp_path / "it")
    assert [f"{r.name}: {r.detail}" for r in check_package(tmp_path / "it") if r.failed] == []


def rolling_in_pieces() -> EnergySystem:
    """Springs and rails with corners, stops and branches; roots and logarithms are on one side alone."""
    x, y = Coordinate("x", "m"), Coordinate("y")
    beyond = sp.sqrt(x.q + sp.Rational(1, 9)) * x.q**2 + sp.log(1 + x.q) * x.q
    rail = sp.Piecewise((3 * x.q**2, x.q < 0), (beyond, True))
    stop = 40 * sp.Max(0, sp.Abs(y.q) - sp.Rational(1, 2)) ** 2 + 2 * sp.Min(x.q, y.q, 0) ** 2
    stop += 5 * sp.Max(0, x.q - 1, y.q - 1) ** 2
    turned = y.qd**2 * sp.atan2(3 + y.q**2, 1 + x.q**2) / 2 + x.qd**2
    grip = sp.Piecewise((-2, sp.And(y.qd > 0, x.q > 0)), (3, sp.Or(y.qd < 0, sp.Eq(x.q, 1))), (0, True))
    links = [
        LinkEnergy("rail", turned, {"Führung */": rail, "stop": stop}),
        LinkEnergy("brake", 0, dissipation=sp.Abs(y.qd), forces={"grip": {"y": grip}}),
    ]
    return energy_system("pieces", [x, y], links)


@pytest.mark.parametrize(
    "backend", ["numpy", "torch", "autograd", pytest.param("native", marks=needs_compiler)]
)
def test_an_equality_holds_at_its_place_alone(backend: str, tmp_path: Path) -> None:
    robot = loaded(rolling_in_pieces(), tmp_path, backend)
    q, rest = np.array([[1.0, 0.2], [1.0 + 1e-9, 0.2]]), np.zeros((2, 2))
    motion = given(backend, q, rest, rest)
    at, beside = values_of(robot.inverse_dynamics(*motion))
    np.testing.assert_allclose(at - beside, [0.0, -3.0], atol=1e-6)


@pytest.mark.parametrize("backend", ["numpy", "torch", "autograd"])
def test_a_power_of_what_is_pressed_in_has_no_slope_before_it_is(backend: str, tmp_path: Path) -> None:
    """Max(0, x)^(3/2) by itself has the slope 0 / 0 where x < 0."""
    x = Coordinate("x", "m")
    ball = LinkEnergy("ball", x.qd**2 / 2, {"stop": sp.Max(0, x.q) ** sp.Rational(3, 2)})
    robot = loaded(energy_system("ball", [x], [ball]), tmp_path, backend)
    q, rest = np.array([[-0.5], [0.25]]), np.zeros((2, 1))
    slopes = values_of(robot.position_gradient(*given(backend, q, rest, rest)))
    np.testing.assert_allclose(slopes.reshape(2), [0.0, 0.75 / 0.5], rtol=1e-14)


@pytest.mark.parametrize("backend", ["numpy", pytest.param("native", marks=needs_compiler)])
def test_motions_are_those_of_scipy_and_their_energy_is_accounted_for(backend: str, tmp_path: Path) -> None:
    integrate = pytest.importorskip("scipy.integrate")
    robot = loaded(crane(), tmp_path, backend)
    time, start = np.linspace(0.0, 2.0, 401), np.array([0.2, 0.5, 0.0, 0.0])

    def force(t: float) -> float:
        return 3.0 * np.cos(5.0 * t)

    def rates(t: float, y: Any) -> Any:
        x, theta, v, omega = y
        shaken = -0.1 * 2.3**2 * np.sin(2.3 * t)
        mass = np.array([[2.3, 0.15 * np.cos(theta)], [0.15 * np.cos(theta), 0.075]])
        bias = [
            -0.15 * omega**2 * np.sin(theta) + 40 * x - 0.7 * omega + 0.8 * v - force(t) + 0.3 * shaken,
            0.7 * v + 0.15 * 9.81 * np.sin(theta) + 0.15 * np.cos(theta) * shaken,
        ]
        return [v, omega, *np.linalg.solve(mass, -np.array(bias))]

    exact = integrate.solve_ivp(rates, (0.0, 2.0), start, "DOP853", time, rtol=1e-12, atol=1e-13).y.T
    options: dict[str, Any] = {"method": "DOP853", "rtol": 1e-12, "atol": 1e-13}
    inputs = {"F": lambda t, q, qd: force(t)}
    found = robot.simulate(start[:2], start[2:], time, inputs=inputs, **options)
    np.testing.assert_allclose(np.concatenate([found.q, found.qd], -1), exact, atol=1e-9)
    assert np.abs(found.energy_drift).max() <= 1e-9
    assert np.ptp(found.energy) > 0.1
    assert robot.parameters["t"] == 0.0  # the robot itself stays where it was
    with pytest.raises(ValueError, match="inputs names 'G', which crane does not have; its inputs are F"):
        robot.simulate(start[:2], start[2:], time, inputs={"G": 1.0})
    with pytest.raises(ValueError, match="input 'F' is not finite at t = 0"):
        robot.simulate(start[:2], start[2:], time, inputs={"F": lambda *_: np.nan}, method="RK45")


@pytest.mark.parametrize("backend", ["torch", "autograd", pytest.param("native", marks=needs_compiler)])
def test_tensors_move_as_arrays_do_with_time_and_inputs(backend: str, tmp_path: Path) -> None:
    torch = pytest.importorskip("torch")
    q, qd, time = np.array([[0.2, 0.5], [0.1, -1.0]]), np.zeros((2, 2)), np.linspace(0.0, 0.2, 21)
    inputs = {"F": lambda t, q, qd: np.cos(5.0 * t)}
    expected = loaded(crane(), tmp_path / "numpy", "numpy").simulate(q, qd, time, inputs=inputs)
    robot = loaded(crane(), tmp_path, backend)
    found = robot.simulate(torch.from_numpy(q), torch.from_numpy(qd), time, inputs=inputs)
    for one, other in zip(found, expected, strict=True):
        np.testing.assert_allclose(values_of(one), other, atol=1e-12)


@pytest.mark.parametrize("backend", ["torch", "autograd"])
def test_gradients_by_an_input_are_kept(backend: str, tmp_path: Path) -> None:
    torch = pytest.importorskip("torch")
    robot, rest, time = loaded(crane(), tmp_path, backend), torch.zeros(2), np.linspace(0.0, 0.2, 5)

    def ends(force: Any) -> Any:
        return robot.simulate(rest.double(), rest.double(), time, inputs={"F": force}).q[-1].sum()

    force = torch.tensor(0.5, dtype=torch.float64, requires_grad=True)
    (slope,) = torch.autograd.grad(ends(force), force)
    assert abs(slope - (ends(0.5 + 1e-4) - ends(0.5 - 1e-4)) / 2e-4) <= 1e-8 * abs(slope)


def test_a_body_turns_with_eulers_equations(tmp_path: Path) -> None:
    """A free body by three angles: without torques, angular momentum stands still in the world."""
    a, c, e = dynamicsymbols("a c e")
    rotation = sp.rot_axis3(-a) * sp.rot_axis1(-c) * sp.rot_axis3(-e)
    top = RigidBody("top", 1, [0, 0, 0], rotation, [1, 2, sp.Rational(5, 2)])
    robot = loaded(energy_system("top", {a: "rad", c: "rad", e: "rad"}, [top]), tmp_path, "numpy")
    start, rate = np.array([0.1, 0.9, 0.4]), np.array([0.7, -1.1, 2.0])
    motion = robot.simulate(start, rate, np.linspace(0, 2, 201), method="DOP853", rtol=1e-12, atol=1e-13)
    turned = sp.lambdify([a, c, e], rotation)
    slopes = [sp.lambdify([a, c, e], rotation.diff(angle)) for angle in (a, c, e)]
    momenta = []
    for q, qd in zip(motion.q, motion.qd, strict=True):
        frame = turned(*q)
        spin = frame.T @ sum(slope(*q) * speed for slope, speed in zip(slopes, qd, strict=True))
        omega = np.array([spin[2, 1], spin[0, 2], spin[1, 0]])
        momenta.append(frame @ (np.array([1.0, 2.0, 2.5]) * omega))
    np.testing.assert_allclose(momenta, np.broadcast_to(momenta[0], (201, 3)), atol=1e-9)
    assert np.ptp(motion.q, axis=0).min() > 0.1


FLAT = Coordinate("x", "m")
LOOSE = sp.Symbol("u")
BAD = {
    "a potential that moves a mass": (
        {"potential": FLAT.qd**2},
        "its potential energy has degree 2 in the velocities; what is of degree two and more is kinetic",
    ),
    "an input in an energy": (
        {"potential": {"spring": LOOSE * FLAT.q**2}},
        "its potential energy 'spring' has the input u, whose change would change the energy",
    ),
    "a step": (
        {"potential": sp.Piecewise((0, FLAT.q < 1), (1, True))},
        "its potential energy jumps where .* passes zero, and has no force there",
    ),
    "a sign": (
        {"potential": {"well": sp.sign(FLAT.q)}},
        "its potential energy 'well' jumps where x passes zero",
    ),
    "no last piece": (
        {"potential": sp.Piecewise((FLAT.q**2, FLAT.q < 1))},
        "a Piecewise has no value where none of its conditions is true",
    ),
    "a force on nothing": (
        {"forces": {"y": 1}},
        "its forces name 'y', which is no coordinate; choose among x",
    ),
    "forces without coordinates": (
        {"forces": 3},
        "its forces are 3; give a dictionary of forces by coordinate",
    ),
    "forces by name and by coordinate": (
        {"forces": {"a": {"x": 1}, "x": 2}},
        "its forces stand partly by name, partly by coordinate; give names to all",
    ),
    "a name that motion has": ({"dissipation": {"velocity": FLAT.qd**2}}, "a share is called 'velocity'"),
    "a name that is none": ({"potential": {3: FLAT.q}}, "a share is called 3; give it a name in quotes"),
    "a jump of the dissipation": ({"dissipation": sp.sign(FLAT.qd)}, "its dissipation jumps where"),
    "a step far away": (
        {"potential": sp.Piecewise((0, FLAT.q < 500), (1e-5, True))},
        "its potential energy jumps where x - 500 passes zero",
    ),
    "a full turn": (
        {"potential": sp.atan2(sp.sin(FLAT.q), sp.cos(FLAT.q))},
        "its potential energy jumps where",
    ),
    "a name between spaces": ({"potential": {" a": FLAT.q}}, "a share is called ' a'; leave out the spaces"),
    "a dissipation at rest": ({"dissipation": FLAT.q**2}, "its dissipation depends on no velocity"),
    "an input at which nothing is defined": (
        {"forces": {"x": 1 / LOOSE}},
        "its force is no number where time and inputs are 0",
    ),
    "a matrix": ({"potential": sp.Matrix([FLAT.q])}, "its potential energy is Matrix.*; give a SymPy expr"),
}


@pytest.mark.parametrize("case", BAD)
def test_what_has_no_force_is_refused_by_name(case: str) -> None:
    terms, message = BAD[case]
    links = [LinkEnergy("bad", FLAT.qd**2, **terms)]
    inputs = [LOOSE] if "input" in case else []
    with pytest.raises(LinkwiseError, match=f"^(while deriving robot 'it': )?link 'bad': {message}"):
        generate(energy_system("it", [FLAT], links, inputs=inputs), ["numpy"])


def test_a_force_with_an_input_may_be_called_energy() -> None:
    link = LinkEnergy("motor", FLAT.qd**2, forces={"energy": {"x": LOOSE}})
    assert energy_system("it", [FLAT], [link], inputs=[LOOSE]).inputs == (LOOSE,)


def test_a_weight_that_is_lifted_off_the_floor_does_not_jump() -> None:
    weight = sp.Piecewise((2e4 * (FLAT.q - 1), FLAT.q > 1), (0, True))
    energy_system("crane", [FLAT], [LinkEnergy("load", FLAT.qd**2, weight)])


ROOM = (FLAT.q, 0, 0)
BODIES = {
    "a mass": (Particle("a", -1, ROOM), "its mass is -1, and no body has a negative one"),
    "one number of gravity": (Particle("a", 1, ROOM, gravity=9.81), "its gravity is 9.81; give 3 components"),
    "letters": (Particle("a", 1, "xy"), "its position is 'xy'; give 2 or 3 components"),
    "an input": (
        Particle("a", 1, [FLAT.q + LOOSE, 0]),
        "where it is depends on the input u, whose rate",
    ),
    "a velocity": (
        Particle("a", 1, [FLAT.q + FLAT.qd, 0]),
        "where it is depends on the velocity d.x./dt, whose rate",
    ),
    "a stretch": (RigidBody("a", 1, ROOM, 2 * sp.eye(3), [1, 1, 1]), "its rotation is none: its columns are"),
    "a mirror": (RigidBody("a", 1, ROOM, sp.diag(1, 1, -1), [1, 1, 1]), "its rotation is a reflection"),
    "a lopsided inertia": (
        RigidBody("a", 1, ROOM, sp.eye(3), [[1, 0.2, 0], [0, 1, 0], [0, 0, 1]]),
        "its inertia is not symmetric; give I_xy twice",
    ),
    "a small lopsided inertia": (
        RigidBody("a", 1, ROOM, sp.eye(3), [[1e-3, 2e-4, 0], [0, 1e-3, 0], [0, 0, 1e-3]]),
        "its inertia is not symmetric; give I_xy twice",
    ),
    "a long inertia": (
        RigidBody("a", 1, ROOM, sp.eye(3), np.array([1, 1, 5])),
        "its principal inertias are 1, 1 and 5, which no rigid body has",
    ),
}


@pytest.mark.parametrize("case", BODIES)
def test_what_is_no_body_is_refused_by_name(case: str) -> None:
    body, message = BODIES[case]
    inputs = [LOOSE] if "input" in case else []
    with pytest.raises(LinkwiseError, match=f"^link 'a': {message}"):
        energy_system("it", [FLAT], [body], inputs=inputs)


GIVEN = {
    "a velocity as time": ({"time": FLAT.qd}, "`time` is d.x./dt, which is a coordinate or its velocity too"),
    "a position as input": ({"inputs": [FLAT.q]}, "the input x is a coordinate or its velocity too"),
    "time as input": ({"time": LOOSE, "inputs": [LOOSE]}, "the input u is time too"),
    "an input twice": ({"inputs": [LOOSE, LOOSE]}, "the input u is another input too"),
    "one input": ({"inputs": LOOSE}, "`inputs` is u; give a list"),
    "a set of inputs": ({"inputs": {LOOSE}}, "`inputs` is .*; give a list"),
    "an input of nothing": (
        {"inputs": [LOOSE]},
        "the input u is in no force and no dissipation",
    ),
    "one independent coordinate": (
        {"independent": FLAT},
        "`independent` is .*; give a list of coordinates",
    ),
    "no links": ({"links": None}, "`links` is None; give a list of linkwise.LinkEnergy"),
    "a kind of links": ({"links": [LinkEnergy]}, "`links` is .*; give a list of linkwise.LinkEnergy"),
    "no coordinates": ({"coordinates": None}, "the coordinates are no list"),
}


@pytest.mark.parametrize("case", GIVEN)
def test_what_is_no_part_of_a_system_is_refused_by_name(case: str) -> None:
    more, message = GIVEN[case]
    asked = {"coordinates": [FLAT], "links": [LinkEnergy("a", FLAT.qd**2)], **more}
    with pytest.raises(LinkwiseError, match=message):
        energy_system("it", **asked)


def test_a_mass_that_its_parameter_makes_negative_is_told_with_its_value() -> None:
    mass = sp.Symbol("m")
    with pytest.raises(LinkwiseError, match=r"its mass is m = -1\.5, and no body has a negative one$"):
        energy_system("it", [FLAT], [Particle("a", mass, ROOM)], {mass: -1.5})


FUNCTIONS = {
    "a coordinate without a unit": (([X], [X.diff(T) ** 2], {}), "the coordinate x(t) has no unit"),
    "an unknown function": (
        ({X: "m"}, [X.diff(T) ** 2 * PUSH], {}),
        "link '0': F(t) is neither a coordinate or its velocity nor among `inputs`",
    ),
    "an acceleration": (
        ({X: "m"}, [X.diff(T, 2) ** 2], {}),
        "an acceleration, which energies and forces do not",
    ),
    "the rate of an input": (
        ({X: "m"}, [X.diff(T) ** 2 + PUSH.diff(T)], {"inputs": [PUSH]}),
        "Derivative(F(t), t) is the rate of an input, which is not known",
    ),
    "another time": (
        ({X: "m"}, [X.diff(T) ** 2], {"time": sp.Symbol("s")}),
        "x(t) is a function of t, and time is s",
    ),
    "time as a parameter": (
        ({X: "m"}, [X.diff(T) ** 2], {"parameters": {T: 3.0}}),
        "parameter t is time or an input too; leave it out of `parameters`",
    ),
}


@pytest.mark.parametrize("case", FUNCTIONS)
def test_functions_of_time_are_coordinates_or_inputs(case: str) -> None:
    (coordinates, kinetic, more), message = FUNCTIONS[case]
    links = [LinkEnergy(str(at), one) for at, one in enumerate(kinetic)]
    with pytest.raises(LinkwiseError) as caught:
        energy_system("it", coordinates, links, **more)
    assert message in str(caught.value)


def test_an_analysis_has_each_share_as_a_cause_of_its_own(tmp_path: Path) -> None:
    x, y = Coordinate("x", "m"), Coordinate("y", "m")
    spring = LinkEnergy("cart", x.qd**2, {"spring/left": 20 * x.q**2}, {"damper": x.qd**2 / 2})
    tail = LinkEnergy("tail", (x.qd + y.qd) ** 2 / 2, {"gravity": 3 * (x.q + y.q)})
    write_package(generate(energy_system("train", [x, y], [spring, tail])), tmp_path / "train")
    log = write_csv(tmp_path / "log.csv", smooth(40, 2), ["x", "y"])
    result = analyze(log, tmp_path / "train", induced=["joints"])
    values = {column.name: row for column, row in zip(result.columns, result.values, strict=True)}
    expected = {"spring/left": 40 * values["q/x"], "damper": values["qd/x"]}
    for name, torque in expected.items():
        np.testing.assert_allclose(values[f"tau_share/x/cart/{column_part(name)}"], torque, atol=1e-12)
        # M^-1 of two masses of 2 and 1 in a row: what pulls at x moves it by 1/2, and y against it.
        np.testing.assert_allclose(
            values[f"acc_share/joints/x/cart/{column_part(name)}"], -torque / 2, atol=1e-12
        )
        np.testing.assert_allclose(
            values[f"acc_share/joints/y/cart/{column_part(name)}"], torque / 2, atol=1e-12
        )
    np.testing.assert_allclose(values["tau_share/y/tail/gravity"], 3.0)
    assert not any(name.startswith(("tau_gravity", "acc_gravity", "power_gravity")) for name in values)
    np.testing.assert_allclose(result.named_shares.sum(-1), result.gravity)
    page = json.loads(page_data(result))
    assert (page["named"], page["shares"]) == ("tau_share", ["spring/left", "damper", "gravity"])
    labels = [text.get_text() for text in result.figure("shares").findobj(Text)]
    assert {"spring/left", "damper", "gravity"} <= set(labels)


def test_an_analysis_moves_time_and_takes_inputs_from_the_log(tmp_path: Path) -> None:
    write_package(generate(crane(), ["numpy", "native"]), tmp_path / "crane")
    robot = import_package(tmp_path / "crane").load("numpy")
    motion = np.column_stack([smooth(40, 2), np.linspace(-3.0, 4.0, 40)])
    log = write_csv(tmp_path / "log.csv", motion, ["x", "theta", "drive"])
    with pytest.raises(LinkwiseError, match=r"no column for input 'F' \(found 'drive'\); name it with --map"):
        analyze(log, tmp_path / "crane")
    result = analyze(log, tmp_path / "crane", Reading(mapping={"drive": "F"}))
    here = robot.at(t=result.time, F=motion[:, 3])
    expected = here.named_shares(result.q, result.qd)
    assert np.ptp(expected[:, 0], axis=0).max() > 1.0
    np.testing.assert_allclose(result.named_shares, expected, atol=1e-12)
    np.testing.assert_allclose(
        result.torque, here.inverse_dynamics(result.q, result.qd, result.qdd), atol=1e-12
    )
    with pytest.raises(LinkwiseError, match="native has one value of for all samples"):
        load_robot(tmp_path / "crane", "native")
