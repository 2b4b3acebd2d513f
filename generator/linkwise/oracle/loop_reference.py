"""Reference for constraints: motion in the null space of A, and least squares, where loops close.

With N an orthonormal basis of the null space, M qdd + h = tau + A^T lambda and A qdd = -dA/dt qd give
(N^T M N) z = N^T (tau - h - M p) for qdd = N z + p, p = -A^+ dA/dt qd; lambda is what A^T lambda fits best.
N is orthonormal in joints measured by sqrt(M_ii), so that a light link's motion is not lost beside a body's.
The package goes another way: it eliminates the dependent joints, by QR. The noise includes what that may
lose.

Loops may be open by some micrometres, where a file's numbers are rounded: rows are those of `basis`, U^T A
and U^T dA/dt for U^T lambda, which are as good as all of them where loops close.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from linkwise_runtime.rule.joint_tree import JointTree

from linkwise.arrays import Array
from linkwise.oracle.held_motion import (
    condition_of,
    far_from_singular,
    held_mass,
    held_motion,
    motions,
    steady,
    with_noise,
)
from linkwise.oracle.loop_equations import LoopEquations
from linkwise.oracle.newton_euler import NewtonEuler
from linkwise.oracle.reference import by_unit
from linkwise.oracle.rounding import measure_rounding
from linkwise.oracle.states import States
from linkwise.package.manifest import Manifest

STATES = 12
TRIED = 60
SMALL = 1e-7
"""Singular values below this part of the largest belong to rows that follow from others."""


class RowsOf(Protocol):
    """Interface of equations with rows."""

    def rows(self, q: Array) -> Array:
        """Return A (samples, C, n)."""


@dataclass(frozen=True)
class LoopReference:
    """Answers at `states`, in which loops close, by name, samples first, and the scales of their rounding.

    tau: torques on all joints, (samples, n)
    leads_back: positions of the independent joints tell those of the others, nearby
    """

    equations: RowsOf
    independent: tuple[int, ...]
    states: States
    tau: Array
    values: Mapping[str, Array]
    scales: Mapping[str, Array]
    leads_back: bool = True


def loop_reference(manifest: Manifest, tree: JointTree, states: States) -> LoopReference | None:
    """Return the answers where loops close; None where none of the states leads there."""
    equations = LoopEquations(NewtonEuler(manifest, tree), tree)
    own = tree.independent
    rest = [k for k in range(len(manifest.joints)) if k not in own]
    # Ever closer to where the package has the loops closed, so that some start always succeeds.
    tried = states.q[:TRIED]
    starts = [tried, *(tree.closed_position + tried * part for part in (0.5, 0.1, 0.02))]
    q = equations.closed_near(np.concatenate(starts))
    q = q[far_from_singular(equations.rows(q), rest)]
    q = q[steady(equations.recursion, q, equations.velocity_map(q))][: min(STATES, len(states.q))]
    if not len(q):
        return None
    condition = condition_of(equations.rows(q), rest)
    yd, ydd = states.qd[: len(q), own], states.qdd[: len(q), own]
    tau = np.random.default_rng(5).uniform(-1.0, 1.0, q.shape)

    def answers(tree: JointTree) -> dict[str, Array]:
        return _answers(LoopEquations(NewtonEuler(manifest, tree), tree), (q, yd, ydd), tau)

    values, scales = measure_rounding(answers, tree, condition**2)
    moved = States(q, values["velocity"], values["acceleration"])
    return LoopReference(equations, own, moved, tau, values, scales)


def _answers(equations: LoopEquations, motion: tuple[Array, Array, Array], tau: Array) -> dict[str, Array]:
    """Return all answers of a package to q, yd and ydd, and to torques, by name."""
    (q, yd, ydd), own = motion, equations.tree.independent
    rest = [k for k in range(q.shape[1]) if k not in own]
    rows, basis = equations.rows(q), equations.basis(q)
    onto = np.swapaxes(basis, -1, -2)
    held = onto @ rows
    followed = _Followed(equations, own, rest, q)
    qd = followed.velocity(yd)
    qdd, rates = followed.acceleration(qd, ydd), equations.rates(q, qd)
    accelerations, forces = held_motion(equations.recursion, States(q, qd, qd), held, onto @ rates, tau, own)
    shares, link_forces = _shared(equations, own, held, States(q, qd, qdd))

    def share(speed: Array, change: Array, gravity: bool = False) -> Array:
        """Return the shares at each q, for as many motions in turn as there are for one."""
        times = len(speed) // len(q)
        again = np.repeat(q, times, 0)
        other = _Followed(equations, own, rest, again)
        full = other.velocity(speed)
        states = States(again, full, other.acceleration(full, change))
        return _shared(equations, own, np.repeat(held, times, 0), states, gravity)[0]

    of_own = States(yd, yd, ydd)
    c2 = by_unit(lambda y, yd, ydd, e: share(0.0 * yd, e), of_own)
    # The central difference of a quadratic form of yd is its derivative; the closing convention takes half.
    c1 = by_unit(lambda y, yd, ydd, e: (share(yd + e, 0.0 * yd) - share(yd - e, 0.0 * yd)) / 4.0, of_own)
    units = equations.units[:, None]
    found = {
        "violation": equations.violation(q) * equations.units,
        "jacobian": rows * units,
        "jacobian_rate": rates * units,
        "velocity_map": followed.map,
        "velocity": qd,
        "acceleration": qdd,
        "velocity_accelerations": qdd - (followed.map @ ydd[..., None])[..., 0],
        "projected": (np.swapaxes(followed.map, -1, -2) @ tau[..., None])[..., 0],
        "tau^": shares,
        "sum of tau^": shares.sum(-1),
        "c2^": c2,
        "c1^": c1,
        "g^": share(0.0 * yd, 0.0 * yd, gravity=True),
        "lambda of links": basis @ link_forces / units,
        "qdd": accelerations,
        "lambda": (basis @ forces[..., None] / units)[..., 0],
    }
    return found | _induced(equations, States(q, qd, qd), (held, onto @ rates, basis / units), tau)


def _induced(
    equations: LoopEquations, states: States, tied: tuple[Array, Array, Array], tau: Array
) -> dict[str, Array]:
    """Return accelerations (samples, n, ...) and forces of ties (samples, C, ...) by source.

    Each source x with force F_x, and the constraints' own with A q̈ = b, b = −Ȧ_s q̇_s, has

        q̈_x = N (Nᵀ M N)⁻¹ Nᵀ (F_x − M p_x) + p_x,  p_x = A⁺ b_x
        λ_x: what Aᵀ λ_x = M q̈_x − F_x fits best
    """
    (rows, rates, basis), torque = tied, equations.recursion.partial_torque
    q, qd, _ = states.motion
    n, rest = q.shape[1], 0.0 * q
    mass = held_mass(equations.recursion, q, rows, equations.tree.independent)
    velocity = by_unit(lambda q, qd, _, e: 0.5 * torque(q, qd + 1j * e, 0.0 * q, gravity=False).imag, states)
    forces = {
        "actuators": np.eye(n) * tau[:, None, :],
        "velocity": -velocity * qd[:, None, None, :],
        "gravity": -torque(q, rest, rest),
        "constraints": np.zeros((*q.shape, n)),
    }
    null = motions(mass, rows)
    back, turned = np.swapaxes(null, -1, -2), np.swapaxes(rows, -1, -2)
    own = -np.linalg.pinv(rows, rcond=SMALL) @ (rates * qd[:, None, :])
    found = {}
    for source, force in forces.items():
        flat = force.reshape(*force.shape[:2], -1)
        bias = own if source == "constraints" else 0.0 * flat
        driven = np.linalg.solve(back @ mass @ null, back @ (flat - mass @ bias))
        shares = null @ driven + bias
        left = mass @ shares - flat
        if equations.recursion.noise:
            left = equations.recursion.noise(left, np.abs(mass) @ np.abs(shares) + np.abs(flat))
        held = np.linalg.pinv(turned, rcond=SMALL) @ left
        found[f"{source}: accelerations"] = shares.reshape(force.shape)
        found[f"{source}: reactions"] = (basis @ held).reshape(len(q), -1, *force.shape[2:])
    return found


@dataclass(frozen=True)
class _Followed:
    """Motion of all joints that follows from the independent ones, by least squares."""

    equations: LoopEquations
    own: Sequence[int]
    rest: Sequence[int]
    q: Array

    @property
    def map(self) -> Array:
        """Velocity map G, (samples, n, m)."""
        return self.equations.velocity_map(self.q)

    def velocity(self, yd: Array) -> Array:
        """Return qd (samples, n)."""
        full: Array = (self.map @ yd[..., None])[..., 0]
        return full

    def acceleration(self, qd: Array, ydd: Array) -> Array:
        """Return qdd (samples, n)."""
        rows, drift = self.equations.rows(self.q), self.equations.rates(self.q, qd) @ qd[..., None]
        full = self.velocity(ydd)
        full[:, self.rest] -= (np.linalg.pinv(rows[..., self.rest]) @ drift)[..., 0]
        return full


def _shared(
    equations: LoopEquations, own: Sequence[int], rows: Array, states: States, gravity: bool = True
) -> tuple[Array, Array]:
    """Return the shares of each link that independent joints and ties carry: S tau^ + A^T lambda = tau_j."""
    samples, _, n = rows.shape
    driven = np.broadcast_to(np.eye(n)[:, own], (samples, n, len(own)))
    both = np.concatenate([driven, np.swapaxes(rows, -1, -2)], -1)
    inverse = np.linalg.pinv(both, rcond=SMALL)
    torque = equations.recursion.partial_torque(*states.motion, gravity)
    found = with_noise(equations.recursion, inverse @ torque, inverse, torque)
    return found[:, : len(own)], found[:, len(own) :]
