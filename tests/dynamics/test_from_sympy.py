"""Systems of sympy.physics.mechanics, held against SymPy's own KanesMethod and LagrangesMethod."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import sympy as sp
from helpers.answers import relative_error
from linkwise import LinkwiseError, from_sympy, generate, read_system, write_package
from linkwise.package.load import import_package
from sympy.physics.mechanics import (
    Force,
    KanesMethod,
    LagrangesMethod,
    Particle,
    PinJoint,
    Point,
    PrismaticJoint,
    ReferenceFrame,
    RigidBody,
    System,
    Torque,
    dynamicsymbols,
)
from sympy.physics.mechanics.actuator import LinearDamper, LinearSpring
from sympy.physics.mechanics.pathway import LinearPathway

T = dynamicsymbols._t
X, THETA, U, OMEGA, PUSH = dynamicsymbols("x theta u omega F")
M, m, r, k, c, g = sp.symbols("M m r k c g", positive=True)


def cart_pole() -> tuple[System, dict[sp.Symbol, float]]:
    """A cart on a spring and a damper, pushed, whose pole is turned by a torque."""
    wall, cart, pole = RigidBody("wall"), RigidBody("cart", mass=M), RigidBody("pole", mass=m)
    system = System.from_newtonian(wall)
    slide = PrismaticJoint("slide", wall, cart, coordinates=X, speeds=U, joint_axis=wall.x)
    pin = PinJoint(
        "pin", cart, pole, coordinates=THETA, speeds=OMEGA, joint_axis=cart.z, child_point=r * pole.y
    )
    system.add_joints(slide, pin)
    system.apply_uniform_gravity(-g * wall.frame.y)
    way = LinearPathway(wall.masscenter, cart.masscenter)
    system.add_actuators(LinearSpring(k, way, equilibrium_length=sp.Rational(1, 10)), LinearDamper(c, way))
    system.add_loads(Force(cart.masscenter, PUSH * wall.x), Torque(pole.frame, sp.sin(T) * wall.z))
    values = {M: 2.0, m: 0.3, r: 0.5, k: 40.0, c: 0.8, g: 9.81}
    inertias = {s for body in (cart, pole) for s in body.central_inertia.to_matrix(body.frame).free_symbols}
    return system, values | dict.fromkeys(sorted(inertias, key=str), 0.02)


def loaded(system: Any, folder: Path) -> Any:
    write_package(generate(system, ["numpy"]), folder / system.name)
    return import_package(folder / system.name).load("numpy")


def test_a_system_moves_as_kanes_method_says(tmp_path: Path) -> None:
    system, values = cart_pole()
    robot = loaded(from_sympy(system, values, inputs=[PUSH], name="pole"), tmp_path).at(t=0.4, F=1.3)
    assert robot.link_names == ("cart", "pole")
    assert robot.share_names == ("force", "LinearSpring", "LinearDamper", "gravity")
    system.form_eoms()
    kane = system.eom_method
    assert isinstance(kane, KanesMethod)
    known = [X, THETA, U, OMEGA, PUSH, T, *values]
    exact = sp.lambdify(known, [kane.mass_matrix, kane.forcing])
    rng = np.random.default_rng(0)
    for _ in range(10):
        q, qd = rng.normal(size=2), rng.normal(size=2)
        mass, forcing = exact(*q, *qd, 1.3, 0.4, *values.values())
        qdd = np.linalg.solve(mass, forcing).ravel()
        assert relative_error(robot.forward_dynamics(q, qd, np.zeros(2)), qdd) <= 1e-12


def test_generalised_speeds_become_velocities_and_energies_those_of_lagranges_method(tmp_path: Path) -> None:
    frame, origin = ReferenceFrame("N"), Point("O")
    system = System(frame, origin)
    origin.set_vel(frame, 0)
    bead = Particle("bead", Point("P"), m)
    bead.masscenter.set_pos(origin, X * sp.cos(THETA) * frame.x + X * sp.sin(THETA) * frame.y)
    speeds = {X.diff(T): U, THETA.diff(T): OMEGA / X}  # along and across the ray
    bead.masscenter.set_vel(frame, bead.masscenter.pos_from(origin).dt(frame).subs(speeds))
    bead.potential_energy = k * X**2 / 2
    system.add_bodies(bead)
    system.add_coordinates(X, THETA)
    system.add_speeds(U, OMEGA)
    system.add_kdes(U - X.diff(T), OMEGA - X * THETA.diff(T))
    values = {m: 0.7, k: 3.0}
    with pytest.raises(
        LinkwiseError, match=r"x\(t\), theta\(t\) have no unit; give them, units={system\.q\[0\]"
    ):
        from_sympy(system, values)
    robot = loaded(from_sympy(system, values, {X: "m", THETA: "rad"}, name="bead"), tmp_path)
    kinetic = m * (X.diff(T) ** 2 + X**2 * THETA.diff(T) ** 2) / 2
    equations = LagrangesMethod(kinetic - k * X**2 / 2, [X, THETA]).form_lagranges_equations()
    symbols = sp.symbols("x0:2 v0:2 a0:2")
    named = {q.diff(T, n): symbols[2 * n + i] for n in (2, 1, 0) for i, q in enumerate((X, THETA))}
    exact = sp.lambdify(symbols, list(equations.xreplace(named).xreplace(values)))
    states = np.random.default_rng(1).normal(size=(3, 10, 2))
    expected = [exact(*np.concatenate(state)) for state in states.swapaxes(0, 1)]
    assert relative_error(robot.inverse_dynamics(*states), expected) <= 1e-12


FILE = """
import sympy as sp
from linkwise import Coordinate, LinkEnergy, energy_system, from_sympy
from sympy.physics.mechanics import PrismaticJoint, RigidBody, System

