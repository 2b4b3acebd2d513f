"""Motions, bodies and loads drawn at random, to hold deviations against.

Noise of positions goes through SciPy's own filter and five-point formulas of this file.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

Floats = NDArray[np.float64]
FIRST, SECOND = (1, -8, 0, 8, -1), (-1, 16, -30, 16, -1)
"""Twelve times the central formulas of five points."""
COUNTS = 1e-6
"""Part of the largest weight below which a sample does not count."""


def passed(samples: int, at: int, rate: float, cutoff: float, order: int = 2) -> Floats:
    """Weights (3, S) of the samples of a log in q, qd and qdd at one of them, behind a zero-phase filter."""
    signal = pytest.importorskip("scipy.signal")
    sos = signal.butter(order, cutoff, fs=rate, output="sos")
    near = signal.sosfiltfilt(sos, np.eye(samples), axis=0, padlen=min(samples - 1, 60))[at - 2 : at + 3]
    qd, qdd = (np.tensordot(w, near, 1) / 12.0 for w in (FIRST, SECOND))
    found: Floats = np.stack([near[2], qd * rate, qdd * rate**2])
    return found


def drawn_motions(weights: Floats, q: Floats, root: Floats, draws: int, seed: int = 0) -> tuple[Any, ...]:
    """Return q, qd, qdd (draws, n) of positions (S, n) and of noise of covariance root root^T.

    weights: (3, S), of `passed`
    """
    sizes = np.abs(weights)
    near = (sizes > COUNTS * sizes.max(1, keepdims=True)).any(0)
    noise = np.random.default_rng(seed).standard_normal((np.count_nonzero(near), draws * q.shape[1]))
    moved = (weights[:, near] @ noise).reshape(3, draws, -1) @ root.T
    return tuple(moved + (weights @ q)[:, None])


def drawn_bodies(
    package: Any, draws: int, mass: float, centre: float, radii: float = 0.0, seed: int = 9
) -> Any:
    """Return a package's bodies, masses and radii of gyration off by parts, centres by m along each axis."""
    own, draw = package.bodies(), np.random.default_rng(seed)
    links = len(own.masses)
    factors = 1.0 + mass * draw.normal(size=(draws, links))
    centres = own.centres + centre * draw.normal(size=(draws, links, 3))
    longer = 1.0 + radii * draw.normal(size=(draws, links, 3))
    inertias = np.empty((draws, links, 3, 3))
    for j, inertia in enumerate(own.inertias):
        moments, axes = np.diag(inertia), np.eye(3)
        if np.abs(inertia - np.diag(moments)).max() > 1e-9 * np.abs(inertia).max():
            moments, axes = np.linalg.eigh(inertia)
        turned = (longer[:, j] ** 2 * moments)[:, None] * axes @ axes.T
        inertias[:, j] = factors[:, j, None, None] * turned
    return own._replace(masses=own.masses * factors, centres=centres, inertias=inertias)


def load_torque(model: Any, q: Any, body: str, wrench: Sequence[Any]) -> Any:
    """Return -J^T w (draws, n) of a force, a moment and the point where they act, in the world's axes."""
    force, moment, point = wrench
    about = moment + np.cross(point - model.kinematics.pose(q, body)[:, :3, 3], force)
    jacobian = model.kinematics.jacobian(q, body)
    found: Any = -np.einsum("dri,dr->di", jacobian, np.concatenate([about, force], 1))
    return found
