"""Rigid bodies as a reference: the Newton–Euler recursion, and bounds of what it sums."""

import numpy as np

from linkwise.check.magnitudes import Magnitudes
from linkwise.check.newton_euler import NewtonEuler
from linkwise.check.reference import TOLERANCE, Reference, columns
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
    n, torque, size = recursion.n, recursion.partial_torque, magnitudes.partial_torque
    rest = 0.0 * q
    values = {
        "tau": torque(q, qd, qdd),
        "g": torque(q, rest, rest),
        "c2": columns(lambda e: torque(q, rest, rest + e, gravity=False), n),
        "c1": columns(lambda e: 0.5 * torque(q, qd + 1j * e, rest, gravity=False).imag, n),
        "c0": columns(lambda e: torque(q + 1j * COMPLEX_STEP * e, qd, qdd).imag / COMPLEX_STEP, n),
    }
    at, speed, change = (np.abs(x) for x in states.motion)

    def moving(rates: Array) -> Array:
        return size(at, rates, rest, gravity=False)

    quadratic = moving(speed)
    scales = {
        "tau": size(at, speed, change),
        "g": size(at, rest, rest),
        "c2": columns(lambda e: size(at, rest, rest + e, gravity=False), n),
        "c1": columns(lambda e: 0.5 * (moving(speed + e) - quadratic - moving(rest + e)), n),
        "c0": columns(lambda e: size(at + e, speed, change), n),
    }
    values["h1"], scales["h1"] = 0.0 * values["c1"], scales["c1"]
    kinetic, potential = recursion.energies(q, qd)
    sizes = magnitudes.lagrangian(at, speed)
    moved = recursion.energies(q + 1j * COMPLEX_STEP * qd, qd + 1j * COMPLEX_STEP * qdd)
    return Reference(
        "Newton-Euler recursion",
        TOLERANCE,
        states,
        values,
        scales,
        {"kinetic": (kinetic, sizes), "potential": (potential, sizes)},
        (moved[0] + moved[1]).imag / COMPLEX_STEP,
    )
