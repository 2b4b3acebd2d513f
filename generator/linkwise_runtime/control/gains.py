"""Gains in the forms that users give them, and what is wanted in place of natural coefficients.

A target says how much of the natural coefficients is kept, and what is added:

    M*_ik = sum_j w_ijk c2_ijk + m_ik        B*_ik = sum_j w_ijk c1_ijk + b_ik

Entries that are given in place of the natural ones have w = 0 and their value in m or b, a scale alpha_ij has
w_ijk = alpha_ij, and a sum that is given whole has w = 0 everywhere.
"""

from collections.abc import Mapping, Sequence
from typing import NamedTuple, cast

import numpy as np
from numpy.typing import NDArray

from ..arguments import as_weights, has_tensors, shape_of
from ..chosen_names import known_kind, short
from ..interface import Library, Numbers, array_of, is_traced
from ..structure import Structure
from ..targets import Natural

Real = NDArray[np.float64]

FORMS = "a number, ({0},) for a diagonal, or ({0}, {0})"
BY_LINK = "a number, ({0},) for a diagonal, ({0}, {0}), or ({0}, {1}, {0}) with the links"


class Gain:
    """Matrix (size, size) that was given as a number, a diagonal, a matrix, or by link.

    Tensors are read again at each call, since they may be learned, and must stay as positive as they were.
    """

    def __init__(
        self,
        name: str,
        given: object,
        names: Sequence[str],
        links: int | None = None,
        definite: bool = False,
        symmetric: bool = True,
        any_sign: bool = False,
    ) -> None:
        """Read and check a gain.

        names: names of the rows; links: number of links, None where nothing is given by link
        definite: whether zero is refused; symmetric: whether the matrix must be symmetric, else its symmetric
        part counts; any_sign: whether it may be any matrix

        Raises ValueError for a shape that is none of these, for numbers that are not finite and for a matrix
        that is not positive; TypeError for what is not numbers.
        """
        size = len(names)
        self.name, self.names = name, tuple(names)
        self.learned = has_tensors([given])
        """True if it was given as a tensor."""
        self._given = read = numbers_of(name, given)
        shapes: tuple[tuple[int, ...], ...] = ((), (size,), (size, size))
        if links is not None:
            shapes += ((size, links, size),)
        if tuple(read.shape) not in shapes:
            forms = (FORMS if links is None else BY_LINK).format(size, links)
            raise ValueError(f"{name} has shape {tuple(read.shape)}; give {forms}")
        self._asked = None if any_sign else (definite, symmetric)
        self.numbers = self._checked(read)
        """Numbers of the gain as a matrix, (size, size)."""
        self._converted: dict[object, Numbers] = {}

    def matrix(self, library: Library, like: Numbers) -> Numbers:
        """Return the matrix (size, size), to compute with `like`.

        Raises ValueError for a tensor that is not positive any more.
        """
        if self.learned:
            if not is_traced(self._given):
                self.numbers = self._checked(self._given, self.numbers)
            given = library.weights(self.name, self._given, like)
            return _square(given, library.constant(np.eye(len(self.names)), like))
        key = like.dtype, getattr(like, "device", None)
        if key not in self._converted:
            self._converted[key] = library.constant(self.numbers, like)
        return self._converted[key]

    def _checked(self, given: Numbers, known: Real | None = None) -> Real:
        """Return the numbers as a matrix, checked; numbers equal to `known` are not checked again."""
        read = np.array(array_of(given), float)
        if not np.isfinite(read).all():
            raise ValueError(f"{self.name} has numbers that are not finite")
        numbers = cast(Real, _square(read, np.eye(len(self.names))))
        if self._asked is not None and (known is None or not np.array_equal(known, numbers)):
            _check_positive(self.name, numbers, self.names, *self._asked)
        return numbers


def numbers_of(name: str, given: object) -> Numbers:
    """Return a tensor, or an array; raises TypeError and ValueError for what is not numbers."""
    if isinstance(given, Mapping) or hasattr(given, "_fields") or isinstance(given, type | str | complex):
        raise TypeError(f"{name} is {known_kind(given, Natural)}, which cannot be taken here; give numbers")
    return as_weights(name, given)


def _square(given: Numbers, ones: Numbers) -> Numbers:
    if given.ndim < 2:
        return given * ones
    return given.sum(1) if given.ndim == 3 else given


def _check_positive(name: str, matrix: Real, names: Sequence[str], definite: bool, symmetric: bool) -> None:
    """Raise ValueError, with what is wrong and where.

    Rows and columns are scaled by the diagonal first, as signs do not depend on units.
    """
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


class TargetShares(NamedTuple):
    """Targets for the coefficients of one order."""

    kept: float | Numbers
    """Weights w: one number, or (n, N, 1) or (n, N, n), of which some may be tensors."""
    by_link: Real | None
    """Weight w of each link, (N,), where all joints that move the link have the same; else None."""
    added: Gain | None
    whole: bool
    """True if `added` was given as the sum over the links, armature included."""
    positive: bool
    """True if what is added is known to be positive."""

    @property
    def natural(self) -> bool:
        """True if the natural coefficients stay as they are."""
        return self.added is None and isinstance(self.kept, float) and self.kept == 1.0

    def of(self, library: Library, natural: Numbers, by_link: Numbers | None, like: Numbers) -> Numbers:
        """Return the wanted sum (..., n, n), from the natural sum and its parts by link (..., n, N, n)."""
        if isinstance(self.kept, float):
            kept = natural if self.kept == 1.0 else self.kept * natural
        else:
            kept = (library.weights("scale", self.kept, like) * by_link).sum(-2)
        return kept if self.added is None else kept + self.added.matrix(library, like)


