"""Numbers whose operations each have a small error: what that changes, rounding changes too."""

import operator
import random
from collections.abc import Callable, Iterator
from typing import Any

NOISE = 1e-9
"""Relative error of each operation of a noisy Lagrangian: what it changes, rounding changes too."""


def errors(seed: int) -> Iterator[float]:
    """Yield factors of 1 and an error of up to NOISE, the same ones for a seed."""
    chosen = random.Random(seed)
    while True:
        yield 1.0 + NOISE * chosen.uniform(-1.0, 1.0)


class NoisyNumber:
    """A tensor whose operations each have a small error."""

    def __init__(self, value: Any, chosen: Iterator[float]) -> None:
        """Keep a value, and the errors of what is computed with it."""
        self.value, self._errors = value, chosen

    def _made(self, operation: Callable[[Any, Any], Any], one: Any, other: Any) -> "NoisyNumber":
        return NoisyNumber(operation(plain(one), plain(other)) * next(self._errors), self._errors)

    def __add__(self, other: Any) -> "NoisyNumber":
        return self._made(operator.add, self, other)

    def __radd__(self, other: Any) -> "NoisyNumber":
        return self._made(operator.add, other, self)

    def __sub__(self, other: Any) -> "NoisyNumber":
        return self._made(operator.sub, self, other)

    def __rsub__(self, other: Any) -> "NoisyNumber":
        return self._made(operator.sub, other, self)

    def __mul__(self, other: Any) -> "NoisyNumber":
        return self._made(operator.mul, self, other)

    def __rmul__(self, other: Any) -> "NoisyNumber":
        return self._made(operator.mul, other, self)

    def __truediv__(self, other: Any) -> "NoisyNumber":
        return self._made(operator.truediv, self, other)

    def __rtruediv__(self, other: Any) -> "NoisyNumber":
        return self._made(operator.truediv, other, self)

    def __pow__(self, other: Any) -> "NoisyNumber":
        return self._made(operator.pow, self, other)

    def __rpow__(self, other: Any) -> "NoisyNumber":
        return self._made(operator.pow, other, self)

    def __neg__(self) -> "NoisyNumber":
        return NoisyNumber(-self.value, self._errors)

    def __pos__(self) -> "NoisyNumber":
        return self

    def __lt__(self, other: Any) -> Any:
        return self.value < plain(other)

    def __le__(self, other: Any) -> Any:
        return self.value <= plain(other)

    def __gt__(self, other: Any) -> Any:
        return self.value > plain(other)

    def __ge__(self, other: Any) -> Any:
        return self.value >= plain(other)


def noisy(function: Callable[..., Any], chosen: Iterator[float]) -> Callable[..., Any]:
    """Return a function of noisy numbers, whose value has an error of its own."""
    return lambda *given: NoisyNumber(function(*map(plain, given)) * next(chosen), chosen)


def plain(value: Any) -> Any:
    """Return the tensor of a number, noisy or not."""
    return value.value if isinstance(value, NoisyNumber) else value
