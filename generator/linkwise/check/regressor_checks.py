"""Checks of regressors against the recursion, for bodies that have one inertial parameter each."""

from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
from linkwise_runtime.dynamics import Dynamics
from linkwise_runtime.rule.joint_tree import JointTree

from linkwise.arrays import Array, Index
from linkwise.check.compare import Entries, Result, compare
from linkwise.check.model_calls import FLOAT32
from linkwise.oracle.magnitudes import Magnitudes
from linkwise.oracle.newton_euler import NewtonEuler
from linkwise.oracle.reference import TOLERANCE, Reference, by_unit
from linkwise.oracle.states import NUMBERS, States
from linkwise.package.manifest import Manifest

MOST = 12
"""Most states."""
MOMENTS = ((0, 0), (0, 1), (1, 1), (0, 2), (1, 2), (2, 2))
"""Index of Ixx, Ixy, Iyy, Ixz, Iyz, Izz, in the order of the regressor."""


def regressor_reference(manifest: Manifest, tree: JointTree, states: States) -> Reference:
    """Return Y of tau, c2, c1 and g, at the first few states."""
    n, links = len(manifest.joints), len(manifest.links)
    few = states.at(slice(max(1, min(MOST, NUMBERS // (10 * n * n * links)))))
    values, scales = _rows(manifest, tree, few)
    for what, value in values.items():
        # A mass at e_a without inertia about the origin has the parameters m and mc_a.
        value[..., 1:4] -= value[..., :1]
        scales[what][..., 1:4] += scales[what][..., :1]
    return Reference("Newton-Euler recursion", TOLERANCE, few, values, scales)


def regressor_calls(name: str, model: Dynamics, reference: Reference) -> Iterator[Result]:
    """Yield checks of both calls of a back end, at all states, one and none, and in single precision."""
    states, every = reference.states, np.arange(len(reference.states.q))

    def entries(kind: type, rows: Index) -> Iterator[Entries]:
        motion: list[Any] = [a.astype(kind) for a in states.at(rows).motion]
        parts = zip(("Y c2", "Y c1", "Y g"), model.coefficient_regressors(*motion[:2]), strict=True)
        at = slice(None) if rows.size == len(states.q) else rows.reshape(-1)  # large: nothing is copied
        for what, value in (("Y", model.regressor(*motion)), *parts):
            expected, scale = (source[what][at] for source in (reference.values, reference.scales))
            yield Entries(what, value.reshape(rows.size, *value.shape[rows.ndim :]), expected, scale)

    batches = (every,) if len(every) == 1 else (every, every[:0], every[0])
    groups = (each for rows in batches for each in entries(np.float64, np.asarray(rows)))
    yield compare(f"{name}: regressors against {reference.name}", groups, reference.tolerance)
    fitting = np.flatnonzero(reference.fits_single())
    yield compare(f"{name}: regressors in single precision", entries(np.float32, fitting), **FLOAT32)


def _unit_bodies() -> Iterator[tuple[float, Any, Any]]:
    """Yield mass, centre of mass, and inertia about it, of each unit body."""
    none = np.zeros((3, 3))
    yield 1.0, (0.0, 0.0, 0.0), none
    for a in range(3):
        away = np.eye(3)[a]
        yield 1.0, away, np.outer(away, away) - np.eye(3)
    for a, b in MOMENTS:
        inertia = none.copy()
        inertia[a, b] = inertia[b, a] = 1.0
        yield 0.0, (0.0, 0.0, 0.0), inertia


def _rows(manifest: Manifest, tree: JointTree, states: States) -> tuple[dict[str, Array], dict[str, Array]]:
    """Return tau, c2, c1 and g, and bounds of what they are summed from, where links carry each unit body."""
    units = [
        replace(tree.links[0], mass=mass, com=com, inertia=inertia) for mass, com, inertia in _unit_bodies()
    ]
    carried = [units] * len(manifest.links)
    torque = partial(NewtonEuler(manifest, tree).torques_of, carried)
    size = partial(Magnitudes(manifest, tree).torques_of, carried)
    q, qd, qdd = states.motion
    rest = 0.0 * q
    values = {
        "Y": torque(q, qd, qdd),
        "Y c2": by_unit(lambda q, qd, _, e: torque(q, 0.0 * qd, e, gravity=False), states),
        "Y c1": by_unit(
            lambda q, qd, _, e: 0.5 * torque(q, qd + 1j * e, 0.0 * q, gravity=False).imag, states
        ),
        "Y g": torque(q, rest, rest),
    }
    at, speed, change = (np.abs(x) for x in states.motion)
    most = States(at, speed, change)

    def moving(q: Array, qd: Array) -> Array:
        return size(q, qd, 0.0 * q, gravity=False)

    scales = {
        "Y": size(at, speed, change),
        "Y c2": by_unit(lambda q, qd, _, e: size(q, 0.0 * qd, e, gravity=False), most),
        # The bound B is quadratic in qd: 1/2 dB/dqd_k = 1/2 (B(qd + e_k) - B(qd) - B(e_k)).
        "Y c1": by_unit(lambda q, qd, _, e: 0.5 * (moving(q, qd + e) - moving(q, qd) - moving(q, e)), most),
        "Y g": size(at, rest, rest),
    }
    return values, scales
