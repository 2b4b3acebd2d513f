"""Each call of a back end's constraints against `loop_reference`."""

from collections.abc import Iterator
from typing import Any

import numpy as np

from linkwise.check.compare import Entries, Result, compare
from linkwise.check.loop_reference import FAR, LoopReference
from linkwise.package.load import Array, Model

TOLD = "in closed loops against least squares"
PERTURBED = 1e-3
"""How far dependent joints are moved away before they are closed again, in rad and m."""


def loop_calls(name: str, model: Model, reference: LoopReference) -> Iterator[Result]:
    """The answers of one back end."""
    constraints: Any = model.constraints
    yield compare(f"{name}: velocities {TOLD}", _velocities(constraints, reference))
    yield compare(f"{name}: shares {TOLD}", _shares(constraints, reference))
    yield compare(f"{name}: forces and accelerations {TOLD}", _forces(constraints, reference))


def _velocities(constraints: Any, reference: LoopReference) -> Iterator[Entries]:
    (q, qd, qdd), own = reference.states.motion, list(reference.independent)
    away = np.random.default_rng(6).uniform(-PERTURBED, PERTURBED, q.shape)
    away[:, own] = 0.0
    yield loop_entries("closed", constraints.closed(q + away), q, 1.0 + np.abs(q).max())
    yield loop_entries(
        "violation", constraints.violation(q), reference.equations.violation(q), 1.0 + np.abs(q).max()
    )
    yield loop_entries("jacobian", constraints.jacobian(q), reference.rows)
    yield loop_entries("jacobian_rate", constraints.jacobian_rate(q, qd), reference.rates)
    yield loop_entries("velocity_map", constraints.velocity_map(q), reference.map)
    yield loop_entries("velocity", constraints.velocity(q, qd[:, own]), qd)
    yield loop_entries("acceleration", constraints.acceleration(q, qd, qdd[:, own]), qdd)
    bias = qdd - (reference.map @ qdd[:, own, None])[..., 0]
    causes = constraints.velocity_accelerations(q, qd).sum(-1)
    yield loop_entries("velocity_accelerations", causes, bias, np.abs(qdd).max())


def _shares(constraints: Any, reference: LoopReference) -> Iterator[Entries]:
    motion, own = reference.states.motion, list(reference.independent)
    q, qd, qdd = motion
    yield loop_entries("tau^", constraints.partial_torque(*motion), reference.shares)
    total = reference.shares.sum(-1)
    yield loop_entries(
        "sum of tau^", constraints.inverse_dynamics(*motion), total, np.abs(reference.shares).max()
    )
    for what, found, expected in zip(
        ("c2^", "c1^", "g^"), constraints.coefficients(q, qd), reference.coefficients, strict=True
    ):
        yield loop_entries(what, found, expected)
    c2, c1, g = reference.coefficients
    parts = c2 * qdd[:, None, None, own], c1 * qd[:, None, None, own], g
    for what, found, expected in zip(
        ("c2^ ydd", "c1^ yd", "gravity"), constraints.propagation(*motion), parts, strict=True
    ):
        yield loop_entries(what, found, expected, np.abs(expected).max())
    expected = (np.swapaxes(reference.map, -1, -2) @ reference.tau[..., None])[..., 0]
    yield loop_entries("projected", constraints.projected(q, reference.tau), expected)


def _forces(constraints: Any, reference: LoopReference) -> Iterator[Entries]:
    motion = reference.states.motion
    q, qd, _ = motion
    forces = reference.link_forces
    yield loop_entries("lambda of links", constraints.forces(*motion), forces)
    found = constraints.forward_dynamics(q, qd, reference.tau, passive=False)
    yield loop_entries("qdd", found.qdd, reference.qdd)
    yield loop_entries("lambda", found.forces, reference.forces)


def loop_entries(what: str, value: Any, expected: Array, scale: float = 0.0) -> Entries:
    """Solving makes rounding larger, by no more than A_d is badly conditioned."""
    size = max(float(np.abs(expected).max(initial=0.0)), scale)
    return Entries(what, value, expected, np.full(expected.shape, size / FAR**2))
