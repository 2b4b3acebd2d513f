"""Random motions of a robot, from which base parameters are found.

Joints that are tied cannot have any positions: they walk at random from positions of a log, by steps along
which loops stay closed in the same way.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np

from ..constraints.robot_constraints import Constraints
from .pseudo_inertia import Floats

SPEED = 3.0
"""Largest random velocity and acceleration in rad/s and rad/s^2, m/s and m/s^2."""
STEPS = 24
"""Number of steps of a walk."""
LONGEST = 0.5
"""Longest step in rad and m; the shortest are a tenth of it."""
STRAIGHT = 0.5
"""Part of a step: if closing the ties moves joints by more, they may close in another way."""
ROUNDS = 12
"""Number of iterations of Newton's method in a step."""
CLOSED = 1e-9
"""Violation in m, rad or a coupling's unit, up to which ties count as closed."""
RANK = 1e-5
"""Singular values below this part of the largest are zero: numbers of files are rounded."""
LEVER = 10.0
"""Factor by which followers may turn faster than where the walk began: more is close to a dead centre."""

Motion = tuple[Floats, Floats, Floats]


def random_motion(n: int, samples: int) -> Motion:
    """Return q, qd and qdd (samples, n) of joints that are free."""
    generator = np.random.default_rng(0)
    q = generator.uniform(-np.pi, np.pi, (samples, n))
    qd, qdd = generator.uniform(-SPEED, SPEED, (2, samples, n))
    return q, qd, qdd


def random_closed_motion(ties: Constraints[Any], closed: Floats, samples: int) -> Motion:
    """Return q, qd and qdd (samples, n) of joints that are tied.

    closed: positions (S, n) in which ties close
    """
    generator, own = np.random.default_rng(0), _independent(ties)
    q = closed[generator.integers(len(closed), size=samples)]
    tolerance = CLOSED + 2.0 * np.abs(_violation(ties, q)).max(initial=0.0)
    most = LEVER * _levers(ties, q)
    for _ in range(STEPS):
        size = LONGEST * 10.0 ** -generator.uniform(0.0, 1.0, (samples, 1))
        step = _along(ties, q, size * generator.uniform(-1.0, 1.0, q.shape))
        there = _closed(ties, q + step)
        beside = np.abs(there - q - step).max(1) <= STRAIGHT * np.abs(step).max(1)
        closes = np.abs(_violation(ties, there)).max(1) <= tolerance
        good = beside & closes & (_levers(ties, there) <= most)
        q = np.where(good[:, None], there, q)
    qd, qdd = np.zeros((2, *q.shape))
    qd[:, own], qdd[:, own] = generator.uniform(-SPEED, SPEED, (2, samples, len(own)))
    q = np.asarray(ties.closed(q))
    qd = np.asarray(ties.velocity(q, qd[:, own]))
    return q, qd, np.asarray(ties.acceleration(q, qd, qdd[:, own]))


def _along(ties: Constraints[Any], q: Floats, step: Floats) -> Floats:
    """Return the part of a step that the ties allow."""
    rows = _rows(ties, q)
    against = np.linalg.pinv(rows, rcond=RANK) @ (rows @ step[..., None])
    left: Floats = step - against[..., 0]
    return left


def _closed(ties: Constraints[Any], q: Floats) -> Floats:
    """Return positions nearby in which ties close, as far as least steps lead there."""
    for _ in range(ROUNDS):
        open_by = _violation(ties, q)[..., None]
        step = (np.linalg.pinv(_rows(ties, q), rcond=RANK) @ open_by)[..., 0]
        size = np.abs(step).max(axis=1, keepdims=True)
        q = q - step * (LONGEST / np.maximum(size, LONGEST))
    return q


def _levers(ties: Constraints[Any], q: Floats) -> Floats:
    """Return the largest speed of a follower for a unit speed of an independent joint, (S,), at least 1."""
    own, rows = _independent(ties), _rows(ties, q)
    rest = [k for k in range(q.shape[1]) if k not in own]
    found: Floats = np.abs(np.linalg.pinv(rows[..., rest], rcond=RANK) @ rows[..., own]).max(
        (1, 2), initial=1.0
    )
    return found


def _rows(ties: Constraints[Any], q: Floats) -> Floats:
    """Return the constraints' Jacobian A, (S, C, n)."""
    return np.asarray(ties.jacobian(q))


def _violation(ties: Constraints[Any], q: Floats) -> Floats:
    """Return the constraints' violation phi, (S, C)."""
    return np.asarray(ties.violation(q))


def _independent(ties: Constraints[Any]) -> Sequence[int]:
    """Return the columns of the independent joints."""
    return list(ties.ties.chosen.independent)
