"""Positions in which ties close, and the motion there of all joints with the independent ones.

Dependent joints d follow the independent ones y where A qd = 0, for matrices (..., C, n):

    A_d = Q R    A_d^+ = R^-1 Q^T    G_d = -A_d^+ A_y    lambda = A_d^+T tau_d

A_d is tall and of full column rank, so that redundant rows need no case of their own: A_d^+ is its
pseudoinverse, and lambda the smallest solution of tau_d = A_d^T lambda. Rows are scaled as `row_sizes` says.
"""

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple, cast

import numpy as np

from ..chosen_names import plain, sample_of
from ..interface import Numbers, array_of, epsilon_of, is_traced, namespace
from .chosen_constraints import OPEN
from .independent_joints import JointColumns, check_factors, check_following, row_sizes
from .rows import ConstraintRows, RowsThere

if TYPE_CHECKING:
    from torch import Tensor  # type: ignore[import-not-found, unused-ignore]


class DependentMap(NamedTuple):
    """Map from the independent joints to all joints, at one position or at many."""

    columns: JointColumns
    inverse: Numbers
    """A_d^+, (..., d, C)."""
    map: Numbers
    """G, (..., n, m)."""
    bearing: Numbers
    """A_d^+, (..., d, C), or with weights of forces the one of which these are the least."""


class RowNames(NamedTuple):
    """Names that error messages use."""

    rows: Sequence[str]
    """Name of each row, which says what it holds."""
    owners: Sequence[str]
    """Name of the tie, coupling or contact that each row belongs to; rows of one are adjacent."""
    joints: Sequence[str]


class TiesAt(NamedTuple):
    """Ties at one position or many, whether they close there or not; rows are divided by their sizes."""

    q: Numbers
    """Positions of all joints, (..., n)."""
    made: RowsThere
    sizes: Numbers | None
    """Sizes that rows are divided by, (..., C); None without couplings."""
    violation: Numbers
    """Violation phi of the rows, (..., C)."""
    rows: Numbers
    """A, (..., C, n)."""
    factors: tuple[Numbers, Numbers]
    """Factors Q and R of A_d."""
    inverse: Numbers | None = None
    """A_d^+; None before A_d is known to have full rank."""
    unit_rows: bool = False
    """See `ConstraintRows`."""

    @property
    def closable(self) -> Numbers:
        """Part of phi that dependent joints could close, (..., C)."""
        return closable(self.factors, self.violation)


class ClosedPlace(NamedTuple):
    """Closed positions, one or many, and how joints follow there."""

    q: Numbers
    """Positions of all joints, (..., n)."""
    found: DependentMap
    made: RowsThere
    rows: Numbers
    """A, with its rows divided by their sizes, (..., C, n)."""
    factors: tuple[Numbers, Numbers]
    """Factors Q and R of A_d, from these rows."""
    unit_rows: bool
    """See `ConstraintRows`."""

    def velocity(self, yd: Numbers) -> Numbers:
        """Return the velocities G yd of all joints, (..., n)."""
        return times(self.found.map, yd)

    def bias(self, qd: Numbers) -> Numbers:
        """Return the accelerations of all joints by velocities alone, -A_d^+ dA/dt qd, (..., n)."""
        return self._shares(self.made.rates(qd) @ qd[..., None])[..., 0]

    def bias_by_cause(self, qd: Numbers) -> Numbers:
        """Return `bias` by cause, (..., n, n): the last axis is the joint s whose velocity causes it."""
        return self._shares(self.made.rates(qd) * qd[..., None, :])

    def map_rate(self, qd: Numbers) -> Numbers:
        """Return dG/dt (..., n, m), -A_d^+ dA/dt G on the dependent joints."""
        return self._shares(self.made.rates(qd) @ self.found.map)

    def _shares(self, changes: Numbers) -> Numbers:
        return dependent_shares(self.found.columns, self.found.inverse, changes)

    def own(self, motion: Numbers) -> Numbers:
        """Return the independent joints' entries (..., m) of motion (..., n)."""
        return self.found.columns.own(motion)


