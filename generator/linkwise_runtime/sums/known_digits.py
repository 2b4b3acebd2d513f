"""How far rounding lets accelerations be known, and where and of which joints to say so.

A mass matrix with ones on its diagonal, of least eigenvalue l, answers with a relative error of about
epsilon / l. Of joint c, (M_cc (M^-1)_cc)^-1 is the part of its own inertia that is left when all others move
freely, at least l: C asks the same of its factors (elimination.h).
"""

import warnings
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..chosen_names import listed, sample_of

SHARE = 1e-3
"""Joints that move less than this part of the one that moves most in a motion without mass are left out."""


class Told(NamedTuple):
    """Whose accelerations are known by how many digits, in messages."""

    what: str
    names: Sequence[str]
    """Of joints or, of a frame, of rows."""
    of_frame: bool = False
    beside: str = ""
    """What is less known yet."""


def can_move(motion: NDArray[Any], joint_names: Sequence[str], share: float = SHARE) -> str:
    """Which joints move in a motion (n,) by this share of the one that moves most, in words."""
    moving = moving_most(motion, joint_names, share)
    if len(moving) > 1:
        return f"the joints {listed(moving)} can move together"
    return f"the joint {listed(moving)} can move"


def moving_most(motion: NDArray[Any], names: Sequence[str], share: float) -> list[str]:
    """The names of those that move in a motion (n,) by this share of the one that moves most."""
    still = np.abs(motion)
    return [names[i] for i in np.flatnonzero(still > share * still.max()).tolist()]


def warn_of_vague(scaled: Any, mobility: Any, about: Told) -> None:
    """Warn where fewer than half of the digits of an answer are known.

    scaled: matrices with ones on their diagonals, (..., n, n); mobility: the largest (M_cc (M^-1)_cc) that
    was found of each, (...,)
    """
    epsilon = epsilon_of(scaled)
    vague = (epsilon**0.5 * mobility > 1.0) & (mobility < float("inf"))
    if not bool(vague.any()):
        return
    found, matrices = np.where(as_array(vague), as_array(mobility), 0.0), as_array(scaled)
    at = np.unravel_index(found.argmax(), found.shape)
    more = np.count_nonzero(found) - 1
    where = sample_of([int(k) for k in at]) + (f" and {more} others" if more else "")
    worst = np.broadcast_to(matrices, (*found.shape, *matrices.shape[-2:]))[at]
    warnings.warn(_vague(worst, where, about), RuntimeWarning, stacklevel=2)


def _vague(scaled: NDArray[Any], where: str, about: Told) -> str:
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


def epsilon_of(values: Any) -> float:
    """The rounding of its dtype."""
    return float(np.finfo(kind_of(values)).eps)


def kind_of(values: Any) -> "np.dtype[Any]":
    """The dtype of floats, of an array or a tensor."""
    return np.dtype(np.float64 if values.dtype.itemsize == 8 else np.float32)


def as_array(values: Any) -> NDArray[Any]:
    """An array, or what a tensor holds."""
    return np.asarray(values.detach().cpu() if hasattr(values, "detach") else values)
