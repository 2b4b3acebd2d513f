"""Gains in the forms that people give them, as matrices to compute with."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..arguments import as_weights, has_tensors

FORMS = "a number, ({0},) for a diagonal, or ({0}, {0})"
BY_LINK = "a number, ({0},) for a diagonal, ({0}, {0}), or ({0}, {1}, {0}) with the links"


class Gain:
    """A matrix (size, size) that was given as a number, a diagonal, a matrix, or by link.

    Tensors are read anew at each call, as they may be learned.
    """

    def __init__(self, name: str, given: Any, names: Sequence[str], links: int | None = None) -> None:
        """names: of the rows; links: how many there are, None where nothing is given by link.

        Raises ValueError for a shape that is none of these, and for what is not finite; TypeError for what is
        not numbers.
        """
        size = len(names)
        self.name, self.names, self._given = name, tuple(names), given
        self.learned = has_tensors([given])
        """Whether it was given as a tensor."""
        self._shapes: tuple[tuple[int, ...], ...] = ((), (size,), (size, size))
        if links is not None:
            self._shapes += ((size, links, size),)
        read = as_weights(name, given)
        if tuple(read.shape) not in self._shapes:
            forms = (FORMS if links is None else BY_LINK).format(size, links)
            raise ValueError(f"{name} has shape {tuple(read.shape)}; give {forms}")
        self.numbers = _square(np, np.array(read.detach().cpu() if self.learned else read, float), size)
        """As they were given, (size, size)."""
        if not np.isfinite(self.numbers).all():
            raise ValueError(f"{name} has numbers that are not finite")
        self._converted: dict[Any, Any] = {}

    def matrix(self, side: Any, like: Any) -> Any:
        """(size, size), to compute with `like`."""
        if self.learned:
            given = side.weights(self.name, self._given, like)
            return _square(side.xp, given, len(self.names), side.constant(np.eye(len(self.names)), like))
        key = like.dtype, getattr(like, "device", None)
        if key not in self._converted:
            self._converted[key] = side.constant(self.numbers, like)
        return self._converted[key]


def _square(xp: Any, given: Any, size: int, ones: Any = None) -> Any:
    ones = np.eye(size) if ones is None else ones
    if given.ndim < 2:
        return given * ones
    return given.sum(1) if given.ndim == 3 else given


def check_positive(gain: Gain, definite: bool, symmetric: bool = True) -> None:
    """Raise ValueError, with what is wrong and where, for a matrix that is not positive.

    definite: whether zero is refused too; symmetric: whether it must be, else its symmetric part counts
    """
    check_matrix(gain.name, gain.numbers, gain.names, definite, symmetric)


def check_matrix(
    name: str, matrix: NDArray[Any], names: Sequence[str], definite: bool, symmetric: bool
) -> None:
    """See `check_positive`; signs do not depend on units, which are taken out first."""
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
        raise ValueError(f"{name} is not {what}: along {moved} it is {values[0]:g} of its size")
