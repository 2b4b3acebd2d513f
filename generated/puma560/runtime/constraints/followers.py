"""How dependent joints d follow the independent ones y where A qd = 0, for matrices (..., C, n).

    A_d = Q R    G_d = -R^-1 Q^T A_y    lambda = Q R^-T tau_d

A_d is tall and of full column rank, so that rows that say the same twice need no case of their own:
A_d^+ = R^-1 Q^T is its pseudoinverse, and lambda the least that does tau_d = A_d^T lambda.
"""

from typing import Any, NamedTuple

import numpy as np

from ..rule.kinematics import taken
from ..sums.namespace import namespace


class JointColumns(NamedTuple):
    """Joints as tables of positions."""

    independent: Any
    dependent: Any
    order: Any
    """Where each joint stands in the independent ones followed by the dependent ones."""


class Followers(NamedTuple):
    """The answers at one position, or at many."""

    columns: JointColumns
    orthogonal: Any
    """Q, (..., C, d)."""
    triangle: Any
    """R, (..., d, d)."""
    map: Any
    """G, (..., n, m)."""


def joint_columns(independent: tuple[int, ...], n: int) -> JointColumns:
    """Positions in the order of all joints."""
    dependent = [k for k in range(n) if k not in independent]
    order = np.argsort([*independent, *dependent])
    return JointColumns(np.array(independent, dtype=np.intp), np.array(dependent, dtype=np.intp), order)


def factored(rows: Any, columns: JointColumns) -> tuple[Any, Any]:
    """Q and R of A_d."""
    q, r = namespace(rows).linalg.qr(taken(rows, columns.dependent, -1))
    return q, r


def followers(rows: Any, columns: JointColumns, factors: tuple[Any, Any]) -> Followers:
    """How joints follow."""
    xp, (q, r) = namespace(rows), factors
    moved = -_solved(r, _transposed(q) @ taken(rows, columns.independent, -1))
    m = len(columns.independent)
    # Zeros of the motion's own make a unit matrix of its kind, in which a gradient may run.
    unit = xp.zeros_like(moved[..., :1, :]) + xp.eye(m, dtype=rows.dtype, **_where(rows))
    return Followers(columns, q, r, taken(xp.concat([unit, moved], -2), columns.order, -2))


def dependent_shares(found: Followers, changes: Any) -> Any:
    """-A_d^+ of columns (..., C, X) on the dependent joints, zero on the independent ones, (..., n, X)."""
    xp = namespace(changes)
    moved = -_solved(found.triangle, _transposed(found.orthogonal) @ changes)
    still = xp.zeros_like(found.map[..., 0, :, None] * moved[..., :1, :])
    return taken(xp.concat([still, moved], -2), found.columns.order, -2)


def closable(factors: tuple[Any, Any], violation: Any) -> Any:
    """The part of phi (..., C) that dependent joints could close, Q Q^T phi."""
    return times(factors[0], times(_transposed(factors[0]), violation))


def borne(found: Followers, torque: Any) -> Any:
    """lambda (..., C, X) of torques (..., n, X) that dependent joints need."""
    own = taken(torque, found.columns.dependent, -2)
    return found.orthogonal @ _solved(_transposed(found.triangle), own, upper=False)


def projected(found: Followers, torque: Any) -> Any:
    """G^T of (..., n, X)."""
    return _transposed(found.map) @ torque


def times(matrix: Any, vector: Any) -> Any:
    """Matrices (..., a, b) times vectors (..., b)."""
    return (matrix @ vector[..., None])[..., 0]


def _solved(triangle: Any, right: Any, upper: bool = True) -> Any:
    xp = namespace(triangle)
    if xp is np:  # which has no solver of triangles; pivoting leaves R as it is
        return np.linalg.solve(triangle, right)
    return xp.linalg.solve_triangular(triangle, right, upper=upper)


def _transposed(matrix: Any) -> Any:
    return namespace(matrix).swapaxes(matrix, -1, -2)


def _where(like: Any) -> dict[str, Any]:
    return {} if isinstance(like, np.ndarray) else {"device": like.device}
