"""What answers are held against: every quantity of every link, from a source that shares no text with them.

- rigid bodies: the Newton–Euler recursion over the manifest's tree (body_reference),
- a user's energies: the manifest's text of them, differentiated by torch.func (energy_reference),
- without torch for that: the package's own torques, of which all else is differences (torque_reference).
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from linkwise.check.states import NUMBERS, States
from linkwise.package.load import Array

TOLERANCE = 1e-9
"""Largest error that passes, relative to the value itself; float64 leaves some 1e-13."""

LEAST = 40
"""Samples' coefficients that a check computes at a time, of robots that are not large."""
STIFF = 10.0
"""How much larger operands of derivatives may be than the largest part of a link's torques."""
SINGLE = 1e18
"""Squares of larger numbers overflow in single precision."""


@dataclass(frozen=True)
class Reference:
    """Dense values by quantity, (samples, n, N[, n]), and how large the numbers are that each is summed from.

    values, scales: of tau, c2, c1, g, c0 and h1, alike in shape
    energies: kinetic and potential ones (samples, N), and their scales, by name; empty where there are none
    power: d/dt of each link's energy, (samples, N)
    """

    name: str
    tolerance: float
    states: States
    values: Mapping[str, Array]
    scales: Mapping[str, Array]
    energies: Mapping[str, tuple[Array, Array]] = field(default_factory=dict)
    power: Array | None = None

    @property
    def lagrangian(self) -> tuple[Array, Array] | None:
        """Kinetic less potential energies (samples, N), and their scales likewise."""
        if not self.energies:
            return None
        (kinetic, size), (potential, other) = self.energies.values()
        return kinetic - potential, size + other

    @property
    def is_large(self) -> bool:
        """Whether a sample's coefficients are so many that batches of every shape would take minutes.

        How batches are cut and joined is code that all robots share.
        """
        return bool(self.values["c0"][0].size * LEAST > NUMBERS)

    @cached_property
    def regularity(self) -> Array:
        """Least eigenvalue of each mass matrix with ones on its diagonal, in size, (samples,)."""
        mass = self.values["c2"].sum(2)
        size = np.sqrt(np.abs(np.einsum("sii->si", mass)))
        size = np.where(size > 0, size, 1.0)
        scaled = mass / (size[:, :, None] * size[:, None, :])
        least: Array = np.abs(np.linalg.eigvalsh(scaled)).min(-1)
        return least

    def fits_single(self) -> NDArray[np.bool_]:
        """Samples (samples,) whose numbers are small enough for single precision, squares included.

        Masses are large enough for their inverses; regressors have none.
        """
        parts = [np.abs(value) for value in self.values.values()]
        if "c2" in self.values:
            mass = np.abs(np.einsum("sii->si", self.values["c2"].sum(2)))
            parts.append(1.0 / np.sqrt(np.where(mass > 0.0, mass, 1.0)))
        sizes = [part.reshape(len(part), -1).max(axis=1, initial=0.0) for part in parts]
        fits: NDArray[np.bool_] = np.max(sizes, axis=0) < SINGLE
        return fits


def columns(column: Callable[[Array], Array], n: int) -> Array:
    """What each unit vector (n,) gives, side by side on a last axis."""
    return np.stack([column(unit) for unit in np.eye(n)], -1)


def link_sizes(values: Mapping[str, Array], states: States) -> dict[str, Array]:
    """How large an entry would have to be to matter, beside the largest part of its link's torques.

    That is of the same sample; a coefficient counts as what it makes of the largest rates of all. STIFF times
    as much, for what is differentiated twice: of log cosh 5q, say, only 1 − tanh² is left.
    """
    _, qd, qdd = (np.abs(x).max(initial=1e-300) for x in states.motion)
    over = {"tau": 1.0, "g": 1.0, "c2": qdd, "c1": qd, "h1": qd, "c0": 1.0}
    parts = [np.abs(value) * over[what] for what, value in values.items()]
    link = np.max([part.max(axis=(1, *range(3, part.ndim)), initial=1e-300) for part in parts], axis=0)
    return {
        what: np.broadcast_to(
            (STIFF * link / over[what])[:, None, :, *[None] * (value.ndim - 3)], value.shape
        )
        for what, value in values.items()
    }


def dense_quantities(reference: Reference) -> dict[str, tuple[Array, Array]]:
    """What functions and calls with zeros answer, and how large the numbers are that each is summed from."""
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
