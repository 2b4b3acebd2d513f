"""Motion of joints under constraint rows A, of ties or contacts, and the positions suited for computing it.

A is (samples, C, n). Joints `rest` follow the others, `own`, where A_d, the columns of A for `rest`, has full
rank.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np

from linkwise.arrays import Array, Index, Mask
from linkwise.oracle.loop_equations import following
from linkwise.oracle.newton_euler import NewtonEuler
from linkwise.oracle.states import States

FAR = 100.0
"""Value of `condition_of` below which a position is far from singular ones."""
MOST = 1e6
"""Value of `condition_of` above which nothing is left to compare."""
STEADY = 1e-2
"""Least eigenvalue of a mass matrix, relative to the median of that of all."""
REGULAR = 1e-8
"""Least eigenvalue of any mass matrix, with ones on its diagonal: below, joints can move together without a
mass."""
REFINED = 3
LEAST = 1e-300
"""Replacement for a singular value that is 0."""


def condition_of(rows: Array, rest: Sequence[int]) -> Array:
    """Return the largest singular value of A (samples, C, n) over the least of columns `rest`, (samples,)."""
    most, sizes = (np.linalg.svd(part, compute_uv=False) for part in (rows, rows[..., rest]))
    condition: Array = most[:, 0] / np.maximum(sizes[:, -1], LEAST)
    return condition


def far_from_singular(rows: Array, rest: Sequence[int]) -> Index:
    """Return the indices of those of A (samples, C, n) that are far from singular in columns `rest`.

    If none is, the best are returned that can be compared at all, the very best first.
    """
    condition = condition_of(rows, rest)
    found = np.flatnonzero(condition < FAR)
    return found if found.size else np.argsort(condition)[: np.count_nonzero(condition < MOST)]


def mass_matrix(recursion: NewtonEuler, q: Array) -> Array:
    """Return M (samples, n, n), column by column, with all columns in one call."""
    samples, n = q.shape
    rest, units = np.zeros((samples * n, n)), np.tile(np.eye(n), (samples, 1))
    torque = recursion.torque(np.repeat(q, n, 0), rest, units, gravity=False)
    mass = np.swapaxes(torque.reshape(samples, n, n), -1, -2)
    return recursion.noise(mass, np.abs(mass)) if recursion.noise else mass


def held_mass(recursion: NewtonEuler, q: Array, rows: Array, own: Sequence[int]) -> Array:
    """Return M (samples, n, n), with the noise of G^T M G, if any, in the rows and columns of `own`.

    A solution that eliminates the other joints by G has that noise.
    """
    mass = mass_matrix(recursion, q)
    if recursion.noise:
        of_own = np.ix_(range(len(q)), own, own)
        followed = np.abs(following(rows, own))
        size = np.swapaxes(followed, -1, -2) @ np.abs(mass) @ followed
        mass[of_own] = recursion.noise(mass[of_own], size)
    return mass


def unit_sizes(mass: Array) -> Array:
    """Return sqrt(M_ii) (samples, n), 1 where that is 0: the unit of each coordinate in a mass matrix."""
    diagonal = np.abs(mass.diagonal(0, -2, -1))
    return np.where(diagonal > 0.0, np.sqrt(diagonal), 1.0)


def motions(mass: Array, rows: Array) -> Array:
    """Return N (samples, n, m), joints' motions under rows A: orthonormal if measured by sqrt(M_ii) each."""
    size = unit_sizes(mass)
    null = np.swapaxes(np.linalg.svd(rows / size[:, None, :])[2][:, rows.shape[1] :], -1, -2)
    return null / size[:, :, None]


def steady(recursion: NewtonEuler, q: Array, mapped: Array) -> Mask:
    """Return which positions (samples, n) are not next to a singular mass matrix, compared with the others.

    mapped: G (samples, n, m); the least eigenvalue of G^T M G, with ones on its diagonal, counts
    """
    mass = np.swapaxes(mapped, -1, -2) @ mass_matrix(recursion, q) @ mapped
    size = unit_sizes(mass)
    least = np.linalg.eigvalsh(mass / (size[:, :, None] * size[:, None, :]))[:, 0]
    if not len(least):
        return np.zeros(0, dtype=bool)
    found: Mask = least >= max(STEADY * float(np.median(least)), REGULAR)
    return found


def held_motion(
    recursion: NewtonEuler, states: States, rows: Array, rates: Array, tau: Array, own: Sequence[int]
) -> tuple[Array, Array]:
    """Return qdd (samples, n) and lambda (samples, C) of torques under rows A.

    The rows do not follow from each other, and leave `own` free.
    M qdd - A^T lambda = tau - h and A qdd = -dA/dt qd are solved as one system, in units in which each
    joint's
    mass and each row's largest number are 1: a light link's motion is not lost beside a body's.
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
    if recursion.noise:  # any solution rounds the sums in the equations
        found = _solved(system, recursion.noise(given, np.abs(system) @ np.abs(found)))
    return found[:, :n, 0] / size, -found[:, n:, 0] / largest[..., 0]


def _solved(system: Array, given: Array) -> Array:
    """Return a solution that is off by no more than rounding of the equations' sums: refined (Skeel 1980)."""
    found: Any = np.linalg.solve(system, given)
    for _ in range(REFINED):
        left = given - system.astype(np.longdouble) @ found
        found = found + np.linalg.solve(system, left.astype(float))
    answer: Array = found
    return answer


def with_noise(recursion: NewtonEuler, product: Array, solution: Array, columns: Array) -> Array:
    """Return `product`, a least-squares solution (samples, m, n) times columns, with its noise if any.

    The solution is by singular vectors, of which every number is rounded by the size of the largest.
    """
    if not recursion.noise:
        return product
    size = np.abs(solution).max((1, 2))[:, None, None] * np.abs(columns).sum(1, keepdims=True)
    return recursion.noise(product, np.broadcast_to(size, product.shape))
