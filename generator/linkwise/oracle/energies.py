"""References from the text of the energies that a manifest gives, whose Lagrangians torch differentiates."""

import copy
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from linkwise_runtime.structure import IMPOSED_MOTION

from linkwise.arrays import Array
from linkwise.extras import extra
from linkwise.oracle.formula_text import TextFormula, parameter_values, torch_functions
from linkwise.oracle.noisy_numbers import NOISE, NoisyNumber, errors, noisy, plain
from linkwise.oracle.reference import TOLERANCE, Reference, link_sizes
from linkwise.oracle.states import Found, States, states_where
from linkwise.package.entries import EnergyEntry, JointEntry

PIECES = {"Piecewise", "Max", "Min", "Abs", "sign"}
"""Functions in pieces."""


class TextValues:
    """Values of formulas in q and qd of shape (n,), time and parameters.

    noise: a seed for errors of up to NOISE in each operation, the same ones in each call; None for none
    """

    def __init__(self, parameters: Mapping[str, float], time: str, noise: int | None = None) -> None:
        torch = extra("torch")
        self._noise = noise
        self._parameters = {
            name: torch.tensor(value, dtype=torch.float64)
            for name, value in parameter_values(parameters).items()
        }
        self._symbols = dict(zip(parameters, parameter_values(parameters), strict=True))
        self._time = self._symbols.get(time, "")
        self.now = self._parameters.get(self._time, torch.zeros((), dtype=torch.float64))

    def value(self, formula: TextFormula, q: Any, qd: Any, time: Any) -> Any:
        """Return the value of one of the formulas, without an axis."""
        names, functions = dict(self._parameters), dict(torch_functions())
        if self._time:
            names[self._time] = time
        for kind, motion in (("q", q), ("qd", qd)):
            names |= {f"{kind}_{k}": motion[k - 1] for k in range(1, len(motion) + 1)}
        if self._noise is not None:
            chosen = errors(self._noise)
            names = {name: NoisyNumber(value, chosen) for name, value in names.items()}
            functions = {name: noisy(function, chosen) for name, function in functions.items()}
        return q.new_zeros(()) + plain(formula.value(names, functions))  # a constant is a tensor, too


class TextTerms(TextValues):
    """Terms of one link; raises Unreadable for no formula."""

    def __init__(
        self,
        entry: EnergyEntry,
        joints: Sequence[str],
        time: str,
        parameters: Mapping[str, float],
        noise: int | None = None,
    ) -> None:
        super().__init__(parameters, time, noise)
        self.kinetic = TextFormula(entry.kinetic)
        self.shares = [
            (
                share.name,
                TextFormula(share.potential),
                TextFormula(share.motion),
                TextFormula(share.dissipation),
                {joints.index(joint): TextFormula(force) for joint, force in share.forces.items()},
            )
            for share in entry.shares
        ]

    @property
    def has_pieces(self) -> bool:
        """True if a formula changes at conditions."""
        shares = (part for _, *parts, forces in self.shares for part in (*parts, *forces.values()))
        return any(PIECES & formula.functions() for formula in (self.kinetic, *shares))

    def at(self, time: float, inputs: Mapping[str, float]) -> "TextTerms":
        """Return the same terms with time and inputs, by name, as they are at an instant."""
        torch, moved = extra("torch"), copy.copy(self)
        moved.now = torch.tensor(time, dtype=torch.float64)
        given = {self._symbols[name]: torch.tensor(v, dtype=torch.float64) for name, v in inputs.items()}
        moved._parameters = {**self._parameters, **given}
        return moved


NAMES = ("tau", "c2", "c1", "g", "c0", "h1", "shares")
POINTS = 8
"""Gauss's points for c1: exact for kinetic energies of degree 16."""
Terms = Sequence[TextTerms]
CORNER, JUMP = 1e-7, 1e-3
"""Distance of the two sides of a state, and by how much of a link's torques they differ at a corner."""
GREATEST = 1e75
"""Largest number to compute with: products of four, as in solutions, do not overflow; masses exceed its
inverse."""


