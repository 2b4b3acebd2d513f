"""What answers are held against: every quantity of every link, from a source that shares no text with them.

- rigid bodies: the Newton–Euler recursion over the manifest's tree,
- a user's energies: the manifest's text of them, differentiated by torch.func,
- without torch for that: the package's own torques alone, from which all else follows by exact differences.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from linkwise.check.magnitudes import Magnitudes
from linkwise.check.newton_euler import NewtonEuler
from linkwise.extras import extra
from linkwise.package.load import Array

TOLERANCE = 1e-9
"""Largest error that passes, relative to an entry's own largest value; float64 leaves some 1e-13."""

DIFFERENCE_TOLERANCE = 1e-6
"""The same against differences of torques in the positions."""

COMPLEX_STEP = 1e-30
"""Nothing is subtracted in a complex step, so that it may be as small as one likes."""

STEP = 0.01
"""Step of the sixth-order differences: what they leave out is of order STEP⁶."""

STEP_ERROR = 1e-8
"""How far halving the step may change a slope; it is then known to a sixtieth of this."""


@dataclass(frozen=True)
class States:
    """The states of all checks, each array (samples, n)."""

    q: Array
    qd: Array
    qdd: Array

    @property
    def motion(self) -> tuple[Array, Array, Array]:
        """q, qd and qdd."""
        return self.q, self.qd, self.qdd

    def at(self, rows: Any) -> "States":
        """Some of the samples, in any shape (..., n)."""
        return States(self.q[rows], self.qd[rows], self.qdd[rows])


@dataclass(frozen=True)
class Reference:
    """Dense values by quantity, (samples, n, N[, n]), and how large the numbers are that each is summed from.

    values, scales: of tau, c2, c1, g, c0 and h1; scales lack the axis of the samples
    lagrangian, its scales: (samples, N) and (N,), None where the source has no energies; power: d/dt of each
    link's energy, (samples, N)
    """

    name: str
    tolerance: float
    states: States
    values: Mapping[str, Array]
    scales: Mapping[str, Array]
    lagrangian: tuple[Array, Array] | None = None
    power: Array | None = None


def random_states(n: int, samples: int, seed: int = 0) -> States:
    """Random states over all four quadrants, no rate near 0, and states at rest; float32 holds them."""
    generator = np.random.default_rng(seed)
    q = generator.uniform(-np.pi, np.pi, (samples, n))
    rates = generator.uniform(0.25, 2.5, (2, samples, n)) * generator.choice([-1.0, 1.0], (2, samples, n))
    still = np.zeros((4, n))
    q, qd, qdd = (
        np.concatenate([random, still]).astype(np.float32).astype(float) for random in (q, rates[0], rates[1])
    )
    q[samples + 1 :], qd[samples + 2], qdd[samples + 3] = q[0], qd[0], qdd[0]
    return States(q, qd, qdd)


def recursion_reference(recursion: NewtonEuler, magnitudes: Magnitudes, states: States) -> Reference:
    """Newton–Euler over the manifest's rigid bodies; τ is a polynomial of degree 2 in q̇ and 1 in q̈.

    ½ Im τ(q̇ + i e_k) is exactly ½ ∂τ/∂q̇_k there, and c0 is a complex step.
    """
    q, qd, qdd = states.motion
    units = np.eye(recursion.n)
    torque, size = recursion.partial_torque, magnitudes.partial_torque
    most = [np.abs(x).max(axis=0) for x in states.motion]
    none = 0.0 * most[0]
    values = {
        "tau": torque(q, qd, qdd),
        "g": torque(q, 0 * q, 0 * q),
        "c2": _columns(lambda e: torque(q, 0 * q, 0 * q + e, gravity=False), units),
        "c1": _columns(lambda e: 0.5 * torque(q, qd + 1j * e, 0 * q, gravity=False).imag, units),
        "c0": _columns(lambda e: torque(q + 1j * COMPLEX_STEP * e, qd, qdd).imag / COMPLEX_STEP, units),
    }
    scales = {
        "tau": size(*most),
        "g": size(most[0], none, none),
        "c2": _columns(lambda e: size(most[0], none, e, gravity=False), units),
        "c1": _columns(lambda e: size(most[0], most[1] + e, none, gravity=False), units),
        "c0": _columns(lambda e: size(most[0] + e, most[1], most[2]), units),
    }
    values["h1"], scales["h1"] = 0.0 * values["c1"], scales["c1"]
    kinetic, potential = recursion.energies(q, qd)
    moved = recursion.energies(q + 1j * COMPLEX_STEP * qd, qd + 1j * COMPLEX_STEP * qdd)
    return Reference(
        "Newton-Euler recursion",
        TOLERANCE,
        states,
        values,
        scales,
        (kinetic - potential, magnitudes.lagrangian(most[0], most[1])),
        (moved[0] + moved[1]).imag / COMPLEX_STEP,
    )


