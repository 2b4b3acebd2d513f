"""Variances of products of two uncertain numbers, from those of both and from their covariance.

For a and b that are normal together, with values A and B, the product has

    var(a b) = A^2 var(b) + B^2 var(a) + 2 A B cov(a, b) + var(a) var(b) + cov(a, b)^2

(L. A. Goodman, On the exact variance of products, J. Am. Stat. Assoc. 55, 1960). The last two count where A
or B is near zero itself: a joint that reverses, a centre of mass on its axis.
"""

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

Part = Callable[[Sequence[Any]], Any]
"""Function that returns the numbers of some of the arrays, which may be views."""


class Product(NamedTuple):
    """Products of numbers of two parts of arrays, such as coefficients and the motion of their causes."""

    first: Part
    second: Part
    is_factor: bool = False
    """True if it is a part of a later product itself."""


class ProductMoments:
    """Finds the variances of products, which stand after the arrays that they are made of."""

    def __init__(self, products: Sequence[Product], here: Sequence[Any]) -> None:
        """Set up products; here: values of the arrays at no deviation."""
        self._products = products
        self._values: list[tuple[Any, Any]] = []
        self._covariances: list[Any] = [0.0] * len(products)
        every = list(here)
        for product in products:
            a, b = product.first(every), product.second(every)
            self._values.append((a, b))
            every.append(a * b if product.is_factor else None)

    def add(self, changes: Sequence[Any]) -> None:
        """Add an independent direction by what the arrays change by along one standard deviation of it."""
        every = list(changes)
        for number, (product, (a, b)) in enumerate(zip(self._products, self._values, strict=True)):
            da, db = product.first(every), product.second(every)
            self._covariances[number] += da * db
            every.append(a * db + b * da if product.is_factor else None)

    def variances(self, found: Sequence[Any]) -> list[Any]:
        """Return the variances of the products by those of the arrays."""
        every = list(found)
        for product, (a, b), both in zip(self._products, self._values, self._covariances, strict=True):
            va, vb = product.first(every), product.second(every)
            every.append(a * a * vb + b * b * va + va * vb + (2.0 * a * b + both) * both)
        return every[len(found) :]
