"""Positions in which ties close, and how all joints move there when the independent ones do.

Dependent joints d follow the independent ones y where A qd = 0, for matrices (..., C, n):

    A_d = Q R    A_d^+ = R^-1 Q^T    G_d = -A_d^+ A_y    lambda = A_d^+T tau_d

A_d is tall and of full column rank, so that rows that say the same twice need no case of their own:
A_d^+ is its pseudoinverse, and lambda the least that does tau_d = A_d^T lambda. Rows are measured as
`row_sizes` has them.
"""

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple, cast

import numpy as np

from ..answers.namespace import array_of, hidden, namespace
from ..chosen_names import plain, sample_of
from ..interface import Numbers
from ..rule.kinematics import taken
from .closing_search import OPEN
from .independent_joints import JointColumns, check_factors, check_following, row_sizes
from .tie_rows import RowsAt, TieRows

if TYPE_CHECKING:
    from torch import Tensor  # type: ignore[import-not-found, unused-ignore]


class Followers(NamedTuple):
    """The answers at one position, or at many."""

    columns: JointColumns
    inverse: Numbers
    """A_d^+, (..., d, C)."""
    map: Numbers
    """G, (..., n, m)."""


class RowNames(NamedTuple):
    """What errors name."""

    rows: Sequence[str]
    """Of each row, what it holds."""
    owners: Sequence[str]
    """Of each row, the tie, coupling or contact; rows of one stand beside each other."""
    joints: Sequence[str]


class TiesAt(NamedTuple):
    """Ties at positions, one or many, whether they close there or not; rows are measured by their sizes."""

    q: Numbers
    """(..., n)"""
    made: RowsAt
    sizes: Numbers | None
    """What rows are measured by, (..., C); None without couplings."""
    violation: Numbers
    """phi, (..., C)."""
    rows: Numbers
    """A, (..., C, n)."""
    factors: tuple[Numbers, Numbers]
    """Q and R of A_d."""
    inverse: Numbers | None = None
    """A_d^+, None before it is known to be one."""

    @property
    def closable(self) -> Numbers:
        """What of phi dependent joints could close."""
        return closable(self.factors, self.violation)


class ClosedPlace(NamedTuple):
    """How joints follow at positions, one or many."""

    q: Numbers
    """(..., n)"""
    found: Followers
    made: RowsAt
    rows: Numbers
    """A, measured, (..., C, n)."""
    triangle: Numbers
    """R of its A_d."""

    def velocity(self, yd: Numbers) -> Numbers:
        """G yd."""
        return times(self.found.map, yd)

    def bias(self, qd: Numbers) -> Numbers:
        """What all joints accelerate by through their velocities alone, -A_d^+ dA/dt qd."""
        return self._shares(self.made.rates(qd) @ qd[..., None])[..., 0]

    def bias_by_cause(self, qd: Numbers) -> Numbers:
        """The same, joint s by joint s in the last axis."""
        return self._shares(self.made.rates(qd) * qd[..., None, :])

    def map_rate(self, qd: Numbers) -> Numbers:
        """dG/dt = -A_d^+ dA/dt G on the dependent joints."""
        return self._shares(self.made.rates(qd) @ self.found.map)

    def _shares(self, changes: Numbers) -> Numbers:
        return dependent_shares(self.found.columns, self.found.inverse, changes)

    def own(self, motion: Numbers) -> Numbers:
        """The independent joints' of (..., n)."""
        return taken(motion, self.found.columns.independent, -1)


def ties_at(ties: TieRows, columns: JointColumns, q: Numbers, held_at: Numbers | None = None) -> TiesAt:
    """Ties at q (..., n); contacts as they are, or from where they took hold."""
    made = ties.at(q, held_at)
    positions = made.positions()
    sizes = None
    if ties.couplings:
        sizes = row_sizes(positions[..., 1:], ties.couplings)
        positions = positions / sizes[..., None]
    rows = positions[..., 1:]
    return TiesAt(q, made, sizes, positions[..., 0], rows, factored(rows, columns))