wall, cart = RigidBody("wall"), RigidBody("cart", mass=2)
_system = System.from_newtonian(wall)
_system.add_joints(PrismaticJoint("slide", wall, cart, joint_axis=wall.x))
"""


def test_a_file_may_hold_a_whole_system(tmp_path: Path) -> None:
    (tmp_path / "cart.py").write_text(FILE + "system = from_sympy(_system, name='cart')\n")
    assert read_system(tmp_path / "cart.py").link_names == ("cart",)
    own = "coordinates, links = [Coordinate('x')], [LinkEnergy('a', Coordinate('x').qd ** 2)]\n"
    made = FILE + own + "system = energy_system('own', coordinates, links)\n"
    (tmp_path / "own.py").write_text(made)
    assert read_system(tmp_path / "own.py").link_names == ("a",)


@pytest.mark.parametrize(
    ("written", "message"),
    [
        (
            "system = from_sympy(_system)\nlinks = []",
            "'links' in line 10 .*: beside `system` linkwise reads noth",
        ),
        ("system = _system", "line 9: `system` is a System of sympy.* system = linkwise.from_sympy"),
        (
            "system = from_sympy(_system, {\n    cart.mass: 'a'})",
            "line 9: `parameters` must be a dictionary",
        ),
    ],
)
def test_what_a_file_gives_for_a_whole_system_is_refused_by_its_line(
    written: str, message: str, tmp_path: Path
) -> None:
    (tmp_path / "cart.py").write_text(FILE + written)
    with pytest.raises(LinkwiseError, match=f"cart.py: {message}"):
        read_system(tmp_path / "cart.py")


def test_what_is_no_system_is_refused() -> None:
    system, values = cart_pole()
    system.add_holonomic_constraints(X - sp.sin(THETA))
    system.velocity_constraints = [X.diff() - 2 * THETA.diff()]
    with pytest.raises(LinkwiseError, match="the system has velocity_constraints of its own in place of"):
        from_sympy(system, values)
    with pytest.raises(
        LinkwiseError, match=r"from_sympy takes a sympy\.physics\.mechanics\.System, and got int"
    ):
        from_sympy(3)  # type: ignore[arg-type]


@pytest.mark.parametrize("are_numbers", [False, True])
def test_a_weight_is_that_of_its_own_body_though_another_holds_its_masscenter(
    are_numbers: bool, tmp_path: Path
) -> None:
    """A wheel turns about its masscenter, at the end of a rod; gravity falls along tilted axes."""
    values = {} if are_numbers else {M: 1.7, m: 0.4, r: 0.6, g: 9.81}
    heavy, light, length, fall = (1.7, 0.4, 0.6, 9.81) if are_numbers else (M, m, r, g)
    wall, rod, wheel = RigidBody("wall"), RigidBody("rod", mass=light), RigidBody("wheel", mass=heavy)
    system = System.from_newtonian(wall)
    end = -length * rod.y
    system.add_joints(
        PinJoint("hip", wall, rod, THETA, OMEGA, joint_axis=wall.z, child_point=length * rod.y),
        PinJoint("axle", rod, wheel, *dynamicsymbols("turn spin"), joint_axis=rod.z, parent_point=end),
    )
    tilted = wall.frame.orientnew("G", "axis", [sp.Rational(3, 10), wall.z])
    system.apply_uniform_gravity(-fall * tilted.y)
    inertias = {s for b in (rod, wheel) for s in b.central_inertia.to_matrix(b.frame).free_symbols}
    robot = loaded(from_sympy(system, values | dict.fromkeys(sorted(inertias, key=str), 0.02)), tmp_path)
    assert robot.share_names == ("gravity",)
    swing = 9.81 * 0.6 * np.sin(0.8 - 0.3)
    weights = robot.named_shares(np.array([0.8, 0.2]), np.zeros(2))
    np.testing.assert_allclose(weights[..., 0], [[0.4 * swing, 2 * 1.7 * swing], [0, 0]], atol=1e-12)


def test_a_force_that_gives_all_bodies_another_acceleration_is_no_gravity(tmp_path: Path) -> None:
    cart, pole = Particle("cart", Point("C"), 2.0), Particle("pole", Point("P"), 0.3)
    frame, origin = ReferenceFrame("N"), Point("O")
    origin.set_vel(frame, 0)
    system = System(frame, origin)
    cart.masscenter.set_pos(origin, X * frame.x)
    pole.masscenter.set_pos(origin, THETA * frame.x)
    for body in (cart, pole):
        body.masscenter.set_vel(frame, body.masscenter.pos_from(origin).dt(frame))
    system.add_bodies(cart, pole)
    system.add_coordinates(X, THETA)
    system.add_speeds(U, OMEGA)
    system.add_kdes(U - X.diff(T), OMEGA - THETA.diff(T))
    system.add_loads(Force(cart.masscenter, 6 * frame.x), Force(pole.masscenter, 6 * frame.x))
    robot = loaded(from_sympy(system, units={X: "m", THETA: "m"}), tmp_path)
    assert robot.share_names == ("force",)


def test_what_is_joined_to_nothing_and_what_is_no_system_is_named() -> None:
    system, values = cart_pole()
    method = LagrangesMethod(M * X.diff(T) ** 2 / 2, [X])
    with pytest.raises(LinkwiseError, match=r"mechanics\.System, and got LagrangesMethod$"):
        from_sympy(method, values)
    system.add_bodies(RigidBody("kite"))
    with pytest.raises(
        LinkwiseError, match=r"^body 'kite': nothing says how it moves in .*; join it by a jo"
    ):
        from_sympy(system, values)
    system, values = cart_pole()
    system.add_loads(Torque(ReferenceFrame("gust"), PUSH * system.frame.x))
    with pytest.raises(LinkwiseError, match=r"^nothing says how 'gust' moves, on which a load acts, in the"):
        from_sympy(system, values, inputs=[PUSH])
