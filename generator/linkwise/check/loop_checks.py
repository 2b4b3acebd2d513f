"""Each call of a back end's constraints, and its induced accelerations in loops, against `loop_reference`."""

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from linkwise_runtime.dynamics import Dynamics

from linkwise.check.compare import Entries, Result, compare
from linkwise.check.loop_reference import LoopReference
from linkwise.package.load import Array

TOLD = "in closed loops against least squares"
PERTURBED = 1e-3
"""How far dependent joints are moved away before they are closed again, in rad and m."""
CHANGED = 0.1
"""By this part of itself A_d may change on that way; else they are moved half as far."""
HALVED = 40
"""So often at most."""
SETTLED = 1e-11
"""How near loops are closed again, of positions of size 1."""


def loop_calls(name: str, model: Dynamics, reference: LoopReference) -> Iterator[Result]:
    """The answers of one back end."""
    yield compare(f"{name}: velocities {TOLD}", _velocities(model, reference))
    yield compare(f"{name}: shares {TOLD}", _shares(model, reference))
    yield compare(f"{name}: forces and accelerations {TOLD}", _forces(model, reference))
    for what, call in (("accelerations", "induced_accelerations"), ("reactions", "induced_reactions")):
        q, qd, _ = reference.states.motion
        found = getattr(model, call)(q, qd, reference.tau, passive=False)
        entries = [
            _entries(reference, f"{source}: {what}", getattr(found, source))
            for source in ("actuators", "velocity", "gravity", "constraints")
        ]
        yield compare(f"{name}: induced {what} {TOLD}", entries)


def _entries(reference: LoopReference, what: str, found: Any) -> Entries:
    return Entries(what, found, reference.values[what], reference.scales[what])


def _velocities(model: Dynamics, reference: LoopReference) -> Iterator[Entries]:
    (q, qd, qdd), own = reference.states.motion, list(reference.independent)
    constraints = model.constraints
    # Least steps end where they no longer matter: a position is as near as that, not as rounding allows.
    size = np.broadcast_to(1.0 + np.abs(q).max(-1, keepdims=True), q.shape)
    yield Entries("closed", constraints.closed(q + _away(reference)), q, size * SETTLED / np.finfo(float).eps)
    found = {
        "violation": constraints.violation(q),
        "jacobian": constraints.jacobian(q),
        "jacobian_rate": constraints.jacobian_rate(q, qd),
        "velocity_map": constraints.velocity_map(q),
        "velocity": constraints.velocity(q, qd[:, own]),
        "acceleration": constraints.acceleration(q, qd, qdd[:, own]),
        "velocity_accelerations": constraints.velocity_accelerations(q, qd).sum(-1),
    }
    yield from (_entries(reference, what, value) for what, value in found.items())


def _away(reference: LoopReference) -> Array:
    """Where dependent joints are moved to (samples, n), so near that Newton's method leads back.

    It does where A_d, on the way, changes by a part of itself alone (Kantorovich): next to a dead point
    another position closes the loop too, however near.
    """
    q, rest = reference.states.q, [k for k in range(reference.tau.shape[1]) if k not in reference.independent]
    away = np.zeros_like(q)
    away[:, rest] = np.random.default_rng(6).uniform(-PERTURBED, PERTURBED, (len(q), len(rest)))
    there = reference.equations.rows(q)[..., rest]
    inverse = np.linalg.pinv(there)
    for _ in range(HALVED):
        change = reference.equations.rows(q + away)[..., rest] - there
        far = np.linalg.norm(inverse @ change, 2, (1, 2)) > CHANGED
        if not far.any():
            break
        away[far] /= 2.0
    return away


def _shares(model: Dynamics, reference: LoopReference) -> Iterator[Entries]:
    constraints, motion = model.constraints, reference.states.motion
    (q, qd, qdd), own = motion, list(reference.independent)
    yield _entries(reference, "tau^", constraints.partial_torque(*motion))
    yield _entries(reference, "sum of tau^", constraints.inverse_dynamics(*motion))
    coefficients, parts = constraints.coefficients(q, qd), constraints.propagation(*motion)
    factors: Sequence[Array] = (qdd[:, None, None, own], qd[:, None, None, own], np.ones((1, 1, 1)))
    for what, value, part, factor in zip(("c2^", "c1^", "g^"), coefficients, parts, factors, strict=True):
        yield _entries(reference, what, value)
        expected, scale = (source[what] for source in (reference.values, reference.scales))
        yield Entries(f"{what} times its motion", part, expected * factor, scale * np.abs(factor).max())
    yield _entries(reference, "projected", constraints.projected(q, reference.tau))


def _forces(model: Dynamics, reference: LoopReference) -> Iterator[Entries]:
    constraints, (q, qd, qdd) = model.constraints, reference.states.motion
    yield _entries(reference, "lambda of links", constraints.forces(q, qd, qdd))
    found = constraints.forward_dynamics(q, qd, reference.tau, passive=False)
    yield _entries(reference, "qdd", found.qdd)
    yield _entries(reference, "lambda", found.forces)