def ties_at(
    ties: ConstraintRows, columns: JointColumns, q: Numbers, held_at: Numbers | None = None
) -> TiesAt:
    """Return the ties at q (..., n), with contacts as they are there, or from where they took hold."""
    made = ties.at(q, held_at)
    positions = made.positions()
    sizes = None
    if ties.couplings:
        sizes = row_sizes(positions[..., 1:], ties.couplings, ties.unit_rows)
        positions = positions / sizes[..., None]
    rows = positions[..., 1:]
    factors = factor_dependent(rows, columns)
    return TiesAt(q, made, sizes, positions[..., 0], rows, factors, unit_rows=ties.unit_rows)


def checked_place(
    at: TiesAt, columns: JointColumns, names: RowNames, shares: Numbers | None = None
) -> ClosedPlace:
    """Return how joints follow where ties close; raises ValueError where they do not stay closed.

    shares: W^(-1/2) (C,), where redundant rows bear the least lambda^T W lambda: forces are then those of
    (W^(-1/2) A_d)^+ W^(-1/2)
    """
    inverse = pseudoinverse(at.factors) if at.inverse is None else at.inverse
    mapped = velocity_map(at.rows, columns, inverse)
    check_following(at.rows, columns, mapped, names.owners, names.joints)
    bearing = inverse
    if shares is not None:
        bearing = pseudoinverse(factor_dependent(at.rows * shares[..., None], columns)) * shares
    if at.sizes is not None:  # rates and forces are those of rows that are not scaled
        inverse, bearing = inverse / at.sizes[..., None, :], bearing / at.sizes[..., None, :]
    found = DependentMap(columns, inverse, mapped, bearing)
    return ClosedPlace(at.q, found, at.made, at.rows, at.factors, at.unit_rows)


def closed_place(
    ties: ConstraintRows,
    columns: JointColumns,
    q: Numbers,
    tolerance: float | None,
    names: RowNames,
    shares: Numbers | None = None,
) -> ClosedPlace:
    """Return how joints follow at q (..., n); raises ValueError where ties are open or joints do not."""
    at = ties_at(ties, columns, q)
    check_closed(at.violation, tolerance, names.rows, names.owners)
    check_factors(at.rows, at.factors[1], columns, names.joints, at.unit_rows)
    if tolerance is None:  # stricter for what joints could close than for what nothing can
        check_closed(at.closable, closable_tolerance(q), names.rows, names.owners)
    return checked_place(at, columns, names, shares)


def factor_dependent(rows: Numbers, columns: JointColumns) -> tuple[Numbers, Numbers]:
    """Return the factors Q and R of A_d, from rows A (..., C, n)."""
    q, r = namespace(rows).linalg.qr(columns.others(rows))
    return q, r


def pseudoinverse(factors: tuple[Numbers, Numbers]) -> Numbers:
    """Return A_d^+ (..., d, C) from the factors of A_d, of which R is regular."""
    orthogonal, triangle = factors
    linalg, right = namespace(triangle).linalg, orthogonal.mT
    found: Numbers
    if isinstance(triangle, np.ndarray):  # NumPy has no triangular solver; pivoting leaves R as it is
        found = linalg.solve(triangle, right)
    else:
        found = linalg.solve_triangular(triangle, right, upper=True)
    return found


