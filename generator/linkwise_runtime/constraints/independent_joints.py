"""Choice of independent joints, and positions where the others do not follow: rank and pivoting of A.

Rows are comparable, as `TieEquations` makes them. They are not divided by their own largest entry each, for
a row that a planar loop leaves at zero holds nothing but rounding. Columns are compared by what is left of
them normal to those taken before.
"""

import sys
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, NamedTuple, cast

import numpy as np
from numpy.typing import NDArray

from ..answers.inertia_solve import SHARE
from ..chosen_names import listed, plain, sample_of
from ..interface import Numbers, array_of, epsilon_of, is_traced, namespace
from ..rule.joint_tree import JointTree
from ..rule.kinematics import gather

if TYPE_CHECKING:
    from torch import Tensor  # type: ignore[import-not-found, unused-ignore]

RANK = 1e-5
"""Singular values below this part of the largest, or of 1, count as zero; so does what is left of columns.

A right angle of 1.5708 in a file tilts by 4e-6 what is meant to be parallel.
"""
LEAST = 3
"""Least number of coordinates of a floating body, in a plane or in space: a slide that turns has bearings."""
ABLE = 0.05
"""Columns smaller than this part of the largest are not preferred to it, whichever joints they belong to."""
TIED = 1e-3
"""Least share of a row in a sum of rows that is zero, to count as one of the rows that the sum relates."""
AGREE = 1e-4
"""Largest relative difference of redundant rows from the rows that they follow from: files round numbers."""


class JointColumns(NamedTuple):
    """Joints as tables of indices: one table for all samples, or one for each, (..., m), on a way."""

    independent: Numbers
    dependent: Numbers
    order: Numbers
    """Position of each joint in the list of the independent joints followed by the dependent ones."""

    def own(self, a: Numbers, axis: int = -1) -> Numbers:
        """Return the independent joints' entries of an axis of `a`, -1 or -2."""
        return _taken(a, self.independent, axis)

    def others(self, a: Numbers, axis: int = -1) -> Numbers:
        """Return the dependent joints' entries."""
        return _taken(a, self.dependent, axis)

    def ordered(self, a: Numbers, axis: int = -1) -> Numbers:
        """Return entries of independent joints followed by dependent ones, in the order of all joints."""
        return _taken(a, self.order, axis)

    def names(self, joints: Sequence[str]) -> tuple[str, ...]:
        """Return the names of the independent joints, "x or y" where samples differ, of those of all."""
        index = array_of(self.independent)
        each = np.unique(index.reshape(-1, index.shape[-1]), axis=0).T.astype(int).tolist()
        return tuple(" or ".join(joints[k] for k in dict.fromkeys(row)) for row in each)

    def of(self, sample: Sequence[int]) -> "JointColumns":
        """Return the table of one sample."""
        shared = len(self.order.shape) == 1
        return self if shared else JointColumns(*(array_of(a)[tuple(sample)] for a in self))


def _taken(a: Numbers, index: Numbers, axis: int) -> Numbers:
    if len(index.shape) == 1:
        return gather(a, index, axis)
    own: Any = index
    if len(a.shape) > len(index.shape):
        own = own[..., None, :] if axis == -1 else own[..., None]
    found: Numbers
    if isinstance(a, np.ndarray):
        found = np.take_along_axis(a, own, axis)
    else:
        found = sys.modules["torch"].take_along_dim(a, own, axis)
    return found


def joint_columns(independent: tuple[int, ...], n: int) -> JointColumns:
    """Return the indices of the independent and dependent joints, each in the order of all joints."""
    dependent = [k for k in range(n) if k not in independent]
    order = np.argsort([*independent, *dependent])
    return JointColumns(np.array(independent, dtype=np.intp), np.array(dependent, dtype=np.intp), order)


def row_sizes(rows: Numbers, couplings: int, unit_rows: bool = False) -> Numbers:
    """Return the sizes (..., C) that rows of A (..., C, n) are divided by; couplings have the last rows.

    The size of a coupling is its largest slope where that is above 1, and for `unit_rows` in any case: its
    unit is its author's choice, and divided by this size, its violation counts in rad and m of its joints.
    Other rows have size 1. No gradient flows through the sizes.
    """
    own: Numbers = rows if isinstance(rows, np.ndarray) else cast("Tensor", rows).detach()
    xp, first = namespace(rows), rows.shape[-2] - couplings
    slopes = xp.amax(abs(own[..., first:, :]), -1)
    ones = xp.ones_like(own[..., 0])
    most = xp.where(slopes > (0.0 if unit_rows else 1.0), slopes, ones[..., first:])
    return xp.concat([ones[..., :first], most], -1)


