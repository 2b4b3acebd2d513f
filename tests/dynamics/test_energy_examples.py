"""Textbook systems of examples/energies, against the equations of the textbooks, and Lagrangians by hand."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import sympy as sp
from helpers.answers import random_states, relative_error
from linkwise import generate, read_system, write_package
from linkwise.package.load import import_package
from sympy.physics.mechanics import LagrangesMethod, dynamicsymbols

FOLDER = Path(__file__).parents[2] / "examples/energies"
T = dynamicsymbols._t
sin, cos = np.sin, np.cos


def spherical_pendulum(q: Any, v: Any, a: Any) -> Any:
    (theta, _), (u, w), (b, c), m, r, g = q, v, a, 0.5, 0.8, 9.81
    return [
        m * r**2 * (b - w**2 * sin(theta) * cos(theta)) + m * g * r * sin(theta),
        m * r**2 * (sin(theta) ** 2 * c + 2 * sin(theta) * cos(theta) * u * w),
    ]


def bead_on_hoop(q: Any, v: Any, a: Any) -> Any:
    (theta,), (u,), (b,), m, r, omega = q, v, a, 0.1, 0.5, 6.0
    turned = b - omega**2 * sin(theta) * cos(theta)
    return [m * r**2 * turned + m * 9.81 * r * sin(theta) + 0.002 * u]


def elastic_joint(q: Any, v: Any, a: Any) -> Any:
    (arm, motor), (u, w), (b, c) = q, v, a
    twist, twisting = motor / 100 - arm, w / 100 - u
    spring = 80 * twist + 0.4 * twisting
    return [0.12 * b + 1.5 * 9.81 * 0.25 * sin(arm) - spring, 2e-5 * c + spring / 100]


def telescopic_link(q: Any, v: Any, a: Any) -> Any:
    (theta, r), (w, u), (b, c), m, g = q, v, a, 0.6, 9.81
    return [
        m * (r**2 * b + 2 * r * u * w) + m * g * r * sin(theta),
        m * (c - r * w**2) - m * g * cos(theta) + 60 * (r - 0.5),
    ]


def charged_particle(q: Any, v: Any, a: Any) -> Any:
    (x, y, z), (u, w, _), (ax, ay, az), m, eb, k = q, v, a, 0.02, 0.15, 0.05
    return [m * ax - eb * w - k * x, m * ay + eb * u - k * y, m * az + 2 * k * z]


def two_mode_beam(q: Any, v: Any, a: Any) -> Any:
    """Mass and stiffness by quadrature; of the hub, deflections turn with it."""
    (_, *w), (h, *wd), (b, *wdd) = q, v, a
    length, rho, stiff = 0.8, 0.4, 2.0
    points, weights = np.polynomial.legendre.leggauss(12)
    s, ds = length * (points + 1) / 2, length * weights / 2
    shapes = np.array([(s / length) ** 2, (s / length) ** 3])
    bends = np.array([2 / length**2 + 0 * s, 6 * s / length**3])
    mass = rho * np.einsum("is,ks,s->ik", shapes, shapes, ds)
    spring = stiff * np.einsum("is,ks,s->ik", bends, bends, ds)
    lever, inertia = rho * shapes @ (s * ds), 0.05 + rho * (s**2) @ ds
    w, wd, wdd = (np.array(one) for one in (w, wd, wdd))
    hub = (inertia + w @ mass @ w) * b + lever @ wdd + 2 * h * (w @ mass @ wd)
    return [hub, *(mass @ wdd + lever * b - h**2 * mass @ w + spring @ w + 0.02 * wd)]


def furuta_pendulum(q: Any, v: Any, a: Any) -> Any:
    (_, theta), (u, w), (b, c), m, R, r = q, v, a, 0.1, 0.2, 0.25
    s, co = sin(theta), cos(theta)
    arm = (0.004 + m * R**2 + m * r**2 * s**2) * b + m * R * r * co * c
    arm += 2 * m * r**2 * s * co * u * w - m * R * r * s * w**2
    bob = m * R * r * co * b + m * r**2 * c - m * r**2 * s * co * u**2 + m * 9.81 * r * s
    return [arm + 0.003 * u + 0.01 * np.tanh(50 * u), bob + 0.0003 * w]


def double_pendulum_cart(q: Any, v: Any, a: Any) -> Any:
    x, one, two = dynamicsymbols("x one two")
    ends = sp.Matrix([x, 0]), *(2 * [None])
    upper = sp.Matrix([x + sp.Rational(2, 5) * sp.sin(one), -sp.Rational(2, 5) * sp.cos(one)])
    lower = upper + sp.Rational(2, 5) * sp.Matrix([sp.sin(two), -sp.cos(two)])
    masses = [(1, ends[0]), (sp.Rational(1, 5), upper), (sp.Rational(1, 5), lower)]
    kinetic = sum(m * (at.diff(T).T * at.diff(T))[0] / 2 for m, at in masses)
    potential = sp.Rational(5, 2) * x**2 + sum(sp.Rational(981, 100) * m * at[1] for m, at in masses)
    equations = LagrangesMethod(kinetic - potential, [x, one, two]).form_lagranges_equations()
    symbols = sp.symbols("q0:3 v0:3 a0:3")
    named = {f.diff(T, n): symbols[3 * n + i] for n in (2, 1, 0) for i, f in enumerate((x, one, two))}
    exact = np.array(sp.lambdify(symbols, list(equations.xreplace(named)))(*q, *v, *a))
    return exact + np.array([0.3 * v[0], 0, 0])


SYSTEMS: dict[str, Callable[[Any, Any, Any], Any]] = {
    function.__name__: function
    for function in (
        *(spherical_pendulum, bead_on_hoop, elastic_joint, telescopic_link, charged_particle),
        *(two_mode_beam, furuta_pendulum, double_pendulum_cart),
    )
}


def turning(turn: Any, contact: Any, inertia: Any, m: float, omega: Any) -> Any:
    """d(omega)/dt in the body's axes of a body that rolls, by Newton and Euler.

    turn: rotation to the world's axes; contact: function of the vertical in the body's axes and its rate,
    that returns the place where the body touches the ground, from its centre of mass, and that place's rate

    F = m (a + g n)    a = d(r x omega)/dt + omega x (r x omega)    I d(omega)/dt + omega x I omega = r x F
    """
    up = turn.T @ [0, 0, 1]
    r, rate = contact(up, np.cross(up, omega))
    own = np.cross(rate, omega) + np.cross(omega, np.cross(r, omega)) + 9.81 * up
    across = np.array([np.cross(r, np.cross(r, axis)) for axis in np.eye(3)]).T
    return np.linalg.solve(inertia - m * across, m * np.cross(r, own) - np.cross(omega, inertia @ omega))


def rolling_disc(up: Any, rate: Any) -> Any:
    across, change = up * [1, 0, 1], rate * [1, 0, 1]  # y is the disc's axis
    size = np.linalg.norm(across)
    way, moved = across / size, change / size - across * (across @ change) / size**3
    return -0.15 * way, -0.15 * moved


def rattleback(up: Any, rate: Any) -> Any:
    squares = np.diag([0.2, 0.03, 0.02]) ** 2
    height = np.sqrt(up @ squares @ up)
    place = -squares @ up / height
    moved = -squares @ rate / height + squares @ up * (up @ squares @ rate) / height**3
    return place + 0.01 * np.eye(3)[2], moved


ROLLING = {
    "rolling_disc": (rolling_disc, 0.3, np.diag([1, 2, 1]) * 0.3 * 0.15**2 / 4, [3, 1, 2]),
    "rattleback": (rattleback, 1.0, [[2e-4, -2e-5, 0], [-2e-5, 1.6e-3, 0], [0, 0, 1.7e-3]], [3, 2, 1]),
}
"""Contact, mass, inertia, and the axes about which the last three coordinates turn, one after the other."""


def test_every_example_has_an_oracle() -> None:
    assert {path.stem for path in FOLDER.glob("*.py")} - {"draw"} == {*SYSTEMS, *ROLLING}


@pytest.mark.parametrize("name", ROLLING)
def test_what_rolls_turns_as_newton_and_euler_say(name: str, tmp_path: Path) -> None:
    contact, m, inertia, axes = ROLLING[name]
    write_package(generate(read_system(FOLDER / f"{name}.py"), ["numpy"]), tmp_path / name)
    robot = import_package(tmp_path / name).load()
    angles, rates, changes = dynamicsymbols("a b c"), sp.symbols("u v w"), sp.symbols("d e f")
    turns = {1: sp.rot_axis1, 2: sp.rot_axis2, 3: sp.rot_axis3}
    turn = sp.eye(3)
    for axis, angle in zip(axes, angles, strict=True):
        turn = turn * turns[axis](-angle)
    spun = turn.T * turn.diff(T)
    omega = sp.Matrix([spun[2, 1], spun[0, 2], spun[1, 0]])
    known = {f.diff(T, 2): a for f, a in zip(angles, changes, strict=True)}
    known |= {f.diff(T): v for f, v in zip(angles, rates, strict=True)}
    made = sp.lambdify(
        [angles, rates, changes], [part.xreplace(known) for part in (turn, omega, omega.diff(T))]
    )
    tied = robot.constraints
    for q, rate, _ in zip(*random_states(5, 6), strict=True):
        q = 0.4 * q  # a disc that leans by more than a right angle touches the ground elsewhere
        qd = tied.velocity(q, rate[2:])
        air = 1e-4 * qd[2:] if name == "rattleback" else 0.0 * qd[2:]
        qdd = tied.forward_dynamics(q, qd, np.concatenate([[0.0, 0.0], air])).qdd
        frame, spin, change = (np.squeeze(part) for part in made(q[2:], qd[2:], qdd[2:]))
        expected = turning(frame, contact, np.array(inertia), m, spin)
        np.testing.assert_allclose(change, expected, atol=1e-12 * np.abs(expected).max())


@pytest.mark.parametrize("name", SYSTEMS)
def test_torques_are_those_of_the_textbook(name: str, tmp_path: Path) -> None:
    system = read_system(FOLDER / f"{name}.py")
    write_package(generate(system, ["numpy"]), tmp_path / name)
    robot = import_package(tmp_path / name).load()
    states = random_states(len(system.coordinates), 10)
    expected = [SYSTEMS[name](*state) for state in zip(*states, strict=True)]
    assert relative_error(robot.inverse_dynamics(*states), expected) <= 1e-12
    start = 0.3 + 0.1 * np.arange(robot.n)
    motion = robot.simulate(
        start, 0.0 * start, np.linspace(0, 0.5, 51), method="DOP853", rtol=1e-12, atol=1e-13
    )
    assert np.abs(motion.energy_drift).max() <= 1e-9


def test_the_teachers_notebook_runs_from_top_to_bottom(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pyplot, drawn = pytest.importorskip("matplotlib.pyplot"), []
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(pyplot, "show", lambda: drawn.append(pyplot.get_fignums()))
    notebook = json.loads((FOLDER.parent / "teaching.ipynb").read_text())
    names: dict[str, Any] = {}
    for cell in notebook["cells"]:
        if cell["cell_type"] == "code":
            exec(compile("".join(cell["source"]), "teaching.ipynb", "exec"), names)
    pyplot.close("all")
    assert len(drawn) == 2
    assert set(names["causes"]) >= {"trolley accelerates", "load swings (its speed)", "rail", "motor"}
