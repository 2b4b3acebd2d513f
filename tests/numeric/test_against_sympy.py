"""Planar arms, and links some of which have one energy alone, against SymPy's own LagrangesMethod."""

from collections.abc import Callable
from types import ModuleType
from typing import Any, NamedTuple

import numpy as np
import pytest
import sympy as sp
from helpers.answers import random_states, relative_error
from linkwise import Coordinate, LinkEnergy, energy_system, generate, write_package
from linkwise.package.load import import_package
from sympy.physics.mechanics import LagrangesMethod, dynamicsymbols

LENGTH, CENTRE, MASS, INERTIA, GRAVITY = 0.25, 0.125, 0.6, 5e-3, 9.80665


def link_lagrangian(angles: list[sp.Expr], j: int) -> sp.Expr:
    """½ m |ċ|² + ½ I θ̇² − m g y, with absolute angles θ_j = q_1 + … + q_j."""
    t = dynamicsymbols._t
    absolute = [sum(angles[: k + 1]) for k in range(j + 1)]
    lengths = [LENGTH] * j + [CENTRE]
    x = sum(length * sp.cos(a) for length, a in zip(lengths, absolute, strict=True))
    y = sum(length * sp.sin(a) for length, a in zip(lengths, absolute, strict=True))
    kinetic = MASS * (x.diff(t) ** 2 + y.diff(t) ** 2) / 2 + INERTIA * absolute[-1].diff(t) ** 2 / 2
    return kinetic - MASS * GRAVITY * y


@pytest.mark.parametrize("n", [2, 3])
def test_partial_torques_are_those_of_lagranges_method(
    n: int, package_of: Callable[[str], ModuleType]
) -> None:
    angles = list(dynamicsymbols(f"q1:{n + 1}"))
    t = dynamicsymbols._t
    motion = [a.diff(t, order) for order in (2, 1, 0) for a in angles]
    plain = sp.symbols(f"x:{len(motion)}")
    states = random_states(n, 50)
    given = package_of(f"planar{n}").load("numpy").partial_torque(*states)
    for j in range(n):
        equations = LagrangesMethod(link_lagrangian(angles, j), angles).form_lagranges_equations()
        # Higher derivatives first: x(t) may only be replaced once no derivative of it is left.
        for derivative, symbol in zip(motion, plain, strict=True):
            equations = equations.subs(derivative, symbol)
        function = sp.lambdify([plain], list(equations), cse=True)
        expected = [function(np.concatenate(state[::-1])) for state in zip(*states, strict=True)]
        assert relative_error(given[:, :, j], np.array(expected, dtype=float)) <= 1e-12


A, B, C, D = (Coordinate(name) for name in "abcd")
ARM = ((0.125, 0), (0.25, 0.125))
SPEEDS = [
    sum(
        (sum(r * f(a) * v for r, a, v in zip(arm, (A.q, A.q + B.q), (A.qd, A.qd + B.qd), strict=True))) ** 2
        for f in (sp.cos, sp.sin)
    )
    for arm in ARM
]
HEIGHTS = [r * sp.sin(A.q) + s * sp.sin(A.q + B.q) for r, s in ARM]
ONE_ENERGY_ALONE = {
    "two masses and a spring": (
        [A, B],
        [
            LinkEnergy("left", 1.5 * A.qd**2, 0),
            LinkEnergy("right", 0.7 * B.qd**2, 0),
            LinkEnergy("spring", 0, 20 * (B.q - A.q) ** 2),
        ],
    ),
    "an arm with elastic joints": (
        [A, B, C, D],
        [
            LinkEnergy("rotor", 1e-2 * C.qd**2, 0),
            LinkEnergy("upper", 0.3 * SPEEDS[0] + 2.5e-3 * A.qd**2, 5.9 * HEIGHTS[0]),
            LinkEnergy("second rotor", 2e-3 * (A.qd + 5 * D.qd) ** 2, 0),
            LinkEnergy("lower", 0.3 * SPEEDS[1] + 2.5e-3 * (A.qd + B.qd) ** 2, 5.9 * HEIGHTS[1]),
            LinkEnergy("gear", 0, 3 * (A.q - C.q) ** 2),
            LinkEnergy("second gear", 0, 3 * (B.q - D.q) ** 4),
        ],
    ),
    "a cart and a wheel listed last": (
        [A, B],
        [
            LinkEnergy("spring", 0, 20 * A.q**2),
            LinkEnergy("cart", A.qd**2, 0),
            LinkEnergy("wheel", (2 + sp.cos(A.q)) * B.qd**2, 0),
        ],
    ),
    "nothing that moves": ([A, B], [LinkEnergy("spring", 0, 3 * A.q**2 * B.q)]),
}
"""Coordinates and links, of which one has no kinetic or no potential energy."""


