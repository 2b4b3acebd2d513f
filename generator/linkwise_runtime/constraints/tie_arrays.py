"""Violation of ties, couplings and contacts, their Jacobian A and its rate, on arrays with samples innermost.

For a pair of frames, with S_f = (z, s) the screws of the joints and m = 1 where a joint moves a frame,

    J = ((m1 - m2) z, (m1 - m2) s + z x X)    X = m1 x1 - m2 x2

is how the pair turns and shifts, J_first - J_second in one. A row is w . J of its pair: w is an axis of the
world, or one of the first frame, whose rate is omega x w, or u = d / |d|, from the second frame to the first.
"""

from typing import NamedTuple

from ..interface import Namespace, Numbers
from ..kinematics.frame_arrays import (
    FramePoses,
    by_coordinate,
    forward_kinematics,
    moving,
    of_frames,
    point_at,
    point_velocity,
    rotate_vectors,
)
from ..rule.kinematics import cross, extend_xy, gather, joint_screws
from ..rule.tree_arrays import TreeArrays
from .held_frames import TieTables

TINY = 1e-12
"""Least cos(t/2)^2: below it a frame is upside down, and its axis of rotation is not known."""


class Ends(NamedTuple):
    """Frames of all pairs at a position."""

    poses: FramePoses
    places: Numbers
    """Places of the frames' points, (3, frames, samples)."""


class Pairs(NamedTuple):
    """Pairs of frames at a position, and what their rows need of them."""

    ends: Ends
    shift: Numbers
    """Vector d from the second frame to the first, (3, P, samples)."""
    moves: Numbers
    """J, (6, P, n, samples)."""
    weights: Numbers
    """w, (6, C, samples)."""


class Changes(NamedTuple):
    """Rates of the pairs."""

    moves: Numbers
    """dJ/dt, (6, P, n, samples)."""
    spin: Numbers
    """Angular velocity omega of the first frames, (3, P, samples)."""
    speeds: Numbers
    """Velocities of the points of all frames, (3, frames, samples)."""


def ends(xp: Namespace, tables: TieTables, numbers: TreeArrays, q: Numbers) -> Ends | None:
    """Return the frames at q (n, samples); None without ties and contacts."""
    if tables.frames is None:
        return None
    found = forward_kinematics(xp, tables.frames, numbers, numbers.offsets, q, from_world=True)
    return Ends(found, point_at(found, tables.points))


def pairs(xp: Namespace, tables: TieTables, numbers: TreeArrays, q: Numbers) -> Pairs | None:
    """Return the pairs at q (n, samples); None without ties and contacts."""
    at = ends(xp, tables, numbers, q)
    if at is None or tables.frames is None:
        return None
    screws = joint_screws(xp, tables.frames.joints, at.poses.joints)[:, :, None]
    one, z = tables.moved_apart, screws[:, 0]
    linear = one * screws[:3, 1] + cross(z, _arms(xp, tables, at.places))
    moves = by_coordinate(tables.frames, xp.concat([one * z[:3], linear], 0))
    shift = at.places[:, : tables.pairs] - second_ends(xp, tables, at.places)
    return Pairs(at, shift, moves, _weights(xp, tables, at, shift))


def pair_changes(
    xp: Namespace, tables: TieTables, numbers: TreeArrays, qd: Numbers, at: Pairs | None
) -> Changes | None:
    """Return the rates of the pairs at qd (n, samples): z x X becomes zd x X + z x dX/dt."""
    if at is None or tables.frames is None:
        return None
    places = at.ends.places
    moved = moving(xp, tables.frames, numbers, at.ends.poses, qd)
    twist = of_frames(tables.frames, moved.twists)
    speeds = point_velocity(xp, twist, places)
    z, zd, sd = moved.screws[:, 0, None], moved.rates[:, 0, None], moved.rates[:3, 1, None]
    linear = cross(zd, _arms(xp, tables, places)) + cross(z, _arms(xp, tables, speeds))
    one = tables.moved_apart
    moves = by_coordinate(tables.frames, xp.concat([one * zd[:3], one * sd + linear], 0))
    return Changes(moves, twist[:3, 0, : tables.pairs], speeds)


def violation(
    xp: Namespace, tables: TieTables, q: Numbers, at: Pairs | None, held: Ends | None = None
) -> Numbers:
    """Return phi (C, samples); held: where contacts took hold, where they are unless given."""
    parts: list[Numbers] = []
    if at is not None:
        axes, places = at.ends.poses.axes, at.ends.places
        shift, weights = at.shift, at.weights
        if held is not None:
            shift = places[:, : tables.pairs] - second_ends(xp, tables, places, held.places)
        along = (weights[3:] * gather(shift, tables.row_pairs)).sum(0)
        if tables.all_axes is not None:
            second = second_ends(xp, tables, axes, held and held.poses.axes)
            turn = _turn(xp, tables.all_axes, axes[:, :, : tables.pairs], second)
            along = along + (weights[:3] * gather(turn, tables.row_pairs)).sum(0)
        parts.append(along * tables.placed - tables.apart)
    if tables.polynomials:
        parts.append(_polynomial(tables.polynomials[0], q).sum(1))
    return _joined(xp, parts)


