"""Fully expanded partial torques, one link at a time within a budget of terms.

    τ_ij = d/dt ∂L_j/∂q̇_i − ∂L_j/∂q_i,   d/dt p = Σ_s ∂p/∂q_s q̇_s + ∂p/∂q̇_s q̈_s
On an expanded polynomial each derivative is one pass over the terms: ∂/∂q of exp(i e q) gives a factor
i e. A digit is a byte, so the exponents of a term are the bytes of its key.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import sympy as sp

from linkwise.errors import LinkwiseError, within
from linkwise.progress import Progress
from linkwise.report.expand import ROUNDING, Expansion, Variables, angle_units
from linkwise.report.laurent import (
    I_SQUARED,
    LIMIT,
    ZERO_BYTE,
    BudgetExceededError,
    ExponentError,
    Laurent,
    add,
    at_digit,
    bounded,
    lifted,
)
from linkwise.robot import Coordinate
from linkwise.symbolic.link_energy import StepwiseEnergy, link_energies
from linkwise.symbolic.system import RigidSystem, System

FORM = (
    "fully expanded; every product of sines and cosines written as one sine or cosine of an "
    "angle sum; like terms collected"
)
"""Canonical form in which all terms are counted."""


@dataclass(frozen=True)
class LinkTorques:
    """τ_ij of link j for the requested joints; joints that are not on path(j) are missing: their torque is 0.

    torques: d_i τ_ij by joint i, in the u_k = q_k/d_k of `variables`; the d are 1 but for geared joints
    """

    link: int
    torques: dict[int, Laurent]
    variables: Variables


def link_torques(
    system: System,
    joints: tuple[int, ...],
    budget: int,
    progress: Progress,
    links: int | None = None,
) -> Iterator[LinkTorques]:
    """Yield the torques of the first `links` links (None: all), expanded.

    Raises BudgetExceededError at a link that is too large.
    """
    energies = link_energies(system)
    rounding = 0.0 if is_exact(system, energies) else ROUNDING
    units = angle_units(system.coordinates, (expr for energy in energies for expr in _expressions(energy)))
    expansion = Expansion(system.coordinates, units, budget, rounding)
    wanted = energies[:links]
    for j, link in enumerate(wanted):
        with within(f"link {link.name!r}"):
            try:
                expansion.define((*link.twist.definitions, *link.height.definitions))
                torques = _torques(expansion, link, joints, system.path(j))
            except ExponentError as error:
                raise LinkwiseError(
                    f"a power above {LIMIT} is more than a term count can hold; lower it"
                ) from error
        if any(len(torque) > budget for torque in torques.values()):
            raise BudgetExceededError
        yield LinkTorques(j, torques, expansion.variables)
        progress("expand", j + 1, len(wanted))


def _torques(
    expansion: Expansion, link: StepwiseEnergy, joints: tuple[int, ...], path: tuple[int, ...]
) -> dict[int, Laurent]:
    """Return the torques of a link on those of the joints that move it, by joint."""
    chosen = [i for i in path if i in joints]
    if not chosen:
        return {}
    parts = expansion(link.kinetic), expansion(link.potential).scaled(-1)
    lagrangian = add(parts).pruned(expansion.rounding)
    by = Differentiation(expansion.coordinates, expansion.variables)
    return {i: by.torque(lagrangian, i, path).pruned(expansion.rounding) for i in chosen}


def _expressions(energy: StepwiseEnergy) -> Iterator[sp.Expr]:
    yield from (expr for _, expr in (*energy.twist.definitions, *energy.height.definitions))
    yield from (energy.kinetic, energy.potential)


def is_exact(system: System, energies: Iterable[StepwiseEnergy]) -> bool:
    """Return whether no coefficient is rounded.

    These are exact: rotations of 0 and ±1, no angle offsets, no irrational number.
    """
    links = system.robot.links if isinstance(system, RigidSystem) else ()
    straight = all(e in (-1.0, 0.0, 1.0) for link in links for row in link.joint.rotation for e in row)
    return straight and all(_is_rational(e.kinetic) and _is_rational(e.potential) for e in energies)


def _is_rational(energy: sp.Expr) -> bool:
    waves, powers = energy.atoms(sp.sin, sp.cos), energy.atoms(sp.Pow)
    offsets = any(wave.args[0].as_coeff_Add()[0] != 0 for wave in waves)
    return not (offsets or energy.has(sp.NumberSymbol) or any(p.is_number for p in powers))


def form_of(system: System) -> str:
    """Return the canonical form in which the terms of `system` are counted, in words."""
    exact = is_exact(system, link_energies(system))
    rounded = f"fixed angles as decimals, coefficients below {ROUNDING:g} of the largest dropped"
    return f"{FORM}; {'coefficients exact' if exact else rounded}"


class Differentiation:
    """Derivatives by the coordinates of one expansion, for every polynomial expanded so far."""

    def __init__(self, coordinates: tuple[Coordinate, ...], variables: Variables) -> None:
        self._x, self._n = variables, len(coordinates)
        self._digits = variables.digits
        self._bare = [variables.digit_of(c.q) for c in coordinates]

    def torque(self, lagrangian: Laurent, i: int, path: tuple[int, ...]) -> Laurent:
        """Return τ_ij from link j's expanded Lagrangian, with path(j) the coordinates that move it."""
        momentum = self._by_velocity(lagrangian, i)
        force = self._along(lagrangian, ((i, 0, None),))
        motion = tuple((s, self._x.qd(s), self._x.qdd(s)) for s in path)
        rate = self._along(momentum, motion)
        return bounded(add([rate, force.scaled(-1)]).reduced())

    def _exponents(self, p: Laurent) -> Iterator[tuple[int, int, bytes]]:
        """Yield terms as key, coefficient and exponents, each of which is ZERO_BYTE too high."""
        offset, digits = lifted(self._digits), self._digits
        for key, c in p.terms.items():
            yield key, c, (key + offset).to_bytes(digits, "little")

    def _by_velocity(self, p: Laurent, k: int) -> Laurent:
        """Return ∂p/∂q̇_k."""
        at, one = 1 + self._n + k, self._x.qd(k)
        terms = {
            key - one: (powers[at] - ZERO_BYTE) * c
            for key, c, powers in self._exponents(p)
            if powers[at] != ZERO_BYTE
        }
        return Laurent(terms, p.denominator, p.bound + 1)

    def _along(self, p: Laurent, motion: tuple[tuple[int, int, int | None], ...]) -> Laurent:
        """Return Σ ∂p/∂q_s · rate + ∂p/∂q̇_s · acceleration.

        The sum is over (s, rate, acceleration) of `motion`, with rate and acceleration monomials; None is 0.
        """
        n = self._n
        places = [
            (1 + s, 1 + n + s, self._bare[s], rate, None if acc is None else acc - self._x.qd(s))
            for s, rate, acc in motion
        ]
        terms: dict[int, int] = {}
        get = terms.get
        for key, c, powers in self._exponents(p):
            for angle, velocity, bare, rate, acceleration in places:
                if e := powers[angle] - ZERO_BYTE:
                    turned, signed = key + rate + 1, e * c
                    if turned & I_SQUARED:
                        turned, signed = turned - I_SQUARED, -signed
                    terms[turned] = get(turned, 0) + signed
                if bare is not None and (e := powers[bare] - ZERO_BYTE):
                    slid = key + rate - at_digit(bare)
                    terms[slid] = get(slid, 0) + e * c
                if acceleration is not None and (e := powers[velocity] - ZERO_BYTE):
                    driven = key + acceleration
                    terms[driven] = get(driven, 0) + e * c
        return Laurent({key: c for key, c in terms.items() if c}, p.denominator, p.bound + 1)
