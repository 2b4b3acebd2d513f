"""Terms of τ_1 by another convention: products of sines and cosines stay, sin² + cos² is two terms.

What velocities consist of (see `world_velocities`) is written in sines and cosines of angle sums, which are
symbols from then on: of the energies K = ½ m v·v + ½ ω·I ω, P = −m g·r, and of their derivatives

    d/dt sin a = ȧ cos a      d/dt cos a = −ȧ sin a      τ_1j = d/dt ∂L_j/∂q̇_1 − ∂L_j/∂q_1

products are multiplied out and like ones collected, and nothing else.
"""

from collections.abc import Iterator, Sequence
from contextlib import suppress
from itertools import islice
from typing import Any, TypeAlias

import sympy as sp
from sympy.polys.rings import ring

from linkwise.report.expand import ROUNDING, Expansion, angle_units
from linkwise.report.expanded_torques import is_exact
from linkwise.report.laurent import BudgetExceededError, Laurent, exponents
from linkwise.report.term_count import TermPair
from linkwise.report.world_velocities import ExpandedBody, expanded_bodies
from linkwise.symbolic.link_energy import exact, link_energies
from linkwise.symbolic.system import RigidSystem

Polynomial: TypeAlias = Any
"""Of a SymPy ring over the rational numbers."""
Angle: TypeAlias = tuple[int, ...]
"""Whole multiples of the u_k, the first one that is not 0 above 0."""

COSTLIEST = 50
"""Products of terms in one multiplication, over the budget."""
FORM = (
    "fully expanded from velocities of the centres of mass in the world's axes; products of sines and "
    "cosines of angle sums not combined; like terms collected"
)


def uncombined_terms(system: RigidSystem, links: int, budget: int) -> Iterator[TermPair]:
    """Counts for the first 1, 2, … `links` links of a serial arm, as far as the budget of terms reaches."""
    joints = [joint for joint in system.links[links - 1].joints if joint.kind == "revolute"]
    waves = [sp.cos(exact((j.ratio, 0, 0))[0] * system.coordinates[j.coordinate].q) for j in joints]
    rounding = 0.0 if is_exact(system, link_energies(system)) else ROUNDING
    expansion = Expansion(system.coordinates, angle_units(system.coordinates, waves), budget, rounding)
    gravity = [expansion(a) for a in exact(system.robot.gravity)]
    bodies = list(_affordable(islice(expanded_bodies(system, expansion), links)))
    read = [a for body in bodies for a in (*body.place, *body.turning)]
    terms = TrigonometricRing(expansion, read)
    torque = terms.zero
    for found in _affordable(_torque(terms, body, gravity, budget) for body in bodies):
        torque += found
        yield TermPair(len(torque), terms.count(torque, terms.qdd[0]))


def _affordable(found: Iterator[Any]) -> Iterator[Any]:
    """What comes before the budget is exceeded."""
    with suppress(BudgetExceededError):
        yield from found


def _torque(
    terms: "TrigonometricRing", body: ExpandedBody, gravity: Sequence[Laurent], budget: int
) -> Polynomial:
    """τ_1j of a body."""

    def times(a: Polynomial, b: Polynomial) -> Polynomial:
        if len(a) * len(b) > COSTLIEST * budget:
            raise BudgetExceededError
        return a * b

    place, turning = ([terms(a) for a in vector] for vector in (body.place, body.turning))
    mass, inertia = terms(body.mass), [[terms(a) for a in row] for row in body.inertia]
    speeds = [terms.rate(a) for a in place]
    kinetic = times(mass, sum((times(v, v) for v in speeds), terms.zero))
    for row, a in zip(inertia, turning, strict=True):
        kinetic += times(a, sum((times(e, b) for e, b in zip(row, turning, strict=True)), terms.zero))
    height = sum((times(terms(g), a) for g, a in zip(gravity, place, strict=True)), terms.zero)
    lagrangian = kinetic / 2 + times(mass, height)
    if len(lagrangian) > budget:
        raise BudgetExceededError
    return terms.rate(lagrangian.diff(terms.qd[0])) - terms.slope(lagrangian, 0)


class TrigonometricRing:
    """Polynomials in the parameters, in u, u̇ and ü, and in sines and cosines of angle sums."""

    def __init__(self, expansion: Expansion, polynomials: Sequence[Laurent]) -> None:
        variables, coordinates = expansion.variables, expansion.coordinates
        self._n, self._digits = variables.n, variables.digits
        n = self._n
        found = {a: None for p in polynomials for key in p.terms if any(a := self._angle(key))}
        angles = [a for a in found if a > tuple(-e for e in a)]
        names = [f"{kind}{k}" for kind in ("qd", "qdd") for k in range(n)]
        names += [f"{wave}{at}" for at in range(len(angles)) for wave in "sc"]
        names += [f"p{at}" for at in range(len(variables.others))]
        self._ring, *generators = ring(names, sp.QQ)
        self.qd, self.qdd = generators[:n], generators[n : 2 * n]
        waves = generators[2 * n : 2 * n + 2 * len(angles)]
        self._waves = dict(zip(angles, zip(waves[::2], waves[1::2], strict=True), strict=True))
        self._others = generators[2 * n + 2 * len(angles) :]
        places = dict(zip(variables.others, self._others, strict=True))
        self._bare = [places.get(c.q) for c in coordinates]
        self.zero = self._ring.zero

    def _angle(self, key: int) -> Angle:
        return tuple(exponents(key, self._digits)[1 : 1 + self._n])

    def __call__(self, p: Laurent) -> Polynomial:
        """The same in sines and cosines: c cos a has c/2 at each of ±a, s sin a has ∓i s/2."""
        n, result = self._n, self.zero
        for key, c in p.terms.items():
            powers = exponents(key, self._digits)
            angle, imaginary = tuple(powers[1 : 1 + n]), powers[0]
            wave = self._ring.one
            if any(angle):
                if angle not in self._waves:
                    continue
                sine, cosine = self._waves[angle]
                wave = -2 * sine if imaginary else 2 * cosine
            for x, power in zip((*self.qd, *self.qdd, *self._others), powers[1 + n :], strict=True):
                wave *= x**power
            result += wave * sp.QQ(c, p.denominator)
        return result

    def slope(self, p: Polynomial, k: int) -> Polynomial:
        """∂p/∂u_k."""
        bare = self._bare[k]
        total = self.zero if bare is None else p.diff(bare)
        for angle, (sine, cosine) in self._waves.items():
            if angle[k]:
                total += angle[k] * (p.diff(sine) * cosine - p.diff(cosine) * sine)
        return total

    def rate(self, p: Polynomial) -> Polynomial:
        """dp/dt."""
        return sum(
            (self.slope(p, k) * self.qd[k] + p.diff(self.qd[k]) * self.qdd[k] for k in range(self._n)),
            self.zero,
        )

    def count(self, p: Polynomial, x: Polynomial) -> int:
        """Terms of p that contain the generator x."""
        at = self._ring.gens.index(x)
        return sum(1 for powers in p.itermonoms() if powers[at])
