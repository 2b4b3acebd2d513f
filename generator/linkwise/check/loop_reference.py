"""What constraints are held against: motion in the null space of A, and least squares, where loops close.

With N an orthonormal basis of the null space, M qdd + h = tau + A^T lambda and A qdd = -dA/dt qd give
(N^T M N) z = N^T (tau - h - M p) for qdd = N z + p, p = -A^+ dA/dt qd; lambda is what A^T lambda fits best.
The package goes another way: it takes the dependent joints out, by QR.

Loops may be open by some micrometres, where a file's numbers are rounded: rows are those of `basis`, U^T A
and U^T dA/dt for U^T lambda, which are as good as all of them where loops close.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from linkwise.check.loop_equations import LoopEquations
from linkwise.check.newton_euler import NewtonEuler
from linkwise.check.reference import columns
from linkwise.check.states import States
from linkwise.package.load import Array
from linkwise.package.manifest import Manifest, RigidTree

STATES = 12
TRIED = 60
FAR = 1e-2
"""Least singular value of A_d, as part of the largest: nearer to a singular position rounding counts more."""


@dataclass(frozen=True)
class LoopReference:
    """Answers to `states`, in which loops close; samples first. tau: (samples, n), on all joints."""

    equations: LoopEquations
    independent: tuple[int, ...]
    states: States
    tau: Array
    rows: Array
    rates: Array
    basis: Array
    map: Array
    qdd: Array
    forces: Array
    """Of tau."""
    shares: Array
    """(samples, m, N)"""
    link_forces: Array
    """(samples, C, N)"""
    coefficients: tuple[Array, Array, Array]


def loop_reference(manifest: Manifest, tree: RigidTree, states: States) -> LoopReference | None:
    """The answers where loops close; None where none of the states leads there."""
    equations = LoopEquations(NewtonEuler(manifest, tree), tree)
    own = tree.independent
    rest = [k for k in range(len(manifest.joints)) if k not in own]
    # Half as far around where the package has them closed: somewhere there is always one.
    tried = states.q[:TRIED]
    q = equations.closed_near(np.concatenate([tried, tree.closed_position + tried / 2.0]))
    sizes = np.linalg.svd(equations.rows(q)[..., rest], compute_uv=False)
    q = q[sizes[:, -1] > FAR * sizes[:, 0]]
    if not len(q):
        return None
    q = q[steady(equations.recursion, q, equations.velocity_map(q))][: min(STATES, len(states.q))]
    rows, basis = equations.rows(q), equations.basis(q)
    back = np.swapaxes(basis, -1, -2)
    followed = _Followed(equations, own, rest, q)
    yd, ydd = states.qd[: len(q), own], states.qdd[: len(q), own]
    qd = followed.velocity(yd)
    moved = States(q, qd, followed.acceleration(qd, ydd))
    tau = np.random.default_rng(5).uniform(-1.0, 1.0, q.shape)
    rates = equations.rates(q, qd)
    qdd, forces = held_motion(equations.recursion, moved, back @ rows, back @ rates, tau)
    shares, link_forces = _shared(equations, own, back @ rows, moved)
    rest_yd = 0.0 * yd

    def share(speed: Array, change: Array) -> Array:
        full = followed.velocity(speed)
        return _shared(equations, own, back @ rows, States(q, full, followed.acceleration(full, change)))[0]

    weight = share(rest_yd, rest_yd)
    c2 = columns(lambda unit: share(rest_yd, rest_yd + unit) - weight, len(own))
    # A quadratic form of yd, whose central difference is its derivative; the closing convention takes half.
    c1 = columns(lambda unit: (share(yd + unit, rest_yd) - share(yd - unit, rest_yd)) / 4.0, len(own))
    forces, link_forces = (basis @ forces[..., None])[..., 0], basis @ link_forces
    found = (rows, rates, basis, followed.map, qdd, forces, shares, link_forces, (c2, c1, weight))
    return LoopReference(equations, own, moved, tau, *found)


@dataclass(frozen=True)
class _Followed:
    """Motion of all joints by that of the independent ones, by least squares."""

    equations: LoopEquations
    own: Sequence[int]
    rest: Sequence[int]
    q: Array

    @property
    def map(self) -> Array:
        """G, (samples, n, m)."""
        return self.equations.velocity_map(self.q)

    def velocity(self, yd: Array) -> Array:
        """qd."""
        full: Array = (self.map @ yd[..., None])[..., 0]
        return full

    def acceleration(self, qd: Array, ydd: Array) -> Array:
        """qdd."""
        rows, drift = self.equations.rows(self.q), self.equations.rates(self.q, qd) @ qd[..., None]
        full = self.velocity(ydd)
        full[:, self.rest] -= (np.linalg.pinv(rows[..., self.rest]) @ drift)[..., 0]
        return full


def mass_matrix(recursion: NewtonEuler, q: Array) -> Array:
    """M (samples, n, n), column by column, all columns at once."""
    samples, n = q.shape
    rest, units = np.zeros((samples * n, n)), np.tile(np.eye(n), (samples, 1))
    torque = recursion.partial_torque(np.repeat(q, n, 0), rest, units, gravity=False).sum(-1)
    return np.swapaxes(torque.reshape(samples, n, n), -1, -2)


def steady(recursion: NewtonEuler, q: Array, mapped: Array) -> NDArray[np.bool_]:
    """Which positions (samples, n) are not next to a singular mass matrix, as others go.

    mapped: G (samples, n, m); of G^T M G, with ones on its diagonal, the least eigenvalue counts
    """
    mass = np.swapaxes(mapped, -1, -2) @ mass_matrix(recursion, q) @ mapped
    size = np.sqrt(mass.diagonal(0, -2, -1))
    least = np.linalg.eigvalsh(mass / (size[:, :, None] * size[:, None, :]))[:, 0]
    found: NDArray[np.bool_] = least >= FAR * np.median(least)
    return found


def held_motion(
    recursion: NewtonEuler, states: States, rows: Array, rates: Array, tau: Array
) -> tuple[Array, Array]:
    """qdd and lambda of torques under rows that do not follow from each other."""
    q, qd, _ = states.motion
    free, mass = q.shape[1] - rows.shape[1], mass_matrix(recursion, q)
    bias = recursion.partial_torque(q, qd, 0.0 * q).sum(-1)
    null = np.swapaxes(np.linalg.svd(rows)[2][:, -free:], -1, -2)
    back = np.swapaxes(null, -1, -2)
    moved = -np.linalg.pinv(rows, rcond=1e-7) @ (rates @ qd[..., None])
    driven = back @ ((tau - bias)[..., None] - mass @ moved)
    qdd = null @ np.linalg.solve(back @ mass @ null, driven) + moved
    left = mass @ qdd + (bias - tau)[..., None]
    forces = np.linalg.pinv(np.swapaxes(rows, -1, -2), rcond=1e-7) @ left
    return qdd[..., 0], forces[..., 0]


def _shared(equations: LoopEquations, own: Sequence[int], rows: Array, states: States) -> tuple[Array, Array]:
    """What independent joints and ties bear of each link: S tau^ + A^T lambda = tau_j."""
    samples, _, n = rows.shape
    driven = np.broadcast_to(np.eye(n)[:, own], (samples, n, len(own)))
    both = np.concatenate([driven, np.swapaxes(rows, -1, -2)], -1)
    found = np.linalg.pinv(both, rcond=1e-7) @ equations.recursion.partial_torque(*states.motion)
    return found[:, : len(own)], found[:, len(own) :]
