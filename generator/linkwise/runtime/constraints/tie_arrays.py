"""How far ties, couplings and contacts are from closing, their Jacobian A and its rate, samples innermost.

Of a pair of frames, with S_f = (z, s) the screws of the joints and m = 1 where a joint moves a frame,

    J = ((m1 - m2) z, (m1 - m2) s + z x X)    X = m1 x1 - m2 x2

is how it turns and shifts, J_first - J_second at once. A row is w . J of its pair: w is an axis of the
world, one of the first frame, whose rate is omega x w, or u = d / |d|, from the second frame to the first.
"""

from typing import Any, NamedTuple

from ..kinematics.frame_arrays import (
    Carried,
    by_coordinate,
    carried,
    moving,
    of_frames,
    point_at,
    point_velocity,
    turned,
)
from ..rule.kinematics import around, cross, joint_screws, taken
from ..rule.tree_arrays import TreeArrays
from .tie_tables import TieTables

TINY = 1e-12
"""Below it cos(t/2)^2 is that of a frame upside down, whose axis of turning is not known."""


class Ends(NamedTuple):
    """Frames of the pairs where they are."""

    carried: Carried
    axes: Any
    """(3, 3, frames, samples)"""
    places: Any
    """Of the points, (3, frames, samples)."""


def ends(xp: Any, tables: TieTables, numbers: TreeArrays, q: Any) -> Ends | None:
    """Where frames are at q (n, samples); None without ties and contacts."""
    if tables.frames is None:
        return None
    found = carried(xp, tables.frames, numbers, numbers.offsets, q, from_world=True)
    return Ends(found, found.axes, point_at(found, tables.points))


def violation(xp: Any, tables: TieTables, q: Any, at: Ends | None, held: Ends | None) -> Any:
    """phi, (C, samples); held: where contacts took hold, where they are unless given."""
    parts = []
    if at is not None:
        first = at.axes[:, :, : tables.pairs]
        second = _seconds(xp, tables, at.axes, held and held.axes)
        shift = at.places[:, : tables.pairs] - _seconds(xp, tables, at.places, held and held.places)
        weights = _weights(xp, tables, at, shift)
        both = xp.concat([_turn(xp, tables, first, second), shift], 0)
        along = (weights * taken(both, tables.row_pairs)).sum(0)
        parts.append(along * tables.placed - taken(tables.apart, tables.row_pairs))
    if tables.polynomials:
        parts.append(_polynomial(tables.polynomials[0], q).sum(1))
    return xp.concat(parts, 0)


def tie_jacobian(xp: Any, tables: TieTables, q: Any, at: Ends | None) -> Any:
    """A, (C, n, samples)."""
    parts = []
    if at is not None:
        shift = at.places[:, : tables.pairs] - _seconds(xp, tables, at.places)
        weights, moves = _weights(xp, tables, at, shift), _moves(xp, tables, at)
        parts.append((weights[:, :, None] * taken(moves, tables.row_pairs, -3)).sum(0))
    if tables.polynomials:
        parts.append(_polynomial(tables.polynomials[1], q))
    return xp.concat(parts, 0)


def tie_jacobian_rate(
    xp: Any, tables: TieTables, numbers: TreeArrays, q: Any, qd: Any, at: Ends | None
) -> Any:
    """dA/dt, (C, n, samples)."""
    parts = []
    if at is not None:
        assert tables.frames is not None  # where frames are, they have tables
        moved = moving(xp, tables.frames, numbers, at.carried, qd, from_world=True)
        twist = of_frames(tables.frames, moved.twists)
        speeds = point_velocity(xp, twist, at.places)
        shift, slip = (a[:, : tables.pairs] - _seconds(xp, tables, a) for a in (at.places, speeds))
        weights = _weights(xp, tables, at, shift)
        rates = _weight_rates(xp, tables, weights, twist[:, 0, : tables.pairs], shift, slip)
        changes = _move_rates(xp, tables, at, moved.screws[:, 0], moved.rates, speeds)
        total = weights[:, :, None] * taken(changes, tables.row_pairs, -3)
        if rates is not None:
            total = total + rates[:, :, None] * taken(_moves(xp, tables, at), tables.row_pairs, -3)
        parts.append(total.sum(0))
    if tables.polynomials:
        parts.append(_polynomial(tables.polynomials[2], q) * qd)
    return xp.concat(parts, 0)


