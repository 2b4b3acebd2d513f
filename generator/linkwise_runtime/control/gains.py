"""Gains in the forms that people give them, as matrices to compute with."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..arguments import as_weights, has_tensors
from ..chosen_names import known_kind
from ..controllers import Natural
from ..sums.namespace import hidden

FORMS = "a number, ({0},) for a diagonal, or ({0}, {0})"
BY_LINK = "a number, ({0},) for a diagonal, ({0}, {0}), or ({0}, {1}, {0}) with the links"


class Gain:
    """A matrix (size, size) that was given as a number, a diagonal, a matrix, or by link.

    Tensors are read anew at each call, as they may be learned, and must stay as positive as they were.
    """

    def __init__(
        self,
        name: str,
        given: Any,
        names: Sequence[str],
        links: int | None = None,
        definite: bool = False,
        symmetric: bool = True,
        any_sign: bool = False,
    ) -> None:
        """names: of the rows; links: how many there are, None where nothing is given by link.

        definite: whether zero is refused; symmetric: whether it must be, else its symmetric part counts;
        any_sign: whether it may be anything

        Raises ValueError for a shape that is none of these, for what is not finite and for what is not
        positive; TypeError for what is not numbers.
        """
        size = len(names)
        self.name, self.names, self._given = name, tuple(names), given
        self.learned = has_tensors([given])
        """Whether it was given as a tensor."""
        read = numbers_of(name, given)
        shapes: tuple[tuple[int, ...], ...] = ((), (size,), (size, size))
        if links is not None:
            shapes += ((size, links, size),)
        if tuple(read.shape) not in shapes:
            forms = (FORMS if links is None else BY_LINK).format(size, links)
            raise ValueError(f"{name} has shape {tuple(read.shape)}; give {forms}")
        self._asked = None if any_sign else (definite, symmetric)
        self.numbers = self._checked(read)
        """As they were given, (size, size)."""
        self._converted: dict[Any, Any] = {}

    def matrix(self, side: Any, like: Any) -> Any:
        """(size, size), to compute with `like`; raises ValueError for a tensor that is positive no more."""
        if self.learned:
            if not hidden(self._given):
                self.numbers = self._checked(self._given, self.numbers)
            given = side.weights(self.name, self._given, like)
            return _square(given, side.constant(np.eye(len(self.names)), like))
        key = like.dtype, getattr(like, "device", None)
        if key not in self._converted:
            self._converted[key] = side.constant(self.numbers, like)
        return self._converted[key]

    def _checked(self, given: Any, known: Any = None) -> NDArray[Any]:
        """The numbers, found to be as they must; those that are known are not looked at again."""
        read = given.detach().cpu().numpy().astype(float) if self.learned else np.array(given, float)
        if not np.isfinite(read).all():
            raise ValueError(f"{self.name} has numbers that are not finite")
        numbers: NDArray[Any] = _square(read, np.eye(len(self.names)))
        if self._asked is not None and (known is None or not np.array_equal(known, numbers)):
            _check_positive(self.name, numbers, self.names, *self._asked)
        return numbers


def numbers_of(name: str, given: Any) -> Any:
    """A tensor, or an array; raises TypeError and ValueError for what is no numbers."""
    if isinstance(given, Mapping) or hasattr(given, "_fields") or isinstance(given, type | str | complex):
        raise TypeError(f"{name} is {known_kind(given, Natural)}, which cannot be taken here; give numbers")
    return as_weights(name, given)


def _square(given: Any, ones: Any) -> Any:
    if given.ndim < 2:
        return given * ones
    return given.sum(1) if given.ndim == 3 else given


def _check_positive(
    name: str, matrix: NDArray[Any], names: Sequence[str], definite: bool, symmetric: bool
) -> None:
    """Raise ValueError, with what is wrong and where; signs do not depend on units, which are taken out."""
    rounding = 1e-9 * np.abs(matrix).max(initial=0.0)
    skew = np.abs(matrix - matrix.T)
    if symmetric and skew.max(initial=0.0) > rounding:
        a, b = divmod(int(skew.argmax()), len(skew))
        raise ValueError(
            f"{name} is not symmetric: ({names[a]}, {names[b]}) is {matrix[a, b]:g}, "
            f"({names[b]}, {names[a]}) is {matrix[b, a]:g}"
        )
    size = np.sqrt(np.where(matrix.diagonal() > 0.0, matrix.diagonal(), 1.0))
    values, vectors = np.linalg.eigh((matrix + matrix.T) / (2.0 * np.outer(size, size)))
    if len(values) and (values[0] < -1e-9 or (definite and values[0] < 1e-9)):
        along = np.abs(vectors[:, 0])
        moved = ", ".join(names[i] for i in np.flatnonzero(along > 0.1 * along.max()).tolist())
        what = "positive" if definite else "positive or zero"
        raise ValueError(
            f"{name} is not {what}: along {moved} it is {'negative' if values[0] < -1e-9 else 'zero'}"
        )
