"""A user's energies as a reference: their Lagrangians, differentiated by torch.func one sample at a time."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from linkwise.check.reference import TOLERANCE, Reference, link_sizes
from linkwise.check.states import Found, States, states_where
from linkwise.check.text_lagrangian import NOISE
from linkwise.extras import extra
from linkwise.package.load import Array

NAMES = ("tau", "c2", "c1", "g", "c0", "h1")

Lagrangians = Sequence[Callable[[Any, Any], Any]]
"""(q, qd) -> L_j in J, for tensors of shape (n,)."""


def energy_reference(exact: Lagrangians, noisy: Sequence[Lagrangians], states: States) -> Reference:
    """Quantities of Lagrangians; `noisy` are the same but for errors of NOISE in each operation.

    What these change is what rounding of that size does: it measures the numbers that each value is summed
    from, whatever cancels of them.
    """
    values, lagrangian = _values(exact, states)
    scales, energy_scale = link_sizes(values, states), np.abs(lagrangian)
    for lagrangians in noisy:
        changed, other = _values(lagrangians, states)
        scales = {
            what: np.maximum(scale, np.abs(changed[what] - values[what]) / NOISE)
            for what, scale in scales.items()
        }
        energy_scale = np.maximum(energy_scale, np.abs(other - lagrangian) / NOISE)
    return Reference("energies differentiated", TOLERANCE, states, values, scales, (lagrangian, energy_scale))


def states_of_energies(lagrangians: Lagrangians, n: int, samples: int) -> Found:
    """States at which the energies and every quantity are numbers."""

    def defined(states: States) -> Any:
        values, energies = _values(lagrangians, states)
        parts = (energies, *values.values())
        return np.all([np.isfinite(part).reshape(len(part), -1).all(axis=1) for part in parts], axis=0)

    return states_where(defined, n, samples)


def _values(lagrangians: Lagrangians, states: States) -> tuple[dict[str, Array], Array]:
    torch = extra("torch")
    motion = [torch.from_numpy(m) for m in states.motion]
    rows = [[part.numpy() for part in torch.func.vmap(_Link(one))(*motion)] for one in lagrangians]
    energies = [torch.func.vmap(one)(*motion[:2]).numpy() for one in lagrangians]
    values = {name: np.stack(parts, 2) for name, parts in zip(NAMES, zip(*rows, strict=True), strict=True)}
    return values, np.stack(energies, 1)


class _Link:
    """One link's quantities, in the order tau, c2, c1, g, c0, h1, for one sample."""

    def __init__(self, lagrangian: Any) -> None:
        self.func, self.lagrangian = extra("torch").func, lagrangian

    def __call__(self, q: Any, qd: Any, qdd: Any) -> tuple[Any, ...]:
        rest = 0.0 * qd
        stiffness, slope = self.func.jacrev(self.torque, (0, 1))(q, qd, qdd)
        h1 = self.func.jacrev(self.torque, 1)(q, rest, rest)
        c2 = self.func.jacrev(self.momentum, 1)(q, qd)
        g = self.torque(q, rest, rest)
        return self.torque(q, qd, qdd), c2, 0.5 * (slope + h1), g, stiffness, h1

    def momentum(self, q: Any, qd: Any) -> Any:
        return self.func.grad(self.lagrangian, 1)(q, qd)

    def torque(self, q: Any, qd: Any, qdd: Any) -> Any:
        """Chain rule of d/dt ∂L/∂q̇, less ∂L/∂q."""
        along, mass = self.func.jacrev(self.momentum, (0, 1))(q, qd)
        return along @ qd + mass @ qdd - self.func.grad(self.lagrangian, 0)(q, qd)
