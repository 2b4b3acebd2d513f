"""Terms of τ_1 by another convention: products of sines and cosines stay, sin² + cos² is two terms.

The vectors of which velocities are made (see `expanded_arm`) are written in sines and cosines of angle sums,
which are symbols from then on: for the energies K = ½ m v·v + ½ ω·I ω, P = −m g·r, and for their derivatives

    d/dt sin a = ȧ cos a      d/dt cos a = −ȧ sin a      τ_1j = d/dt ∂L_j/∂q̇_1 − ∂L_j/∂q_1

products are multiplied out and like terms collected, and nothing else.
"""

from collections.abc import Iterator

from linkwise.report.expanded_arm import ExpandedBody, Vector, affordable, expanded_arm
from linkwise.report.laurent import BudgetExceededError
from linkwise.report.term_count import TermPair
from linkwise.report.trigonometric_ring import Polynomial, TrigonometricRing
from linkwise.symbolic.system import RigidSystem

COSTLIEST = 50
"""Products of terms in one multiplication, as a multiple of the budget."""
FORM = (
    "fully expanded from velocities of the centres of mass in the world's axes; products of sines and "
    "cosines of angle sums not combined; like terms collected"
)


def uncombined_terms(system: RigidSystem, links: int, budget: int) -> Iterator[TermPair]:
    """Yield counts for the first 1, 2, … `links` links of a serial arm, as far as the budget allows."""
    arm = expanded_arm(system, links, budget)
    terms = TrigonometricRing(arm)
    torque = terms.zero
    for found in affordable(_torque(terms, body, arm.gravity, budget) for body in arm.bodies):
        torque += found
        yield TermPair(len(torque), terms.count(torque, terms.qdd[0]))


def _torque(terms: TrigonometricRing, body: ExpandedBody, gravity: Vector, budget: int) -> Polynomial:
    """Return τ_1j of a body."""

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
