"""Fully expanded partial torques.

    τ_ij = d/dt ∂L_j/∂q̇_i − ∂L_j/∂q_i,   d/dt p = Σ_s ∂p/∂q_s q̇_s + ∂p/∂q̇_s q̈_s
On an expanded polynomial each derivative is one pass over the terms: ∂/∂q of exp(i e q) brings
down i e.
"""

from linkwise.model.robot import Coordinate
from linkwise.report import laurent
from linkwise.report.expand import Variables
from linkwise.report.laurent import DIGIT, I_SQUARED, Laurent


class Differentiation:
    """Derivatives by the coordinates of one expansion."""

    def __init__(self, coordinates: tuple[Coordinate, ...], variables: Variables) -> None:
        self.x = variables
        bare = (variables.digit_of(c.name) for c in coordinates)
        self._bare = dict(enumerate(bare))
        self._lifted = laurent.lifted(variables.digits)

    def torque(self, lagrangian: Laurent, i: int, path: tuple[int, ...]) -> Laurent:
        """τ_ij from link j's expanded Lagrangian, with path(j) the coordinates that move it."""
        x = self.x
        momentum = self._by_velocity(lagrangian, i)
        parts = [self._by_coordinate(lagrangian, i).scaled(-1)]
        for s in path:
            parts.append(_times(self._by_coordinate(momentum, s), x.qd(s)))
            parts.append(_times(self._by_velocity(momentum, s), x.qdd(s)))
        return laurent.bounded(laurent.add(parts).reduced())

    def _by_velocity(self, p: Laurent, k: int) -> Laurent:
        return self._by_digit(p, 1 + self.x.n + k)

    def _by_coordinate(self, p: Laurent, k: int) -> Laurent:
        """∂p/∂q_k: through exp(i q_k), and through a bare q_k of a slide or a spring."""
        through_angle = self._by_angle(p, k)
        digit = self._bare[k]
        return through_angle if digit is None else laurent.add([through_angle, self._by_digit(p, digit)])

    def _by_digit(self, p: Laurent, digit: int) -> Laurent:
        lifted, shift, one = self._lifted, DIGIT * digit, laurent.at_digit(digit)
        terms = {}
        for key, c in p.terms.items():
            exponent = (((key + lifted) >> shift) & _MASK) - _HALF
            if exponent:
                terms[key - one] = exponent * c
        return Laurent(terms, p.denominator, p.bound + 1)

    def _by_angle(self, p: Laurent, k: int) -> Laurent:
        lifted, shift = self._lifted, DIGIT * (1 + k)
        terms = {}
        for key, c in p.terms.items():
            exponent = (((key + lifted) >> shift) & _MASK) - _HALF
            if exponent:
                turned = key + 1
                if turned & I_SQUARED:
                    terms[turned - I_SQUARED] = -exponent * c
                else:
                    terms[turned] = exponent * c
        return Laurent(terms, p.denominator, p.bound)


_MASK, _HALF = (1 << DIGIT) - 1, 1 << (DIGIT - 1)


def _times(p: Laurent, monomial: int) -> Laurent:
    return Laurent({key + monomial: c for key, c in p.terms.items()}, p.denominator, p.bound + 1)
