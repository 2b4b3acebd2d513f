"""Positions in which ties close: Newton's method on the dependent joints.

    q_d <- q_d - A_d^+ phi

The last step is one from the closed position, so that a gradient through it is that of what is implied:
dq_d = -A_d^+ A_y dq_y.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np

from ..chosen_names import plain
from ..rule.kinematics import taken
from ..sums.namespace import hidden, namespace
from .closed_places import RowNames
from .followers import JointColumns, closable, dependent_shares, factored, followers
from .singular_positions import check_factors, closable_tolerance, open_by, sample_of, worst_open
from .tie_rows import TieRows

STEPS = 50
LONGEST = 0.5
"""Of a step, in m and rad; loops that are far from closing are not thrown further."""


def closed(
    ties: TieRows,
    columns: JointColumns,
    q: Any,
    held_at: Any,
    tolerance: float | None,
    names: RowNames,
) -> Any:
    """q (..., n) with its dependent joints moved.

    held_at: where contacts took hold, q unless given; names: what errors name
    Raises ValueError for the first sample that is singular, or stays open beyond the tolerance.
    """
    start = q if held_at is None else held_at
    if isinstance(q, np.ndarray):
        found = _found(ties, columns, q, start, names.joints)
    else:
        with namespace(q).no_grad():
            found = _found(ties, columns, q, start, names.joints)
        found = _with_independent_of(q, found.detach(), columns)
        found = found + _step(ties, columns, found, start, names.joints)
    violation = ties.violation(found, start)
    _check(violation, tolerance, names)
    if tolerance is None:
        factors = factored(ties.at(found).positions()[..., 1:], columns)
        _check(closable(factors, violation), closable_tolerance(q), names)
    return found


def _found(ties: TieRows, columns: JointColumns, q: Any, start: Any, joint_names: Sequence[str]) -> Any:
    precise = 1e-8 if q.dtype.itemsize == 8 else 1e-4  # of a step; what is left is about its square
    for _ in range(STEPS):
        step = _step(ties, columns, q, start, joint_names)
        size = (step * step).sum(-1)[..., None] ** 0.5
        q = q + step * (LONGEST / namespace(q).where(size > LONGEST, size, 0.0 * size + LONGEST))
        if not hidden(q) and not bool((size > precise).any()):
            break
    return q


def _step(ties: TieRows, columns: JointColumns, q: Any, start: Any, joint_names: Sequence[str]) -> Any:
    rows = ties.at(q).positions()[..., 1:]
    factors = factored(rows, columns)
    check_factors(rows, factors[1], columns, joint_names)
    shares = dependent_shares(followers(rows, columns, factors), ties.violation(q, start)[..., None])
    return shares[..., 0]


def _with_independent_of(q: Any, found: Any, columns: JointColumns) -> Any:
    """Positions found, through whose independent joints a gradient of q runs."""
    own, others = taken(q, columns.independent, -1), taken(found, columns.dependent, -1)
    return taken(namespace(q).concat([own, others], -1), columns.order, -1)


def _check(violation: Any, tolerance: float | None, names: RowNames) -> None:
    found = worst_open(violation, tolerance)
    if found is not None:
        place, row, size = found
        raise ValueError(
            f"{plain(names.owners[row])} does not close{sample_of(place)}: from here the dependent joints "
            f"leave {open_by(size, names.rows[row])}; start them elsewhere, if it can close at all"
        )
