"""Which joints may be independent: rank and pivoting of A at one position, on NumPy arrays.

Rows are comparable, as `closing_search` has them: not each by its own largest entry, for a row that a planar
loop leaves at zero holds nothing but rounding. Columns are compared by what is left of them across those
taken before.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..rule.joint_tree import JointTree

RANK = 1e-5
"""Singular values below this part of the largest, or of 1, are zero; what is left of columns likewise.

A file's right angle of 1.5708 tilts by 4e-6 what is meant to be parallel.
"""
LEAST = 3
"""Coordinates of a body that floats, in a plane or in space: a slide that turns, too, has bearings."""
ABLE = 0.05
"""Columns smaller than this part of the largest are not preferred to it, whatever joints they are of."""
SHARE = 1e-3
"""Rows that have less than this part in a sum of rows that is zero are not among those that it ties."""


def rank_of(rows: NDArray[np.float64], tolerance: float = RANK) -> int:
    """Rank of A (C, n)."""
    values = np.linalg.svd(rows, compute_uv=False)
    return int((values > tolerance * max(1.0, values.max(initial=0.0))).sum())


def chosen_independent(
    rows: NDArray[np.float64],
    rather_dependent: Sequence[int] = (),
    preference: Sequence[Any] | None = None,
    tolerance: float = RANK,
) -> tuple[int, ...]:
    """Coordinates that are left when columns of A (C, n) are taken by pivoting, as of dependent ones.

    rather_dependent: those that are taken before any other, as far as they can be, since nothing drives them
    preference: of each coordinate, what compares; of columns that are not small beside the largest that of
    the greatest is taken, unless given the largest
    """
    left, rank = rows.copy(), rank_of(rows, tolerance)
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
    """Whose rows of A (C, n) follow from others, so that forces on them are not unique; each once, in order.

    Rows of nothing but rounding count where their owner has no others: it holds nothing that could move. A
    planar loop's pin has such across its plane, where no force is asked for.
    """
    least = RANK * max(1.0, np.linalg.svd(rows, compute_uv=False).max(initial=0.0))
    rows = rows.copy()
    for owner in set(owners):  # along and across what moves, however the robot stands in the world
        own = [at for at, name in enumerate(owners) if name == owner]
        rows[own] = np.linalg.svd(rows[own])[0].T @ rows[own]
    there = np.abs(rows).max(-1, initial=0.0) > least
    u, values, _ = np.linalg.svd(rows[there])
    shared = np.abs(u[:, int((values > least).sum()) :]).max(-1, initial=0.0) > SHARE
    moving = [owner for owner, moves in zip(owners, there, strict=True) if moves]
    found = {owner for owner, is_so in zip(moving, shared, strict=True) if is_so} | set(owners) - set(moving)
    return tuple(owner for owner in dict.fromkeys(owners) if owner in found)


def loose_base(tree: JointTree) -> tuple[int, ...]:
    """Coordinates of bodies that float: that slide and turn in one place, and hang on nothing else.

    Nobody drives these. Where a slide is says nothing, so that only what turns must be in one place.
    """
    carried = {link.joint for link in tree.links}
    roots = [f for f, joint in enumerate(tree.joints) if joint.parent is None]
    return tuple(k for root in roots for k in _floating(tree, root, carried))


def _floating(tree: JointTree, root: int, carried: set[int]) -> tuple[int, ...]:
    """Coordinates on the way from a root to the first link, if they slide and turn; else none."""
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
