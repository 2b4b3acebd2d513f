"""Fully expanded partial torques.

    τ_ij = d/dt ∂L_j/∂q̇_i − ∂L_j/∂q_i,   d/dt p = Σ_s ∂p/∂q_s q̇_s + ∂p/∂q̇_s q̈_s
On an expanded polynomial each derivative is one pass over the terms: ∂/∂q of exp(i e q) brings down
i e. A digit is a byte, so the exponents of a term are the bytes of its key.
"""

from collections.abc import Iterator

from linkwise.report import laurent
from linkwise.report.expand import Variables
from linkwise.report.laurent import I_SQUARED, ZERO_BYTE, Laurent
from linkwise.robot.robot import Coordinate


class Differentiation:
    """Derivatives by the coordinates of one expansion, of every polynomial expanded so far."""

    def __init__(self, coordinates: tuple[Coordinate, ...], variables: Variables) -> None:
        self._x, self._n = variables, len(coordinates)
        self._digits = variables.digits
        self._bare = [variables.digit_of(c.name) for c in coordinates]

    def torque(self, lagrangian: Laurent, i: int, path: tuple[int, ...]) -> Laurent:
        """τ_ij from link j's expanded Lagrangian, with path(j) the coordinates that move it."""
        momentum = self._by_velocity(lagrangian, i)
        force = self._along(lagrangian, ((i, 0, None),))
        motion = tuple((s, self._x.qd(s), self._x.qdd(s)) for s in path)
        rate = self._along(momentum, motion)
        return laurent.bounded(laurent.add([rate, force.scaled(-1)]).reduced())

    def _exponents(self, p: Laurent) -> Iterator[tuple[int, int, bytes]]:
        """Terms as key, coefficient and exponents, each of which is ZERO_BYTE too high."""
        lifted, digits = laurent.lifted(self._digits), self._digits
        for key, c in p.terms.items():
            yield key, c, (key + lifted).to_bytes(digits, "little")

    def _by_velocity(self, p: Laurent, k: int) -> Laurent:
        """∂p/∂q̇_k."""
        at, one = 1 + self._n + k, self._x.qd(k)
        terms = {
            key - one: (powers[at] - ZERO_BYTE) * c
            for key, c, powers in self._exponents(p)
            if powers[at] != ZERO_BYTE
        }
        return Laurent(terms, p.denominator, p.bound + 1)

    def _along(self, p: Laurent, motion: tuple[tuple[int, int, int | None], ...]) -> Laurent:
        """Σ ∂p/∂q_s · rate + ∂p/∂q̇_s · acceleration over (s, rate, acceleration), monomials; None is 0."""
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
                    slid = key + rate - laurent.at_digit(bare)
                    terms[slid] = get(slid, 0) + e * c
                if acceleration is not None and (e := powers[velocity] - ZERO_BYTE):
                    driven = key + acceleration
                    terms[driven] = get(driven, 0) + e * c
        return Laurent({key: c for key, c in terms.items() if c}, p.denominator, p.bound + 1)
