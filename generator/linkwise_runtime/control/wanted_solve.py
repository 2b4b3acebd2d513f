"""Accelerations from a wanted inertia, M* a = f, and the joints or rows along which it is not positive.

What half of the digits are asks for, and what is refused, C judges by the same numbers (impedance.h).
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..answers.inertia_solve import ROUNDINGS, Told, warn_of_vague
from ..answers.namespace import array_of, epsilon_of, hidden, namespace
from ..chosen_names import sample_of
from ..interface import Namespace, Numbers
from ..targets import ROWS

SMALL = 1e3
"""Beside the root of rounding: where no pivot is less, half of the digits and more are known."""


class WantedInertia(NamedTuple):
    """A matrix to be solved for, in messages."""

    singular: str
    vague: Told

    @property
    def roundings(self) -> float:
        """By which a number of the size of 1 may be wrong, as C has it: six rows stand for any of a frame."""
        return ROUNDINGS * (len(ROWS) if self.vague.of_frame else len(self.vague.names))


def solved_wanted(
    about: WantedInertia,
    wanted: Numbers,
    force: Numbers,
    natural: Numbers,
    positive: bool = True,
    told: bool = False,
) -> Numbers:
    """a (..., r, X) of M* (..., r, r) and forces (..., r, X).

    natural: numbers (..., r), as large as those that each row of M* is made from, whose rounding is in it
    positive: whether M* must be positive (its symmetric part, that is), else regular
    told: whether another matrix says already how well a is known

    Raises ValueError for the first M* that is not, with the sample and the rows: of a singular one those
    that say nothing, or the same as others. Warns of samples whose answer is known to fewer than half of the
    digits. A positive matrix is judged by its own diagonal, as M is: links that are made lighter all alike
    are as well known as before.
    """
    xp: Namespace = namespace(wanted)
    own, natural = abs(wanted.diagonal(0, -2, -1)), abs(natural)
    size = own if positive else xp.maximum(own, natural)
    size = xp.where(size > 0.0, size, xp.ones_like(size)) ** 0.5
    scaled = wanted / (size[..., :, None] * size[..., None, :])
    if not hidden(wanted):
        diagonals = array_of(wanted).diagonal(0, -2, -1), array_of(natural)
        _check(about, array_of(scaled), diagonals, positive, told)
    right = force / size[..., None]
    array = isinstance(wanted, np.ndarray)
    moved: Numbers = xp.linalg.solve(scaled, right) if array else xp.linalg.solve_ex(scaled, right)[0]
    return moved / size[..., None]


def _check(
    about: WantedInertia,
    scaled: NDArray[np.floating],
    diagonals: tuple[NDArray[np.floating], NDArray[np.floating]],
    positive: bool,
    told: bool,
) -> None:
    """Raise ValueError for the first that is not positive, or not regular, or warn; NaN passes.

    diagonals: of it before it was scaled, and of what it is made from, (..., r)
    """
    finite = np.isfinite(scaled).all((-2, -1), keepdims=True)
    known = np.where(finite, scaled, np.eye(scaled.shape[-1], dtype=scaled.dtype))
    least = about.roundings * epsilon_of(scaled)
    if positive:
        own, natural = diagonals
        lost = own <= least * natural  # by rounding alone it may be as large
        if lost.any():
            at = tuple(np.argwhere(lost.any(-1))[0].tolist())
            _refuse(about, at, lost[at])
        known = (known + np.swapaxes(known, -1, -2)) / 2.0
    mobility = _largest_when_free(known) if positive else _largest_of_inverse(known)
    singular = ~(mobility * least < 1.0)
    if singular.any():
        sample = tuple(np.argwhere(singular)[0].tolist())
        along = np.abs(_least_along(known[sample], positive))
        _refuse(about, sample, along > 0.1 * along.max())
    if not told:
        warn_of_vague(known, mobility, about.vague)


def _refuse(about: WantedInertia, sample: tuple[int, ...], rows: NDArray[np.bool_]) -> None:
    along = ", ".join(about.vague.names[r] for r in np.flatnonzero(rows).tolist())
    raise ValueError(f"{about.singular}{sample_of(sample)}: along {along}")


def _largest_when_free(matrices: NDArray[np.floating]) -> NDArray[np.floating]:
    """Of positive ones, 1 by the part of a row's inertia that is left when all others move freely (...,).

    It is of the row with the least pivot; infinite where one of the matrices is not positive.
    """
    try:
        pivots = np.linalg.cholesky(matrices).diagonal(0, -2, -1) ** 2
        if pivots.min(initial=1.0) >= SMALL * epsilon_of(matrices) ** 0.5:
            return _inverted(pivots.min(-1))
        unit = np.eye(matrices.shape[-1], dtype=matrices.dtype)[pivots.argmin(-1)]
        moved = np.linalg.solve(matrices, unit[..., None])[..., 0]
    except np.linalg.LinAlgError:  # of the root or, where rounding has left that a pivot, of the solution
        return _inverted(np.linalg.eigvalsh(matrices)[..., 0])
    mobility: NDArray[np.floating] = (moved * unit).sum(-1)
    # Rounding may leave less than nothing, and less than what moves while those behind are held.
    return np.where(mobility > 0.0, np.maximum(mobility, _inverted(pivots.min(-1))), np.inf)


def _largest_of_inverse(matrices: NDArray[np.floating]) -> NDArray[np.floating]:
    """Of any, the largest number of its inverse (...,); infinite where one is exactly singular."""
    try:
        largest: NDArray[np.floating] = np.abs(np.linalg.inv(matrices)).max((-2, -1))
    except np.linalg.LinAlgError:
        return _inverted(np.linalg.svd(matrices, compute_uv=False)[..., -1])
    return largest


def _inverted(least: NDArray[np.floating]) -> NDArray[np.floating]:
    """1 by each, infinite for what is not above 0."""
    above = least > 0.0
    return np.where(above, 1.0 / np.where(above, least, 1.0), np.inf).astype(least.dtype)


def _least_along(matrix: NDArray[np.floating], symmetric: bool) -> NDArray[np.floating]:
    """The rows (r,) along which a matrix is the least."""
    if symmetric:
        return np.asarray(np.linalg.eigh(matrix)[1][:, 0])
    return np.asarray(np.linalg.svd(matrix)[0][:, -1])
