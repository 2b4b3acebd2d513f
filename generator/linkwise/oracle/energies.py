"""References from the text of the energies that a manifest gives, whose Lagrangians torch differentiates."""

import operator
import random
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from linkwise.arrays import Array
from linkwise.extras import extra
from linkwise.oracle.formula_text import TextFormula, parameter_values, torch_functions
from linkwise.oracle.reference import TOLERANCE, Reference, link_sizes
from linkwise.oracle.states import Found, States, states_where
from linkwise.package.entries import EnergyEntry, JointEntry

NOISE = 1e-9
"""Relative error of each operation of a noisy Lagrangian: what it changes, rounding changes too."""


class TextLagrangian:
    """Lagrangian L(q, qd) of one link, for q and qd of shape (n,); raises Unreadable for no formula.

    noise: a seed for errors of up to NOISE in each operation, the same ones in each call; None for none
    """

    def __init__(
        self, energies: EnergyEntry, parameters: Mapping[str, float], noise: int | None = None
    ) -> None:
        torch = extra("torch")
        self._kinetic, self._potential = TextFormula(energies.kinetic), TextFormula(energies.potential)
        self._noise = noise
        self._parameters = {
            name: torch.tensor(value, dtype=torch.float64)
            for name, value in parameter_values(parameters).items()
        }

    def __call__(self, q: Any, qd: Any) -> Any:
        """Return the value in J, without an axis."""
        kinetic, potential = self.energies(q, qd)
        return kinetic - potential

    def energies(self, q: Any, qd: Any) -> tuple[Any, Any]:
        """Return kinetic and potential energy in J, without an axis."""
        names, functions = dict(self._parameters), dict(torch_functions())
        for kind, motion in (("q", q), ("qd", qd)):
            names |= {f"{kind}_{k}": motion[k - 1] for k in range(1, len(motion) + 1)}
        if self._noise is not None:
            errors = _errors(self._noise)
            names = {name: _Noisy(value, errors) for name, value in names.items()}
            functions = {name: _noisy(function, errors) for name, function in functions.items()}
        energies = (formula.value(names, functions) for formula in (self._kinetic, self._potential))
        kinetic, potential = (
            q.new_zeros(()) + _plain(one) for one in energies
        )  # a constant is a tensor, too
        return kinetic, potential


def _errors(seed: int) -> Iterator[float]:
    chosen = random.Random(seed)
    while True:
        yield 1.0 + NOISE * chosen.uniform(-1.0, 1.0)


class _Noisy:
    """A tensor whose operations each have a small error."""

    def __init__(self, value: Any, errors: Iterator[float]) -> None:
        self.value, self._errors = value, errors

    def _made(self, operation: Callable[[Any, Any], Any], one: Any, other: Any) -> "_Noisy":
        return _Noisy(operation(_plain(one), _plain(other)) * next(self._errors), self._errors)

    def __add__(self, other: Any) -> "_Noisy":
        return self._made(operator.add, self, other)

    def __radd__(self, other: Any) -> "_Noisy":
        return self._made(operator.add, other, self)

    def __sub__(self, other: Any) -> "_Noisy":
        return self._made(operator.sub, self, other)

    def __rsub__(self, other: Any) -> "_Noisy":
        return self._made(operator.sub, other, self)

    def __mul__(self, other: Any) -> "_Noisy":
        return self._made(operator.mul, self, other)

    def __rmul__(self, other: Any) -> "_Noisy":
        return self._made(operator.mul, other, self)

    def __truediv__(self, other: Any) -> "_Noisy":
        return self._made(operator.truediv, self, other)

    def __rtruediv__(self, other: Any) -> "_Noisy":
        return self._made(operator.truediv, other, self)

    def __pow__(self, other: Any) -> "_Noisy":
        return self._made(operator.pow, self, other)

    def __rpow__(self, other: Any) -> "_Noisy":
        return self._made(operator.pow, other, self)

    def __neg__(self) -> "_Noisy":
        return _Noisy(-self.value, self._errors)

    def __pos__(self) -> "_Noisy":
        return self


