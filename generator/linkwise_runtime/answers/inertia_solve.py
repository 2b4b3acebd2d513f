"""Accelerations from the mass matrix, M qdd = f, joints that make it singular, and digits lost to rounding.

For a mass matrix with ones on its diagonal and the least eigenvalue l, the relative error of the answer is
about epsilon / l. For joint c, (M_cc (M^-1)_cc)^-1 is the part of its own inertia that is left when all
others move freely, at least l: C asks the same of its factors (elimination.h).
"""

import sys
import warnings
from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple, cast

import numpy as np
from numpy.typing import NDArray

from ..chosen_names import listed, sample_of
from ..interface import NUMPY, Numbers, array_of, epsilon_of, is_traced, kind_of, namespace

if TYPE_CHECKING:
    from torch import Tensor  # type: ignore[import-not-found, unused-ignore]

CLEAR = 1e5
"""Number of roundings: a matrix with ones on its diagonal and a larger least pivot is far from singular."""
ROUNDINGS = 4.0
"""Number of roundings for each joint by which eigenvalues of a matrix with ones on its diagonal may move."""
SHARE = 1e-3
"""Share of the largest move, in a motion without mass, below which joints are left out."""


class Told(NamedTuple):
    """Accelerations that are known by few digits, for messages."""

    what: str
    names: Sequence[str]
    """Names of the joints or, for a frame, of its rows."""
    of_frame: bool = False
    beside: str = ""
    """Further text on what is known by even fewer digits."""


def solve_inertia(mass: Numbers, force: Numbers, joint_names: Sequence[str]) -> Numbers:
    """Return M^-1 f (..., n), for matrices (..., n, n) and forces (..., n); raise as it does for columns."""
    return solve_inertia_columns(mass, force[..., None], joint_names)[..., 0]


def solve_inertia_columns(mass: Numbers, forces: Numbers, joint_names: Sequence[str]) -> Numbers:
    """Return M^-1 F (..., n, X), for matrices (..., n, n) and columns of forces (..., n, X).

    Rows and columns are first scaled to ones on the diagonal, so that a hand's inertia is not lost beside a
    body's. Raises ValueError for a singular matrix, with the sample and the joints, and warns of samples
    whose answer is known to fewer than half of the digits of its dtype; where numbers are hidden, as under
    vmap, the answer of a singular matrix is not finite.
    """
    xp = namespace(mass)
    diagonal = abs(mass.diagonal(0, -2, -1))
    size = xp.where(diagonal > 0.0, diagonal, xp.ones_like(diagonal)) ** 0.5
    scaled = mass / (size[..., :, None] * size[..., None, :])
    columns = forces / size[..., None]
    if is_traced(mass) or 0 in scaled.shape:
        return _quotient(scaled, columns) / size[..., None]
    own = _unit_of(_lightest(scaled, joint_names), scaled)
    wide = xp.zeros_like(own[..., None] + columns.sum(-1)[..., None])
    # One column more: the acceleration of that joint by a unit of its own force.
    moved = _quotient(scaled, xp.concat([columns + wide, own[..., None] + wide], -1))
    warn_of_vague(
        scaled, (moved[..., -1] * own).sum(-1), Told("the mass matrix is nearly singular", joint_names)
    )
    return moved[..., :-1] / size[..., None]


def _quotient(scaled: Numbers, columns: Numbers) -> Numbers:
    found: Numbers
    if isinstance(scaled, np.ndarray):
        found = NUMPY.linalg.solve(scaled, columns)
    else:
        found = sys.modules["torch"].linalg.solve_ex(scaled, columns)[0]
    return found