def lagrangian_reference(modules: Sequence[Any], states: States) -> Reference:
    """Lagrangians (q, qd) -> L_j, differentiated by torch.func one sample at a time."""
    torch = extra("torch")
    motion = [torch.from_numpy(m) for m in states.motion]
    rows = [[part.numpy() for part in torch.func.vmap(_Link(module))(*motion)] for module in modules]
    names = ("tau", "c2", "c1", "g", "c0", "h1")
    values = {name: np.stack(parts, 2) for name, parts in zip(names, zip(*rows, strict=True), strict=True)}
    batched = [torch.func.vmap(module)(*motion[:2]).numpy() for module in modules]
    return _finite("energies differentiated", TOLERANCE, states, values, np.stack(batched, 1))


class _Link:
    """One link's quantities, in the order tau, c2, c1, g, c0, h1, for one sample."""

    def __init__(self, module: Any) -> None:
        self.func, self.module = extra("torch").func, module

    def __call__(self, q: Any, qd: Any, qdd: Any) -> tuple[Any, ...]:
        rest = 0.0 * qd
        stiffness, slope = self.func.jacrev(self.torque, (0, 1))(q, qd, qdd)
        h1 = self.func.jacrev(self.torque, 1)(q, rest, rest)
        c2 = self.func.jacrev(self.momentum, 1)(q, qd)
        g = self.torque(q, rest, rest)
        return self.torque(q, qd, qdd), c2, 0.5 * (slope + h1), g, stiffness, h1

    def momentum(self, q: Any, qd: Any) -> Any:
        return self.func.grad(self.module, 1)(q, qd)

    def torque(self, q: Any, qd: Any, qdd: Any) -> Any:
        """Chain rule of d/dt ∂L/∂q̇, less ∂L/∂q."""
        along, mass = self.func.jacrev(self.momentum, (0, 1))(q, qd)
        return along @ qd + mass @ qdd - self.func.grad(self.module, 0)(q, qd)


def torque_reference(name: str, torque: Callable[[Array, Array, Array], Array], states: States) -> Reference:
    """Dense τ_ij (samples, n, N) of the package itself, and all else by differences of it.

    They are exact in q̈ (degree 1) and q̇ (degree 2); those in q are of sixth order.
    """
    q, qd, qdd = states.motion
    rest, units = 0.0 * q, np.eye(q.shape[1])
    g = torque(q, rest, rest)
    slope = _columns(lambda e: (torque(q, qd + e, rest) - torque(q, qd - e, rest)) / 2, units)
    h1 = _columns(lambda e: (torque(q, rest + e, rest) - torque(q, rest - e, rest)) / 2, units)
    values = {
        "tau": torque(q, qd, qdd),
        "g": g,
        "c2": _columns(lambda e: torque(q, rest, rest + e) - g, units),
        "c1": 0.5 * (slope + h1),
        "c0": _columns(lambda e: _sixth_order(lambda x: torque(x, qd, qdd), q, e), units),
        "h1": h1,
    }
    return _finite(f"differences of {name}'s torques", DIFFERENCE_TOLERANCE, states, values)


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


def _finite(
    name: str, tolerance: float, states: States, values: dict[str, Array], lagrangian: Array | None = None
) -> Reference:
    """A reference over those states that the energies are defined for.

    A coefficient that is 0 but for rounding has no size of its own: what counts is how large one is that
    makes torques as large as the link's of this motion.
    """
    kept = np.ones(len(states.q), dtype=bool)
    for value in values.values():
        kept &= np.isfinite(value).reshape(len(kept), -1).all(axis=1)
    states, values = states.at(kept), {key: value[kept] for key, value in values.items()}
    _, qd, qdd = (np.abs(x).max(initial=1e-300) for x in states.motion)
    parts = [
        values["tau"],
        values["g"],
        values["c2"] * qdd,
        values["c1"] * qd,
        values["h1"] * qd,
        values["c0"],
    ]
    link = np.max([np.abs(part).max(axis=_others(part), initial=1e-300) for part in parts], axis=0)
    over = {"tau": 1.0, "g": 1.0, "c2": qdd, "c1": qd, "h1": qd, "c0": 1.0}
    scales = {
        key: np.broadcast_to((link / over[key]).reshape(1, -1, *[1] * (value.ndim - 3)), value.shape[1:])
        for key, value in values.items()
    }
    energy = (
        None
        if lagrangian is None
        else (lagrangian[kept], np.abs(lagrangian[kept]).max(axis=0, initial=1e-300))
    )
    return Reference(name, tolerance, states, values, scales, energy)


def _others(value: Array) -> tuple[int, ...]:
    """All axes but that of the links."""
    return tuple(axis for axis in range(value.ndim) if axis != 2)


def _columns(column: Callable[[Array], Array], units: Array) -> Array:
    """Columns k side by side on a last axis."""
    return np.stack([column(unit) for unit in units], -1)
