"""What is refused in one line: open ties, positions where joints do not follow, ties in each other's way."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..chosen_names import listed, plain, sample_of
from ..sums.known_digits import SHARE
from ..sums.namespace import hidden
from .followers import Followers, JointColumns
from .independent_joints import chosen_independent, rank_of

OPEN = 1e-4
"""In m, rad and units of couplings, what may be left open that nothing closes: files round their numbers."""
AGREE = 1e-4
"""Rows that follow from others may differ from these by this part of their size: files round numbers."""


def check_factors(rows: Any, triangle: Any, columns: JointColumns, joint_names: Sequence[str]) -> None:
    """Raise ValueError for the first sample where A_d, of which R is given, loses its rank."""
    place = lost_at(triangle)
    if place is not None:
        own = _array(rows)[tuple(place)].astype(float)
        raise ValueError(why_not_following(own, columns, _epsilon(rows), joint_names, sample_of(place)))


def least_left(triangle: Any) -> NDArray[Any]:
    """Of R the least part of a column that is left across those before it, (...,): |R_ff| by its length."""
    r = _array(triangle)
    sizes = np.sqrt((r * r).sum(-2))
    least: NDArray[Any] = (np.abs(r.diagonal(0, -2, -1)) / np.where(sizes > 0.0, sizes, 1.0)).min(-1)
    return least


def lost_at(triangle: Any) -> list[int] | None:
    """The first sample where R has lost its rank."""
    if hidden(triangle):
        return None
    lost = least_left(triangle) <= _epsilon(triangle)
    if not lost.any():
        return None
    place: list[int] = np.argwhere(lost)[0].tolist()
    return place


def why_not_following(
    rows: NDArray[np.float64], columns: JointColumns, epsilon: float, joint_names: Sequence[str], where: str
) -> str:
    """Why A_d of one sample leaves joints free, of whose columns less than the part `epsilon` is left."""
    dependent = columns.dependent.tolist()
    told = left_free(rows, columns, joint_names, where)
    if rank_of(rows, epsilon) < len(dependent):
        return (
            f"the position is singular: {told}, for the constraints take fewer freedoms there than elsewhere"
        )
    # Those that follow now go on to do so, as far as they can.
    others = [joint_names[k] for k in chosen_independent(rows, dependent, tolerance=epsilon)]
    return (
        f"the independent joints do not tell the others: {told}; there, choose "
        f"robot.constrained(independent={others})"
    )


def left_free(rows: Any, columns: JointColumns, joint_names: Sequence[str], where: str) -> str:
    """Which dependent joints A_d of one sample leaves free, in words."""
    dependent, independent = columns.dependent.tolist(), columns.independent.tolist()
    still = np.abs(np.linalg.svd(_array(rows).astype(float)[:, dependent])[2][-1])
    moving = [joint_names[dependent[f]] for f in np.flatnonzero(still > SHARE * still.max())]
    held = listed([joint_names[k] for k in independent])
    stand = "stands" if len(independent) == 1 else "stand"
    return f"{listed(moving)} can move{where} while {held} {stand} still"


def check_following(rows: Any, found: Followers, names: Sequence[str], joint_names: Sequence[str]) -> None:
    """Raise ValueError for the first sample where rows that follow from others do not agree: A G != 0.

    Rows are measured by the largest of their tie's: of a loop that a joint carries as a whole, or that is
    open within the tolerance, some are nothing but what is left of differences.
    """
    if rows.shape[-2] == len(found.columns.dependent) or hidden(rows):
        return
    a, g = _array(rows), _array(found.map)
    starts = [at for at, name in enumerate(names) if not at or name != names[at - 1]]
    largest = np.maximum.reduceat(np.abs(a).max(-1), starts, -1)
    sizes = largest.repeat(np.diff([*starts, len(names)]), -1)
    scale = sizes[..., None] * np.abs(g).max(-2, keepdims=True)
    wrong = np.abs(a @ g) > (AGREE if rows.dtype.itemsize == 8 else 10.0 * AGREE) * scale
    if not wrong.any():
        return
    *place, row, joint = np.argwhere(wrong)[0].tolist()
    mover = joint_names[found.columns.independent[joint]]
    raise ValueError(
        f"{plain(names[row])} does not stay closed{sample_of(place)} when {mover} moves and the others "
        "follow: the loop is over-constrained, and what holds it twice does not agree"
    )


def check_closed(violation: Any, tolerance: float | None, rows: Sequence[str], names: Sequence[str]) -> None:
    """Raise ValueError for the first sample where a row of phi (..., C) is open beyond the tolerance."""
    found = worst_open(violation, tolerance)
    if found is not None:
        place, row, size = found
        raise ValueError(
            f"{plain(names[row])} is open by {open_by(size, rows[row])}{sample_of(place)}; give positions "
            "in which ties close, as closed(q) answers"
        )


def closable_tolerance(like: Any) -> float:
    """How far joints may be from where they would close ties, in m and rad."""
    return 1e-6 if like.dtype.itemsize == 8 else 1e-4


def worst_open(violation: Any, tolerance: float | None) -> tuple[list[int], int, float] | None:
    """The first sample where a row of phi (..., C) is open, which one most, by how much; None for none."""
    if hidden(violation):
        return None
    size = np.abs(_array(violation))
    allowed = OPEN if tolerance is None else tolerance
    if not (size > allowed).any():
        return None
    place = np.argwhere((size > allowed).any(-1))[0].tolist()
    row = int(size[tuple(place)].argmax())
    return place, row, float(size[tuple(place)][row])


def open_by(size: float, row: str) -> str:
    """How much a row is open, in its unit."""
    if " force" in row:
        return f"{1e3 * size:.3g} mm"
    return f"{size:.3g} rad" if " moment" in row else f"{size:.3g} of its sum, in rad and m"


def _epsilon(like: Any) -> float:
    """What is left of a column, as part of it, where nothing is left but rounding."""
    kind: Any = np.float64 if like.dtype.itemsize == 8 else np.float32
    epsilon: float = float(np.finfo(kind).eps) ** (2.0 / 3.0)
    return epsilon


def _array(values: Any) -> NDArray[Any]:
    array: NDArray[Any] = values if isinstance(values, np.ndarray) else values.detach().cpu().numpy()
    return array
