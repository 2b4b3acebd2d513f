"""Accelerations from a wanted inertia, M* a = f, and the joints or rows along which it is not positive.

C uses the same limits to warn of lost digits and to refuse a matrix (impedance.h).
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..answers.inertia_solve import ROUNDINGS, Told, warn_of_vague
from ..chosen_names import sample_of
from ..interface import Namespace, Numbers, array_of, epsilon_of, is_traced, namespace
from ..targets import ROWS

SMALL = 1e3
"""Factor of the square root of rounding: where no pivot is less, at least half of the digits are known."""


class TargetInertia(NamedTuple):
    """Matrix that is solved for, as messages name it."""

    singular: str
    vague: Told

    @property
    def roundings(self) -> float:
        """Roundings by which a number of size 1 may be wrong, as in C: a frame always counts as six rows."""
        return ROUNDINGS * (len(ROWS) if self.vague.of_frame else len(self.vague.names))


def solve_target(
    about: TargetInertia,
    wanted: Numbers,
    force: Numbers,
    natural: Numbers,
    positive: bool = True,
    told: bool = False,
) -> Numbers:
    """Return a (..., r, X) of M* a = f, for M* (..., r, r) and forces (..., r, X).

    natural: numbers (..., r), as large as those that each row of M* is made from, whose rounding is in it
    positive: whether M* (its symmetric part, that is) must be positive definite; else it must be regular
    told: whether the accuracy of a is already reported for another matrix

    Raises ValueError for the first M* that is not, with the sample and the rows: for a singular one, the rows
    that are zero or follow from others. Warns of samples whose answer is known to fewer than half of the
    digits. A positive matrix is judged by its own diagonal, as M is: if all links are made lighter alike, the
    answer is known as well as before.
    """
    xp: Namespace = namespace(wanted)
    own, natural = abs(wanted.diagonal(0, -2, -1)), abs(natural)
    size = own if positive else xp.maximum(own, natural)
    size = xp.where(size > 0.0, size, xp.ones_like(size)) ** 0.5
    scaled = wanted / (size[..., :, None] * size[..., None, :])
    if not is_traced(wanted):
        diagonals = array_of(wanted).diagonal(0, -2, -1), array_of(natural)
        _check(about, array_of(scaled), diagonals, positive, told)
    right = force / size[..., None]
    array = isinstance(wanted, np.ndarray)
    moved: Numbers = xp.linalg.solve(scaled, right) if array else xp.linalg.solve_ex(scaled, right)[0]
    return moved / size[..., None]


def _check(
    about: TargetInertia,
    scaled: NDArray[np.floating],
    diagonals: tuple[NDArray[np.floating], NDArray[np.floating]],
    positive: bool,
    told: bool,
) -> None:
    """Raise ValueError for the first matrix that is not positive, or not regular, or warn; NaN passes.

    diagonals: that of the matrix before it was scaled, and that of what it is made from, (..., r)
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


def _refuse(about: TargetInertia, sample: tuple[int, ...], rows: NDArray[np.bool_]) -> None:
    along = ", ".join(about.vague.names[r] for r in np.flatnonzero(rows).tolist())
    raise ValueError(f"{about.singular}{sample_of(sample)}: along {along}")


def _largest_when_free(matrices: NDArray[np.floating]) -> NDArray[np.floating]:
    """Return 1 divided by the part of a row's inertia that is left when all others move freely, (...,).

    It is for positive matrices, and of the row with the least pivot; infinite for one that is not positive.
    Where all pivots are large, 1 divided by the least pivot is used instead; where a matrix of the batch is
    not positive, 1 divided by the least eigenvalue of each.
    """
    try:
        pivots = np.linalg.cholesky(matrices).diagonal(0, -2, -1) ** 2
        if pivots.min(initial=1.0) >= SMALL * epsilon_of(matrices) ** 0.5:
            return _inverted(pivots.min(-1))
        unit = np.eye(matrices.shape[-1], dtype=matrices.dtype)[pivots.argmin(-1)]
        moved = np.linalg.solve(matrices, unit[..., None])[..., 0]
    except np.linalg.LinAlgError:  # of the factor or, where rounding has left that a pivot, of the solution
        return _inverted(np.linalg.eigvalsh(matrices)[..., 0])
    mobility: NDArray[np.floating] = (moved * unit).sum(-1)
    # Rounding may leave a negative number, or less than what moves with the rows behind held.
    return np.where(mobility > 0.0, np.maximum(mobility, _inverted(pivots.min(-1))), np.inf)


def _largest_of_inverse(matrices: NDArray[np.floating]) -> NDArray[np.floating]:
    """Return the largest number of each inverse, (...,), infinite for a matrix that is exactly singular.

    Where one of the batch is, 1 divided by the least singular value of each is used instead.
    """
    try:
        largest: NDArray[np.floating] = np.abs(np.linalg.inv(matrices)).max((-2, -1))
    except np.linalg.LinAlgError:
        return _inverted(np.linalg.svd(matrices, compute_uv=False)[..., -1])
    return largest


def _inverted(least: NDArray[np.floating]) -> NDArray[np.floating]:
    """Return 1 divided by each number, infinite for one that is not above 0."""
    above = least > 0.0
    return np.where(above, 1.0 / np.where(above, least, 1.0), np.inf).astype(least.dtype)


def _least_along(matrix: NDArray[np.floating], symmetric: bool) -> NDArray[np.floating]:
    """Return the direction over the rows, (r,), along which a matrix is the least."""
    if symmetric:
        return np.asarray(np.linalg.eigh(matrix)[1][:, 0])
    return np.asarray(np.linalg.svd(matrix)[0][:, -1])
