"""References for answers: every quantity of every link, from a source that shares no text with them.

- rigid bodies: the Newton–Euler recursion over the manifest's tree (body_reference),
- a user's energies: the manifest's text of them, differentiated by torch.func (energy_reference),
- without torch for that: the package's own torques, and all else by differences of them (torque_reference).
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from linkwise.arrays import Array, Mask
from linkwise.oracle.magnitudes import Magnitudes
from linkwise.oracle.newton_euler import NewtonEuler
from linkwise.oracle.states import NUMBERS, Found, States, states_where
from linkwise.package.entries import JointEntry

TOLERANCE = 1e-9
"""Largest error that passes, relative to the value itself; float64 leaves some 1e-13."""

LEAST = 40
"""Number of samples whose coefficients a check computes at a time, for robots that are not large."""
STIFF = 10.0
"""Factor by which operands of derivatives may exceed the largest part of a link's torques."""
SINGLE = 1e18
"""Squares of larger numbers overflow in single precision."""


@dataclass(frozen=True)
class Reference:
    """Dense values by quantity, (samples, n, N[, n]), and sizes of the numbers that each is summed from.

    values, scales: by quantity, tau, c2, c1, g, c0 and h1, alike in shape
    energies: kinetic and potential ones (samples, N), and their scales, by name; empty where there are none
    power: of the joints' torques on each link, by its energies, (samples, N)
    resting: c2 and g at rest, and their scales, where velocities change them
    written: Lagrangians of links that were written by hand (samples, N), and their scales
    """

    name: str
    tolerance: float
    states: States
    values: Mapping[str, Array]
    scales: Mapping[str, Array]
    energies: Mapping[str, tuple[Array, Array]] = field(default_factory=dict)
    power: Array | None = None
    resting: Mapping[str, tuple[Array, Array]] = field(default_factory=dict)
    written: tuple[Array, Array] | None = None

    def at_rest(self, what: str) -> tuple[Array, Array]:
        """Return c2 or g at rest, and their scales."""
        return self.resting.get(what) or (self.values[what], self.scales[what])

    @property
    def lagrangian(self) -> tuple[Array, Array] | None:
        """Lagrangians (samples, N), and their scales likewise; None without energies."""
        if self.written is not None or not self.energies:
            return self.written
        (kinetic, size), (potential, other) = self.energies.values()
        return kinetic - potential, size + other

    @property
    def is_large(self) -> bool:
        """True if a sample's coefficients are so many that batches of every shape would take minutes.

        How batches are cut and joined is code that all robots share.
        """
        return bool(self.values["c0"][0].size * LEAST > NUMBERS)

    @cached_property
    def regularity(self) -> Array:
        """Least absolute eigenvalue of each mass matrix with ones on its diagonal, (samples,)."""
        mass = self.values["c2"].sum(2)
        size = np.sqrt(np.abs(np.einsum("sii->si", mass)))
        size = np.where(size > 0, size, 1.0)
        scaled = mass / (size[:, :, None] * size[:, None, :])
        least: Array = np.abs(np.linalg.eigvalsh(scaled)).min(-1)
        return least

    def fits_single(self) -> Mask:
        """Return which samples have numbers small enough for single precision, squares included, (samples,).

        Masses must be large enough for their inverses; regressors have none.
        """
        parts = [np.abs(value) for value in self.values.values()]
        if "c2" in self.values:
            mass = np.abs(np.einsum("sii->si", self.values["c2"].sum(2)))
            parts.append(1.0 / np.sqrt(np.where(mass > 0.0, mass, 1.0)))
        sizes = [part.reshape(len(part), -1).max(axis=1, initial=0.0) for part in parts]
        fits: Mask = np.max(sizes, axis=0) < SINGLE
        return fits


def columns(column: Callable[[Array], Array], n: int) -> Array:
    """Return what `column` gives for each unit vector (n,), side by side on a last axis."""
    return np.stack([column(unit) for unit in np.eye(n)], -1)