def _lightest(scaled: Numbers, joint_names: Sequence[str]) -> Numbers:
    """Return the joint (...,) with the least part of its inertia left when the joints before it move freely.

    Raises ValueError for the first singular matrix of (..., n, n); what is not finite stays so.
    """
    if isinstance(scaled, np.ndarray):
        try:
            left = np.linalg.cholesky(scaled).diagonal(0, -2, -1)
        except np.linalg.LinAlgError:  # not positive, as a user's energies may be
            return _lightest_of_any(scaled, joint_names)
        if not _are_clear(left):
            return _lightest_of_any(scaled, joint_names)
        lightest: NDArray[np.intp] = left.argmin(-1)
        return lightest
    torch, tensor = sys.modules["torch"], cast("Tensor", scaled)
    factors, faults = torch.linalg.cholesky_ex(tensor.detach())
    pivots = factors.diagonal(0, -2, -1)
    found: Numbers
    if not bool(faults.any()) and _are_clear(pivots):
        found = pivots.argmin(-1)
    else:
        found = torch.as_tensor(_lightest_of_any(array_of(scaled), joint_names), device=tensor.device)
    return found


def _are_clear(pivots: Numbers) -> bool:
    return bool(pivots.min() ** 2 > CLEAR * epsilon_of(pivots))


def _lightest_of_any(scaled: NDArray[np.floating], joint_names: Sequence[str]) -> NDArray[np.intp]:
    """Return the joint (...,) that moves most with the least mass, for matrices that may not be positive.

    Raises ValueError for the first singular matrix.
    """
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


def _unit_of(joint: Numbers, like: Numbers) -> Numbers:
    """Return zeros (..., n), with a one at this joint (...,)."""
    if isinstance(like, np.ndarray):
        return np.asarray(joint[..., None] == np.arange(like.shape[-1]), like.dtype)
    torch, device = sys.modules["torch"], cast("Tensor", like).device
    counted = torch.arange(like.shape[-1], device=device)
    unit: Numbers = torch.asarray(joint[..., None] == counted, dtype=like.dtype)
    return unit


def can_move(motion: NDArray[np.floating], joint_names: Sequence[str], share: float = SHARE) -> str:
    """Return in words which joints move in a motion (n,) by more than this share of the largest move."""
    moving = moving_most(motion, joint_names, share)
    if len(moving) > 1:
        return f"the joints {listed(moving)} can move together"
    return f"the joint {listed(moving)} can move"


def moving_most(motion: NDArray[np.floating], names: Sequence[str], share: float) -> list[str]:
    """Return the names of those that move in a motion (n,) by more than this share of the largest move."""
    still = np.abs(motion)
    return [names[i] for i in np.flatnonzero(still > share * still.max()).tolist()]


def warn_of_vague(scaled: Numbers, mobility: Numbers, about: Told) -> None:
    """Warn where fewer than half of the digits of an answer are known.

    scaled: matrices with ones on their diagonals, (..., n, n); mobility: the largest (M_cc (M^-1)_cc) that
    was found for each, (...,)
    """
    epsilon = epsilon_of(scaled)
    vague = (epsilon**0.5 * mobility > 1.0) & (mobility < float("inf"))
    if not bool(vague.any()):
        return
    found, matrices = np.where(array_of(vague), array_of(mobility), 0.0), array_of(scaled)
    at = np.unravel_index(found.argmax(), found.shape)
    more = np.count_nonzero(found) - 1
    where = sample_of([int(k) for k in at]) + (f" and {more} others" if more else "")
    worst = np.broadcast_to(matrices, (*found.shape, *matrices.shape[-2:]))[at]
    warnings.warn(_vague(worst, where, about), RuntimeWarning, stacklevel=2)


def _vague(scaled: NDArray[np.floating], where: str, about: Told) -> str:
    _, values, motions = np.linalg.svd(scaled.astype(float))
    least, most, still = values[-1], values[0], motions[-1]
    kind, epsilon = kind_of(scaled), epsilon_of(scaled)
    wider = ", or compute in float64" if kind == np.float32 else ""
    if about.of_frame:
        along = f"along {listed(moving_most(still, about.names, 0.1))}"
        places = "an arm that is stretched out"
    else:
        along = f"{can_move(still, about.names, 0.1)} almost without moving any mass"
        places = "90 degrees of the middle one of three turns of a base, or write these in another order"
    return (
        f"{about.what}{where}: {along}. By its condition number of {most / least:.1e}, {kind} knows the "
        f"accelerations there to about {epsilon / least:.0e} of the largest{about.beside}; keep away from "
        f"there, as from {places}{wider}"
    )