def target_shares(name: str, given: object, structure: Structure, definite: bool) -> TargetShares:
    """Return targets in the forms that `Dynamics.partial_impedance` accepts; raises as it says.

    definite: whether a sum that is given must be positive definite and symmetric, as inertia must
    """
    names = structure.joint_names
    if isinstance(given, Natural):
        plus = f"{name}.plus"
        added = None if given.plus is None else Gain(plus, given.plus, names, symmetric=definite)
        return TargetShares(*_scaled(f"{name}.scale", given.scale, structure), added, False, True)
    if isinstance(given, Mapping):
        kept, values = entries_apart(name, given, structure)
        return TargetShares(kept, None, Gain(name, values, names, any_sign=True), False, False)
    added = Gain(name, given, names, structure.N, definite, symmetric=definite)
    check_paths(name, given, structure)
    whole = len(shape_of(given)) < 3
    return TargetShares(0.0, np.zeros(structure.N), added, whole, True)


def stiffness_of(given: object, structure: Structure) -> Gain | None:
    """Return K*, or None without stiffness; raises ValueError if it is not symmetric or negative anywhere."""
    if isinstance(given, Mapping):
        given = entries_apart("stiffness", given, structure)[1]
    elif isinstance(given, Natural):
        raise TypeError(
            "stiffness is Natural, but a position loads nothing by itself, and gravity, as any potential, is "
            "compensated; give numbers in N m/rad or N/m"
        )
    gain = Gain("stiffness", given, structure.joint_names, structure.N)
    check_paths("stiffness", given, structure)
    return gain if has_tensors([given]) or gain.numbers.any() else None


def check_paths(name: str, given: object, structure: Structure) -> None:
    """Raise ValueError for an entry (n, N, n) of a joint that does not move the link."""
    if len(shape_of(given)) != 3:
        return
    numbers = np.asarray(array_of(numbers_of(name, given)), dtype=np.float64)
    for place in np.argwhere(numbers):
        entry_of(name, tuple(place.tolist()), structure)


def entries_apart(name: str, given: Mapping[object, object], structure: Structure) -> tuple[Real, Real]:
    """Return w (n, N, n), zero for the entries, and their values summed over the links, (n, n)."""
    kept = np.ones((structure.n, structure.N, structure.n))
    values = np.zeros((structure.n, structure.n))
    for key, value in given.items():
        if not isinstance(key, tuple) or len(key) != 3:
            raise ValueError(f"{name} has the key {short(key)}; entries are (joint, link, coordinate)")
        i, j, k = entry_of(name, key, structure)
        if not kept[i, j, k]:
            raise ValueError(f"{name} has the entry {short(key)} twice, by name and by number")
        kept[i, j, k] = 0.0
        values[i, k] += _number(name, key, value)
    return kept, values


def entry_of(name: str, key: tuple[int | str, ...], structure: Structure) -> tuple[int, int, int]:
    """Return indices i, j, k; raises ValueError for a joint that does not exist or does not move the link."""
    i = structure.joint_index(key[0], f"{name}: joint")
    j = structure.link_index(key[1], f"{name}: link")
    k = structure.joint_index(key[2], f"{name}: coordinate")
    for joint in (i, k):
        if joint not in structure.paths[j]:
            raise ValueError(
                f"{name} has the entry {short(key)}, which is always zero: joint "
                f"{structure.joint_names[joint]!r} does not move link {structure.link_names[j]!r}"
            )
    return i, j, k


def _number(name: str, key: object, value: object) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float | np.floating | np.integer):
        raise TypeError(
            f"{name} of {short(key)} is {short(value)}; give a number, or a whole tensor to learn"
        )
    return float(value)


def _scaled(name: str, scale: object, structure: Structure) -> tuple[float | Numbers, Real | None]:
    """Return w, and w by link (N,) where it is one number for each link."""
    if isinstance(scale, Mapping):
        scale = _by_names(name, scale, structure)
    read = numbers_of(name, scale)
    numbers = np.asarray(array_of(read), float)
    if numbers.shape not in ((), (structure.n, structure.N)):
        raise ValueError(
            f"{name} has shape {numbers.shape}; give a number, ({structure.n}, {structure.N}) for joints and "
            "links, {link: number} or {(joint, link): number}"
        )
    for place in np.argwhere(~(numbers >= 0.0) | np.isinf(numbers)):
        where = (
            f" of ({structure.joint_names[place[0]]}, {structure.link_names[place[1]]})" if len(place) else ""
        )
        raise ValueError(f"{name}{where} is {numbers[tuple(place)]:g}; give 0 or above")
    if not numbers.ndim:
        return read if has_tensors([read]) else float(numbers), np.full(structure.N, float(numbers))
    kept = read if has_tensors([read]) else numbers.copy()
    return kept[..., None], _alike(numbers, structure)


def _alike(numbers: Real, structure: Structure) -> Real | None:
    columns = [numbers[list(path), j] for j, path in enumerate(structure.paths)]
    if any(len(column) and np.ptp(column) for column in columns):
        return None
    return np.array([column[0] if len(column) else 1.0 for column in columns])


def _by_names(
    name: str, given: Mapping[int | str | tuple[int | str, ...], object], structure: Structure
) -> Real:
    scale = np.ones((structure.n, structure.N))
    for key, value in given.items():
        if isinstance(key, tuple):
            if len(key) != 2:
                raise ValueError(f"{name} has the key {short(key)}; keys are link or (joint, link)")
            i, j, _ = entry_of(name, (*key, key[0]), structure)
            scale[i, j] = _number(name, key, value)
        else:
            scale[:, structure.link_index(key, f"{name}: link")] = _number(name, key, value)
    return scale
