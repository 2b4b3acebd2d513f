"""Rotation of a frame from another: the rotation vector, and its rate for an angular velocity."""

import math

import numpy as np

from ..chosen_names import sample_of
from ..interface import Library, Numbers, array_of, is_traced

SMALL = 1e-2
"""Angle in rad below which series serve: their errors are some 1e-17."""
HALF_TURN = math.pi - 1e-6
SKEWED = 1e-4
"""Largest error of a rotation matrix: a pose of float32, or of a file, may be so far from a rotation."""


def rotation_vector(library: Library, turn: Numbers, wanted: Numbers) -> Numbers:
    """Return theta (..., 3), in rad, with turn = exp([theta]) wanted, for matrices (..., 3, 3).

    Raises ValueError at half a turn, which has no direction, and for a `wanted` that is no rotation.
    """
    xp = library.xp
    relative = turn @ xp.swapaxes(wanted, -1, -2)
    twice = xp.stack(
        [relative[..., c, b] - relative[..., b, c] for b, c in ((1, 2), (2, 0), (0, 1))], -1
    )  # 2 sin(theta) along the axis
    cosine = (relative[..., 0, 0] + relative[..., 1, 1] + relative[..., 2, 2] - 1.0) / 2.0
    square = (twice * twice).sum(-1) / 4.0
    near = (square < SMALL * SMALL) & (cosine > 0.0)
    sine = xp.where(near, xp.ones_like(square), square) ** 0.5
    angle = xp.arctan2(sine, cosine)
    if not is_traced(turn):
        ones = library.constant(np.eye(3), wanted)
        _refuse("target.pose is no rotation", abs(wanted @ wanted.mT - ones) > SKEWED)
        mirrored = xp.linalg.det(wanted) < 0.0
        _refuse("target.pose is no rotation, but mirrors", mirrored[..., None, None])
        far = ~near & (angle > HALF_TURN)
        _refuse(
            "the frame is half a turn from its target, which has no direction; take steps between",
            far[..., None, None],
        )
    # arcsin(s) / s, and theta / sin(theta)
    series = 1.0 + square * (
        1.0 / 6.0 + square * (3.0 / 40.0 + square * (15.0 / 336.0 + square * 35.0 / 1152.0))
    )
    return xp.where(near, series, angle / sine)[..., None] * twice / 2.0


def rates_of_turning(library: Library, theta: Numbers) -> Numbers:
    """Return E (..., 3, 3) of d(theta)/dt = E w, w being the angular velocity in the same axes.

    E = 1 - [theta]/2 + c [theta]^2 with c = (1 - t/2 cot(t/2)) / t^2, t the angle: the inverse of the left
    Jacobian of rotations.
    """
    xp = library.xp
    square = (theta * theta).sum(-1)
    near = square < SMALL * SMALL
    t = xp.where(near, xp.ones_like(square), square) ** 0.5
    c = xp.where(
        near,
        1.0 / 12.0 + square * (1.0 / 720.0 + square / 30240.0),
        (1.0 - t / (2.0 * xp.tan(t / 2.0))) / (t * t),
    )
    x, y, z = theta[..., 0], theta[..., 1], theta[..., 2]
    none = xp.zeros_like(x)
    cross = xp.stack([xp.stack(row, -1) for row in ((none, -z, y), (z, none, -x), (-y, x, none))], -2)
    product = cross @ cross
    return library.constant(np.eye(3), cross) - cross / 2.0 + c[..., None, None] * product


def _refuse(what: str, wrong: Numbers) -> None:
    """Raise ValueError for the first sample of (..., 3, 3) or (..., 1, 1) where anything is wrong."""
    if bool(wrong.any()):
        sample = np.argwhere(array_of(wrong).any((-2, -1)))[0].tolist()
        raise ValueError(f"{what}{sample_of(sample)}")
