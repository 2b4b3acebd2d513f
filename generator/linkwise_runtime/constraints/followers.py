"""How dependent joints d follow the independent ones y where A qd = 0, for matrices (..., C, n).

    A_d = Q R    A_d^+ = R^-1 Q^T    G_d = -A_d^+ A_y    lambda = A_d^+T tau_d

A_d is tall and of full column rank, so that rows that say the same twice need no case of their own:
A_d^+ is its pseudoinverse, and lambda the least that does tau_d = A_d^T lambda.
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
    inverse: Any
    """A_d^+, (..., d, C)."""
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


def inverted(factors: tuple[Any, Any]) -> Any:
    """A_d^+ of a regular R."""
    orthogonal, triangle = factors
    xp, right = namespace(triangle), _transposed(orthogonal)
    if xp is np:  # which has no solver of triangles; pivoting leaves R as it is
        return np.linalg.solve(triangle, right)
    return xp.linalg.solve_triangular(triangle, right, upper=True)


def followers(rows: Any, columns: JointColumns, inverse: Any) -> Followers:
    """How joints follow."""
    xp = namespace(rows)
    moved = -inverse @ taken(rows, columns.independent, -1)
    m = len(columns.independent)
    # Zeros of the motion's own make a unit matrix of its kind, in which a gradient may run.
    unit = xp.zeros_like(moved[..., :1, :]) + xp.eye(m, dtype=rows.dtype, **_where(rows))
    return Followers(columns, inverse, taken(xp.concat([unit, moved], -2), columns.order, -2))


def dependent_shares(columns: JointColumns, inverse: Any, changes: Any) -> Any:
    """-A_d^+ of columns (..., C, X) on the dependent joints, zero on the independent ones, (..., n, X)."""
    xp, m = namespace(changes), len(columns.independent)
    moved = -inverse @ changes
    still = xp.zeros_like(moved[..., :1, :]) + xp.zeros((m, 1), dtype=moved.dtype, **_where(moved))
    return taken(xp.concat([still, moved], -2), columns.order, -2)


def closable(factors: tuple[Any, Any], violation: Any) -> Any:
    """The part of phi (..., C) that dependent joints could close, Q Q^T phi."""
    return times(factors[0], times(_transposed(factors[0]), violation))


def borne(found: Followers, torque: Any) -> Any:
    """lambda (..., C, X) of torques (..., n, X) that dependent joints need."""
    return _transposed(found.inverse) @ taken(torque, found.columns.dependent, -2)


def projected(found: Followers, torque: Any) -> Any:
    """G^T of (..., n, X)."""
    return _transposed(found.map) @ torque


def times(matrix: Any, vector: Any) -> Any:
    """Matrices (..., a, b) times vectors (..., b)."""
    return (matrix @ vector[..., None])[..., 0]


def _transposed(matrix: Any) -> Any:
    return namespace(matrix).swapaxes(matrix, -1, -2)


def _where(like: Any) -> dict[str, Any]:
    return {} if isinstance(like, np.ndarray) else {"device": like.device}
