"""Motion of the frame behind a joint: vectors of three components, numbers or tensors of all samples.

The number 0.0 stands for a component that is always zero, and products with it are left out: a planar arm
costs no more than its planar formulas do, and a missing shoulder offset costs nothing. Nothing here looks
into a tensor. These functions are called for every component of every vector, so their checks are few and
inline.
"""

from collections.abc import Sequence

import torch
from torch import Tensor

from .energy_interface import Number, Values

Vector = Sequence[Number] | Tensor
Triple = tuple[Number, Number, Number]
Signed = tuple[float, Number]
"""A sign, 1.0 or -1.0, and the number that it belongs to."""

GROUND = (0.0, 0.0, 0.0)
"""Velocity or angular velocity of the ground, on which everything stands."""


class JointCurve:
    """Piecewise polynomials in q - start, each valid from its start on; the first one before its start too.

    pieces: coefficients of powers 0, 1, 2, ... for rad or m
    """

    def __init__(self, starts: Sequence[float], pieces: Sequence[Sequence[float]]) -> None:
        size = max(2, *map(len, pieces))
        filled = torch.tensor(
            [(*piece, *[0.0] * (size - len(piece))) for piece in pieces], dtype=torch.float64
        )
        self._starts = torch.tensor(starts, dtype=torch.float64)
        self._pieces = torch.cat([self._starts[:, None], filled], 1)
        self._slopes = torch.cat([self._starts[:, None], (filled * torch.arange(size))[:, 1:]], 1)

    def __call__(self, q: Tensor) -> Tensor:
        """Return the joint's displacement at q."""
        return self._value(q, self._pieces)

    def slope(self, q: Tensor) -> Tensor:
        """Return the derivative of the displacement by q."""
        return self._value(q, self._slopes)

    def _value(self, q: Tensor, pieces: Tensor) -> Tensor:
        """Return the value at q of polynomials, given as rows: a start and the coefficients from there."""
        piece = (q.detach().unsqueeze(-1) >= self._starts[1:].to(q)).sum(-1)
        start, *coefficients = torch.nn.functional.embedding(piece, pieces.to(q)).unbind(-1)
        value = coefficients[-1]
        for coefficient in reversed(coefficients[:-1]):
            value = value * (q - start) + coefficient
        return value


class Axes:
    """The axes behind a joint at q = 0, as columns in the axes before it."""

    def __init__(self, *rows: tuple[float, float, float]) -> None:
        self._columns = list(zip(*rows, strict=True))
        entries = [[(entry, at) for at, entry in enumerate(column) if entry] for column in self._columns]
        along = [found[0] for found in entries if len(found) == 1 and abs(found[0][0]) == 1.0]
        self._picked = along if len(along) == 3 else None

    def turn(self, q: Values, k: int, ratio: float = 1.0, curve: JointCurve | None = None) -> "Turn":
        """Return Rᵀ of a joint that turns about its z axis by ratio · q[k], or by ratio · curve(q[k])."""
        return Turn(self, q, k, ratio, curve)

    def slide(self, a: Vector) -> Triple:
        """Return Rᵀ a of a prismatic joint: its axes are always those at q = 0."""
        x, y, z = (value if sign > 0.0 else _opposite(value) for sign, value in self.along(a))
        return x, y, z

    def along(self, a: Vector) -> Sequence[Signed]:
        """Return the components of a along these axes."""
        if self._picked:
            return [(sign, a[at]) for sign, at in self._picked]
        return [(1.0, _dot(column, a)) for column in self._columns]


class Turn:
    """The map Rᵀ of vectors, from the axes before a joint to those behind it: R = axes · Rz(ratio · q[k])."""

    def __init__(self, axes: Axes, q: Values, k: int, ratio: float, curve: JointCurve | None) -> None:
        self._axes, self._q, self._k, self._ratio, self._curve = axes, q, k, ratio, curve
        self._sine_and_cosine: tuple[Tensor, Tensor] | None = None

    def __call__(self, a: Vector) -> Triple:
        """Return the vector in the axes behind the joint."""
        (i, x), (k, y), (m, z) = self._axes.along(a)
        if m < 0.0:
            z = _opposite(z)
        if x.__class__ is float and y.__class__ is float and x == y == 0.0:
            return 0.0, 0.0, z
        s, c = self._sine_and_cosine or self._trigonometry()
        return _two(i, c, x, k, s, y), _two(k, c, y, -i, s, x), z

    def _trigonometry(self) -> tuple[Tensor, Tensor]:
        """Return sine and cosine of the angle, computed once, when first needed."""
        moved = self._curve(self._q[self._k]) if self._curve else self._q[self._k]
        angle = moved if self._ratio == 1.0 else self._ratio * moved
        self._sine_and_cosine = torch.sin(angle), torch.cos(angle)
        return self._sine_and_cosine


def along_z(a: Vector, more: Number) -> Triple:
    """Return a + z · more, z the axis of the joint."""
    x, y, z = a
    return x, y, more if z.__class__ is float and z == 0.0 else z + more


def velocity_at(place: Vector, w: Vector, v: Vector) -> Triple:
    """Return v + w × p in m/s, the velocity of point p of a body.

    The body turns by w in rad/s, and its origin moves by v in m/s.
    """
    x, y, z = place
    return (
        _less(_more(v[0], w[1], z), w[2], y),
        _less(_more(v[1], w[2], x), w[0], z),
        _less(_more(v[2], w[0], y), w[1], x),
    )


def potential_at(place: Vector, a: Vector, u: Number) -> Number:
    """Return u - a·p in m^2/s^2, the potential per mass at point p, with gravity a and u at the origin."""
    return _less(_less(_less(u, a[0], place[0]), a[1], place[1]), a[2], place[2])


def _dot(column: Sequence[float], a: Vector) -> Number:
    value: Number = 0.0
    for entry, component in zip(column, a, strict=True):
        value = _more(value, component, entry)
    return value


def _two(i: float, f: Tensor, x: Number, k: float, g: Tensor, y: Number) -> Number:
    """Return i f x + k g y with signs i and k."""
    if y.__class__ is float and y == 0.0:
        return f * x if i > 0.0 else -(f * x)
    if x.__class__ is float and x == 0.0:
        return g * y if k > 0.0 else -(g * y)
    if i > 0.0:
        return f * x + g * y if k > 0.0 else f * x - g * y
    return g * y - f * x if k > 0.0 else -(f * x + g * y)


def _more(value: Number, a: Number, b: Number) -> Number:
    """Return value + a b."""
    if (b.__class__ is float and b == 0.0) or (a.__class__ is float and a == 0.0):
        return value
    product = a if b.__class__ is float and b == 1.0 else a * b
    return product if value.__class__ is float and value == 0.0 else value + product


def _less(value: Number, a: Number, b: Number) -> Number:
    """Return value - a b."""
    if (b.__class__ is float and b == 0.0) or (a.__class__ is float and a == 0.0):
        return value
    if value.__class__ is float and value == 0.0:
        return a * -b
    return value - a * b


def _opposite(value: Number) -> Number:
    return value if value.__class__ is float and value == 0.0 else -value
