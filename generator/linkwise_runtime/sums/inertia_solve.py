"""Accelerations from the mass matrix, M qdd = f, and which joints make it singular."""

import sys
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..chosen_names import sample_of
from .known_digits import Told, as_array, can_move, epsilon_of, kind_of, warn_of_vague
from .namespace import hidden, namespace

CLEAR = 1e5
"""Roundings; a matrix with ones on its diagonal whose least pivot is as large is far from singular."""
ROUNDINGS = 4.0
"""By so many for each joint, rounding moves eigenvalues of a matrix with ones on its diagonal."""


def solved(mass: Any, force: Any, joint_names: Sequence[str]) -> Any:
    """M^-1 f (..., n), of matrices (..., n, n) and forces (..., n); raises as `solved_columns` does."""
    return solved_columns(mass, force[..., None], joint_names)[..., 0]


def solved_columns(mass: Any, forces: Any, joint_names: Sequence[str]) -> Any:
    """M^-1 F (..., n, X), of matrices (..., n, n) and columns of forces (..., n, X).

    Rows and columns are scaled to ones on the diagonal first: a hand's inertia is not lost beside a body's.
    Raises ValueError for a singular matrix, with the sample and the joints, and warns of samples whose
    answer is known to fewer than half of the digits of its dtype; where nobody may look at numbers, as under
    vmap, the answer of a singular matrix is not finite.
    """
    xp = namespace(mass)
    diagonal = abs(mass.diagonal(0, -2, -1))
    size = xp.where(diagonal > 0.0, diagonal, xp.ones_like(diagonal)) ** 0.5
    scaled = mass / (size[..., :, None] * size[..., None, :])
    columns = forces / size[..., None]
    if hidden(mass) or 0 in scaled.shape:
        return _quotient(scaled, columns) / size[..., None]
    own = _unit_of(_lightest(scaled, joint_names), scaled)
    wide = xp.zeros_like(own[..., None] + columns.sum(-1)[..., None])
    # One column more: the acceleration of that joint by a unit of its own force.
    moved = _quotient(scaled, xp.concat([columns + wide, own[..., None] + wide], -1))
    warn_of_vague(
        scaled, (moved[..., -1] * own).sum(-1), Told("the mass matrix is nearly singular", joint_names)
    )
    return moved[..., :-1] / size[..., None]


def _quotient(scaled: Any, columns: Any) -> Any:
    if isinstance(scaled, np.ndarray):
        return np.linalg.solve(scaled, columns)
    return sys.modules["torch"].linalg.solve_ex(scaled, columns)[0]


def _lightest(scaled: Any, joint_names: Sequence[str]) -> Any:
    """The joint of which, those before it moving freely, the least part of its inertia is left (...,).

    Raises ValueError for the first singular matrix of (..., n, n); what is not finite stays so.
    """
    if isinstance(scaled, np.ndarray):
        try:
            pivots = np.linalg.cholesky(scaled).diagonal(0, -2, -1)
        except np.linalg.LinAlgError:  # not positive, as a user's energies may be
            return _lightest_of_any(scaled, joint_names)
        return pivots.argmin(-1) if _are_clear(pivots) else _lightest_of_any(scaled, joint_names)
    torch: Any = sys.modules["torch"]
    factors, faults = torch.linalg.cholesky_ex(scaled.detach())
    pivots = factors.diagonal(0, -2, -1)
    if not bool(faults.any()) and _are_clear(pivots):
        return pivots.argmin(-1)
    return torch.as_tensor(_lightest_of_any(as_array(scaled), joint_names), device=scaled.device)


def _are_clear(pivots: Any) -> bool:
    return bool(pivots.min() ** 2 > CLEAR * epsilon_of(pivots))


def _lightest_of_any(scaled: NDArray[Any], joint_names: Sequence[str]) -> NDArray[np.intp]:
    """The same of matrices that may not be positive: the joint that moves most with the least mass."""
    finite = np.isfinite(scaled).all((-2, -1))
    values, vectors = np.linalg.eigh(np.where(finite[..., None, None], scaled, np.eye(scaled.shape[-1])))
    least = np.abs(values).argmin(-1)[..., None]
    moving = np.take_along_axis(vectors, least[..., None], -1)[..., 0]
    size = np.abs(np.take_along_axis(values, least, -1)[..., 0])
    singular = size <= ROUNDINGS * values.shape[-1] * epsilon_of(scaled)
    if singular.any():
        sample: list[int] = np.argwhere(singular)[0].tolist()
        wider = "; float64 may tell more" if kind_of(scaled) == np.float32 else ""
        raise ValueError(
            f"the mass matrix is singular{sample_of(sample)}: "
            f"{can_move(moving[tuple(sample)], joint_names)} without moving any mass, as far as "
            f"{kind_of(scaled)} tells, so that no acceleration follows from the torques{wider}"
        )
    lightest: NDArray[np.intp] = np.abs(moving).argmax(-1)
    return lightest


def _unit_of(joint: Any, like: Any) -> Any:
    """Zeros (..., n), and one at this joint (...,)."""
    xp = namespace(like)
    counted = np.arange(like.shape[-1]) if xp is np else xp.arange(like.shape[-1], device=like.device)
    return xp.asarray(joint[..., None] == counted, dtype=like.dtype)