def link_sizes(values: Mapping[str, Array], states: States) -> dict[str, Array]:
    """Return how large an entry must be to matter beside the largest part of its link's torques.

    That part is of the same sample; a coefficient counts as what it makes of the largest rates of all. STIFF
    times as much is taken, for what is differentiated twice: of log cosh 5q, say, only 1 − tanh² is left.
    """
    _, qd, qdd = (np.abs(x).max(initial=1e-300) for x in states.motion)
    over = {"tau": 1.0, "g": 1.0, "shares": 1.0, "c2": qdd, "c1": qd, "h1": qd, "c0": 1.0}
    parts = [np.abs(value) * over[what] for what, value in values.items()]
    link = np.max([part.max(axis=(1, *range(3, part.ndim)), initial=1e-300) for part in parts], axis=0)
    return {
        what: np.broadcast_to(
            (STIFF * link / over[what])[:, None, :, *[None] * (value.ndim - 3)], value.shape
        )
        for what, value in values.items()
    }


def dense_quantities(reference: Reference) -> dict[str, tuple[Array, Array]]:
    """Return results of functions and calls with zeros, and sizes of the numbers that each is summed from."""
    values, scales = reference.values, reference.scales
    rates = {"qd": reference.states.qd, "qdd": reference.states.qdd}
    over = {name: rate[:, None, None, :] for name, rate in rates.items()}
    found = {what: (values[what], scales[what]) for what in ("tau", "c2", "c1", "g", "c0")}
    found["sums"] = values["tau"].sum(-1), scales["tau"].sum(-1)
    slopes = 2 * values["c1"] - values["h1"], 2 * scales["c1"]
    for what, motion, (value, scale) in (
        ("c2", "qdd", found["c2"]),
        ("c1", "qd", found["c1"]),
        ("slopes", "qd", slopes),
    ):
        found[f"{what} {motion}"] = value * over[motion], scale * np.abs(over[motion])
    return found


COMPLEX_STEP = 1e-30
"""Complex step: nothing is subtracted in it, so that it may be as small as one likes."""


def body_reference(recursion: NewtonEuler, magnitudes: Magnitudes, states: States) -> Reference:
    """Return the reference by Newton–Euler recursion over the manifest's rigid bodies.

    τ is a polynomial of degree 2 in q̇ and 1 in q̈. ½ Im τ(q̇ + i e_k) is exactly ½ ∂τ/∂q̇_k there, and c0 is
    a complex step. Of the bound B(q̇), which is quadratic too, ½ ∂B/∂q̇_k is
    ½ (B(q̇ + e_k) − B(q̇) − B(e_k)).
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
    """Return what `torque` gives for q, qd, qdd and each unit vector e (n,), (samples, i, j, ...).

    The unit vectors are on an axis behind j, and all in one call.
    """
    samples, n = states.q.shape
    motion = (np.repeat(x, n, axis=0) for x in states.motion)
    found = torque(*motion, np.tile(np.eye(n), (samples, 1)))
    return np.ascontiguousarray(np.moveaxis(found.reshape(samples, n, *found.shape[1:]), 1, 3))


DIFFERENCE_TOLERANCE = 1e-6
"""Largest error that passes against differences, relative to the value."""

STEP = 0.01
"""Step of the sixth-order differences: what they leave out is of order STEP⁶."""

STEP_ERROR = 1e-8
"""Largest relative change of a slope where the step is halved; it is then known to a sixtieth of this."""


def torque_reference(name: str, torque: Callable[[Array, Array, Array], Array], states: States) -> Reference:
    """Return the package's own dense τ_ij (samples, n, N), and all else by differences of it.

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
    """Return states at which the torques are numbers."""

    def defined(states: States) -> Any:
        return np.isfinite(torque(*states.motion)).all(axis=(1, 2))

    return states_where(defined, joints, samples)


def _sixth_order(f: Callable[[Array], Array], x: Array, direction: Array) -> Array:
    """Return the slope of f along a direction; NaN for states where half the step disagrees, as at a pole."""
    coarse, fine = (_central(f, x, direction, step) for step in (STEP, STEP / 2))
    apart = np.abs(coarse - fine) > STEP_ERROR * np.abs(fine).max(initial=1e-300, where=np.isfinite(fine))
    slope: Array = np.where(apart, np.nan, fine)
    return slope


def _central(f: Callable[[Array], Array], x: Array, direction: Array, step: float) -> Array:
    one, two, three = (f(x + k * step * direction) - f(x - k * step * direction) for k in (1, 2, 3))
    slope: Array = (45 * one - 9 * two + three) / (60 * step)
    return slope
