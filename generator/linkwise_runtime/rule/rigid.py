"""Rigid-link rule on arrays: all links and all pairs of joints at once, without differentiation.

Vectors, screws S_f = (z, s) and twists V = (omega, v) are those of `kinematics`; A is the rate of V, from
minus gravity. A link of mass m, first moment h, inertia I about o and second moment E = 1/2 tr(I) - I has

    P = m v + omega x h        B = -[omega]x E - v h^T + (h . v) 1

and needs a wrench (N, f) for the motion of each joint f, whose part on joint e is S_e . (N, f) = z_e . N +
s_e . f:

    c2:   N = h x s + I z                 f = m s + z x h                      of S_f = (z, s)
    c1:   N = h x sd + I zd + B z         f = m sd + zd x h + z x P            of its rate (zd, sd) too
    tau:  c2's for A, plus the terms of B and P for omega; g: c2's for minus gravity
    c0:   c2's for S-dot-dot, plus the terms of B and P for twice zd; and where joint e is not behind f,
          S_f x* (N, f) = (z x N + s x f, z x f) of tau's wrench

Errors of tau are rounding of its wrench. The part of velocities in it, a centripetal force say, may be large
and do nothing along any axis: where joints move fast and hardly accelerate, few digits of tau are left.

Wrenches are linear in the screws. So a link is also a matrix of 6 rows, whose columns multiply (z, s) and z,
and matrix products answer for the links of a group and all pairs of joints, of which `layout` says what
is packed.
"""

from typing import NamedTuple

from ..interface import Namespace, Numbers
from .kinematics import (
    KinematicTables,
    Poses,
    Positions,
    Twists,
    cross,
    extend_xy,
    gather,
    motion_cross,
    places_from_world,
    poses,
    product,
    twists,
)
from .tree_arrays import TreeArrays


class LinkNumbers(NamedTuple):
    """Masses, centres and inertias of the links, in the axes of their frames."""

    masses: Numbers
    """(N, samples)"""
    mass_matrices: Numbers
    """m 1, (3, 3, N, samples)"""
    centres: Numbers
    """(3, N, samples)"""
    half_traces: Numbers
    """Half the traces of the inertias J about the centres, (N, samples)."""
    second_moments: Numbers
    """1/2 tr(J) - J, (3, 3, N, samples)"""


class LinkTables(NamedTuple):
    """Constants of the rule."""

    joints: Positions
    """Index of the joint of each link."""
    eye: Numbers
    """(3, 3, 1, 1)"""
    skew: Numbers
    """Index in (a, -a, 0) of each entry of [a]x, row by row."""


class LinkMoments(NamedTuple):
    """Links in motion, about the first hinge of their path.

    Vectors end with their x and y once more, matrices have their columns first.
    """

    m: Numbers
    """(N, samples)"""
    h: Numbers
    """(5, N, samples)"""
    inertia: Numbers
    """(3, 3, N, samples)"""
    momentum: Numbers
    """P, (5, N, samples)."""
    b: Numbers
    """(3, 3, N, samples)"""


class LinkStates(NamedTuple):
    """Links in motion, and their wrenches (6, 2, N, samples): that of tau and that of their weight."""

    moments: LinkMoments
    wrenches: Numbers


def link_numbers(
    xp: Namespace, eye: Numbers, masses: Numbers, centres: Numbers, inertias: Numbers
) -> LinkNumbers:
    """Return numbers of links, from masses (N, samples), centres (3, N, samples) and inertias about them.

    inertias: (3, 3, N, samples)
    """
    inertias = 0.5 * (inertias + xp.swapaxes(inertias, 0, 1))
    half = 0.5 * (inertias[0, 0] + inertias[1, 1] + inertias[2, 2])
    return LinkNumbers(masses, masses * eye, centres, half, half * eye - inertias)


