"""Rigid bodies as a reference: the Newton–Euler recursion, and bounds of what it sums."""

from collections.abc import Callable

import numpy as np

from linkwise.check.magnitudes import Magnitudes
from linkwise.check.newton_euler import NewtonEuler
from linkwise.check.reference import TOLERANCE, Reference
from linkwise.check.states import States
from linkwise.package.load import Array

COMPLEX_STEP = 1e-30
"""Nothing is subtracted in a complex step, so that it may be as small as one likes."""


def body_reference(recursion: NewtonEuler, magnitudes: Magnitudes, states: States) -> Reference:
    """Newton–Euler over the manifest's rigid bodies; τ is a polynomial of degree 2 in q̇ and 1 in q̈.

    ½ Im τ(q̇ + i e_k) is exactly ½ ∂τ/∂q̇_k there, and c0 is a complex step. Of the bound B(q̇), which is
    quadratic too, ½ ∂B/∂q̇_k is ½ (B(q̇ + e_k) − B(q̇) − B(e_k)).
    """
    q, qd, qdd = states.motion
    torque, size = recursion.partial_torque, magnitudes.partial_torque
    rest = 0.0 * q
    step = 1j * COMPLEX_STEP
    values = {
        "tau": torque(q, qd, qdd),
        "g": torque(q, rest, rest),
        "c2": by_unit(lambda q, qd, qdd, e: torque(q, 0.0 * qd, e, gravity=False), states),
        "c1": by_unit(
            lambda q, qd, qdd, e: 0.5 * torque(q, qd + 1j * e, 0.0 * q, gravity=False).imag, states
        ),
        "c0": by_unit(lambda q, qd, qdd, e: torque(q + step * e, qd, qdd).imag / COMPLEX_STEP, states),
    }
    at, speed, change = (np.abs(x) for x in states.motion)
    most = States(at, speed, change)

    def moving(q: Array, rates: Array) -> Array:
        return size(q, rates, 0.0 * q, gravity=False)

    def velocity(q: Array, qd: Array, qdd: Array, e: Array) -> Array:
        return 0.5 * (moving(q, qd + e) - moving(q, qd) - moving(q, e))

    scales = {
        "tau": size(at, speed, change),
        "g": size(at, rest, rest),
        "c2": by_unit(lambda q, qd, qdd, e: size(q, 0.0 * qd, e, gravity=False), most),
        "c1": by_unit(velocity, most),
        "c0": by_unit(lambda q, qd, qdd, e: size(q + e, qd, qdd), most),
    }
    values["h1"], scales["h1"] = np.zeros_like(values["c1"]), scales["c1"]
    kinetic, potential = recursion.energies(q, qd)
    sizes = magnitudes.lagrangian(at, speed)
    moved = recursion.energies(q + step * qd, qd + step * qdd)
    return Reference(
        "Newton-Euler recursion",
        TOLERANCE,
        states,
        values,
        scales,
        {"kinetic": (kinetic, sizes), "potential": (potential, sizes)},
        (moved[0] + moved[1]).imag / COMPLEX_STEP,
    )


def by_unit(torque: Callable[..., Array], states: States) -> Array:
    """What each unit vector e (n,) gives with q, qd and qdd, (samples, i, j, ...), on an axis behind j.

    All of them are in one call.
    """
    samples, n = states.q.shape
    motion = (np.repeat(x, n, axis=0) for x in states.motion)
    found = torque(*motion, np.tile(np.eye(n), (samples, 1)))
    return np.ascontiguousarray(np.moveaxis(found.reshape(samples, n, *found.shape[1:]), 1, 3))
