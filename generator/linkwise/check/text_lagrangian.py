"""A link's Lagrangian from the text of the energies that a manifest gives, for torch to differentiate."""

import operator
import random
from collections.abc import Callable, Iterator, Mapping
from typing import Any

from linkwise.check.text_reader import TextFormula, parameter_values, torch_functions
from linkwise.extras import extra
from linkwise.package.entries import EnergyEntry

NOISE = 1e-9
"""Error of each operation of a noisy Lagrangian, relative to its result: what it changes, rounding does."""


class TextLagrangian:
    """L(q, qd) of one link, for q and qd of shape (n,); raises Unreadable for text that is no formula.

    noise: a seed for errors of up to NOISE in each operation, the same ones in each call; None for none
    """

    def __init__(
        self, energies: EnergyEntry, parameters: Mapping[str, float], noise: int | None = None
    ) -> None:
        torch = extra("torch")
        self._kinetic, self._potential = TextFormula(energies.kinetic), TextFormula(energies.potential)
        self._noise = noise
        self._parameters = {
            name: torch.tensor(value, dtype=torch.float64)
            for name, value in parameter_values(parameters).items()
        }

    def __call__(self, q: Any, qd: Any) -> Any:
        """Value in J, without an axis."""
        kinetic, potential = self.energies(q, qd)
        return kinetic - potential

    def energies(self, q: Any, qd: Any) -> tuple[Any, Any]:
        """Kinetic and potential energy in J, without an axis."""
        names, functions = dict(self._parameters), dict(torch_functions())
        for kind, motion in (("q", q), ("qd", qd)):
            names |= {f"{kind}_{k}": motion[k - 1] for k in range(1, len(motion) + 1)}
        if self._noise is not None:
            errors = _errors(self._noise)
            names = {name: _Noisy(value, errors) for name, value in names.items()}
            functions = {name: _noisy(function, errors) for name, function in functions.items()}
        energies = (formula.value(names, functions) for formula in (self._kinetic, self._potential))
        kinetic, potential = (
            q.new_zeros(()) + _plain(one) for one in energies
        )  # a constant is a tensor, too
        return kinetic, potential


def _errors(seed: int) -> Iterator[float]:
    chosen = random.Random(seed)
    while True:
        yield 1.0 + NOISE * chosen.uniform(-1.0, 1.0)


class _Noisy:
    """A tensor each operation on which errs a little."""

    def __init__(self, value: Any, errors: Iterator[float]) -> None:
        self.value, self._errors = value, errors

    def _made(self, operation: Callable[[Any, Any], Any], one: Any, other: Any) -> "_Noisy":
        return _Noisy(operation(_plain(one), _plain(other)) * next(self._errors), self._errors)

    def __add__(self, other: Any) -> "_Noisy":
        return self._made(operator.add, self, other)

    def __radd__(self, other: Any) -> "_Noisy":
        return self._made(operator.add, other, self)

    def __sub__(self, other: Any) -> "_Noisy":
        return self._made(operator.sub, self, other)

    def __rsub__(self, other: Any) -> "_Noisy":
        return self._made(operator.sub, other, self)

    def __mul__(self, other: Any) -> "_Noisy":
        return self._made(operator.mul, self, other)

    def __rmul__(self, other: Any) -> "_Noisy":
        return self._made(operator.mul, other, self)

    def __truediv__(self, other: Any) -> "_Noisy":
        return self._made(operator.truediv, self, other)

    def __rtruediv__(self, other: Any) -> "_Noisy":
        return self._made(operator.truediv, other, self)

    def __pow__(self, other: Any) -> "_Noisy":
        return self._made(operator.pow, self, other)

    def __rpow__(self, other: Any) -> "_Noisy":
        return self._made(operator.pow, other, self)

    def __neg__(self) -> "_Noisy":
        return _Noisy(-self.value, self._errors)

    def __pos__(self) -> "_Noisy":
        return self


def _noisy(function: Callable[[Any], Any], errors: Iterator[float]) -> Callable[[Any], Any]:
    return lambda argument: _Noisy(function(_plain(argument)) * next(errors), errors)


def _plain(value: Any) -> Any:
    return value.value if isinstance(value, _Noisy) else value