def energy_reference(
    exact: Terms, altered: Sequence[Terms], names: Sequence[str], states: States
) -> Reference:
    """Return the quantities of links by their terms; `altered` are the same but for errors in each operation.

    What these errors, of NOISE, change, rounding of that size changes too: it measures the numbers that each
    value is summed from, whatever cancels among them.

    names: of the shares, in the order of their axis
    """
    resting = States(states.q, 0.0 * states.qd, 0.0 * states.qdd)
    values, energies, power = _values(exact, names, states)
    still, _, _ = _values(exact, names, resting)
    scales, sizes = link_sizes(values, states), np.abs(energies)
    for terms in altered:
        changed, other, _ = _values(terms, names, states)
        scales = {
            what: np.maximum(scale, np.abs(changed[what] - values[what]) / NOISE)
            for what, scale in scales.items()
        }
        sizes = np.maximum(sizes, np.abs(other - energies) / NOISE)
    pairs = zip(("kinetic", "potential"), zip(energies[:2], sizes[:2], strict=True), strict=True)
    return Reference(
        "energies differentiated",
        TOLERANCE,
        states,
        values,
        scales,
        dict(pairs),
        power,
        {what: (still[what], np.maximum(scales[what], np.abs(still[what]))) for what in ("c2", "g")},
        (energies[2], sizes[2]),
    )


def states_of_energies(
    terms: Terms, names: Sequence[str], joints: Sequence[JointEntry], samples: int
) -> Found:
    """Return states at which the energies and every quantity are numbers that can be computed with."""

    def defined(states: States) -> Any:
        values, energies, _ = _values(terms, names, states)
        mass = np.abs(np.einsum("sii->si", values["c2"].sum(2)))
        parts = (*energies, *values.values(), 1.0 / np.where(mass > 0.0, mass, 1.0))
        found = np.all([(np.abs(part) < GREATEST).reshape(len(part), -1).all(1) for part in parts], axis=0)
        return found & ~_at_a_corner(terms, names, states) if any(one.has_pieces for one in terms) else found

    return states_where(defined, joints, samples)


def _at_a_corner(terms: Terms, names: Sequence[str], states: States) -> Any:
    """Return at which states a quantity is another on either side: there it has no one value."""
    sides = []
    for step in (-CORNER, CORNER):
        values, _, _ = _values(terms, names, States(states.q + step, states.qd + step, states.qdd))
        sides.append(values)
    sizes = link_sizes(sides[0], states)
    apart = [np.abs(sides[1][what] - below) > JUMP * sizes[what] for what, below in sides[0].items()]
    return np.any([one.reshape(len(one), -1).any(1) for one in apart], axis=0)


def _values(terms: Terms, names: Sequence[str], states: States) -> tuple[dict[str, Array], Array, Array]:
    """Return quantities, energies K, P and L (3, samples, N), and the power of the torques (samples, N)."""
    torch = extra("torch")
    motion = [torch.from_numpy(m) for m in states.motion]
    rows = [[part.numpy() for part in torch.func.vmap(_Link(one, names))(*motion)] for one in terms]
    *quantities, kinetic, potential, lagrangian, power = zip(*rows, strict=True)
    values = {name: np.stack(parts, 2) for name, parts in zip(NAMES, quantities, strict=True)}
    kinds = (kinetic, potential, lagrangian)
    return values, np.stack([np.stack(kind, 1) for kind in kinds]), np.stack(power, 1)


def quantities_of(terms: Terms, names: Sequence[str], states: States) -> dict[str, Array]:
    """Return tau, c2, c1, g and the other quantities of all links, samples first; names: of the shares."""
    return _values(terms, names, states)[0]


def equations_of_motion(terms: Terms, q: Array, qd: Array) -> tuple[Array, Array, float, float]:
    """Return M (n, n), the torques (n,) without acceleration, the power beside the joints, and the energy.

    q, qd: (n,), at the time and the inputs that the terms have
    """
    torch = extra("torch")
    at, rate = torch.from_numpy(q), torch.from_numpy(qd)
    mass, bias, beside, energy = torch.zeros(len(q), len(q), dtype=torch.float64), 0.0 * at, 0.0, 0.0
    for one in terms:
        link, now = _Link(one, ()), one.now
        mass = mass + link.func.jacrev(link.momentum, 1)(at, rate, now)
        bias = bias + link.torque(at, rate, 0.0 * at)
        beside += float(link.beside(at, rate))
        energy += float(link.energy(at, rate, now))
    return mass.numpy(), bias.numpy(), beside, energy