def rank_of(rows: NDArray[np.float64], tolerance: float = RANK) -> int:
    """Return the rank of A (C, n)."""
    values = np.linalg.svd(rows, compute_uv=False)
    return int((values > tolerance * max(1.0, values.max(initial=0.0))).sum())


def chosen_independent(
    rows: NDArray[np.float64],
    rather_dependent: Sequence[int] = (),
    preference: Sequence[tuple[float, ...]] | None = None,
    tolerance: float = RANK,
    rank: int | None = None,
) -> tuple[int, ...]:
    """Return the coordinates left when pivoting takes columns of A (C, n) as those of dependent joints.

    rather_dependent: coordinates that are taken before any other, as far as possible, since nothing drives
    them
    preference: key of each coordinate; of the columns that are not small beside the largest, the one with the
    greatest key is taken; unless given, the largest column is
    rank: number of dependent coordinates; that of A unless given
    """
    left, rank = rows.copy(), rank_of(rows, tolerance) if rank is None else rank
    least = tolerance * np.linalg.norm(left, axis=0).max(initial=1.0)
    rest = [k for k in range(rows.shape[1]) if k not in rather_dependent]
    taken: list[int] = []
    for group in (list(rather_dependent), rest):
        open_ones = list(group)
        while open_ones and len(taken) < rank:
            sizes = np.linalg.norm(left[:, open_ones], axis=0)
            if group is not rest and not sizes.max() > least:
                break
            pivot = open_ones[int(sizes.argmax())]
            if preference is not None:
                able = [k for k, size in zip(open_ones, sizes, strict=True) if size >= ABLE * sizes.max()]
                pivot = max(able, key=lambda k: (preference[k], k))
            open_ones.remove(pivot)
            taken.append(pivot)
            axis = left[:, pivot] / np.linalg.norm(left[:, pivot])
            for _ in range(2):  # once more for what rounding leaves
                left -= np.outer(axis, axis @ left)
    return tuple(k for k in range(rows.shape[1]) if k not in taken)


def redundant_names(rows: NDArray[np.float64], owners: Sequence[str]) -> tuple[str, ...]:
    """Return the owners of rows of A (C, n) that follow from other rows, each once, in order.

    The forces on such rows are not unique. Rows of nothing but rounding count where their owner has no other
    rows: it holds nothing that could move. The pin of a planar loop has such rows across its plane, where no
    force is asked for.
    """
    least = RANK * max(1.0, np.linalg.svd(rows, compute_uv=False).max(initial=0.0))
    rows = rows.copy()
    for owner in set(owners):  # along and across the motion, however the robot stands in the world
        own = [at for at, name in enumerate(owners) if name == owner]
        rows[own] = np.linalg.svd(rows[own])[0].T @ rows[own]
    there = np.abs(rows).max(-1, initial=0.0) > least
    u, values, _ = np.linalg.svd(rows[there])
    shared = np.abs(u[:, int((values > least).sum()) :]).max(-1, initial=0.0) > TIED
    moving = [owner for owner, moves in zip(owners, there, strict=True) if moves]
    found = {owner for owner, is_so in zip(moving, shared, strict=True) if is_so} | set(owners) - set(moving)
    return tuple(owner for owner in dict.fromkeys(owners) if owner in found)


def loose_base(tree: JointTree) -> tuple[int, ...]:
    """Return the coordinates of floating bodies: those that slide and turn in one place, on nothing else.

    Nothing drives these coordinates. The place of a slide does not matter, so only the turns must be in one
    place.
    """
    carried = {link.joint for link in tree.links}
    roots = [f for f, joint in enumerate(tree.joints) if joint.parent is None]
    return tuple(k for root in roots for k in _floating(tree, root, carried))


def _floating(tree: JointTree, root: int, carried: set[int]) -> tuple[int, ...]:
    """Return the coordinates from a root to the first link, if they slide and turn; else none."""
    run = [root]
    while run[-1] not in carried:
        children = [f for f, joint in enumerate(tree.joints) if joint.parent == run[-1]]
        turned = any(tree.joints[f].kind == "revolute" for f in run)
        if len(children) != 1 or (turned and any(tree.joints[children[0]].translation)):
            break
        run.append(children[0])
    kinds = {tree.joints[f].kind for f in run}
    coordinates = tuple(dict.fromkeys(tree.joints[f].coordinate for f in run))
    return coordinates if len(kinds) > 1 and len(coordinates) >= LEAST else ()


