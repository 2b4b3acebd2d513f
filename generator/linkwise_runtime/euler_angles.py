"""Yaw, pitch and roll, about the moved z, y and x, of quaternions, and their rates of angular velocities.

R = Rz(yaw) Ry(pitch) Rx(roll)      w = E (yaw', pitch', roll'), w along the body's axes

         -sin(pitch)                 0           1
    E =   sin(roll) cos(pitch)   cos(roll)       0
          cos(roll) cos(pitch)  -sin(roll)       0
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

Numbers = NDArray[np.float64]


def angles_of(quaternion: Numbers) -> Numbers:
    """Yaw, pitch and roll (..., 3), pitch within a right angle, of unit quaternions w, x, y, z (..., 4)."""
    w, x, y, z = np.moveaxis(quaternion, -1, 0)
    yaw = np.arctan2(2.0 * (x * y + w * z), w * w + x * x - y * y - z * z)
    roll = np.arctan2(2.0 * (y * z + w * x), w * w - x * x - y * y + z * z)
    across = np.hypot(2.0 * (y * z + w * x), w * w - x * x - y * y + z * z)
    pitch = np.arctan2(2.0 * (w * y - x * z), across)
    return np.stack([yaw, pitch, roll], -1)


def continued(given: Numbers, before: Numbers | None = None) -> Numbers:
    """The same attitudes (..., T, 3) by angles without leaps from sample to sample.

    before: angles (..., 3) of the sample before the first, from which they go on

    Each attitude has two triples up to whole turns, (yaw, pitch, roll) and (yaw + pi, pi - pitch, roll + pi):
    every sample takes that which is nearer to the sample's before it.
    """
    if before is not None:
        return continued(np.concatenate([before[..., None, :], given], -2))[..., 1:, :]
    other = np.stack([given[..., 0] + np.pi, np.pi - given[..., 1], given[..., 2] + np.pi], -1)
    same, crossed = (_apart(triple[..., 1:, :], given[..., :-1, :]) for triple in (given, other))
    # From the one to the other and back, a step costs the same.
    switches = np.concatenate([np.zeros((*given.shape[:-2], 1), int), crossed < same], -1)
    found = np.where((np.cumsum(switches, -1) % 2)[..., None].astype(bool), other, given)
    return np.asarray(np.unwrap(found, axis=-2))


def _apart(one: Numbers, other: Numbers) -> Numbers:
    """The sum of the squares of how far angles are apart, whole turns aside."""
    turned = np.remainder(one - other + np.pi, 2.0 * np.pi) - np.pi
    apart: Numbers = (turned * turned).sum(-1)
    return apart


def rates_map(angles: Numbers) -> Numbers:
    """E, (..., 3, 3)."""
    (_, sp, sr), (_, cp, cr) = (np.moveaxis(f(angles), -1, 0) for f in (np.sin, np.cos))
    zero = 0.0 * sp
    rows = [[-sp, zero, zero + 1.0], [sr * cp, cr, zero], [cr * cp, -sr, zero]]
    return np.stack([np.stack(row, -1) for row in rows], -2)


def rates_of(angles: Numbers, turning: Numbers) -> Numbers:
    """E^-1 w: rates of the angles for angular velocities along the body's axes, (..., 3) each."""
    (_, sp, sr), (_, cp, cr) = (np.moveaxis(f(angles), -1, 0) for f in (np.sin, np.cos))
    x, y, z = np.moveaxis(turning, -1, 0)
    yaw = (y * sr + z * cr) / cp
    return np.stack([yaw, y * cr - z * sr, x + yaw * sp], -1)


def turning_of_rates(angles: Numbers, rates: Numbers) -> Numbers:
    """dE/dt times the rates, what w' has besides E times their change, (..., 3)."""
    (_, sp, sr), (_, cp, cr) = (np.moveaxis(f(angles), -1, 0) for f in (np.sin, np.cos))
    yaw, pitch, roll = np.moveaxis(rates, -1, 0)
    x = -yaw * cp * pitch
    y = -pitch * sr * roll + yaw * (cr * roll * cp - sr * sp * pitch)
    z = -pitch * cr * roll - yaw * (sr * roll * cp + cr * sp * pitch)
    return np.stack([x, y, z], -1)


def turned(angles: Numbers, vectors: Any) -> Numbers:
    """Vectors along the body's axes, (..., 3), along those that it turns in."""
    (sy, sp, sr), (cy, cp, cr) = (np.moveaxis(f(angles), -1, 0) for f in (np.sin, np.cos))
    x, y, z = np.moveaxis(vectors, -1, 0)
    y, z = cr * y - sr * z, sr * y + cr * z
    x, z = cp * x + sp * z, -sp * x + cp * z
    return np.stack([cy * x - sy * y, sy * x + cy * y, z], -1)
