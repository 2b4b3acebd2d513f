"""Regressors on arrays: factors of the links' inertial parameters in the torques.

Torques are linear in what link j carries, pi_j = (m, mc_x, mc_y, mc_z, I_xx, I_xy, I_yy, I_xz, I_yz, I_zz),
with the inertia I about the origin of the link's frame and in its axes:

    tau_ij = Y_ij . pi_j        and so c2_ijk, c1_ijk and g_ij, each with a row of its own.

In these axes, and about this origin, that of the frame that the link's joint moves, coordinate i turns the
link by z_i and moves the origin by u_i, its partial velocity; the link turns at omega. One row serves all,

    Y = [u_i . a,   a x z_i + u_i x alpha + (u_i x beta) x omega,   z_i alpha^T + y beta^T - 1/2 (y . beta) 1]

with y = z_i x omega, a product of inertia counting for both entries of the matrix, for

    tau:      a the origin's acceleration less gravity    alpha = omega-dot     beta = omega
    c2 of k:  a = u_k                                     alpha = z_k           beta = 0
    c1 of k:  a = rate of u_k                             alpha = rate of z_k   beta = z_k
    g:        a = minus gravity                           alpha = 0             beta = 0

This is the rule of `rigid` about that origin, sorted by mass, first moment h = mc and inertia. Arrays
are those of `kinematics`: samples innermost.
"""

from collections.abc import Callable, Sequence
from types import ModuleType
from typing import NamedTuple

import numpy as np

from ..arguments import has_tensors
from ..interface import Namespace, Numbers
from ..quantities import PARAMETERS
from .joint_tree import Bodies, JointTree, Own
from .kinematics import KinematicTables, Twists, cross, extend_xy, gather, poses, twists
from .layout import joined, members
from .tree_arrays import TreeArrays


class RegressorTables(NamedTuple):
    """Tables of a robot's rows: pairs of a link and a coordinate of its path, in `Layout.torque`'s order."""

    joints: tuple[Numbers, ...]
    """Joints that follow each pair's coordinate, a table for each summand; the ground where there is none."""
    frames: Numbers
    """Index of the joint that moves each pair's link."""
    upper: tuple[Numbers, Numbers]
    """Pairs of i and of k, in the order of `Layout.acceleration`."""
    every: tuple[Numbers, Numbers]
    """Pairs of i and of k, in the order of `Layout.velocity`."""


class LinkAxes(NamedTuple):
    """Pairs in the axes of their links, about the origins of their frames; vectors (5, pairs, samples)."""

    z: Numbers
    u: Numbers
    omega: Numbers
    v: Numbers
    """Velocity of the origin, in m/s."""


Turn = Callable[[Numbers], tuple[Numbers, Numbers]]
"""Function that turns screws (5, 2, pairs, samples) into the links' axes."""


def inertial_parameters(bodies: Bodies[Own]) -> Own:
    """Return pi_j of bodies, (..., N, 10), an array or a tensor as they are.

    I is about the origin: I = J + m (c . c 1 - c c^T), J about the centre c.
    """
    m, c, j = bodies
    h = m[..., None] * c
    squares = (h * c).sum(-1)

    def about_origin(a: int, b: int) -> Numbers:
        own = 0.5 * (j[..., a, b] + j[..., b, a]) - h[..., a] * c[..., b]
        return own + squares if a == b else own

    moments = [about_origin(b, c) for c in range(3) for b in range(c + 1)]
    library: ModuleType = np
    if has_tensors(bodies):
        import torch

        library = torch
    rows: Own = library.stack([m, *(h[..., a] for a in range(3)), *moments], -1)
    return rows


def regressor_tables(tree: JointTree) -> RegressorTables:
    """Return the tables of a tree."""
    chains = [np.array(tree.chain(link.joint)) for link in tree.links]
    found = [members(tree, j) for j in range(len(tree.links))]
    rows = [np.where(m < 0, -1, chain[m]).T for chain, m in zip(chains, found, strict=True)]
    counts = [len(m) for m in found]
    pairs = [
        (start + i, start + k)
        for start, count in zip(np.cumsum([0, *counts[:-1]]), counts, strict=True)
        for i in range(count)
        for k in range(count)
    ]
    i, k = np.array(pairs, dtype=np.intp).T
    up = i <= k
    frames = [link.joint for link, count in zip(tree.links, counts, strict=True) for _ in range(count)]
    joints = tuple(joined(rows, len(tree.joints)))
    return RegressorTables(joints, np.array(frames, dtype=np.intp), (i[up], k[up]), (i, k))


