"""Positions in which ties close, and how all joints move there when the independent ones do."""

from collections.abc import Sequence
from typing import Any, NamedTuple

from ..rule.kinematics import taken
from .followers import (
    Followers,
    JointColumns,
    closable,
    dependent_shares,
    factored,
    followers,
    inverted,
    times,
)
from .singular_positions import check_closed, check_factors, check_following, closable_tolerance
from .tie_rows import RowsAt, TieRows


class RowNames(NamedTuple):
    """What errors name."""

    rows: Sequence[str]
    """Of each row, what it holds."""
    owners: Sequence[str]
    """Of each row, the tie, coupling or contact; rows of one stand beside each other."""
    joints: Sequence[str]


class TiesAt(NamedTuple):
    """Ties at positions, one or many, whether they close there or not."""

    q: Any
    """(..., n)"""
    made: RowsAt
    violation: Any
    """phi, (..., C)."""
    rows: Any
    """A, (..., C, n)."""
    factors: tuple[Any, Any]
    """Q and R of A_d."""
    inverse: Any = None
    """A_d^+, None before it is known to be one."""

    @property
    def closable(self) -> Any:
        """What of phi dependent joints could close."""
        return closable(self.factors, self.violation)


class ClosedPlace(NamedTuple):
    """How joints follow at positions, one or many."""

    q: Any
    """(..., n)"""
    found: Followers
    rows: RowsAt
    triangle: Any
    """R of A_d."""

    def velocity(self, yd: Any) -> Any:
        """G yd."""
        return times(self.found.map, yd)

    def bias(self, qd: Any) -> Any:
        """What all joints accelerate by through their velocities alone, -A_d^+ dA/dt qd."""
        return self._shares(self.rows.rates(qd) @ qd[..., None])[..., 0]

    def bias_by_cause(self, qd: Any) -> Any:
        """The same, joint s by joint s in the last axis."""
        return self._shares(self.rows.rates(qd) * qd[..., None, :])

    def map_rate(self, qd: Any) -> Any:
        """dG/dt = -A_d^+ dA/dt G on the dependent joints."""
        return self._shares(self.rows.rates(qd) @ self.found.map)

    def _shares(self, changes: Any) -> Any:
        return dependent_shares(self.found.columns, self.found.inverse, changes)

    def own(self, motion: Any) -> Any:
        """The independent joints' of (..., n)."""
        return taken(motion, self.found.columns.independent, -1)


def ties_at(ties: TieRows, columns: JointColumns, q: Any, held_at: Any = None) -> TiesAt:
    """Ties at q (..., n); contacts as they are, or from where they took hold."""
    made = ties.at(q, held_at)
    positions = made.positions()
    rows = positions[..., 1:]
    return TiesAt(q, made, positions[..., 0], rows, factored(rows, columns))


def followed(at: TiesAt, columns: JointColumns, names: RowNames) -> ClosedPlace:
    """How joints follow where ties close; raises ValueError where they do not stay closed."""
    inverse = inverted(at.factors) if at.inverse is None else at.inverse
    found = followers(at.rows, columns, inverse)
    check_following(at.rows, found, names.owners, names.joints)
    return ClosedPlace(at.q, found, at.made, at.factors[1])


def closed_place(
    ties: TieRows, columns: JointColumns, q: Any, tolerance: float | None, names: RowNames
) -> ClosedPlace:
    """How joints follow at q (..., n); raises ValueError where ties are open, or joints do not follow."""
    at = ties_at(ties, columns, q)
    check_closed(at.violation, tolerance, names.rows, names.owners)
    check_factors(at.rows, at.factors[1], columns, names.joints)
    if tolerance is None:  # what joints could close is held more strictly than what nothing closes
        check_closed(at.closable, closable_tolerance(q), names.rows, names.owners)
    return followed(at, columns, names)