def _noisy(function: Callable[[Any], Any], errors: Iterator[float]) -> Callable[[Any], Any]:
    return lambda argument: _Noisy(function(_plain(argument)) * next(errors), errors)


def _plain(value: Any) -> Any:
    return value.value if isinstance(value, _Noisy) else value


NAMES = ("tau", "c2", "c1", "g", "c0", "h1")

Lagrangians = Sequence[TextLagrangian]
GREATEST = 1e75
"""Largest number to compute with: products of four, as in solutions, do not overflow; masses exceed its
inverse."""


def energy_reference(exact: Lagrangians, noisy: Sequence[Lagrangians], states: States) -> Reference:
    """Return the quantities of Lagrangians; `noisy` are the same but for errors of NOISE in each operation.

    What these change, rounding of that size changes too: it measures the numbers that each value is summed
    from, whatever cancels among them.
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
    """Return states at which the energies and every quantity are numbers that can be computed with."""

    def defined(states: States) -> Any:
        values, energies, _ = _values(lagrangians, states)
        mass = np.abs(np.einsum("sii->si", values["c2"].sum(2)))
        parts = (*energies, *values.values(), 1.0 / np.where(mass > 0.0, mass, 1.0))
        return np.all([(np.abs(part) < GREATEST).reshape(len(part), -1).all(1) for part in parts], axis=0)

    return states_where(defined, joints, samples)


def _values(lagrangians: Lagrangians, states: States) -> tuple[dict[str, Array], Array, Array]:
    """Return quantities, energies (2, samples, N): K and P, and rates of `energy_integral` (samples, N)."""
    torch = extra("torch")
    motion = [torch.from_numpy(m) for m in states.motion]
    rows = [[part.numpy() for part in torch.func.vmap(_Link(one))(*motion)] for one in lagrangians]
    energies = [torch.func.vmap(one.energies)(*motion[:2]) for one in lagrangians]
    *quantities, rates = zip(*rows, strict=True)
    values = {name: np.stack(parts, 2) for name, parts in zip(NAMES, quantities, strict=True)}
    kinds = [np.stack([one.numpy() for one in kind], 1) for kind in zip(*energies, strict=True)]
    return values, np.stack(kinds), np.stack(rates, 1)


class _Link:
    """Quantities of one link, in the order tau, c2, c1, g, c0, h1, rate, for one sample."""

    def __init__(self, lagrangian: Any) -> None:
        self.func, self.lagrangian = extra("torch").func, lagrangian

    def __call__(self, q: Any, qd: Any, qdd: Any) -> tuple[Any, ...]:
        rest = 0.0 * qd
        stiffness, slope = self.func.jacrev(self.torque, (0, 1))(q, qd, qdd)
        h1 = self.func.jacrev(self.torque, 1)(q, rest, rest)
        c2 = self.func.jacrev(self.momentum, 1)(q, qd)
        g = self.torque(q, rest, rest)
        along, across = self.func.grad(self.energy_integral, (0, 1))(q, qd)
        rate = (along * qd + across * qdd).sum()
        return self.torque(q, qd, qdd), c2, 0.5 * (slope + h1), g, stiffness, h1, rate

    def energy_integral(self, q: Any, qd: Any) -> Any:
        """Return qd . dL/dqd - L, whose rate is the torques' power: K + P where K is quadratic in qd."""
        return (qd * self.momentum(q, qd)).sum() - self.lagrangian(q, qd)

    def momentum(self, q: Any, qd: Any) -> Any:
        return self.func.grad(self.lagrangian, 1)(q, qd)

    def torque(self, q: Any, qd: Any, qdd: Any) -> Any:
        """Return d/dt ∂L/∂q̇, by the chain rule, less ∂L/∂q."""
        along, mass = self.func.jacrev(self.momentum, (0, 1))(q, qd)
        return along @ qd + mass @ qdd - self.func.grad(self.lagrangian, 0)(q, qd)
