"""τ_ij of planar arms against SymPy's own LagrangesMethod, one Lagrangian written by hand a link."""

from collections.abc import Callable
from types import ModuleType

import numpy as np
import pytest
import sympy as sp
from answers import random_states, relative_error
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