class OfLink(NamedTuple):
    """Answers of LagrangesMethod on one link at every state; c1 as half the slope by velocities."""

    c2: Any
    c1: Any
    c0: Any
    g: Any
    tau: Any


def by_lagranges_method(coordinates: list[Coordinate], link: LinkEnergy, states: Any) -> OfLink:
    n, t = len(coordinates), dynamicsymbols._t
    moving = list(dynamicsymbols(f"y1:{n + 1}"))
    motion = [y.diff(t, order) for order in (2, 1, 0) for y in moving]
    plain = sp.symbols(f"x:{3 * n}")
    qdd, qd, q = sp.Matrix(plain[:n]), sp.Matrix(plain[n : 2 * n]), sp.Matrix(plain[2 * n :])
    written = [c.qd for c in coordinates] + [c.q for c in coordinates]
    lagrangian = (link.kinetic - link.potential).subs(dict(zip(written, motion[n:], strict=True)))
    method = LagrangesMethod(lagrangian, moving)
    tau, c2 = method.form_lagranges_equations(), method.mass_matrix
    for derivative, symbol in zip(motion, plain, strict=True):
        tau, c2 = tau.subs(derivative, symbol), c2.subs(derivative, symbol)
    rest = dict.fromkeys([*qdd, *qd], 0)
    parts = (c2, tau.jacobian(list(qd)) / 2, tau.jacobian(list(q)), tau.subs(rest), tau)
    rows = np.concatenate(states[::-1], -1)
    values = [np.array([sp.lambdify([plain], part)(row) for row in rows], dtype=float) for part in parts]
    return OfLink(*values[:3], *(value[..., 0] for value in values[3:]))


@pytest.fixture(scope="module", params=ONE_ENERGY_ALONE)
def case(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> tuple[ModuleType, Any, OfLink]:
    """A package of one of these, states, and what is expected there."""
    (coordinates, links), folder = ONE_ENERGY_ALONE[request.param], tmp_path_factory.mktemp("case") / "r"
    write_package(generate(energy_system("robot", coordinates, links), ["numpy", "autograd"]), folder)
    states = random_states(len(coordinates), 7)
    of_links = [by_lagranges_method(coordinates, link, states) for link in links]
    return (
        import_package(folder),
        states,
        OfLink(*(np.stack(part, 2) for part in zip(*of_links, strict=True))),
    )


@pytest.mark.parametrize("backend", ["numpy", "autograd", "autograd mapped"])
def test_links_with_one_energy_alone_move_as_lagranges_method_says(
    case: tuple[ModuleType, Any, OfLink], backend: str
) -> None:
    package, states, expected = case
    robot, motion = package.load(backend.split()[0]), states
    if backend != "numpy":
        torch = pytest.importorskip("torch")
        motion = [torch.from_numpy(state) for state in states]
    q, qd, _ = motion

    def answer(call: str, *given: Any) -> Any:
        found = getattr(robot, call)
        return (torch.vmap(found) if backend.endswith("mapped") else found)(*given)

    found = answer("coefficients", q, qd)
    pairs = [
        (found[0], expected.c2),
        (found[1], expected.c1),
        (found[2], expected.g),
        (answer("position_gradient", *motion), expected.c0),
        (answer("partial_torque", *motion), expected.tau),
        (answer("inverse_dynamics", *motion), expected.tau.sum(-1)),
        (answer("mass_matrix", q), expected.c2.sum(2)),
        (answer("gravity_torque", q), expected.g.sum(-1)),
    ]
    if backend == "autograd":
        graphs = [[robot.graph(i, j).evaluate(*motion) for j in range(robot.N)] for i in range(robot.n)]
        pairs.append(
            (np.moveaxis(np.array([[np.asarray(g) for g in row] for row in graphs]), 2, 0), expected.tau)
        )
    for value, reference in pairs:
        np.testing.assert_allclose(np.asarray(value), reference, rtol=1e-12, atol=1e-12)
