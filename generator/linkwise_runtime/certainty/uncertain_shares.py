"""Standard deviations of shares, their sums and powers, by uncertain bodies and by uncertain motion."""

import math
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from ..chosen_names import short
from ..interface import side_by_side
from ..share_uncertainty import Uncertainty
from .divided_differences import Direction, variances
from .parameter_moments import ROUNDING, Floats
from .share_deviations import root, share_deviations


def uncertainty(robot: Any, q: object, qd: object, qdd: object, bodies: object, motion: object) -> Any:
    """Return the answer of `Dynamics.uncertainty`."""
    if bodies is None and motion is None:
        raise ValueError("nothing is uncertain; give bodies, motion or both")
    backend, read = robot.door.read({"q": q, "qd": qd, "qdd": qdd})
    backend.answers.check_regresses()
    batch = tuple(read[0].shape[:-1])
    flat = [a.reshape(math.prod(batch), a.shape[-1]) for a in read]
    found: list[Any] = []
    if bodies is not None:
        found.append([a**2 for a in _by_bodies(backend, flat, bodies)])
    if motion is not None:
        roots = motion_roots(motion, batch, read[0].shape[-1])
        found.append(variances(_shares(robot, flat), _directions(robot, flat, roots)))
    together = [sum(parts) for parts in zip(*found, strict=True)]
    deviations = (root(backend.xp, variance) for variance in together)
    return Uncertainty(*(side_by_side(a.reshape(*batch, *a.shape[1:])) for a in deviations))


def _by_bodies(backend: Any, flat: Sequence[Any], bodies: object) -> Sequence[Any]:
    """Return the deviations by bodies, in the order of `Uncertainty`."""
    at = share_deviations(backend, bodies)
    found, (_, rate, gain) = at.packed(flat), (abs(a) for a in flat)
    c2, c1 = at.spread(found.c2, "acceleration"), at.spread(found.c1, "velocity")
    torque = at.spread(found.torque, "torque")
    return (
        torque,
        c2,
        c1,
        c2 * gain[:, None, None, :],
        c1 * rate[:, None, None, :],
        at.spread(found.gravity, "gravity"),
        found.joint_torque,
        found.joint_c2 * gain[:, None, :],
        found.joint_c1 * rate[:, None, :],
        found.joint_gravity,
        torque * rate[:, :, None],
        found.joint_torque * rate,
    )


def _shares(robot: Any, motion: Sequence[Any]) -> list[Any]:
    """Return what the fields of `Uncertainty` are deviations of, (S, ...) each."""
    q, qd, qdd = motion
    c2, c1, g = robot.coefficients(q, qd)
    tau = robot.partial_torque(q, qd, qdd)
    by_acceleration, by_velocity = c2 * qdd[:, None, None, :], c1 * qd[:, None, None, :]
    whole = tau.sum(-1)
    sums = (whole, by_acceleration.sum(2), by_velocity.sum(2), g.sum(-1))
    return [tau, c2, c1, by_acceleration, by_velocity, g, *sums, tau * qd[:, :, None], whole * qd]


def _directions(robot: Any, flat: Sequence[Any], roots: Floats) -> Iterator[Direction]:
    """Yield the directions of motion, columns of the roots (S or 1, 3 n, R)."""
    n = flat[0].shape[-1]
    for number in range(roots.shape[-1]):
        moves = [robot.backend.constant(roots[:, k * n : (k + 1) * n, number], flat[0]) for k in range(3)]

        def values(size: float, moves: Sequence[Any] = moves) -> list[Any]:
            return _shares(robot, [a + size * move for a, move in zip(flat, moves, strict=True)])

        yield Direction(values)


def motion_roots(given: object, batch: Sequence[int], n: int) -> Floats:
    """Return D (S or 1, 3 n, R) with D D^T the covariance of q, qd and qdd, one after the other.

    Raises ValueError for what is no covariance, or not of these joints and samples.
    """
    try:
        matrices = np.asarray(given, dtype=float)
    except (TypeError, ValueError):
        raise ValueError(f"motion is {short(given)}; give a covariance of q, qd and qdd") from None
    size = 3 * n
    if matrices.shape not in ((size, size), (*batch, size, size)):
        wanted = f"{(size, size)}, or {(*batch, size, size)}" if batch else f"{(size, size)}"
        raise ValueError(f"motion has shape {matrices.shape}; a covariance of q, qd and qdd has {wanted}")
    if not np.isfinite(matrices).all():
        raise ValueError("motion has NaN or infinity; give finite numbers")
    flat = matrices.reshape(-1, size, size)
    # By correlations, as positions, velocities and accelerations differ in size and unit.
    scale = np.sqrt(np.abs(np.einsum("saa->sa", flat)))
    scale[scale == 0.0] = 1.0
    own = flat / (scale[:, :, None] * scale[:, None])
    values, vectors = np.linalg.eigh(0.5 * (own + own.mT))
    if np.abs(own - own.mT).max() > ROUNDING or values.min() < -ROUNDING * size:
        raise ValueError("motion is no covariance: it is not symmetric, or has a negative eigenvalue")
    found: Floats = scale[:, :, None] * vectors * np.sqrt(np.maximum(values, 0.0))[:, None]
    return found[:, :, (values > ROUNDING).any(0)]
