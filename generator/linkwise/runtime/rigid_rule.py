"""The rigid-link rule on arrays: all links and all pairs of joints at once, nothing differentiated.

Vectors, screws S_f = (z, s) and twists V = (omega, v) are those of `kinematics`, A is the rate of V, from minus
gravity. A link of mass m, first moment h, inertia I about o and second moment E = 1/2 tr(I) - I has

    P = m v + omega x h        B = -[omega]x E - v h^T + (h . v) 1

and asks of each joint f a wrench (N, f), whose part on joint e is S_e . (N, f) = z_e . N + s_e . f:

    c2:   N = h x s + I z                 f = m s + z x h                      of S_f = (z, s)
    c1:   N = h x sd + I zd + B z         f = m sd + zd x h + z x P            of its rate (zd, sd) too
    tau:  the same two, of A and of omega; g: the first, of minus gravity
    c0:   those of S-dot-dot and of twice zd; and where joint e is not behind f,
          S_f x* (N, f) = (z x N + s x f, z x f) of tau's wrench

So a link is a matrix of 6 rows: its inertia, which meets (z, s), and B over -[P]x, which meets z. Matrix products
answer for all links of a group and all pairs of joints, and `rule_layout` says which entries are packed.
"""

from typing import Any, NamedTuple

from .kinematics import Poses, Twists, around, cross, motion_cross, product, taken


class LinkNumbers(NamedTuple):
    """What the links carry, in the axes of their frames."""

    masses: Any
    """(N, samples)"""
    mass_matrices: Any
    """m 1, (3, 3, N, samples)"""
    centres: Any
    """(3, N, samples)"""
    half_traces: Any
    """Half the traces of the inertias J about the centres, (N, samples)."""
    second_moments: Any
    """1/2 tr(J) - J, (3, 3, N, samples)"""


class LinkTables(NamedTuple):
    """Constants of the rule."""

    joints: Any
    """Joint of each link."""
    eye: Any
    """(3, 3, 1, 1)"""
    skew: Any
    """Where (a, -a, 0) stands in [a]x, row by row."""


class LinkStates(NamedTuple):
    """Links in motion."""

    matrices: Any
    """Columns first: (9, 6, N, samples)."""
    wrenches: Any
    """Of tau and of g, (6, 2, N, samples)."""


def link_numbers(xp: Any, eye: Any, masses: Any, centres: Any, inertias: Any) -> LinkNumbers:
    """From masses (N, samples), centres (3, N, samples) and inertias (3, 3, N, samples) about them."""
    inertias = 0.5 * (inertias + xp.swapaxes(inertias, 0, 1))
    half = 0.5 * (inertias[0, 0] + inertias[1, 1] + inertias[2, 2])
    return LinkNumbers(masses, masses * eye, centres, half, half * eye - inertias)


def link_states(
    xp: Any, tables: LinkTables, numbers: LinkNumbers, poses: Poses, moved: Twists, own: Any, gravity: Any
) -> LinkStates:
    """Matrices and wrenches of the links.

    own: velocity and acceleration of every joint's coordinate, (frames, samples) each; gravity (3, 1, samples)
    """
    velocity, acceleration = own
    screws, rates = taken(moved.screws, tables.joints), taken(moved.rates, tables.joints)
    qd, qdd = taken(velocity, tables.joints), taken(acceleration, tables.joints)
    twist = taken(moved.twists, tables.joints) + screws * qd
    rate = taken(moved.accelerations, tables.joints) + screws * qdd + rates * qd
    matrices = _matrices(xp, tables, numbers, poses, twist, moved.origin)
    motion = xp.concat([rate[:3, 0], rate[:3, 1], twist[:3, 0]], 0)
    whole = (matrices * motion[:, None]).sum(0)
    weight = -(matrices[3:6] * gravity[:, None]).sum(0)
    return LinkStates(matrices, xp.stack([whole, weight], 1))