def tie_jacobian(xp: Namespace, tables: TieTables, q: Numbers, at: Pairs | None) -> Numbers:
    """Return A (C, n, samples)."""
    parts: list[Numbers] = []
    if at is not None:
        parts.append((at.weights[:, :, None] * gather(at.moves, tables.row_pairs, -3)).sum(0))
    if tables.polynomials:
        parts.append(_polynomial(tables.polynomials[1], q))
    return _joined(xp, parts)


def tie_jacobian_rate(
    xp: Namespace, tables: TieTables, q: Numbers, qd: Numbers, at: Pairs | None, changes: Changes | None
) -> Numbers:
    """Return dA/dt (C, n, samples)."""
    parts: list[Numbers] = []
    if at is not None and changes is not None:
        total = at.weights[:, :, None] * gather(changes.moves, tables.row_pairs, -3)
        rates = _weight_rates(xp, tables, at, changes)
        if rates is not None:
            total = total + rates[:, :, None] * gather(at.moves, tables.row_pairs, -3)
        parts.append(total.sum(0))
    if tables.polynomials:
        parts.append(_polynomial(tables.polynomials[2], q) * qd)
    return _joined(xp, parts)


def second_ends(xp: Namespace, tables: TieTables, a: Numbers, held: Numbers | None = None) -> Numbers:
    """Return the part of `a` for the second frames of pairs, (..., P, samples).

    For a contact it is that of its own frame, as it was held.
    """
    own = a[..., tables.pairs :, :]
    if tables.ties == tables.pairs:
        return own
    kept = (a if held is None else held)[..., tables.ties : tables.pairs, :]
    return xp.concat([own, kept], -2)


def _turn(xp: Namespace, every: Numbers, first: Numbers, second: Numbers) -> Numbers:
    """Return 2 sin(t/2) times the axis about which, by t, the first frames are turned from the second ones.

    With all axes a, sin t times that axis is half the sum of a2 x a1; with z alone it is z2 x z1.
    """
    sines = cross(extend_xy(xp, second), extend_xy(xp, first))
    cosines = (second * first).sum(0)
    sine = every * 0.5 * sines.sum(1) + (1.0 - every) * sines[:, 2]
    cosine = every * 0.5 * (cosines.sum(0) - 1.0) + (1.0 - every) * cosines[2]
    half = 0.5 * (1.0 + cosine)  # cos(t/2)^2
    return sine / xp.where(half > TINY, half, 0.0 * half + TINY) ** 0.5


def _weights(xp: Namespace, tables: TieTables, at: Ends, shift: Numbers) -> Numbers:
    """Return w (6, C, samples), with one for all samples where w is constant."""
    weights = tables.fixed
    if tables.turning is not None:
        turning = rotate_vectors(gather(at.poses.axes, tables.row_pairs), tables.turning)
        weights = weights + xp.concat([turning, 0.0 * turning], 0)
    if tables.along is not None:
        along = tables.along * gather(shift / _size(xp, tables, shift), tables.row_pairs)
        weights = weights + xp.concat([0.0 * along, along], 0)
    return weights


def _weight_rates(xp: Namespace, tables: TieTables, at: Pairs, changes: Changes) -> Numbers | None:
    """Return dw/dt (6, C, samples); None where w is constant."""
    if tables.turning is None and tables.along is None:
        return None
    turning, along = 0.0 * at.weights[:3], 0.0 * at.weights[3:]
    if tables.turning is not None:
        own = at.weights[:3] - tables.fixed[:3]
        spin = extend_xy(xp, changes.spin)
        turning = cross(gather(spin, tables.row_pairs), extend_xy(xp, own))
    if tables.along is not None:
        # the part of d's rate that is normal to d, divided by |d|
        size = _size(xp, tables, at.shift)
        speeds = changes.speeds
        u, slip = at.shift / size, speeds[:, : tables.pairs] - second_ends(xp, tables, speeds)
        along = tables.along * gather((slip - u * (u * slip).sum(0)) / size, tables.row_pairs)
    return xp.concat([turning, along], 0)


def _size(xp: Namespace, tables: TieTables, shift: Numbers) -> Numbers:
    """Return |d| of pairs whose length is held, (P, samples); 1 for others, and where the ends coincide.

    Where they coincide, d has no direction, and u = 0: phi is the whole length, and A, whose row is zero, has
    lost its rank.
    """
    squares = (shift * shift).sum(0) * tables.is_apart + (1.0 - tables.is_apart)
    return xp.where(squares > 0.0, squares, 0.0 * squares + 1.0) ** 0.5


def _arms(xp: Namespace, tables: TieTables, places: Numbers) -> Numbers:
    """Return X (5, P, joints, samples), with its x and y once more, as `extend_xy` has it."""
    first, second = places[:, : tables.pairs], second_ends(xp, tables, places)
    return extend_xy(xp, tables.first * first[:, :, None] - tables.second * second[:, :, None])


def _polynomial(factors: tuple[Numbers, ...], q: Numbers) -> Numbers:
    """Return c_0 + c_1 q + ..., (K, n, samples), by Horner's rule."""
    value = factors[-1] + 0.0 * q
    for factor in factors[-2::-1]:
        value = value * q + factor
    return value


def _joined(xp: Namespace, parts: list[Numbers]) -> Numbers:
    return parts[0] if len(parts) == 1 else xp.concat(parts, 0)
