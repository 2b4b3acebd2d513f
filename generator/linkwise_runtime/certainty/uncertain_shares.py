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
from .product_moments import Product, ProductMoments
from .share_variances import root, share_variances

SHARES = ("c2", "c1", "gravity", "torque", "joint_torque", "joint_c2", "joint_c1", "joint_gravity")
"""Shares, and their sums over links, in the order of `PackedVariances`."""
BASES = (*SHARES, "qd", "qdd")
"""Shares and motion, of which products are made."""
C2, C1, _, TAU, WHOLE, JOINT_C2, JOINT_C1, _, QD, QDD = range(len(BASES))
BY_PRODUCT = ("acceleration", "velocity", "joint_acceleration", "joint_velocity", "power", "joint_power")
PRODUCTS = (
    Product(lambda a: a[C2], lambda a: a[QDD][:, None, None, :]),
    Product(lambda a: a[C1], lambda a: a[QD][:, None, None, :]),
    Product(lambda a: a[JOINT_C2], lambda a: a[QDD][:, None, :]),
    Product(lambda a: a[JOINT_C1], lambda a: a[QD][:, None, :]),
    Product(lambda a: a[TAU], lambda a: a[QD][:, :, None]),
    Product(lambda a: a[WHOLE], lambda a: a[QD]),
)


def uncertainty(robot: Any, q: object, qd: object, qdd: object, bodies: object, motion: object) -> Any:
    """Return the answer of `Dynamics.uncertainty`."""
    if bodies is None and motion is None:
        raise ValueError("nothing is uncertain; give bodies, motion or both")
    backend, read = robot.door.read({"q": q, "qd": qd, "qdd": qdd})
    backend.answers.check_regresses()
    batch = tuple(read[0].shape[:-1])
    flat = [a.reshape(math.prod(batch), a.shape[-1]) for a in read]
    here = _shares(robot, flat)
    moments = ProductMoments(PRODUCTS, here)
    found = [abs(0.0 * a) for a in here]
    if motion is not None:
        roots = motion_roots(motion, batch, read[0].shape[-1])
        found = variances(here, _directions(robot, flat, roots), moments.add)
    if bodies is not None:
        for number, borne in enumerate(_by_bodies(backend, flat, bodies)):
            found[number] = found[number] + borne
    by_name = dict(zip((*BASES, *BY_PRODUCT), [*found, *moments.variances(found)], strict=True))
    deviations = (root(backend.xp, by_name[name]) for name in Uncertainty._fields)
    return Uncertainty(*(side_by_side(a.reshape(*batch, *a.shape[1:])) for a in deviations))


def _by_bodies(backend: Any, flat: Sequence[Any], bodies: object) -> Sequence[Any]:
    """Return the variances by bodies of the shares, in the order of `SHARES`."""
    at = share_variances(backend, bodies)
    found = at.packed(flat)
    fields = ("acceleration", "velocity", "gravity", "torque")
    return [*map(at.spread, found[:4], fields), *found[4:]]


def _shares(robot: Any, motion: Sequence[Any]) -> list[Any]:
    """Return shares and sums over links, (S, ...) each, in the order of `BASES`."""
    q, qd, qdd = motion
    c2, c1, g = robot.coefficients(q, qd)
    tau = robot.partial_torque(q, qd, qdd)
    return [c2, c1, g, tau, tau.sum(-1), c2.sum(2), c1.sum(2), g.sum(-1), qd, qdd]


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
