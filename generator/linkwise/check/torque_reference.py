"""A package's own torques as a reference, where there is no other: all else is differences of them."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from linkwise.check.reference import Reference, columns, link_sizes
from linkwise.check.states import Found, States, states_where
from linkwise.package.entries import JointEntry
from linkwise.package.load import Array

DIFFERENCE_TOLERANCE = 1e-6
"""Largest error that passes against differences, relative to the value."""

STEP = 0.01
"""Step of the sixth-order differences: what they leave out is of order STEP⁶."""

STEP_ERROR = 1e-8
"""How far halving the step may change a slope; it is then known to a sixtieth of this."""


def torque_reference(name: str, torque: Callable[[Array, Array, Array], Array], states: States) -> Reference:
    """Dense τ_ij (samples, n, N) of the package itself, and all else by differences of it.

    They are exact in q̈ (degree 1) and q̇ (degree 2); those in q are of sixth order.
    """
    q, qd, qdd = states.motion
    rest, n = 0.0 * q, q.shape[1]
    g = torque(q, rest, rest)
    slope = columns(lambda e: (torque(q, qd + e, rest) - torque(q, qd - e, rest)) / 2, n)
    h1 = columns(lambda e: (torque(q, rest + e, rest) - torque(q, rest - e, rest)) / 2, n)
    values = {
        "tau": torque(q, qd, qdd),
        "g": g,
        "c2": columns(lambda e: torque(q, rest, rest + e) - g, n),
        "c1": 0.5 * (slope + h1),
        "c0": columns(lambda e: _sixth_order(lambda x: torque(x, qd, qdd), q, e), n),
        "h1": h1,
    }
    kept = np.all([np.isfinite(v).reshape(len(v), -1).all(axis=1) for v in values.values()], axis=0)
    states, values = states.at(kept), {what: value[kept] for what, value in values.items()}
    name = f"differences of {name}'s torques"
    return Reference(name, DIFFERENCE_TOLERANCE, states, values, link_sizes(values, states))


def states_of_torques(
    torque: Callable[[Array, Array, Array], Array], joints: Sequence[JointEntry], samples: int
) -> Found:
    """States at which the torques are numbers."""

    def defined(states: States) -> Any:
        return np.isfinite(torque(*states.motion)).all(axis=(1, 2))

    return states_where(defined, joints, samples)


def _sixth_order(f: Callable[[Array], Array], x: Array, direction: Array) -> Array:
    """Slope of f along a direction; NaN for states where half the step says otherwise, as beside a pole."""
    coarse, fine = (_central(f, x, direction, step) for step in (STEP, STEP / 2))
    apart = np.abs(coarse - fine) > STEP_ERROR * np.abs(fine).max(initial=1e-300, where=np.isfinite(fine))
    slope: Array = np.where(apart, np.nan, fine)
    return slope


def _central(f: Callable[[Array], Array], x: Array, direction: Array, step: float) -> Array:
    one, two, three = (f(x + k * step * direction) - f(x - k * step * direction) for k in (1, 2, 3))
    slope: Array = (45 * one - 9 * two + three) / (60 * step)
    return slope
