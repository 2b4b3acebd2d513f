"""Exact sparse polynomials in complex exponentials, velocities and parameters.

A trigonometric sum is a Laurent polynomial in z_k = exp(i q_k): cos q = (z + 1/z)/2 and
sin q = (z − 1/z)/2i. In it every product of sines and cosines is already one sine or cosine of an
angle sum, and like terms combine without further steps. A monomial is one integer whose digits are the
exponents, so that multiplying monomials is adding integers. Digits are balanced (−128..127); the
lowest one is the power of i, kept at 0 or 1 by i² = −1.
"""

import math
from collections.abc import Iterable
from dataclasses import dataclass
from fractions import Fraction

DIGIT = 8
"""Bits of an exponent: a byte, so that a monomial's bytes are its exponents."""
ZERO_BYTE = 1 << (DIGIT - 1)
"""Byte of exponent 0 in a lifted key."""
LIMIT = (1 << (DIGIT - 2)) - 1
"""Highest exponent; a digit holds twice that, so a product can be examined before it overflows."""
I_SQUARED = 2


class BudgetExceededError(Exception):
    """A polynomial has more terms than its budget allows."""


class ExponentError(Exception):
    """A power is too high for its digit."""


@dataclass(frozen=True)
class Laurent:
    """Σ coefficient · monomial, over one common denominator.

    terms: numerators, whole and never zero, by packed exponents
    bound: no exponent exceeds it in size
    """

    terms: dict[int, int]
    denominator: int = 1
    bound: int = 0

    def __bool__(self) -> bool:
        return bool(self.terms)

    def __len__(self) -> int:
        return len(self.terms)

    def scaled(self, factor: Fraction | int) -> "Laurent":
        """Return factor · self."""
        if not factor:
            return ZERO
        top, below = Fraction(factor).as_integer_ratio()
        terms = self.terms if top == 1 else {key: top * c for key, c in self.terms.items()}
        return Laurent(terms, self.denominator * below, self.bound)

    def reduced(self) -> "Laurent":
        """Return the polynomial in lowest terms, which keeps numerators short."""
        common = math.gcd(self.denominator, *self.terms.values())
        if common == 1:
            return self
        terms = {key: c // common for key, c in self.terms.items()}
        return Laurent(terms, self.denominator // common, self.bound)

    def pruned(self, relative: float) -> "Laurent":
        """Return the polynomial without coefficients below `relative` times the largest, left by rounding."""
        if not relative or not self.terms:
            return self
        top, below = Fraction(relative).as_integer_ratio()  # numerators may be too large for a float
        least = top * max(map(abs, self.terms.values())) // below
        terms = {key: c for key, c in self.terms.items() if abs(c) > least}
        return Laurent(terms, self.denominator, self.bound)


ZERO = Laurent({})
ONE = Laurent({0: 1})


def constant(value: Fraction | int) -> Laurent:
    """Return the number `value`."""
    return ONE.scaled(value)


def add(parts: Iterable[Laurent]) -> Laurent:
    """Return the sum of polynomials."""
    summands = [part for part in parts if part]
    if len(summands) < 2:
        return summands[0] if summands else ZERO
    denominator = math.lcm(*(part.denominator for part in summands))
    summands.sort(key=len, reverse=True)
    factor = denominator // summands[0].denominator
    total = {key: factor * c for key, c in summands[0].terms.items()}
    get = total.get
    for part in summands[1:]:
        factor = denominator // part.denominator
        for key, c in part.terms.items():
            total[key] = get(key, 0) + factor * c
    for key in [key for key, c in total.items() if not c]:
        del total[key]
    return Laurent(total, denominator, max(part.bound for part in summands))


def multiply(a: Laurent, b: Laurent, budget: int) -> Laurent:
    """Return a · b; raise BudgetExceededError once the product has more than `budget` terms."""
    if len(a) > len(b):
        a, b = b, a
    square = a is b
    product: dict[int, int] = {}
    get = product.get
    every = list(b.terms.items())
    for at, (key_a, c_a) in enumerate(a.terms.items()):
        rest, weight = every, c_a
        if square:
            # (Σ x)² = Σ x² + 2 Σ x y over later y: half the work.
            _accumulate(product, 2 * key_a, c_a * c_a)
            rest, weight = every[at + 1 :], 2 * c_a
        for key_b, c_b in rest:
            key = key_a + key_b
            if key & I_SQUARED:
                key -= I_SQUARED
                product[key] = get(key, 0) - weight * c_b
            else:
                product[key] = get(key, 0) + weight * c_b
        if len(product) > budget:
            raise BudgetExceededError
    terms = {key: c for key, c in product.items() if c}
    result = Laurent(terms, a.denominator * b.denominator, a.bound + b.bound)
    return bounded(result.reduced())


def _accumulate(product: dict[int, int], key: int, c: int) -> None:
    if key & I_SQUARED:
        key, c = key - I_SQUARED, -c
    product[key] = product.get(key, 0) + c


def power(base: Laurent, exponent: int, budget: int) -> Laurent:
    """Return base**exponent; a negative exponent needs a base of one term."""
    if exponent < 0:
        ((key, c),) = base.terms.items()
        inverse = Fraction(base.denominator, c) * (-1 if key & 1 else 1)
        flipped = -key + 2 * (key & 1)
        return power(Laurent({flipped: 1}, 1, base.bound).scaled(inverse), -exponent, budget)
    result = ONE
    for _ in range(exponent):
        result = multiply(result, base, budget)
    return result


def bounded(p: Laurent) -> Laurent:
    """Return `p` with a bound within LIMIT; raise ExponentError if an exponent exceeds that."""
    if p.bound <= LIMIT:
        return p
    digits = max(key.bit_length() for key in p.terms) // DIGIT + 2
    raised = lifted(digits)
    used = set(b"".join((key + raised).to_bytes(digits, "little") for key in p.terms))
    highest = max(max(used) - ZERO_BYTE, ZERO_BYTE - min(used))
    if highest > LIMIT:
        raise ExponentError
    return Laurent(p.terms, p.denominator, highest)


def exponents(key: int, digits: int) -> list[int]:
    """Return the lowest `digits` exponents of a monomial, the power of i first."""
    raised = (key + lifted(digits)) & ((1 << (DIGIT * digits)) - 1)
    return [byte - ZERO_BYTE for byte in raised.to_bytes(digits, "little")]


def lifted(digits: int) -> int:
    """Return the number that, added to a key, makes each of its `digits` balanced digits non-negative."""
    return int.from_bytes(bytes([ZERO_BYTE]) * digits, "little")


def at_digit(at: int) -> int:
    """Return the monomial whose only exponent is a 1 in digit `at`."""
    return 1 << (DIGIT * at)
