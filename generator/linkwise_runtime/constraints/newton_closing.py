"""Search for closed positions by Newton's method on the dependent joints.

    q_d <- q_d - A_d^+ phi

The last step starts at the closed position, so that a gradient through it is that of the implicit function:
dq_d = dq_d - A_d^+ dphi, which is -A_d^+ A_y dq_y where all constraints are of positions.

With the independent joints alone, the others are led from a position where ties are closed: steps along G go
straight to the wanted independent joints, all samples at once, and are halved where others would leap. So
ties that can close in several ways keep the way of the start.
"""

import sys
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, cast

import numpy as np

from ..chosen_names import listed, plain, sample_of
from ..interface import Numbers, is_traced, namespace
from .closed_places import (
    ClosedPlace,
    RowNames,
    TiesAt,
    closable_tolerance,
    dependent_shares,
    open_by,
    pseudoinverse,
    ties_at,
    worst_open,
)
from .independent_joints import JointColumns, check_factors, left_free, lost_at
from .rows import ConstraintRows

if TYPE_CHECKING:
    from torch import Tensor  # type: ignore[import-not-found, unused-ignore]

STEPS = 50
LONGEST = 0.5
"""Longest step, in m and rad: loops that are far from closing are not thrown further."""
NEAR = 0.1
"""Largest distance from a joint's guess, in rad and m: farther away, ties may close in another way."""
SHORTEST = 1e-6
"""Smallest part of the way; no step is halved below it."""


class DoesNotClose(ValueError):
    """Error for ties that stay open: why, and what to do about it."""

    def __init__(self, reason: str, remedy: str) -> None:
        super().__init__(f"{reason}; {remedy}")
        self.reason, self._remedy = reason, remedy

    def __reduce__(self) -> tuple[type["DoesNotClose"], tuple[str, str]]:
        """Return the parts that pickle needs to pass the error between processes."""
        return DoesNotClose, (self.reason, self._remedy)


def closed(
    ties: ConstraintRows,
    columns: JointColumns,
    q: Numbers,
    held_at: Numbers,
    tolerance: float | None,
    names: RowNames,
) -> TiesAt:
    """Return the ties at q (..., n) with its dependent joints moved until they close.

    held_at: positions in which contacts took hold, (..., n); names: names for error messages
    Raises ValueError for the first sample that is singular, or stays open beyond the tolerance.
    """
    if isinstance(q, np.ndarray):
        at = _found(ties, columns, q, held_at, tolerance, names)
    else:
        torch = sys.modules["torch"]
        with torch.no_grad():
            at = _found(ties, columns, q, held_at, tolerance, names)
        if torch.is_grad_enabled():
            # The value of what was found, and the slope of q: where a constraint is of velocities, positions
            # of all joints are states.
            found = q + cast("Tensor", at.q - q).detach()
            at = ties_at(ties, columns, found, held_at)
            step = dependent_shares(columns, pseudoinverse(at.factors), at.violation[..., None])[..., 0]
            at = ties_at(ties, columns, found + step, held_at)
    _check(at.violation, tolerance, columns, names)
    if tolerance is None:
        _check(at.closable, closable_tolerance(q), columns, names)
    return at


def _found(
    ties: ConstraintRows,
    columns: JointColumns,
    q: Numbers,
    held_at: Numbers,
    tolerance: float | None,
    names: RowNames,
) -> TiesAt:
    double = q.dtype.itemsize == 8
    near = 1e-8 if double else 1e-4  # of a step; what is left is about its square
    if ties.unit_rows and columns.dependent.shape[-1] < ties.couplings:
        near = 0.0  # a row of velocities that repeats one of positions halves its steps
    least = 1e-12 if double else 1e-6  # of a step that changes no row by more than rounding does
    at, is_near, is_seen = ties_at(ties, columns, q, held_at), False, not is_traced(q)
    for count in range(STEPS):
        _check_step(at, columns, tolerance, names, not count)
        inverse = pseudoinverse(at.factors)
        at = at._replace(inverse=inverse)
        step = dependent_shares(columns, inverse, at.violation[..., None])[..., 0]
        size = (step * step).sum(-1)[..., None] ** 0.5
        if is_near or (is_seen and not bool((size > least).any())):
            return at._replace(q=at.q + step)
        is_near = is_seen and not bool((size > near).any())
        longest = namespace(q).where(size > LONGEST, size, 0.0 * size + LONGEST)
        at = ties_at(ties, columns, at.q + step * (LONGEST / longest), held_at)
    return at