def link_states(
    xp: Namespace, tables: LinkTables, numbers: LinkNumbers, poses: Poses, moved: Twists, gravity: Numbers
) -> LinkStates:
    """Return the moments and wrenches of the links; gravity: (3, 1, samples)."""
    joints = tables.joints
    twist, change = gather(moved.twists, joints), gather(moved.accelerations, joints)
    moments = _moments(xp, tables, numbers, poses, twist)
    whole = inertial_wrench(xp, moments, change[:, 0], change[:, 1]) + turning(xp, moments, twist[:, 0])
    moment = cross(moments.h, extend_xy(xp, gravity))
    weight = xp.concat([moment, xp.broadcast_to(moments.m * gravity, moment.shape)], 0)
    return LinkStates(moments, xp.stack([whole, -weight], 1))


def _moments(
    xp: Namespace, tables: LinkTables, numbers: LinkNumbers, poses: Poses, twist: Numbers
) -> LinkMoments:
    """Return the moments of the links, from their frames and twists (5, 2, N, samples)."""
    omega, v, m, c = twist[:, 0], twist[:, 1], numbers.masses, numbers.centres
    axes, place = gather(poses.axes, tables.joints), gather(poses.places, tables.joints)
    centre = _centres(axes, place, c)
    h = m * centre
    # About o: E = R (1/2 tr(J) - J) R^T + h c^T, I = tr(E) - E with tr(E) = 1/2 tr(J) + h . c.
    turned = product(axes, numbers.second_moments)
    e = product(turned, xp.swapaxes(axes, 0, 1)) + h[:, None] * centre[None]
    inertia = (numbers.half_traces + (h * centre).sum(0)) * tables.eye - e
    # P = m v + omega x h
    first = extend_xy(xp, h)
    momentum = m * v[:3] + cross(omega, first)
    # B = -[omega]x E - v h^T + (h . v) 1; column k of the first part is E_k x omega.
    columns = xp.swapaxes(cross(extend_xy(xp, e), omega[:, None]), 0, 1)
    b = columns - h[:, None] * v[None, :3] + (h * v[:3]).sum(0) * tables.eye
    return LinkMoments(m, first, inertia, extend_xy(xp, momentum), b)


def inertial_wrench(xp: Namespace, link: LinkMoments, z: Numbers, s: Numbers) -> Numbers:
    """Return N = h x s + I z over f = m s + z x h, (6, ...), of vectors (5, ...)."""
    moment = cross(link.h, s) + applied(link.inertia, z)
    return xp.concat([moment, link.m * s[:3] + cross(z, link.h)], 0)


def turning(xp: Namespace, link: LinkMoments, z: Numbers) -> Numbers:
    """Return N = B z over f = z x P, (6, ...), of a vector (5, ...)."""
    return xp.concat([applied(link.b, z), cross(z, link.momentum)], 0)


def applied(matrix: Numbers, z: Numbers) -> Numbers:
    """Return a matrix, columns first, times a vector."""
    return matrix[0] * z[0] + matrix[1] * z[1] + matrix[2] * z[2]


def link_matrices(xp: Namespace, tables: LinkTables, numbers: LinkNumbers, link: LinkMoments) -> Numbers:
    """Return matrices of `inertial_wrench` and `turning`, columns first: (9, 6, N, samples).

    The columns multiply (z, s) for the one and z for the other.
    """
    hx, px = _skew(tables, xp, link.h[:3]), _skew(tables, xp, link.momentum[:3])
    mass = xp.broadcast_to(numbers.mass_matrices, link.inertia.shape)
    # z x h = -[h]x z, and the transpose of -[h]x is [h]x.
    rows = [link.inertia, hx], [xp.swapaxes(hx, 0, 1), mass], [link.b, px]
    return xp.concat([xp.concat(row, 1) for row in rows], 0)


def gradient_matrices(xp: Namespace, tables: LinkTables, matrices: Numbers, wrench: Numbers) -> Numbers:
    """Return the matrices with S x* (wrench) behind: -[N]x z - [f]x s over -[f]x z, (15, 6, N, samples)."""
    n, f = _skew(tables, xp, wrench[:3]), _skew(tables, xp, wrench[3:])
    return xp.concat([matrices, xp.concat([n, f], 1), xp.concat([f, 0.0 * f], 1)], 0)


