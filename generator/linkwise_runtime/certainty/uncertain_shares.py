"""Standard deviations of shares, their sums and powers, by uncertain bodies and by uncertain motion."""

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from ..answers.packed import PackedTables
from ..chosen_names import short
from ..interface import side_by_side
from ..share_uncertainty import Uncertainty
from .divided_differences import Direction, variances
from .motion_variances import VARIANCES
from .parameter_moments import ROUNDING, Floats
from .product_moments import Product, ProductMoments
from .share_variances import root, share_variances

SHARES = ("c2", "c1", "gravity", "torque", "joint_torque", "joint_c2", "joint_c1", "joint_gravity")
"""Shares, and their sums over links, in the order of `PackedVariances`."""
BASES = (*SHARES, "qd", "qdd")
"""Shares and motion, of which products are made."""
C2, C1, _, TAU, WHOLE, JOINT_C2, JOINT_C1, _, QD, QDD = range(len(BASES))
FIELDS = {"c2": "acceleration", "gravity": "gravity", "torque": "torque", "power": "torque"}
"""Fields of `Layout` in whose order packed variances are, of those that are not in that of velocities."""
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
    causes, found = flat[1:], dict[str, Any]()
    spreads = [0.0 * a for a in causes]
    if motion is not None:
        roots = motion_roots(motion, batch, read[0].shape[-1])
        found, spreads = _by_motion(robot, backend, flat, roots)
    if bodies is not None:
        borne = _by_bodies(backend, flat, bodies)
        every = [a**2 + b for a, b in zip(causes, spreads, strict=True)]
        borne |= zip(BY_PRODUCT, (first * part for first, part in _pairs(borne, every)), strict=True)
        found = {name: found[name] + one if name in found else one for name, one in borne.items()}
    deviations = (root(backend.xp, found[name]) for name in Uncertainty._fields)
    return Uncertainty(*(side_by_side(a.reshape(*batch, *a.shape[1:])) for a in deviations))


def _pairs(shares: Mapping[str, Any], causes: Sequence[Any]) -> Iterator[tuple[Any, Any]]:
    """Yield the factors of each product, in the order of `BY_PRODUCT`; causes: something of qd and of qdd."""
    every = [shares[name] for name in SHARES] + list(causes)
    yield from ((product.first(every), product.second(every)) for product in PRODUCTS)


def _by_motion(
    robot: Any, backend: Any, flat: Sequence[Any], roots: Floats
) -> tuple[dict[str, Any], list[Any]]:
    """Return variances by motion, by the names of shares and products, and those of qd and qdd."""
    n = flat[0].shape[-1]
    sizes = [(roots[:, at : at + n] ** 2).sum(-1) for at in (n, 2 * n)]
    spreads = [backend.constant(a, flat[0]) + 0.0 * b for a, b in zip(sizes, flat[1:], strict=True)]
    known = backend.motion_variances(flat, roots, VARIANCES)
    if known is not None:
        return _spread(backend, known), spreads
    here = _shares(robot, flat)
    moments = ProductMoments(PRODUCTS, here)
    found = variances(here, _directions(robot, flat, roots), moments.add)
    return dict(zip((*BASES, *BY_PRODUCT), [*found, *moments.variances(found)], strict=True)), spreads


def _spread(backend: Any, known: Mapping[str, Any]) -> dict[str, Any]:
    """Return variances (S, ...) with their zeros from packed ones with the samples last."""
    tables, n, found = PackedTables(backend), backend.structure.n, {}
    for name, rows in known.items():
        values, share = np.ascontiguousarray(rows.T), name.removeprefix("joint_")
        field = FIELDS.get(share, "velocity")
        if share == name:
            found[name] = tables.spread(values, field)
        else:
            found[name] = values if field in ("gravity", "torque") else values.reshape(-1, n, n)
    return found


def _by_bodies(backend: Any, flat: Sequence[Any], bodies: object) -> dict[str, Any]:
    """Return the variances by bodies of the shares."""
    at = share_variances(backend, bodies)
    found = at.packed(flat)
    fields = ("acceleration", "velocity", "gravity", "torque")
    return dict(zip(SHARES, [*map(at.spread, found[:4], fields), *found[4:]], strict=True))


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
        read = np.asarray(given)
        matrices = read.astype(float)
    except (TypeError, ValueError):
        raise ValueError(f"motion is {short(given)}; give a covariance of q, qd and qdd") from None
    size = 3 * n
    if matrices.shape not in ((size, size), (*batch, size, size)):
        wanted = f"{(size, size)}, or {(*batch, size, size)}" if batch else f"{(size, size)}"
        raise ValueError(f"motion has shape {matrices.shape}; a covariance of q, qd and qdd has {wanted}")
    if not np.isfinite(matrices).all():
        raise ValueError("motion has NaN or infinity; give finite numbers")
    flat = matrices.reshape(-1, size, size)
    if not flat.size:
        return np.zeros((0, size, 0))
    # By correlations, as positions, velocities and accelerations differ in size and unit.
    scale = np.sqrt(np.abs(np.einsum("saa->sa", flat)))
    scale[scale == 0.0] = 1.0
    own = flat / (scale[:, :, None] * scale[:, None])
    values, vectors = np.linalg.eigh(0.5 * (own + own.mT))
    rounding = max(ROUNDING, 8.0 * float(np.finfo(read.dtype).eps)) if read.dtype.kind == "f" else ROUNDING
    if np.abs(own - own.mT).max() > rounding or values.min() < -rounding * size:
        raise ValueError("motion is no covariance: it is not symmetric, or has a negative eigenvalue")
    found: Floats = scale[:, :, None] * vectors * np.sqrt(np.maximum(values, 0.0))[:, None]
    return found[:, :, (values > rounding).any(0)]
