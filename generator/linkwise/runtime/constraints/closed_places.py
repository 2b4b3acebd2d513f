"""Positions in which ties close, and how all joints move there when the independent ones do."""

from collections.abc import Sequence
from typing import Any, NamedTuple

from ..rule.kinematics import taken
from .followers import Followers, JointColumns, closable, dependent_shares, factored, followers, times
from .singular_positions import check_closed, check_factors, check_following, closable_tolerance
from .tie_rows import RowsAt, TieRows


class RowNames(NamedTuple):
    """What errors name."""

    rows: Sequence[str]
    """Of each row, what it holds."""
    owners: Sequence[str]
    """Of each row, the tie, coupling or contact."""
    joints: Sequence[str]


class ClosedPlace(NamedTuple):
    """How joints follow at positions, one or many."""

    found: Followers
    rows: RowsAt

    def velocity(self, yd: Any) -> Any:
        """G yd."""
        return times(self.found.map, yd)

    def bias(self, qd: Any) -> Any:
        """What all joints accelerate by through their velocities alone, -A_d^+ dA/dt qd."""
        return dependent_shares(self.found, self.rows.rates(qd) @ qd[..., None])[..., 0]

    def bias_by_cause(self, qd: Any) -> Any:
        """The same, joint s by joint s in the last axis."""
        return dependent_shares(self.found, self.rows.rates(qd) * qd[..., None, :])

    def map_rate(self, qd: Any) -> Any:
        """dG/dt = -A_d^+ dA/dt G on the dependent joints."""
        return dependent_shares(self.found, self.rows.rates(qd) @ self.found.map)

    def own(self, motion: Any) -> Any:
        """The independent joints' of (..., n)."""
        return taken(motion, self.found.columns.independent, -1)


def closed_place(
    ties: TieRows, columns: JointColumns, q: Any, tolerance: float | None, names: RowNames
) -> ClosedPlace:
    """How joints follow at q (..., n); raises ValueError where ties are open, or joints do not follow."""
    rows_at = ties.at(q)
    positions = rows_at.positions()
    check_closed(positions[..., 0], tolerance, names.rows, names.owners)
    rows = positions[..., 1:]
    factors = factored(rows, columns)
    check_factors(rows, factors[1], columns, names.joints)
    if tolerance is None:  # what joints could close is held more strictly than what nothing closes
        left = closable(factors, positions[..., 0])
        check_closed(left, closable_tolerance(q), names.rows, names.owners)
    found = followers(rows, columns, factors)
    check_following(rows, found, names.owners, names.joints)
    return ClosedPlace(found, rows_at)
