"""Induced accelerations and reactions in closed loops by source, against motion in the null space of A.

Each source x with force F_x, and the constraints' own with A q̈ = b, b = −Ȧ_s q̇_s, has

    q̈_x = N (Nᵀ M N)⁻¹ Nᵀ (F_x − M p_x) + p_x,  p_x = A⁺ b_x        λ_x: what Aᵀ λ_x = M q̈_x − F_x fits best
"""

from collections.abc import Iterator
from typing import Any

import numpy as np

from linkwise.check.compare import Entries, Result, compare
from linkwise.check.induced_checks import diagonal, flat
from linkwise.check.loop_checks import TOLD, loop_entries
from linkwise.check.loop_reference import LoopReference, mass_matrix
from linkwise.check.reference import columns
from linkwise.package.load import Array, Model

SMALL = 1e-7
"""Singular values below this part of the largest are those of rows that follow from others."""


def induced_loop_calls(name: str, model: Model, reference: LoopReference) -> Iterator[Result]:
    """Both calls of one back end."""
    calls: Any = model
    q, qd, _ = reference.states.motion
    accelerations, forces = _shares(reference)
    found = {
        "induced accelerations": calls.induced_accelerations(q, qd, reference.tau, passive=False),
        "induced reactions": calls.induced_reactions(q, qd, reference.tau, passive=False),
    }
    for (what, shares), expected in zip(found.items(), (accelerations, forces), strict=True):
        yield compare(f"{name}: {what} {TOLD}", _compared(shares, expected))


def _compared(found: Any, expected: dict[str, Array]) -> Iterator[Entries]:
    size = max(float(np.abs(value).max(initial=0.0)) for value in expected.values())
    for source, value in expected.items():
        yield loop_entries(source, getattr(found, source), value, size)


def _shares(reference: LoopReference) -> tuple[dict[str, Array], dict[str, Array]]:
    """Accelerations (samples, n, ...) and forces (samples, C, ...) by source."""
    torque, (q, qd, _) = reference.equations.recursion.partial_torque, reference.states.motion
    n, rest = q.shape[1], 0.0 * q
    mass = mass_matrix(reference.equations.recursion, q)
    velocity = columns(lambda unit: 0.5 * torque(q, qd + 1j * unit, rest, gravity=False).imag, n)
    forces = {
        "actuators": diagonal(reference.tau),
        "velocity": -velocity * qd[:, None, None, :],
        "gravity": -torque(q, rest, rest),
        "constraints": np.zeros((*q.shape, n)),
    }
    onto = np.swapaxes(reference.basis, -1, -2)
    rows, moved, borne = onto @ reference.rows, {}, {}
    free = len(reference.independent)
    null = np.swapaxes(np.linalg.svd(rows)[2][:, -free:], -1, -2)
    back, turned = np.swapaxes(null, -1, -2), np.swapaxes(rows, -1, -2)
    own = -np.linalg.pinv(rows, rcond=SMALL) @ (onto @ reference.rates * qd[:, None, :])
    for source, force in forces.items():
        bias = own if source == "constraints" else 0.0 * flat(force)
        driven = np.linalg.solve(back @ mass @ null, back @ (flat(force) - mass @ bias))
        shares = null @ driven + bias
        held = np.linalg.pinv(turned, rcond=SMALL) @ (mass @ shares - flat(force))
        moved[source] = shares.reshape(force.shape)
        borne[source] = (reference.basis @ held).reshape(len(q), -1, *force.shape[2:])
    return moved, borne