def followed(at: TiesAt, columns: JointColumns, names: RowNames) -> ClosedPlace:
    """How joints follow where ties close; raises ValueError where they do not stay closed."""
    inverse = inverted(at.factors) if at.inverse is None else at.inverse
    mapped = velocity_map(at.rows, columns, inverse)
    check_following(at.rows, columns, mapped, names.owners, names.joints)
    if at.sizes is not None:  # of rows as they are, whose rates and forces it answers to
        inverse = inverse / at.sizes[..., None, :]
    return ClosedPlace(at.q, Followers(columns, inverse, mapped), at.made, at.rows, at.factors[1])


def closed_place(
    ties: TieRows, columns: JointColumns, q: Numbers, tolerance: float | None, names: RowNames
) -> ClosedPlace:
    """How joints follow at q (..., n); raises ValueError where ties are open, or joints do not follow."""
    at = ties_at(ties, columns, q)
    check_closed(at.violation, tolerance, names.rows, names.owners)
    check_factors(at.rows, at.factors[1], columns, names.joints)
    if tolerance is None:  # what joints could close is held more strictly than what nothing closes
        check_closed(at.closable, closable_tolerance(q), names.rows, names.owners)
    return followed(at, columns, names)


def factored(rows: Numbers, columns: JointColumns) -> tuple[Numbers, Numbers]:
    """Q and R of A_d."""
    q, r = namespace(rows).linalg.qr(taken(rows, columns.dependent, -1))
    return q, r


def inverted(factors: tuple[Numbers, Numbers]) -> Numbers:
    """A_d^+ of a regular R."""
    orthogonal, triangle = factors
    linalg, right = namespace(triangle).linalg, orthogonal.mT
    found: Numbers
    if isinstance(triangle, np.ndarray):  # NumPy has no solver of triangles; pivoting leaves R as it is
        found = linalg.solve(triangle, right)
    else:
        found = linalg.solve_triangular(triangle, right, upper=True)
    return found


def velocity_map(rows: Numbers, columns: JointColumns, inverse: Numbers) -> Numbers:
    """G, (..., n, m)."""
    xp = namespace(rows)
    moved = -inverse @ taken(rows, columns.independent, -1)
    m = len(columns.independent)
    # Zeros of the motion's own make a unit matrix of its kind, in which a gradient may run.
    unit = xp.zeros_like(moved[..., :1, :]) + xp.eye(m, **_kind(rows))
    return taken(xp.concat([unit, moved], -2), columns.order, -2)


def dependent_shares(columns: JointColumns, inverse: Numbers, changes: Numbers) -> Numbers:
    """-A_d^+ of columns (..., C, X) on the dependent joints, zero on the independent ones, (..., n, X)."""
    xp, m = namespace(changes), len(columns.independent)
    moved = -inverse @ changes
    still = xp.zeros_like(moved[..., :1, :]) + xp.zeros((m, 1), **_kind(moved))
    return taken(xp.concat([still, moved], -2), columns.order, -2)


def closable(factors: tuple[Numbers, Numbers], violation: Numbers) -> Numbers:
    """The part of phi (..., C) that dependent joints could close, Q Q^T phi."""
    return times(factors[0], times(factors[0].mT, violation))


def borne(found: Followers, torque: Numbers) -> Numbers:
    """lambda (..., C, X) of torques (..., n, X) that dependent joints need."""
    return found.inverse.mT @ taken(torque, found.columns.dependent, -2)


def projected(found: Followers, torque: Numbers) -> Numbers:
    """G^T of (..., n, X)."""
    return found.map.mT @ torque


def times(matrix: Numbers, vector: Numbers) -> Numbers:
    """Matrices (..., a, b) times vectors (..., b)."""
    return (matrix @ vector[..., None])[..., 0]


def _kind(like: Numbers) -> dict[str, object]:
    """Where and of which kind numbers are made to go with others."""
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
    """How far joints may be from where they would close ties, in m and rad."""
    return 1e-6 if like.dtype.itemsize == 8 else 1e-4


def worst_open(violation: Numbers, tolerance: float | None) -> tuple[list[int], int, float] | None:
    """The first sample where a row of phi (..., C) is open, which one most, by how much; None for none."""
    if hidden(violation):
        return None
    size = np.abs(array_of(violation))
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