def _matrices(
    xp: Any, tables: LinkTables, numbers: LinkNumbers, poses: Poses, twist: Any, origin: Any
) -> Any:
    """[inertia | B over -[P]x] of every link, columns first: (9, 6, links, samples)."""
    omega, v, m = twist[:, 0], twist[:, 1], numbers.masses
    axes, place = taken(poses.axes, tables.joints), taken(poses.places, tables.joints)
    c = numbers.centres
    centre = place - origin + axes[:, 0] * c[0] + axes[:, 1] * c[1] + axes[:, 2] * c[2]
    h = m * centre
    # About o: E = R (1/2 tr(J) - J) R^T + h c^T, I = tr(E) - E with tr(E) = 1/2 tr(J) + h . c.
    turned = product(axes, numbers.second_moments)
    e = product(turned, xp.swapaxes(axes, 0, 1)) + h[:, None] * centre[None]
    inertia = (numbers.half_traces + (h * centre).sum(0)) * tables.eye - e
    # P = m v + omega x h
    momentum = m * v[:3] + cross(omega, around(xp, h))
    # B = -[omega]x E - v h^T + (h . v) 1, columns first; column k of the first part is E_k x omega.
    turning = xp.swapaxes(cross(around(xp, e), omega[:, None]), 0, 1)
    b = turning - h[:, None] * v[None, :3] + (h * v[:3]).sum(0) * tables.eye
    hx, px = _skew(xp, tables, h), _skew(xp, tables, momentum)
    mass = xp.broadcast_to(numbers.mass_matrices, inertia.shape)
    # Rows and columns change places: the transpose of [a]x is -[a]x.
    return xp.concat(
        [xp.concat(rows, 1) for rows in ([inertia, hx], [xp.swapaxes(hx, 0, 1), mass], [b, px])], 0
    )


def _skew(xp: Any, tables: LinkTables, a: Any) -> Any:
    """[a]x of vectors (3, N, samples), (3, 3, N, samples)."""
    rows = xp.concat([a, -a, 0.0 * a[:1]], 0)[tables.skew]
    return rows.reshape(3, 3, *a.shape[1:])


def decomposition_columns(xp: Any, moved: Twists) -> Any:
    """What the matrices meet for c2 and for c1, (9, 2, joints, samples)."""
    (z, s), (zd, sd) = _halves(moved.screws), _halves(moved.rates)
    return xp.stack([xp.concat([z, s, 0.0 * z], 0), xp.concat([zd, sd, z], 0)], 1)


def gradient_columns(xp: Any, moved: Twists) -> Any:
    """What the matrices and tau's wrench meet for c0 behind joint f, and at and before it, (15, 2, ...)."""
    # S-dot-dot = A x S + V x S-dot
    change = motion_cross(xp, moved.accelerations, moved.screws) + motion_cross(xp, moved.twists, moved.rates)
    (z, s), (zd, _), (zdd, sdd) = _halves(moved.screws), _halves(moved.rates), _halves(change)
    after = xp.concat([zdd, sdd, 2.0 * zd], 0)
    return xp.stack([xp.concat([after, 0.0 * z, 0.0 * s], 0), xp.concat([after, z, s], 0)], 1)


def gradient_matrices(xp: Any, tables: LinkTables, states: LinkStates) -> Any:
    """The links' matrices with S x* of tau's wrench behind: -[N]x z - [f]x s over -[f]x z, (15, 6, N, ...)."""
    n, f = (_skew(xp, tables, part) for part in (states.wrenches[:3, 0], states.wrenches[3:, 0]))
    turned = xp.concat([xp.concat([n, f], 1), xp.concat([f, 0.0 * f], 1)], 0)
    return xp.concat([states.matrices, turned], 0)


def _halves(screws: Any) -> tuple[Any, Any]:
    """z and s of pairs of vectors (5, 2, frames, samples), without the ground."""
    return screws[:3, 0, :-1], screws[:3, 1, :-1]