def velocity_map(rows: Numbers, columns: JointColumns, inverse: Numbers) -> Numbers:
    """Return the velocity map G (..., n, m), with zeros for joints that ties hold where they are.

    Of such a joint only rounding is left, |G_ia| <= 4 n eps |A_d^+ row i| |A_y column a|, whose sign would be
    that of its Coulomb friction. Zeros are made by what has no gradient: the joint may begin to move.
    """
    xp = namespace(rows)
    own = columns.own(rows)
    moved = -inverse @ own
    m = columns.independent.shape[-1]
    reach = (inverse * inverse).sum(-1)[..., None] * (own * own).sum(-2)[..., None, :]
    rounding = 4.0 * rows.shape[-1] * epsilon_of(rows)
    held = (moved * moved <= rounding**2 * reach).all(-1)[..., None]
    left = moved if isinstance(moved, np.ndarray) else cast("Tensor", moved).detach()
    moved = moved - xp.where(held, left, xp.zeros_like(left))
    # Zeros made from the motion give a unit matrix of its kind, through which gradients can flow.
    unit = xp.zeros_like(moved[..., :1, :]) + xp.eye(m, **_kind(rows))
    return columns.ordered(xp.concat([unit, moved], -2), -2)


def dependent_shares(columns: JointColumns, inverse: Numbers, changes: Numbers) -> Numbers:
    """Return -A_d^+ times columns (..., C, X) on dependent joints, zero on independent ones, (..., n, X)."""
    xp, m = namespace(changes), columns.independent.shape[-1]
    moved = -inverse @ changes
    still = xp.zeros_like(moved[..., :1, :]) + xp.zeros((m, 1), **_kind(moved))
    return columns.ordered(xp.concat([still, moved], -2), -2)


def closable(factors: tuple[Numbers, Numbers], violation: Numbers) -> Numbers:
    """Return the part of phi (..., C) that dependent joints could close, Q Q^T phi."""
    return times(factors[0], times(factors[0].mT, violation))


def tie_forces(found: DependentMap, torque: Numbers) -> Numbers:
    """Return lambda (..., C, X) for torques (..., n, X), of which those of dependent joints count."""
    return found.bearing.mT @ found.columns.others(torque, -2)


def independent_torque(found: DependentMap, torque: Numbers) -> Numbers:
    """Return G^T times torques (..., n, X), (..., m, X)."""
    return found.map.mT @ torque


def times(matrix: Numbers, vector: Numbers) -> Numbers:
    """Return matrices (..., a, b) times vectors (..., b)."""
    return (matrix @ vector[..., None])[..., 0]


def _kind(like: Numbers) -> dict[str, object]:
    """Return the dtype, and the device of a tensor, that new numbers need to go with others."""
    if isinstance(like, np.ndarray):
        return {"dtype": like.dtype}
    tensor = cast("Tensor", like)
    return {"dtype": tensor.dtype, "device": tensor.device}


def check_closed(
    violation: Numbers, tolerance: float | None, rows: Sequence[str], names: Sequence[str]
) -> None:
    """Raise ValueError for the first sample where a row of phi (..., C) is open beyond the tolerance."""
    found = worst_open(violation, tolerance)
    if found is not None:
        place, row, size = found
        raise ValueError(
            f"{plain(names[row])} is open by {open_by(size, rows[row])}{sample_of(place)}; give positions "
            "in which ties close, as closed(q) answers"
        )


def closable_tolerance(like: Numbers) -> float:
    """Return how far joints may be from where they would close ties, in m and rad."""
    return 1e-6 if like.dtype.itemsize == 8 else 1e-4


def worst_open(violation: Numbers, tolerance: float | None) -> tuple[list[int], int, float] | None:
    """Return the first sample where phi (..., C) is open, its most open row, and by how much; or None."""
    if is_traced(violation):
        return None
    size = np.abs(array_of(violation))
    allowed = OPEN if tolerance is None else tolerance
    if not (size > allowed).any():
        return None
    place = np.argwhere((size > allowed).any(-1))[0].tolist()
    row = int(size[tuple(place)].argmax())
    return place, row, float(size[tuple(place)][row])


def open_by(size: float, row: str) -> str:
    """Return how far a row is open, in words with its unit."""
    if " force" in row:
        return f"{1e3 * size:.3g} mm"
    return f"{size:.3g} rad" if " moment" in row else f"{size:.3g} of its sum, in rad and m"