class _Link:
    """Quantities of one link in the order of NAMES, then K, P, L and power, for one sample.

    With E = qd . dK/dqd - K + P, the torques' power is dE/dt, time itself held fixed, and what dissipation,
    forces and imposed motions take.
    """

    def __init__(self, terms: TextTerms, names: Sequence[str]) -> None:
        self.func, self.terms, self._names = extra("torch").func, terms, names

    def __call__(self, q: Any, qd: Any, qdd: Any) -> tuple[Any, ...]:
        func, time = self.func, self.terms.now
        stiffness, slope = func.jacrev(self.torque, (0, 1))(q, qd, qdd)
        c2 = func.jacrev(self.momentum, 1)(q, qd, time)
        points, weights = np.polynomial.legendre.leggauss(POINTS)
        c1 = sum(
            w / 2.0 * func.jacrev(lambda v: self.velocity_force(q, v))((x + 1.0) / 2.0 * qd)
            for x, w in zip(points, weights, strict=True)
        )
        by_name = {share[0]: self.share(share, q, qd) for share in self.terms.shares}
        zero = q.new_zeros(q.shape)
        columns = [by_name.get(name, zero)[:, None] for name in self._names]
        shares = extra("torch").cat([q.new_zeros((len(q), 0)), *columns], -1)
        along, across = func.grad(self.energy, (0, 1))(q, qd, time)
        lost = sum((self.lost(share, q, qd) for share in self.terms.shares), zero)
        power = (along * qd + across * qdd + lost * qd).sum()
        kinetic = self.stored_kinetic(q, qd, time)
        return (
            self.torque(q, qd, qdd),
            c2,
            c1,
            sum(by_name.values(), zero),
            stiffness,
            2.0 * c1 - slope,
            shares,
            kinetic,
            self.potential(q, time),
            self.lagrangian(q, qd),
            power,
        )

    def kinetic(self, q: Any, qd: Any, time: Any) -> Any:
        return self.terms.value(self.terms.kinetic, q, qd, time)

    def potential(self, q: Any, time: Any) -> Any:
        rest = 0.0 * q
        found = (self.terms.value(share[1], q, rest, time) for share in self.terms.shares)
        return sum(found, q.new_zeros(()))

    def lagrangian(self, q: Any, qd: Any) -> Any:
        time = self.terms.now
        motions = (self.terms.value(share[2], q, qd, time) for share in self.terms.shares)
        return sum(motions, self.kinetic(q, qd, time)) - self.potential(q, time)

    def stored_kinetic(self, q: Any, qd: Any, time: Any) -> Any:
        return (qd * self.momentum(q, qd, time)).sum() - self.kinetic(q, qd, time)

    def energy(self, q: Any, qd: Any, time: Any) -> Any:
        return self.stored_kinetic(q, qd, time) + self.potential(q, time)

    def beside(self, q: Any, qd: Any) -> Any:
        """Return R = dE/dt - tau . qd, what time itself changes, and dissipation, forces and motions give."""
        lost = sum((self.lost(share, q, qd) for share in self.terms.shares), 0.0 * q)
        return self.func.grad(self.energy, 2)(q, qd, self.terms.now) - (lost * qd).sum()

    def momentum(self, q: Any, qd: Any, time: Any) -> Any:
        return self.func.grad(self.kinetic, 1)(q, qd, time)

    def velocity_force(self, q: Any, qd: Any) -> Any:
        """Return h = sum_s dp/dq_s qd_s - dK/dq."""
        along = self.func.jacrev(self.momentum, 0)(q, qd, self.terms.now)
        return along @ qd - self.func.grad(self.kinetic, 0)(q, qd, self.terms.now)

    def torque(self, q: Any, qd: Any, qdd: Any) -> Any:
        mass = self.func.jacrev(self.momentum, 1)(q, qd, self.terms.now)
        shares = (self.share(share, q, qd) for share in self.terms.shares)
        return mass @ qdd + self.velocity_force(q, qd) + sum(shares, 0.0 * q)

    def share(self, share: Any, q: Any, qd: Any) -> Any:
        rest, time = 0.0 * qd, self.terms.now
        slope = self.func.grad(lambda x: self.terms.value(share[1], x, rest, time))(q)
        return slope + self.lost(share, q, qd)

    def lost(self, share: Any, q: Any, qd: Any) -> Any:
        """Return a share but for the slope of its potential."""
        name, _, motion, dissipation, forces = share
        func, now = self.func, self.terms.now

        def term(x: Any, v: Any, time: Any) -> Any:
            return self.terms.value(motion, x, v, time)

        def momentum(x: Any, v: Any, time: Any) -> Any:
            return func.grad(term, 1)(x, v, time)

        along, change = func.jacrev(momentum, (0, 2))(q, qd, now)
        found = along @ qd + change - func.grad(term, 0)(q, qd, now)
        if name == IMPOSED_MOTION:
            found = found + func.jacrev(self.momentum, 2)(q, qd, now)
        found = found + func.grad(lambda v: self.terms.value(dissipation, q, v, now))(qd)
        for joint, force in forces.items():
            unit = q.new_zeros(q.shape)
            unit[joint] = 1.0
            found = found - unit * self.terms.value(force, q, qd, now)
        return found