def _check_step(
    at: TiesAt, columns: JointColumns, tolerance: float | None, names: RowNames, is_start: bool
) -> None:
    """Raise ValueError where A_d has lost its rank; open ties are named, for q is not where they close."""
    place = lost_at(at.factors[1], at.unit_rows)
    if place is None:
        return
    found = worst_open(at.violation[tuple(place)], tolerance)
    if found is None:
        check_factors(at.rows, at.factors[1], columns, names.joints, at.unit_rows)
        return
    tie, where = plain(names.owners[found[1]]), sample_of(place)
    columns = columns.of(place)
    free = left_free(at.rows[tuple(place)], columns, names.joints, " there")
    if is_start:
        raise DoesNotClose(
            f"{tie} cannot be closed{where}, for the start is singular: {free}, and no step of theirs closes "
            "it",
            f"start them off it, by 0.1 say, to the side on which it shall close, or {_led(columns)}",
        )
    raise DoesNotClose(
        f"{tie} does not close{where}: on the way the dependent joints come to a singular position, {free}",
        f"start them elsewhere, or {_led(columns)}, if it can close at all",
    )


def _led(columns: JointColumns) -> str:
    """Return the advice that needs no guess: to give the independent joints alone."""
    own = columns.independent.tolist()
    return f"give closed(q[..., {own}]) the independent joints alone"


def with_independent(q: Numbers, own: Numbers, columns: JointColumns) -> Numbers:
    """Return q (..., n) with its independent joints at `own` (..., m); gradients flow through both."""
    return columns.ordered(namespace(q).concat([own, columns.others(q)], -1))


def _check(violation: Numbers, tolerance: float | None, columns: JointColumns, names: RowNames) -> None:
    found = worst_open(violation, tolerance)
    if found is not None:
        place, row, size = found
        columns = columns.of(place)
        raise DoesNotClose(
            f"{plain(names.owners[row])} does not close{sample_of(place)}: from here the dependent joints "
            f"leave {open_by(size, names.rows[row])}",
            f"start them elsewhere, or {_led(columns)}, if it can close at all",
        )


def led(
    place_of: Callable[[Numbers], ClosedPlace],
    start: Numbers,
    wanted: Numbers,
    columns: JointColumns,
    names: Sequence[str],
) -> Numbers:
    """Return closed positions (..., n), led from `start` (..., n) to independent joints at `wanted` (..., m).

    place_of: function that returns the closed place near a position; names: names of all joints
    Raises ValueError where the others cannot be led there.
    """
    at = place_of(start)
    first, done, step = at.own(at.q), 0.0, 1.0
    while done < 1.0:
        step = min(step, 1.0 - done)
        own = first + (done + step) * (wanted - first)
        guess = with_independent(at.q + at.velocity(own - at.own(at.q)), own, columns)
        try:
            found, told = place_of(guess), "they would have to leap"
        except ValueError as error:
            found, told = None, error.reason if isinstance(error, DoesNotClose) else str(error)
        # Written so, positions that are NaN, as in gaps of a batch, do not stop the other samples.
        if found is not None and not bool((abs(found.q - guess) > NEAR).any()):
            at, done, step = found, done + step, 2.0 * step
            continue
        step /= 2.0
        if step < SHORTEST:
            raise _not_led(done, told, columns, names)
    return at.q


def _not_led(done: float, told: str, columns: JointColumns, names: Sequence[str]) -> DoesNotClose:
    own = listed([names[k] for k in columns.independent.tolist()])
    return DoesNotClose(
        f"the joints that follow {own} cannot be led there, but {100.0 * done:.3g} % of the straight way "
        f"from a closed position ({told})",
        "give closed(q) all joints, those that follow near where ties close, if they do",
    )
