"""Accelerations from the mass matrix, M qdd = f, and which joints make it singular."""

import sys
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..chosen_names import MOST_NAMES, plain
from .namespace import hidden, namespace

CLEAR = 1e5
"""Roundings; a matrix with ones on its diagonal whose least pivot is as large is far from singular."""
ROUNDINGS = 4.0
"""By so many for each joint, rounding moves eigenvalues of a matrix with ones on its diagonal."""
SHARE = 1e-3
"""Joints that move less than this part of the one that moves most in a motion without mass are left out."""


def solved(mass: Any, force: Any, joint_names: Sequence[str]) -> Any:
    """M^-1 f (..., n), of matrices (..., n, n) and forces (..., n); raises as `solved_columns` does."""
    return solved_columns(mass, force[..., None], joint_names)[..., 0]


def solved_columns(mass: Any, forces: Any, joint_names: Sequence[str]) -> Any:
    """M^-1 F (..., n, X), of matrices (..., n, n) and columns of forces (..., n, X).

    Rows and columns are scaled to ones on the diagonal first: a hand's inertia is not lost beside a body's.
    Raises ValueError for a singular matrix, with the sample and the joints; where nobody may look at
    numbers, as under vmap, the answer is then not finite.
    """
    xp = namespace(mass)
    diagonal = abs(mass.diagonal(0, -2, -1))
    size = xp.where(diagonal > 0.0, diagonal, xp.ones_like(diagonal)) ** 0.5
    scaled = mass / (size[..., :, None] * size[..., None, :])
    if xp is np:
        _check(scaled, joint_names)
        moved = np.linalg.solve(scaled, forces / size[..., None])
    else:
        _check_tensor(scaled, joint_names)
        moved = xp.linalg.solve_ex(scaled, forces / size[..., None])[0]
    return moved / size[..., None]


def _check_tensor(scaled: Any, joint_names: Sequence[str]) -> None:
    if hidden(scaled):
        return
    torch: Any = sys.modules["torch"]
    factors, faults = torch.linalg.cholesky_ex(scaled.detach())
    least = factors.diagonal(0, -2, -1).amin(-1) if scaled.numel() else faults + 1.0
    clear = (faults == 0) & (least**2 > CLEAR * torch.finfo(scaled.dtype).eps)
    if not bool(clear.all()):
        _check(scaled.detach().cpu().numpy(), joint_names)


def _check(scaled: NDArray[Any], joint_names: Sequence[str]) -> None:
    """Raise ValueError for the first singular matrix of (..., n, n); what is not finite stays so."""
    epsilon = np.finfo(scaled.dtype).eps
    try:
        pivots = np.linalg.cholesky(scaled).diagonal(0, -2, -1)
        if pivots.min(initial=1.0) ** 2 > CLEAR * epsilon:
            return
    except np.linalg.LinAlgError:  # not positive, as a user's energies may be
        pass
    finite = np.isfinite(scaled).all((-2, -1))
    values, vectors = np.linalg.eigh(np.where(finite[..., None, None], scaled, np.eye(scaled.shape[-1])))
    singular = np.abs(values).min(-1) <= ROUNDINGS * scaled.shape[-1] * epsilon
    if not singular.any():
        return
    sample: list[int] = np.argwhere(singular)[0].tolist()
    at = tuple(sample)
    still = np.abs(vectors[at][:, np.abs(values[at]).argmin()])
    raise ValueError(
        _singular(sample, [joint_names[i] for i in np.flatnonzero(still > SHARE * still.max()).tolist()])
    )


def _singular(sample: Sequence[int], joints: Sequence[str]) -> str:
    where = f" at sample {', '.join(map(str, sample))}" if sample else ""
    shown = ", ".join(plain(name) for name in joints[:MOST_NAMES])
    more = f" and {len(joints) - MOST_NAMES} more" if len(joints) > MOST_NAMES else ""
    moving = "joints" if len(joints) > 1 else "joint"
    together = " together" if len(joints) > 1 else ""
    return (
        f"the mass matrix is singular{where}: the {moving} {shown}{more} can move{together} without moving "
        "any mass, so that no acceleration follows from the torques"
    )
