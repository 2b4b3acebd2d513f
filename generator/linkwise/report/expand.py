"""From a link's symbolic energy to a fully expanded polynomial.

Digits of a monomial: the power of i, then z_k, q̇_k and q̈_k of the n coordinates, then parameters
(and q_k itself, for slides and springs) as they turn up.
"""

import math
from collections.abc import Iterable
from fractions import Fraction

import sympy as sp

from linkwise.errors import LinkwiseError
from linkwise.report.laurent import (
    LIMIT,
    ONE,
    ZERO,
    ExponentError,
    Laurent,
    add,
    at_digit,
    constant,
    multiply,
    power,
)
from linkwise.robot import Coordinate
from linkwise.symbolic.link_energy import Definition

ROUNDING = 1e-9
"""Where a fixed angle is not a right angle, smaller shares of the largest coefficient are rounding."""


class Variables:
    """Which digit of a monomial belongs to which variable."""

    def __init__(self, n: int) -> None:
        self.n = n
        self._other: dict[str, int] = {}

    def z(self, k: int) -> int:
        """Monomial exp(i q_k)."""
        return at_digit(1 + k)

    def qd(self, k: int) -> int:
        """Monomial q̇_k."""
        return at_digit(1 + self.n + k)

    def qdd(self, k: int) -> int:
        """Monomial q̈_k."""
        return at_digit(1 + 2 * self.n + k)

    def other(self, name: str) -> int:
        """Monomial of a parameter or a bare coordinate; new names get the next digit."""
        return at_digit(self._other.setdefault(name, 1 + 3 * self.n + len(self._other)))

    def digit_of(self, name: str) -> int | None:
        """Digit of a parameter or bare coordinate, None if it never turned up."""
        return self._other.get(name)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the digits behind the q̈, in order."""
        return tuple(self._other)

    @property
    def digits(self) -> int:
        """Number of digits in use."""
        return 1 + 3 * self.n + len(self._other)


class Expansion:
    """Expands SymPy expressions over coordinates; remembers what each symbol stands for."""

    def __init__(self, coordinates: Iterable[Coordinate], budget: int, rounding: float = 0.0) -> None:
        self.coordinates = tuple(coordinates)
        self.variables = Variables(len(self.coordinates))
        self.budget, self.rounding = budget, rounding
        self._known: dict[sp.Expr, Laurent] = {}
        self._angles = {c.q: k for k, c in enumerate(self.coordinates)}
        for k, c in enumerate(self.coordinates):
            self._known[c.qd] = Laurent({self.variables.qd(k): 1}, 1, 1)

    def define(self, definitions: Iterable[Definition]) -> None:
        """Expand named steps in order; later expressions may use their symbols."""
        for symbol, expr in definitions:
            self._known[symbol] = self(expr).pruned(self.rounding)

    def __call__(self, expr: sp.Expr) -> Laurent:
        """Expand `expr`; raises LinkwiseError for what no polynomial can express."""
        known = self._known.get(expr)
        if known is not None:
            return known
        if expr.is_Symbol:
            return Laurent({self.variables.other(expr.name): 1}, 1, 1)
        if expr.is_Rational or expr.is_Float:
            return constant(exact(expr))
        if expr.is_Add:
            return add(self(term) for term in expr.args)
        if expr.is_Mul:
            return self._product([self(factor) for factor in expr.args])
        if expr.is_Pow:
            return self._power(expr)
        if expr.func in (sp.sin, sp.cos):
            return self._wave(expr)
        if expr.is_number:
            return constant(Fraction(repr(float(expr))))
        raise LinkwiseError(
            f"{expr.func.__name__}(…) cannot be expanded into terms; counts need sums and "
            "products of sines, cosines, velocities and parameters"
        )

    def _product(self, factors: list[Laurent]) -> Laurent:
        # Long factors first: their product merges, and the short ones then cost one pass each.
        factors.sort(key=len, reverse=True)
        result = factors[0]
        for factor in factors[1:]:
            result = multiply(result, factor, self.budget)
        return result

    def _power(self, expr: sp.Expr) -> Laurent:
        base, exponent = self(expr.base), expr.exp
        if not exponent.is_Integer or (exponent < 0 and len(base) != 1):
            raise LinkwiseError(
                f"the power ({expr.base})**({exponent}) cannot be expanded into terms; "
                "counts need whole exponents, and single parameters below a fraction line"
            )
        return power(base, int(exponent), self.budget)

    def _wave(self, expr: sp.Expr) -> Laurent:
        """Sine or cosine of a whole combination of angles: (z^a ± z^−a)/2, the sine over i."""
        key, phase = 0, 0.0
        bound = 0
        for term in sp.Add.make_args(sp.expand(expr.args[0])):
            factor, rest = term.as_coeff_Mul()
            if rest in self._angles and float(factor).is_integer():
                key += int(factor) * self.variables.z(self._angles[rest])
                bound = max(bound, abs(int(factor)))
            elif term.is_number:
                phase += float(term)
            else:
                raise LinkwiseError(
                    f"{expr} cannot be expanded into terms; counts need sines and cosines of whole "
                    "combinations of the joint angles"
                )
        if bound > LIMIT:
            raise ExponentError
        sine = Laurent({key + 1: -1, -key + 1: 1}, 2, bound) if key else ZERO
        cosine = Laurent({key: 1, -key: 1}, 2, bound) if key else ONE
        s, c = snapped(math.sin(phase)), snapped(math.cos(phase))
        if expr.func == sp.sin:
            return add([sine.scaled(c), cosine.scaled(s)])
        return add([cosine.scaled(c), sine.scaled(-s)])


def exact(number: sp.Expr) -> Fraction:
    """Return the number as a fraction; a float is taken for the decimal that it prints as."""
    if number.is_Rational:
        return Fraction(int(number.p), int(number.q))
    return Fraction(repr(float(number)))


def snapped(value: float) -> Fraction:
    """Return 0 or ±1 where `value` is that within rounding, else the decimal it prints as."""
    near = round(value)
    return Fraction(near) if abs(value - near) < 1e-12 else Fraction(repr(value))
