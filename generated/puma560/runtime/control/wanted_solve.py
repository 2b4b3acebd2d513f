"""Accelerations from a wanted inertia, M* a = f, and the joints or rows along which it is not positive."""

import sys
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..sums.namespace import hidden, namespace

LEAST = 4.0
"""Roundings by which an eigenvalue of each row, of a matrix scaled to its natural size, may be wrong."""


def solved_wanted(
    what: str, wanted: Any, force: Any, natural: Any, names: Sequence[str], positive: bool = True
) -> Any:
    """a (..., r, X) of M* (..., r, r) and forces (..., r, X).

    what: is wrong where it cannot be, as the message says
    natural: matrix (..., r, r) whose diagonal says how large each row is, so that kilograms and square metres
    go together; positive: whether M* must be positive (its symmetric part, that is), else regular

    Raises ValueError for the first M* that is not, with the sample and the rows: of a singular one those
    that say nothing, or the same as others.
    """
    xp = namespace(wanted)
    diagonal = abs(natural.diagonal(0, -2, -1))
    size = xp.where(diagonal > 0.0, diagonal, xp.ones_like(diagonal)) ** 0.5
    scaled = wanted / (size[..., :, None] * size[..., None, :])
    if not hidden(wanted):
        numbers = scaled if xp is np else scaled.detach().cpu().numpy()
        _check(what, numbers, names, positive)
    if xp is np:
        return np.linalg.solve(scaled, force / size[..., None]) / size[..., None]
    return sys.modules["torch"].linalg.solve_ex(scaled, force / size[..., None])[0] / size[..., None]


def _check(what: str, scaled: NDArray[Any], names: Sequence[str], positive: bool) -> None:
    """Raise ValueError for the first of (..., r, r) that is not positive, or regular; NaN passes."""
    finite = np.isfinite(scaled).all((-2, -1), keepdims=True)
    known = np.where(finite, scaled, np.eye(scaled.shape[-1]))
    least = LEAST * scaled.shape[-1] * np.finfo(scaled.dtype).eps
    if positive:
        symmetric = (known + np.swapaxes(known, -1, -2)) / 2.0
        try:
            if np.linalg.cholesky(symmetric).diagonal(0, -2, -1).min(initial=1.0) ** 2 > 1e3 * least:
                return
        except np.linalg.LinAlgError:
            pass
        values, vectors = np.linalg.eigh(symmetric)
        value, vector = values[..., 0], vectors[..., :, 0]
    else:
        vectors, values, _ = np.linalg.svd(known)
        value, vector = values[..., -1], vectors[..., :, -1]
    bad = value <= least * np.maximum(1.0, np.abs(values).max(-1))
    if not bad.any():
        return
    sample = tuple(np.argwhere(bad)[0].tolist())
    where = f" at sample {', '.join(map(str, sample))}" if sample else ""
    along = np.abs(vector[sample])
    rows = ", ".join(names[r] for r in np.flatnonzero(along > 0.1 * along.max()).tolist())
    raise ValueError(f"{what}{where}: along {rows}")
