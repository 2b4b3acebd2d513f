"""Random motions of a robot, by which base parameters are told.

Joints that are tied cannot be anywhere: from positions of a log they walk at random, by steps along which
loops stay closed in the way in which they do there.
"""

import numpy as np
from linkwise_runtime.dynamics import Dynamics
from numpy.typing import NDArray

from linkwise.analysis.constrained_model import ConstrainedModel
from linkwise.package.load import Array

SPEED = 3.0
"""rad/s and rad/s^2, m/s and m/s^2."""
STEPS = 24
"""Of a walk."""
LONGEST = 0.5
"""Of a step in rad and m; the shortest are a tenth of it."""
STRAIGHT = 0.5
"""Of a step: what is more than this beside it may have come to another way to close."""
ROUNDS = 12
"""Of Newton's method in a step."""
CLOSED = 1e-9
"""m, rad or a coupling's unit."""
RANK = 1e-5
"""Singular values below this part of the largest are zero: numbers of files are rounded."""
LEVER = 10.0
"""Times what joints that follow turn faster than where the walk began: next to a dead centre."""

Motion = tuple[Array, Array, Array]


def random_motion(model: Dynamics, samples: int) -> Motion:
    """q, qd and qdd (samples, n) of joints that are free."""
    generator, n = np.random.default_rng(0), len(model.joint_names)
    q = generator.uniform(-np.pi, np.pi, (samples, n))
    qd, qdd = generator.uniform(-SPEED, SPEED, (2, samples, n))
    return q, qd, qdd


def random_closed_motion(model: ConstrainedModel, closed: Array, samples: int) -> Motion:
    """The same of joints that are tied; closed: positions (S, n) in which ties close."""
    generator, own = np.random.default_rng(0), list(model.following.independent)
    q = closed[generator.integers(len(closed), size=samples)]
    tolerance = CLOSED + 2.0 * np.abs(_violation(model, q)).max(initial=0.0)
    most = LEVER * _levers(model, q)
    for _ in range(STEPS):
        size = LONGEST * 10.0 ** -generator.uniform(0.0, 1.0, (samples, 1))
        step = _along(model, q, size * generator.uniform(-1.0, 1.0, q.shape))
        there = _closed(model, q + step)
        beside = np.abs(there - q - step).max(1) <= STRAIGHT * np.abs(step).max(1)
        closes = np.abs(_violation(model, there)).max(1) <= tolerance
        good: NDArray[np.bool_] = beside & closes & (_levers(model, there) <= most)
        q = np.where(good[:, None], there, q)
    qd, qdd = np.zeros((2, *q.shape))
    qd[:, own], qdd[:, own] = generator.uniform(-SPEED, SPEED, (2, samples, len(own)))
    return model.consistent(q, qd, qdd)


def _along(model: ConstrainedModel, q: Array, step: Array) -> Array:
    """What ties let of a step."""
    rows = _rows(model, q)
    against = np.linalg.pinv(rows, rcond=RANK) @ (rows @ step[..., None])
    left: Array = step - against[..., 0]
    return left


def _closed(model: ConstrainedModel, q: Array) -> Array:
    """Positions nearby in which ties close, as far as least steps lead there."""
    for _ in range(ROUNDS):
        open_by = _violation(model, q)[..., None]
        step = (np.linalg.pinv(_rows(model, q), rcond=RANK) @ open_by)[..., 0]
        size = np.abs(step).max(axis=1, keepdims=True)
        q = q - step * (LONGEST / np.maximum(size, LONGEST))
    return q


def _levers(model: ConstrainedModel, q: Array) -> Array:
    """How much faster than the independent joints others move at most, (S,)."""
    own, rows = list(model.following.independent), _rows(model, q)
    rest = [k for k in range(q.shape[1]) if k not in own]
    found: Array = np.abs(np.linalg.pinv(rows[..., rest], rcond=RANK) @ rows[..., own]).max(
        (1, 2), initial=1.0
    )
    return found


def _rows(model: ConstrainedModel, q: Array) -> Array:
    """A, (S, C, n)."""
    return np.asarray(model.constraints.jacobian(q))


def _violation(model: ConstrainedModel, q: Array) -> Array:
    """phi, (S, C)."""
    return np.asarray(model.constraints.violation(q))
