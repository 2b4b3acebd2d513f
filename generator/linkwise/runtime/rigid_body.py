"""Kinetic energy of a rigid body, in few operations on tensors."""

from collections.abc import Sequence
from typing import Any

import torch
from torch import Tensor

Number = Any
"""A number, or a tensor of one value or of one a sample."""
Vector = Sequence[Number]


def kinetic_energy(w: Vector, v: Vector, *, mass: Number, com: Vector, inertia: Sequence[Vector]) -> Any:
    """m v·v/2 + m v·(w × c) + w·I w/2 in J, with I = inertia + m (c·c 1 - c cᵀ) about the frame's origin.

    w, v: angular velocity in rad/s and velocity of the frame's origin in m/s, tensors of one shape; those
    components that are always zero are numbers
    mass in kg, com = c in m, inertia about it in kg m², in the axes of w and v
    """
    twist = (*w, *v)
    moving = [a for a, value in enumerate(twist) if torch.is_tensor(value)]
    if not twist[moving[0]].dim():
        return _written_out(w, v, mass, com, inertia)
    speeds = torch.stack([twist[a] for a in moving])
    whole = _spatial_inertia(mass, com, inertia)
    momentum = _product([[whole[a][b] for b in moving] for a in moving], speeds)
    return 0.5 * (speeds * momentum).sum(0)


def _written_out(w: Vector, v: Vector, m: Number, c: Vector, inertia: Sequence[Vector]) -> Any:
    """m u·u/2 + w·inertia w/2 with u = v + w × c, of single numbers.

    Whoever looks at what is recorded of one sample sees products and sums of numbers, and those with zeros
    left out.
    """
    u = [
        _dot((1.0, c[2], -c[1]), (v[0], w[1], w[2])),
        _dot((1.0, c[0], -c[2]), (v[1], w[2], w[0])),
        _dot((1.0, c[1], -c[0]), (v[2], w[0], w[1])),
    ]
    return 0.5 * _dot((m, 1.0), (_dot(u, u), _dot(w, [_dot(row, w) for row in inertia])))


def _dot(a: Vector, b: Vector) -> Number:
    """a·b without the products with the number 0."""
    pairs = ((x, y) for x, y in zip(a, b, strict=True) if not (_is(x, 0.0) or _is(y, 0.0)))
    products = [y if _is(x, 1.0) else x * y for x, y in pairs]
    return sum(products[1:], products[0]) if products else 0.0


def _is(value: Number, number: float) -> bool:
    return not torch.is_tensor(value) and value == number


def _spatial_inertia(m: Number, c: Vector, inertia: Sequence[Vector]) -> list[list[Number]]:
    """Return H with K = (w, v)·H (w, v)/2: the blocks I, m [c]×, its transpose and m 1."""
    x, y, z = c
    cross = ((0.0, -m * z, m * y), (m * z, 0.0, -m * x), (-m * y, m * x, 0.0))
    squares = (y * y + z * z, x * x + z * z, x * x + y * y)
    rows = []
    for i in range(3):
        about = [inertia[i][k] + m * (squares[i] if i == k else -c[i] * c[k]) for k in range(3)]
        rows.append([*about, *cross[i]])
    rows += [[*(cross[k][i] for k in range(3)), *(m if i == k else 0.0 for k in range(3))] for i in range(3)]
    return rows


def _product(matrix: list[list[Number]], vector: Tensor) -> Tensor:
    """Matrix times vector (m, ...); its entries are numbers or tensors that broadcast to the shape (...)."""
    size, entries = len(matrix), [entry for row in matrix for entry in row]
    if not any(map(torch.is_tensor, entries)):
        table = torch.tensor(matrix, dtype=vector.dtype, device=vector.device)
    else:
        given = [torch.as_tensor(e, dtype=vector.dtype, device=vector.device) for e in entries]
        table = torch.stack(torch.broadcast_tensors(*given))  # type: ignore[no-untyped-call]
        table = table.reshape(size, size, *table.shape[1:])
    if table.dim() == 2:
        return (table @ vector.reshape(size, -1)).reshape(vector.shape)
    ones = [1] * (vector.dim() + 1 - table.dim())
    return (table.reshape(size, size, *ones, *table.shape[2:]) * vector).sum(1)
