"""Expansion of a link's symbolic energy to a polynomial.

Digits of a monomial: the power of i, then z_k, u̇_k and ü_k of the n coordinates, then parameters (and u_k
itself, for prismatic joints and springs) in the order in which they occur. Here u_k = q_k/d_k and
z_k = exp(i u_k); d_k is 1 unless a gear turns a link by a fraction of q_k, which is a whole multiple of u_k.
"""

import math
from collections.abc import Iterable, Sequence
from fractions import Fraction

import sympy as sp

from linkwise.errors import LinkwiseError
from linkwise.report.laurent import (
    LIMIT,
    ONE,
    ZERO,
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
"""Part of the largest coefficient, below which others are rounding, where a fixed angle is no right angle."""


class Variables:
    """Digits of a monomial by variable; `units` are the d_k."""

    def __init__(self, units: Sequence[int]) -> None:
        self.units = tuple(units)
        self.n = len(self.units)
        self._other: dict[sp.Symbol, int] = {}

    def z(self, k: int) -> int:
        """Return the monomial z_k."""
        return at_digit(1 + k)

    def qd(self, k: int) -> int:
        """Return the monomial u̇_k."""
        return at_digit(1 + self.n + k)

    def qdd(self, k: int) -> int:
        """Return the monomial ü_k."""
        return at_digit(1 + 2 * self.n + k)

    def other(self, symbol: sp.Symbol) -> int:
        """Return the monomial of a parameter or a bare coordinate; a new one gets the next digit."""
        return at_digit(self._other.setdefault(symbol, 1 + 3 * self.n + len(self._other)))

    def digit_of(self, symbol: sp.Symbol) -> int | None:
        """Return the digit of a parameter or bare coordinate; None if it never occurred."""
        return self._other.get(symbol)

    @property
    def others(self) -> tuple[sp.Symbol, ...]:
        """Symbols of the digits after the ü, in order."""
        return tuple(self._other)

    @property
    def digits(self) -> int:
        """Number of digits in use."""
        return 1 + 3 * self.n + len(self._other)


class Expansion:
    """Expands SymPy expressions over coordinates; remembers what each symbol stands for."""

    def __init__(
        self, coordinates: Sequence[Coordinate], units: Sequence[int], budget: int, rounding: float = 0.0
    ) -> None:
        self.coordinates = tuple(coordinates)
        self.variables = Variables(units)
        self.budget, self.rounding = budget, rounding
        self._known: dict[sp.Expr, Laurent] = {}
        self._angles = {c.q: k for k, c in enumerate(self.coordinates)}
        for k, c in enumerate(self.coordinates):
            self._known[c.qd] = Laurent({self.variables.qd(k): units[k]}, 1, 1)

    def define(self, definitions: Iterable[Definition]) -> None:
        """Expand named steps in order; later expressions may use their symbols."""
        for symbol, expr in definitions:
            self._known[symbol] = self(expr).pruned(self.rounding)

    def __call__(self, expr: sp.Expr) -> Laurent:
        """Return `expr` expanded; raise LinkwiseError for what no polynomial can express."""
        known = self._known.get(expr)
        if known is not None:
            return known
        if expr.is_Symbol:
            unit = self.variables.units[self._angles[expr]] if expr in self._angles else 1
            return Laurent({self.variables.other(expr): unit}, 1, 1)
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
        # Long factors first: like terms of their product merge, and the short ones then cost one pass each.
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
        """Return sine or cosine of a whole combination of the u_k: (z^a ± z^−a)/2, the sine over i."""
        key, phase = 0, 0.0
        bound = 0
        for term in sp.Add.make_args(sp.expand(expr.args[0])):
            factor, rest = term.as_coeff_Mul()
            if rest in self._angles:
                k = self._angles[rest]
                whole = int(exact(factor) * self.variables.units[k])
                key += whole * self.variables.z(k)
                bound = max(bound, abs(whole))
            elif term.is_number:
                phase += float(term)
            else:
                raise LinkwiseError(
                    f"{expr} cannot be expanded into terms; counts need sines and cosines of whole "
                    "combinations of the joint angles, or of simple fractions of them"
                )
        if bound > LIMIT:
            raise LinkwiseError(
                f"{expr} cannot be expanded into terms: written in whole multiples of one angle a joint, it "
                f"takes more than {LIMIT} of them; round the ratio to a simple fraction"
            )
        sine = Laurent({key + 1: -1, -key + 1: 1}, 2, bound) if key else ZERO
        cosine = Laurent({key: 1, -key: 1}, 2, bound) if key else ONE
        s, c = snap_number(math.sin(phase)), snap_number(math.cos(phase))
        if expr.func == sp.sin:
            return add([sine.scaled(c), cosine.scaled(s)])
        return add([cosine.scaled(c), sine.scaled(-s)])


def angle_units(coordinates: Sequence[Coordinate], energies: Iterable[sp.Expr]) -> tuple[int, ...]:
    """Return d_k: the least whole numbers for which all sines and cosines are of multiples of q_k/d_k."""
    units = {c.q: 1 for c in coordinates}
    for energy in energies:
        for wave in energy.atoms(sp.sin, sp.cos):
            for term in sp.Add.make_args(sp.expand(wave.args[0])):
                factor, angle = term.as_coeff_Mul()
                if angle in units:
                    units[angle] = math.lcm(units[angle], exact(factor).denominator)
    return tuple(units.values())


def exact(number: sp.Expr) -> Fraction:
    """Return the number as a fraction; a float stands for the decimal that it prints as."""
    if number.is_Rational:
        return Fraction(int(number.p), int(number.q))
    return Fraction(repr(float(number)))


def snap_number(value: float) -> Fraction:
    """Return 0 or ±1 where `value` is that within rounding, else the decimal it prints as."""
    near = round(value)
    return Fraction(near) if abs(value - near) < 1e-12 else Fraction(repr(value))
