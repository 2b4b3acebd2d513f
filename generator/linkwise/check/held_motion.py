"""Motion of joints that rows A hold, of ties or of contacts, and whether a position is one to compute it at.

A is (samples, C, n). Joints `rest` follow the others, `own`, where A_d, A's columns of them, has full rank.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from linkwise.check.loop_equations import following
from linkwise.check.newton_euler import NewtonEuler
from linkwise.check.states import States
from linkwise.package.load import Array

FAR = 100.0
"""Of `condition_of`, below which a position is far from singular ones."""
MOST = 1e6
"""The same, above which nothing is left to compare."""
STEADY = 1e-2
"""Least eigenvalue of a mass matrix beside that of others."""
REGULAR = 1e-8
"""Least eigenvalue of any, with ones on its diagonal: below, joints can move together without a mass."""
REFINED = 3
LEAST = 1e-300
"""In place of a singular value that is 0."""


def condition_of(rows: Array, rest: Sequence[int]) -> Array:
    """What A (samples, C, n) moves at most, to what A_d, its columns `rest`, moves at least: (samples,)."""
    most, sizes = (np.linalg.svd(part, compute_uv=False) for part in (rows, rows[..., rest]))
    condition: Array = most[:, 0] / np.maximum(sizes[:, -1], LEAST)
    return condition


def far_from_singular(rows: Array, rest: Sequence[int]) -> NDArray[np.intp]:
    """Which of A (samples, C, n) are, by columns `rest`: the best first if none is far enough."""
    condition = condition_of(rows, rest)
    found = np.flatnonzero(condition < FAR)
    return found if found.size else np.argsort(condition)[: np.count_nonzero(condition < MOST)]


def mass_matrix(recursion: NewtonEuler, q: Array) -> Array:
    """M (samples, n, n), column by column, all columns at once."""
    samples, n = q.shape
    rest, units = np.zeros((samples * n, n)), np.tile(np.eye(n), (samples, 1))
    torque = recursion.torque(np.repeat(q, n, 0), rest, units, gravity=False)
    mass = np.swapaxes(torque.reshape(samples, n, n), -1, -2)
    return recursion.noise(mass, np.abs(mass)) if recursion.noise else mass


def held_mass(recursion: NewtonEuler, q: Array, rows: Array, own: Sequence[int]) -> Array:
    """M, with noise where who takes the others out by G has that of G^T M G: in rows and columns of `own`."""
    mass = mass_matrix(recursion, q)
    if recursion.noise:
        of_own = np.ix_(range(len(q)), own, own)
        followed = np.abs(following(rows, own))
        size = np.swapaxes(followed, -1, -2) @ np.abs(mass) @ followed
        mass[of_own] = recursion.noise(mass[of_own], size)
    return mass


def unit_sizes(mass: Array) -> Array:
    """sqrt(M_ii) (samples, n), 1 where that is none: what a coordinate is measured by in a mass matrix."""
    diagonal = np.abs(mass.diagonal(0, -2, -1))
    return np.where(diagonal > 0.0, np.sqrt(diagonal), 1.0)


def motions(mass: Array, rows: Array) -> Array:
    """N (samples, n, m), what joints may do under rows A: orthonormal if each is measured by sqrt(M_ii)."""
    size = unit_sizes(mass)
    null = np.swapaxes(np.linalg.svd(rows / size[:, None, :])[2][:, rows.shape[1] :], -1, -2)
    return null / size[:, :, None]


def steady(recursion: NewtonEuler, q: Array, mapped: Array) -> NDArray[np.bool_]:
    """Which positions (samples, n) are not next to a singular mass matrix, as others go.

    mapped: G (samples, n, m); of G^T M G, with ones on its diagonal, the least eigenvalue counts
    """
    mass = np.swapaxes(mapped, -1, -2) @ mass_matrix(recursion, q) @ mapped
    size = unit_sizes(mass)
    least = np.linalg.eigvalsh(mass / (size[:, :, None] * size[:, None, :]))[:, 0]
    if not len(least):
        return np.zeros(0, dtype=bool)
    found: NDArray[np.bool_] = least >= max(STEADY * float(np.median(least)), REGULAR)
    return found


def held_motion(
    recursion: NewtonEuler, states: States, rows: Array, rates: Array, tau: Array, own: Sequence[int]
) -> tuple[Array, Array]:
    """qdd and lambda of torques under rows that do not follow from each other and leave `own` free.

    Of M qdd - A^T lambda = tau - h and A qdd = -dA/dt qd as one system, in units of which each joint's mass
    and each row's largest number are 1: a light link's motion is not lost beside a body's.
    """
    q, qd, _ = states.motion
    mass = held_mass(recursion, q, rows, own)
    bias = recursion.torque(q, qd, 0.0 * q)
    size = unit_sizes(mass)
    held = rows / size[:, None, :]
    largest = np.abs(held).max(-1, keepdims=True)
    held = held / largest
    n, ties = q.shape[1], rows.shape[1]
    system = np.zeros((len(q), n + ties, n + ties))
    system[:, :n, :n] = mass / (size[:, :, None] * size[:, None, :])
    system[:, n:, :n], system[:, :n, n:] = held, np.swapaxes(held, -1, -2)
    force, change = tau - bias, rates @ qd[..., None]
    if recursion.noise:
        change = recursion.noise(change, np.abs(rates) @ np.abs(qd)[..., None])
        force = recursion.noise(force, np.abs(tau) + np.abs(bias))
    given = np.concatenate([force[..., None] / size[..., None], -change / largest], 1)
    found = _solved(system, given)
    if recursion.noise:  # whoever solves it rounds what the equations sum up
        found = _solved(system, recursion.noise(given, np.abs(system) @ np.abs(found)))
    return found[:, :n, 0] / size, -found[:, n:, 0] / largest[..., 0]


def _solved(system: Array, given: Array) -> Array:
    """A solution that is off by no more than rounding of the equations' own sums: refined (Skeel 1980)."""
    found: Any = np.linalg.solve(system, given)
    for _ in range(REFINED):
        left = given - system.astype(np.longdouble) @ found
        found = found + np.linalg.solve(system, left.astype(float))
    answer: Array = found
    return answer


def with_noise(recursion: NewtonEuler, product: Array, solution: Array, columns: Array) -> Array:
    """A solution of least squares (samples, m, n) times columns, with its noise if there is any.

    It is by singular vectors, of which every number is rounded by the size of the largest.
    """
    if not recursion.noise:
        return product
    size = np.abs(solution).max((1, 2))[:, None, None] * np.abs(columns).sum(1, keepdims=True)
    return recursion.noise(product, np.broadcast_to(size, product.shape))