def check_factors(
    rows: Numbers,
    triangle: Numbers,
    columns: JointColumns,
    joint_names: Sequence[str],
    unit_rows: bool = False,
) -> None:
    """Raise ValueError for the first sample where A_d, whose factor R is given, loses its rank."""
    place = lost_at(triangle, unit_rows)
    if place is not None:
        own, columns = array_of(rows)[tuple(place)].astype(float), columns.of(place)
        raise ValueError(why_not_following(own, columns, _epsilon(rows), joint_names, sample_of(place)))


def least_left(triangle: Numbers, unit_rows: bool = False) -> NDArray[np.floating]:
    """Return the least part of a column of R left normal to those before it, (...,): |R_ff| by its length.

    unit_rows: rows of A have a largest slope of 1, and |R_ff| itself says how well a joint follows
    """
    r = array_of(triangle)
    if unit_rows:
        return np.asarray(np.abs(r.diagonal(0, -2, -1)).min(-1))
    sizes = np.sqrt((r * r).sum(-2))
    least: NDArray[np.floating] = (np.abs(r.diagonal(0, -2, -1)) / np.where(sizes > 0.0, sizes, 1.0)).min(-1)
    return least


def lost_at(triangle: Numbers, unit_rows: bool = False) -> list[int] | None:
    """Return the first sample where R has lost its rank, or None."""
    if is_traced(triangle):
        return None
    lost = least_left(triangle, unit_rows) <= _epsilon(triangle)
    if not lost.any():
        return None
    place: list[int] = np.argwhere(lost)[0].tolist()
    return place


def why_not_following(
    rows: NDArray[np.float64], columns: JointColumns, epsilon: float, joint_names: Sequence[str], where: str
) -> str:
    """Return why A_d of one sample leaves joints free: less than the part `epsilon` of a column is left."""
    dependent = columns.dependent.tolist()
    told = left_free(rows, columns, joint_names, where)
    if rank_of(rows, epsilon) < len(dependent):
        return (
            f"the position is singular: {told}, for the constraints take fewer freedoms there than elsewhere"
        )
    # Joints that follow now stay dependent, as far as they can.
    others = [joint_names[k] for k in chosen_independent(rows, dependent, tolerance=epsilon)]
    return (
        f"the independent joints do not tell the others: {told}; there, choose "
        f"robot.constrained(independent={others})"
    )


def left_free(rows: Numbers, columns: JointColumns, joint_names: Sequence[str], where: str) -> str:
    """Return in words which dependent joints A_d of one sample leaves free."""
    dependent, independent = columns.dependent.tolist(), columns.independent.tolist()
    still = np.abs(np.linalg.svd(array_of(rows).astype(float)[:, dependent])[2][-1])
    moving = [joint_names[dependent[f]] for f in np.flatnonzero(still > SHARE * still.max())]
    held = listed([joint_names[k] for k in independent])
    stand = "stands" if len(independent) == 1 else "stand"
    return f"{listed(moving)} can move{where} while {held} {stand} still"


def check_following(
    rows: Numbers, columns: JointColumns, mapped: Numbers, names: Sequence[str], joint_names: Sequence[str]
) -> None:
    """Raise ValueError for the first sample where redundant rows contradict those they follow from: A G != 0.

    Rows are compared with the largest of their tie: in a loop that a joint carries as a whole, or that is
    open within the tolerance, some rows are nothing but what is left of differences.
    """
    if rows.shape[-2] == columns.dependent.shape[-1] or is_traced(rows):
        return
    a, g = array_of(rows), array_of(mapped)
    starts = [at for at, name in enumerate(names) if not at or name != names[at - 1]]
    largest = np.maximum.reduceat(np.abs(a).max(-1), starts, -1)
    sizes = largest.repeat(np.diff([*starts, len(names)]), -1)
    scale = sizes[..., None] * np.abs(g).max(-2, keepdims=True)
    wrong = np.abs(a @ g) > (AGREE if rows.dtype.itemsize == 8 else 10.0 * AGREE) * scale
    if not wrong.any():
        return
    *place, row, joint = np.argwhere(wrong)[0].tolist()
    mover = joint_names[columns.of(place).independent.tolist()[joint]]
    raise ValueError(
        f"{plain(names[row])} does not stay closed{sample_of(place)} when {mover} moves and the others "
        "follow: the loop is over-constrained, and what holds it twice does not agree"
    )


def _epsilon(like: Numbers) -> float:
    """Return the part of a column at or below which only rounding is left of it."""
    return float(epsilon_of(like) ** (2.0 / 3.0))
