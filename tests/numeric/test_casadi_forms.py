"""Closed forms that compute with CasADi's symbols, as docs/coming-from-casadi.md says, against Pinocchio."""

import importlib
from collections.abc import Callable
from types import ModuleType

import numpy as np
import pytest
from helpers.answers import random_states, relative_error

pytest.importorskip("pinocchio")
pytest.importorskip("casadi")

import casadi as ca

from numeric import oracle_models


def test_closed_forms_in_casadi_and_their_slopes_are_pinocchios(
    package_of: Callable[[str], ModuleType],
) -> None:
    package = package_of("puma560")
    joints = package.load("numpy").joint_names
    n, states = len(joints), random_states(len(joints), 20)
    symbols = [ca.SX.sym(name, n) for name in ("q", "qd", "qdd")]
    rows = [np.array(ca.vertsplit(part), dtype=object) for part in symbols]
    torque, slope = np.zeros((20, n, n)), np.zeros((20, n, n, n))
    for j in range(n):
        link = importlib.import_module(f"{package.__name__}.forms.link_{j + 1}")
        form = ca.vertcat(*link.torque(ca, *rows, {}))
        function = ca.Function("link", symbols, [form, ca.jacobian(form, symbols[0])])
        for s, state in enumerate(zip(*states, strict=True)):
            value, gradient = (answer.full() for answer in function(*state))
            torque[s, link.PATH, j] = value[:, 0]
            slope[s, link.PATH, j] = gradient
    expected = oracle_models.decomposition(oracle_models.puma560(), joints, *states)
    assert relative_error(torque, expected["torque"]) <= 1e-14
    assert relative_error(slope, expected["position_gradient"]) <= 1e-14
