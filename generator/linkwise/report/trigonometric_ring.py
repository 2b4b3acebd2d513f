"""Polynomials in sines and cosines of angle sums, whose products are not combined.

d/dt sin a = ȧ cos a      d/dt cos a = −ȧ sin a
"""

from typing import Any, TypeAlias

import sympy as sp
from sympy.polys.rings import ring

from linkwise.report.expanded_arm import ExpandedArm
from linkwise.report.laurent import Laurent, exponents

Polynomial: TypeAlias = Any
"""Polynomial of a SymPy ring over the rational numbers."""
Angle: TypeAlias = tuple[int, ...]
"""Whole multiples of the u_k; the first that is not 0 is above 0."""


class TrigonometricRing:
    """Polynomials in the parameters, in u, u̇ and ü, and in sines and cosines of angle sums."""

    def __init__(self, arm: ExpandedArm) -> None:
        variables, coordinates = arm.expansion.variables, arm.expansion.coordinates
        polynomials = [a for body in arm.bodies for a in (*body.place, *body.turning)]
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
        units = list(zip(coordinates, variables.units, strict=True))
        self._symbols = [*(c.qd / d for c, d in units), *(c.qdd / d for c, d in units)]
        turned = [sum(a * c.q / d for a, (c, d) in zip(angle, units, strict=True)) for angle in angles]
        self._symbols += [wave(a) for a in turned for wave in (sp.sin, sp.cos)]
        self._symbols += variables.others

    def _angle(self, key: int) -> Angle:
        return tuple(exponents(key, self._digits)[1 : 1 + self._n])

    def __call__(self, p: Laurent) -> Polynomial:
        """Return p in sines and cosines: c cos a has c/2 at each of ±a, s sin a has ∓i s/2."""
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

    def expression(self, p: Laurent) -> sp.Expr:
        """Return p as a SymPy expression in sines, cosines, coordinates, velocities and accelerations."""
        return self(p).as_expr(*self._symbols)

    def slope(self, p: Polynomial, k: int) -> Polynomial:
        """Return ∂p/∂u_k."""
        bare = self._bare[k]
        total = self.zero if bare is None else p.diff(bare)
        for angle, (sine, cosine) in self._waves.items():
            if angle[k]:
                total += angle[k] * (p.diff(sine) * cosine - p.diff(cosine) * sine)
        return total

    def rate(self, p: Polynomial) -> Polynomial:
        """Return dp/dt."""
        return sum(
            (self.slope(p, k) * self.qd[k] + p.diff(self.qd[k]) * self.qdd[k] for k in range(self._n)),
            self.zero,
        )

    def count(self, p: Polynomial, x: Polynomial) -> int:
        """Return the number of terms of p that contain the generator x."""
        at = self._ring.gens.index(x)
        return sum(1 for powers in p.itermonoms() if powers[at])