def torque_rows(
    xp: Namespace,
    frames: KinematicTables,
    tables: RegressorTables,
    numbers: TreeArrays,
    motion: Sequence[Numbers],
) -> list[Numbers]:
    """Return Y of tau, (samples, pairs * 10), for q, qd and qdd (n, samples)."""
    moved, turn, link, _ = _moved(xp, frames, tables, numbers, motion)
    rate = turn(gather(moved.accelerations, tables.frames))
    # a = vd + omega-dot x p + omega x v: `turn` adds the part of the origin's place p.
    a = rate[1] + cross(link.omega, link.v)
    return [_rows(xp, link, extend_xy(xp, a), extend_xy(xp, rate[0]), link.omega)]


def coefficient_rows(
    xp: Namespace,
    frames: KinematicTables,
    tables: RegressorTables,
    numbers: TreeArrays,
    motion: Sequence[Numbers],
) -> list[Numbers]:
    """Return Y of c2, c1 and g, (samples, entries * 10) each, for q, qd and qdd (n, samples)."""
    moved, turn, link, gravity = _moved(xp, frames, tables, numbers, motion)
    zd, fixed = (extend_xy(xp, a) for a in turn(_of_pairs(moved.rates, tables)))
    # About the moving origin: u-dot = sd + zd x p + z x v.
    ud = fixed + extend_xy(xp, cross(link.z, link.v))
    none = 0.0 * link.z
    i, k = tables.upper
    second = _rows(xp, _taken(link, i), gather(link.u, k), gather(link.z, k), gather(none, k))
    i, k = tables.every
    first = _rows(xp, _taken(link, i), gather(ud, k), gather(zd, k), gather(link.z, k))
    return [second, first, _rows(xp, link, extend_xy(xp, -gravity), none, none)]


def _moved(
    xp: Namespace,
    frames: KinematicTables,
    tables: RegressorTables,
    numbers: TreeArrays,
    motion: Sequence[Numbers],
) -> tuple[Twists, Turn, LinkAxes, Numbers]:
    """Return twists, the function that turns screws, the pairs in the links' axes, and gravity there."""
    position, velocity, acceleration = (gather(a, frames.coordinates) for a in motion)
    placed = poses(xp, frames, numbers.translations, position)
    moved = twists(xp, frames, placed, numbers.gravity, velocity, acceleration)
    axes = gather(placed.axes, tables.frames)
    place = extend_xy(xp, gather(placed.places, tables.frames))

    def turned(a: Numbers) -> Numbers:
        return (axes * a[:, None]).sum(0)

    def turn(screw: Numbers) -> tuple[Numbers, Numbers]:
        z, s = screw[:, 0], screw[:, 1]
        return turned(z[:3]), turned(s[:3] + cross(z, place))

    z, u, omega, v = (
        extend_xy(xp, a)
        for screw in (_of_pairs(moved.screws, tables), gather(moved.twists, tables.frames))
        for a in turn(screw)
    )
    return moved, turn, LinkAxes(z, u, omega, v), turned(numbers.gravity + 0.0 * z[:3])


def _of_pairs(screws: Numbers, tables: RegressorTables) -> Numbers:
    """Return the screws of frames for each pair, summed over the joints that follow its coordinate."""
    first, *others = (gather(screws, joints) for joints in tables.joints)
    return sum(others, first)


def _taken(link: LinkAxes, pairs: Numbers) -> LinkAxes:
    return LinkAxes(*(gather(a, pairs) for a in link))


def _rows(xp: Namespace, link: LinkAxes, a: Numbers, alpha: Numbers, beta: Numbers) -> Numbers:
    """Return Y of the links' pairs, (samples, rows * 10).

    a, alpha, beta: vectors (5, rows, samples) or (3, rows, samples)
    """
    z, u = link.z, link.u
    y = cross(z, link.omega)
    h = cross(a, z) + cross(u, alpha) + cross(extend_xy(xp, cross(u, beta)), link.omega)
    half = 0.5 * (y * beta[:3]).sum(0)
    terms = z[:3, None] * alpha[None, :3] + y[:, None] * beta[None, :3]
    inertia = [
        terms[b, b] - half if b == c else terms[b, c] + terms[c, b] for c in range(3) for b in range(c + 1)
    ]
    rows = xp.stack([(u[:3] * a[:3]).sum(0), *h, *inertia], 0)
    ordered = xp.swapaxes(rows, 0, 2)  # (samples, rows, 10)
    flat: Numbers = ordered.reshape(rows.shape[2], rows.shape[1] * PARAMETERS)
    return flat
