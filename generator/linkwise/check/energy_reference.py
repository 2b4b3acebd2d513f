"""A user's energies as a reference: their Lagrangians, differentiated by torch.func one sample at a time."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from linkwise.check.reference import TOLERANCE, Reference, link_sizes
from linkwise.check.states import Found, States, states_where
from linkwise.check.text_lagrangian import NOISE, TextLagrangian
from linkwise.extras import extra
from linkwise.package.entries import JointEntry
from linkwise.package.load import Array

NAMES = ("tau", "c2", "c1", "g", "c0", "h1")

Lagrangians = Sequence[TextLagrangian]
GREATEST = 1e75
"""Of numbers whose products of four are numbers too, as solutions have; of masses the inverse is as small."""


def energy_reference(exact: Lagrangians, noisy: Sequence[Lagrangians], states: States) -> Reference:
    """Quantities of Lagrangians; `noisy` are the same but for errors of NOISE in each operation.

    What these change is what rounding of that size does: it measures the numbers that each value is summed
    from, whatever cancels of them.
    """
    values, energies, power = _values(exact, states)
    scales, sizes = link_sizes(values, states), np.abs(energies)
    for lagrangians in noisy:
        changed, other, _ = _values(lagrangians, states)
        scales = {
            what: np.maximum(scale, np.abs(changed[what] - values[what]) / NOISE)
            for what, scale in scales.items()
        }
        sizes = np.maximum(sizes, np.abs(other - energies) / NOISE)
    pairs = zip(("kinetic", "potential"), zip(energies, sizes, strict=True), strict=True)
    return Reference("energies differentiated", TOLERANCE, states, values, scales, dict(pairs), power)


def states_of_energies(lagrangians: Lagrangians, joints: Sequence[JointEntry], samples: int) -> Found:
    """States at which the energies and every quantity are numbers that can be computed with."""

    def defined(states: States) -> Any:
        values, energies, _ = _values(lagrangians, states)
        mass = np.abs(np.einsum("sii->si", values["c2"].sum(2)))
        parts = (*energies, *values.values(), 1.0 / np.where(mass > 0.0, mass, 1.0))
        return np.all([(np.abs(part) < GREATEST).reshape(len(part), -1).all(1) for part in parts], axis=0)

    return states_where(defined, joints, samples)


def _values(lagrangians: Lagrangians, states: States) -> tuple[dict[str, Array], Array, Array]:
    """Quantities; kinetic and potential energies (2, samples, N); rates of what is kept (samples, N)."""
    torch = extra("torch")
    motion = [torch.from_numpy(m) for m in states.motion]
    rows = [[part.numpy() for part in torch.func.vmap(_Link(one))(*motion)] for one in lagrangians]
    energies = [torch.func.vmap(one.energies)(*motion[:2]) for one in lagrangians]
    *quantities, rates = zip(*rows, strict=True)
    values = {name: np.stack(parts, 2) for name, parts in zip(NAMES, quantities, strict=True)}
    kinds = [np.stack([one.numpy() for one in kind], 1) for kind in zip(*energies, strict=True)]
    return values, np.stack(kinds), np.stack(rates, 1)


class _Link:
    """One link's quantities, in the order tau, c2, c1, g, c0, h1, rate, for one sample."""

    def __init__(self, lagrangian: Any) -> None:
        self.func, self.lagrangian = extra("torch").func, lagrangian

    def __call__(self, q: Any, qd: Any, qdd: Any) -> tuple[Any, ...]:
        rest = 0.0 * qd
        stiffness, slope = self.func.jacrev(self.torque, (0, 1))(q, qd, qdd)
        h1 = self.func.jacrev(self.torque, 1)(q, rest, rest)
        c2 = self.func.jacrev(self.momentum, 1)(q, qd)
        g = self.torque(q, rest, rest)
        along, across = self.func.grad(self.kept, (0, 1))(q, qd)
        rate = (along * qd + across * qdd).sum()
        return self.torque(q, qd, qdd), c2, 0.5 * (slope + h1), g, stiffness, h1, rate

    def kept(self, q: Any, qd: Any) -> Any:
        """qd . dL/dqd - L, whose rate is the power of the torques: K + P where K is quadratic in qd."""
        return (qd * self.momentum(q, qd)).sum() - self.lagrangian(q, qd)

    def momentum(self, q: Any, qd: Any) -> Any:
        return self.func.grad(self.lagrangian, 1)(q, qd)

    def torque(self, q: Any, qd: Any, qdd: Any) -> Any:
        """Chain rule of d/dt ∂L/∂q̇, less ∂L/∂q."""
        along, mass = self.func.jacrev(self.momentum, (0, 1))(q, qd)
        return along @ qd + mass @ qdd - self.func.grad(self.lagrangian, 0)(q, qd)