def _skew(tables: LinkTables, xp: Namespace, a: Numbers) -> Numbers:
    """Return [a]x of vectors (3, N, samples), (3, 3, N, samples)."""
    rows = xp.concat([a, -a, 0.0 * a[:1]], 0)[tables.skew]
    matrices: Numbers = rows.reshape(3, 3, *a.shape[1:])
    return matrices


def decomposition_columns(xp: Namespace, moved: Twists) -> Numbers:
    """Return the columns that the matrices multiply for c2 and for c1, (9, 2, joints, samples)."""
    (z, s), (zd, sd) = _halves(moved.screws), _halves(moved.rates)
    return xp.stack([xp.concat([z, s, 0.0 * z], 0), xp.concat([zd, sd, z], 0)], 1)


def gradient_columns(xp: Namespace, moved: Twists) -> Numbers:
    """Return the columns that the gradient's matrices multiply for c0, (15, 2, joints, samples).

    The first kind is for joints behind joint f, the second for it and those before.
    """
    (z, s), (zd, _), (zdd, sdd) = (_halves(a) for a in (moved.screws, moved.rates, second_rates(xp, moved)))
    after = xp.concat([zdd, sdd, 2.0 * zd], 0)
    return xp.stack([xp.concat([after, 0.0 * z, 0.0 * s], 0), xp.concat([after, z, s], 0)], 1)


def second_rates(xp: Namespace, moved: Twists) -> Numbers:
    """Return S-dot-dot = A x S + V x S-dot, and the terms of curves, (5, 2, frames, samples)."""
    second = motion_cross(xp, moved.accelerations, moved.screws) + motion_cross(xp, moved.twists, moved.rates)
    return second if moved.second is None else second + moved.second


def _halves(screws: Numbers) -> tuple[Numbers, Numbers]:
    """Return z and s of pairs of vectors (5, 2, frames, samples), without the ground."""
    return screws[:3, 0, :-1], screws[:3, 1, :-1]


def link_energies(
    xp: Namespace, tables: KinematicTables, joints: Positions, numbers: TreeArrays, q: Numbers, qd: Numbers
) -> list[Numbers]:
    """Return kinetic and potential energies in J, (N, samples) each.

    With v and omega the twist of a link about the origin, c its centre of mass seen from there, J its inertia
    about c and w = R^T omega in its own axes,

        K = 1/2 (m |v + omega x c|^2 + w . J w)        P = -m a_g . c, c from the world's origin

    joints: joint of each link; q, qd: (n, samples)
    """
    position, velocity = gather(q, tables.coordinates), gather(qd, tables.coordinates)
    placed = poses(xp, tables, numbers.translations, position)
    moved = twists(xp, tables, placed, numbers.gravity, velocity, 0.0 * velocity)
    twist, axes = gather(moved.twists, joints), gather(placed.axes, joints)
    omega, centre = twist[:, 0], _centres(axes, gather(placed.places, joints), numbers.centres)
    speed = twist[:3, 1] + cross(omega, extend_xy(xp, centre))
    own = (axes * omega[:3, None]).sum(0)
    spin = (own[:, None] * numbers.inertias * own[None]).sum((0, 1))
    kinetic = 0.5 * (numbers.masses * (speed * speed).sum(0) + spin)
    places = places_from_world(tables, numbers.translations, position, placed.axes)
    height = _centres(axes, gather(places, joints), numbers.centres)
    return [kinetic, -numbers.masses * (numbers.gravity * height).sum(0)]


def _centres(axes: Numbers, places: Numbers, c: Numbers) -> Numbers:
    """Return centres of mass (3, N, samples), from where places are counted."""
    return places + axes[:, 0] * c[0] + axes[:, 1] * c[1] + axes[:, 2] * c[2]