def _seconds(xp: Any, tables: TieTables, a: Any, held: Any = None) -> Any:
    """What the second frames of the pairs have, (..., P, samples): that of a contact is its own, held."""
    own = a[..., tables.pairs :, :]
    if tables.ties == tables.pairs:
        return own
    kept = (a if held is None else held)[..., tables.ties : tables.pairs, :]
    return xp.concat([own, kept], -2)


def _turn(xp: Any, tables: TieTables, first: Any, second: Any) -> Any:
    """2 sin(t/2) times the axis about which, by t, the first frames are turned from the second ones.

    Of all axes a, or of z alone: v = sin t times it is half the sum of a2 x a1, or z2 x z1.
    """
    products = cross(around(xp, second), around(xp, first))
    cosines = (second * first).sum(0)
    z, c = products[:, 2], cosines[2]
    every = tables.all_axes
    turn = every * 0.5 * products.sum(1) + (1.0 - every) * z
    cosine = every * 0.5 * (cosines.sum(0) - 1.0) + (1.0 - every) * c
    half = 0.5 * (1.0 + cosine)  # cos(t/2)^2
    return turn / xp.where(half > TINY, half, xp.zeros_like(half) + TINY) ** 0.5


def _weights(xp: Any, tables: TieTables, at: Ends, shift: Any) -> Any:
    """w, (6, C, samples)."""
    turns, shifts = tables.fixed[:3], tables.fixed[3:]
    if tables.turning is not None:
        turns = turns + turned(taken(at.axes, tables.row_pairs), tables.turning)
    if tables.along is not None:
        shifts = shifts + tables.along[0] * taken(shift / _size(tables, shift), tables.row_pairs)
    samples = max(turns.shape[-1], shifts.shape[-1])
    shape = 3, len(tables.placed), samples
    return xp.concat([xp.broadcast_to(turns, shape), xp.broadcast_to(shifts, shape)], 0)


def _weight_rates(xp: Any, tables: TieTables, weights: Any, spin: Any, shift: Any, slip: Any) -> Any:
    """dw/dt; None where they stay as they are."""
    if tables.turning is None and tables.along is None:
        return None
    turns, shifts = 0.0 * weights[:3], 0.0 * weights[3:]
    if tables.turning is not None:
        turning = weights[:3] - tables.fixed[:3]
        turns = cross(taken(spin, tables.row_pairs), around(xp, turning))
    if tables.along is not None:
        # u = d / |d|: its rate is what of the rate of d stands across it, by |d|
        size = _size(tables, shift)
        u = shift / size
        rate = (slip - u * (u * slip).sum(0)) / size
        shifts = tables.along[0] * taken(rate, tables.row_pairs)
    return xp.concat([turns, shifts], 0)


def _size(tables: TieTables, shift: Any) -> Any:
    """|d| of pairs whose length is held, 1 of others, (P, samples)."""
    return ((shift * shift).sum(0) * tables.is_apart + (1.0 - tables.is_apart)) ** 0.5


def _arms(xp: Any, tables: TieTables, places: Any) -> Any:
    """X, (5, P, joints, samples)."""
    first, second = places[:, : tables.pairs], _seconds(xp, tables, places)
    return around(xp, tables.first * first[:, :, None] - tables.second * second[:, :, None])


def _moves(xp: Any, tables: TieTables, at: Ends) -> Any:
    """J of the pairs, (6, P, n, samples)."""
    assert tables.frames is not None  # where frames are, they have tables
    screws = joint_screws(xp, tables.frames.from_world, at.carried.joints)[:, :, None]
    one, z = tables.first - tables.second, screws[:, 0]
    shift = one * screws[:3, 1] + cross(z, _arms(xp, tables, at.places))
    return by_coordinate(tables.frames, xp.concat([one * z[:3], shift], 0))


def _move_rates(xp: Any, tables: TieTables, at: Ends, z: Any, rates: Any, speeds: Any) -> Any:
    """Their rates: z x X becomes zd x X + z x dX/dt."""
    assert tables.frames is not None  # where frames are, they have tables
    one, zd, sd = tables.first - tables.second, rates[:, 0, None], rates[:3, 1, None]
    changed = cross(zd, _arms(xp, tables, at.places)) + cross(z[:, None], _arms(xp, tables, speeds))
    return by_coordinate(tables.frames, xp.concat([one * zd[:3], one * sd + changed], 0))


def _polynomial(factors: tuple[Any, ...], q: Any) -> Any:
    """c_0 + c_1 q + ..., (K, n, samples), by Horner's rule."""
    value = factors[-1] + 0.0 * q
    for factor in factors[-2::-1]:
        value = value * q + factor
    return value
