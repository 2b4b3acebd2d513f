"""How a joint moves the frame behind it: vectors of three components, numbers or tensors of all samples.

What is the number 0.0 is always zero, and products with it are left out: a planar arm costs what a planar arm
costs, and so does a shoulder without offset. Nothing here looks into a tensor. These functions are called for
every component of every vector, so they ask little, and ask it in place.
"""

from collections.abc import Sequence

import torch
from torch import Tensor

from .energy_interface import Number, Values

Vector = Sequence[Number] | Tensor
Triple = tuple[Number, Number, Number]
Signed = tuple[float, Number]
"""A sign, 1.0 or -1.0, and what it stands before."""

GROUND = (0.0, 0.0, 0.0)
"""Velocity and angular velocity of what everything hangs on."""


class JointCurve:
    """Polynomials in q - start, each from its start on; the first one holds before its start too.

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
        """What the joint moves by."""
        return self._value(q, self._pieces)

    def slope(self, q: Tensor) -> Tensor:
        """How that changes with q."""
        return self._value(q, self._slopes)

    def _value(self, q: Tensor, pieces: Tensor) -> Tensor:
        """For rows of a start and the coefficients from there on."""
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
        """Rᵀ of a joint that turns by ratio · q[k], or that of its curve, about its z axis."""
        return Turn(self, q, k, ratio, curve)

    def slide(self, a: Vector) -> Triple:
        """Rᵀ a of a joint that slides: its axes are always those at q = 0."""
        x, y, z = (value if sign > 0.0 else _opposite(value) for sign, value in self.along(a))
        return x, y, z

    def along(self, a: Vector) -> Sequence[Signed]:
        """Components of a along these axes."""
        if self._picked:
            return [(sign, a[at]) for sign, at in self._picked]
        return [(1.0, _dot(column, a)) for column in self._columns]


class Turn:
    """Rᵀ a of vectors a: from the axes before a joint to those behind it, R = axes · Rz(ratio · q[k])."""

    def __init__(self, axes: Axes, q: Values, k: int, ratio: float, curve: JointCurve | None) -> None:
        self._axes, self._q, self._k, self._ratio, self._curve = axes, q, k, ratio, curve
        self._sine_and_cosine: tuple[Tensor, Tensor] | None = None

    def __call__(self, a: Vector) -> Triple:
        """The vector in the axes behind the joint."""
        (i, x), (k, y), (m, z) = self._axes.along(a)
        if m < 0.0:
            z = _opposite(z)
        if x.__class__ is float and y.__class__ is float and x == y == 0.0:
            return 0.0, 0.0, z
        s, c = self._sine_and_cosine or self._trigonometry()
        return _two(i, c, x, k, s, y), _two(k, c, y, -i, s, x), z

    def _trigonometry(self) -> tuple[Tensor, Tensor]:
        """Sine and cosine of the angle, once, where they are needed."""
        moved = self._curve(self._q[self._k]) if self._curve else self._q[self._k]
        angle = moved if self._ratio == 1.0 else self._ratio * moved
        self._sine_and_cosine = torch.sin(angle), torch.cos(angle)
        return self._sine_and_cosine


def along_z(a: Vector, more: Number) -> Triple:
    """a + z · more, z the axis of the joint."""
    x, y, z = a
    return x, y, more if z.__class__ is float and z == 0.0 else z + more


def velocity_at(place: Vector, w: Vector, v: Vector) -> Triple:
    """v + w × p in m/s: of the point p of a body that turns by w in rad/s, and whose origin moves by v."""
    x, y, z = place
    return (
        _less(_more(v[0], w[1], z), w[2], y),
        _less(_more(v[1], w[2], x), w[0], z),
        _less(_more(v[2], w[0], y), w[1], x),
    )


def potential_at(place: Vector, a: Vector, u: Number) -> Number:
    """u - a·p in m^2/s^2: potential per mass at the point p, with a gravity and u that of the origin."""
    return _less(_less(_less(u, a[0], place[0]), a[1], place[1]), a[2], place[2])


def _dot(column: Sequence[float], a: Vector) -> Number:
    value: Number = 0.0
    for entry, component in zip(column, a, strict=True):
        value = _more(value, component, entry)
    return value


def _two(i: float, f: Tensor, x: Number, k: float, g: Tensor, y: Number) -> Number:
    """i f x + k g y with signs i and k."""
    if y.__class__ is float and y == 0.0:
        return f * x if i > 0.0 else -(f * x)
    if x.__class__ is float and x == 0.0:
        return g * y if k > 0.0 else -(g * y)
    if i > 0.0:
        return f * x + g * y if k > 0.0 else f * x - g * y
    return g * y - f * x if k > 0.0 else -(f * x + g * y)


def _more(value: Number, a: Number, b: Number) -> Number:
    """value + a b."""
    if (b.__class__ is float and b == 0.0) or (a.__class__ is float and a == 0.0):
        return value
    product = a if b.__class__ is float and b == 1.0 else a * b
    return product if value.__class__ is float and value == 0.0 else value + product


def _less(value: Number, a: Number, b: Number) -> Number:
    """value - a b."""
    if (b.__class__ is float and b == 0.0) or (a.__class__ is float and a == 0.0):
        return value
    if value.__class__ is float and value == 0.0:
        return a * -b
    return value - a * b


def _opposite(value: Number) -> Number:
    return value if value.__class__ is float and value == 0.0 else -value
