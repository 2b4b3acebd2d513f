"""Mean and covariance of one link's inertial parameters, whose centre and radii of gyration are normal."""

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
ROUNDING = 1e-9
"""Part of a matrix' size that counts as rounding: entries off a diagonal, eigenvalues below zero."""
PAIRS = ((0, 0), (0, 1), (1, 1), (0, 2), (1, 2), (2, 2))
"""Entries of an inertia, in the order of inertial parameters."""


def principal_moments(inertia: Floats, axes: Floats) -> tuple[Floats, Floats]:
    """Return the principal moments of an inertia (3, 3), (3,), and the principal axes, columns (3, 3).

    axes: columns that are the axes where several will do, as of a body of revolution
    """
    there = 0.5 * axes.T @ (inertia + inertia.T) @ axes
    off = there - np.diag(np.diag(there))
    if np.abs(off).max() <= ROUNDING * np.abs(there).max():
        return np.maximum(np.diag(there), 0.0), axes
    moments, own = np.linalg.eigh(there)
    return np.maximum(moments, 0.0), axes @ own


def parameter_moments(
    mass: float, centre: Floats, p: Floats, principal: Floats, axes: Floats, part: float
) -> tuple[Floats, Floats]:
    """Return the mean (10,) and covariance (10, 10) of p = (m, m c, I).

    p: covariance of the centre; principal, axes: moments about it; part: of radii, as a part of them
    """
    # Moments of a normal c: E[c c^T] = P + c c^T, and by Isserlis' theorem
    # cov(c_a c_b, c_d) = P_ad c_b + P_bd c_a,
    # cov(c_a c_b, c_d c_e) = c_a c_d P_be + c_a c_e P_bd + c_b c_d P_ae + c_b c_e P_ad
    #                         + P_ad P_be + P_ae P_bd.
    outer = np.outer(centre, centre)
    second = p + outer
    third = np.einsum("ad,b->abd", p, centre) + np.einsum("bd,a->abd", p, centre)
    fourth = np.einsum("ad,be->abde", second, p) + np.einsum("ae,bd->abde", second, p)
    fourth = fourth + np.einsum("bd,ae->abde", outer, p) + np.einsum("be,ad->abde", outer, p)
    moments = np.zeros((15, 15))
    moments[:3, :3] = p
    moments[3:12, :3] = third.reshape(9, 3)
    moments[:3, 3:12] = moments[3:12, :3].T
    moments[3:12, 3:12] = fourth.reshape(9, 9)
    # Of r^2 with r normal: E = (1 + part^2) r^2, var = (4 part^2 + 2 part^4) r^4.
    moments[12:, 12:] = np.diag((4.0 * part**2 + 2.0 * part**4) * principal**2)
    table = _table(mass, axes)
    mean = table @ np.concatenate([centre, second.reshape(9), (1.0 + part**2) * principal])
    mean[0] = mass
    return mean, table @ moments @ table.T


def _table(mass: float, axes: Floats) -> Floats:
    """Return the matrix (10, 15) of (m, m c, I), but for m itself, from c, c c^T and principal moments."""
    table = np.zeros((10, 15))
    table[1:4, :3] = mass * np.eye(3)
    for row, (a, b) in enumerate(PAIRS, 4):
        own = (a == b) * np.eye(3)
        own[a, b] -= 1.0
        table[row, 3:12] = mass * own.reshape(9)
        table[row, 12:] = axes[a] * axes[b]
    return table


def factor(covariance: Floats) -> Floats:
    """Return F with F F^T = covariance (10, 10), as many columns as it has directions."""
    scale = np.sqrt(np.diag(covariance))
    there = scale > 0
    if not there.any():
        return np.zeros((len(covariance), 0))
    own = covariance[np.ix_(there, there)] / np.outer(scale[there], scale[there])
    values, vectors = np.linalg.eigh(own)
    kept = values > np.finfo(float).eps * len(own)
    found = np.zeros((len(covariance), int(kept.sum())))
    found[there] = scale[there, None] * vectors[:, kept] * np.sqrt(values[kept])
    return found
