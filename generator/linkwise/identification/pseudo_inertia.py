"""Inertial parameters as pseudo-inertia, which shows whether a body can exist.

    P. Wensing, S. Kim, J.-J. Slotine, IEEE Robotics and Automation Letters 3(1), 2018

With second moments S = 1/2 tr(I) 1 - I about the origin and the first moment h = m c,

    J = [S h; h^T m]

is positive semidefinite if and only if some density of mass, nowhere negative, has these parameters. It is
linear in pi = (m, mcx, mcy, mcz, Ixx, Ixy, Iyy, Ixz, Iyz, Izz).

Where several links are one rigid body of which only the whole is known, each link is stretched, shifted and
made heavier alike. With the mass m and centre c of the links together, its second moments S about c for each
kilogram, and the wanted m', c', S',

    x -> M (x - c) + c',    M = S^-1/2 (S^1/2 S' S^1/2)^1/2 S^-1/2,    m'/m times as heavy

takes the one to the other, and of all linear maps that do so moves the mass the least (I. Olkin, F.
Pukelsheim, Linear Algebra and its Applications 48, 1982). A body that can exist stays one, and links that fit
already stay as they are.
"""

import numpy as np

from linkwise.arrays import Array

MOMENTS = ((0, 0), (0, 1), (1, 1), (0, 2), (1, 2), (2, 2))
"""Places of the last six parameters in the inertia."""

FLAT = 1e-9
"""Second moment, as a part of the largest, of a body in a direction without extent."""


def pseudo_inertia(pi: Array) -> Array:
    """Return J (..., 4, 4) of parameters (..., 10)."""
    inertia = np.zeros((*pi.shape[:-1], 3, 3))
    for at, (a, b) in enumerate(MOMENTS, 4):
        inertia[..., a, b] = inertia[..., b, a] = pi[..., at]
    half = 0.5 * np.trace(inertia, axis1=-2, axis2=-1)
    j = np.empty((*pi.shape[:-1], 4, 4))
    j[..., :3, :3] = half[..., None, None] * np.eye(3) - inertia
    j[..., :3, 3] = j[..., 3, :3] = pi[..., 1:4]
    j[..., 3, 3] = pi[..., 0]
    return j


def pseudo_inertia_of(mass: float, com: Array, inertia: Array) -> Array:
    """Return J (4, 4) of a mass, its centre (3,) and its inertia about that (3, 3)."""
    j = np.zeros((4, 4))
    j[:3, :3] = 0.5 * np.trace(inertia) * np.eye(3) - inertia + mass * np.outer(com, com)
    j[:3, 3] = j[3, :3] = mass * com
    j[3, 3] = mass
    return j


def central(pi: Array) -> tuple[float, Array, Array]:
    """Return mass, centre of mass (3,) and inertia about it (3, 3) of parameters (10,) with mass above 0."""
    return central_of(pseudo_inertia(pi))


def central_of(j: Array, rounding: float = 0.0) -> tuple[float, Array, Array]:
    """Return mass, centre of mass (3,) and inertia about it (3, 3) of J (4, 4).

    The centre of a body that has inertia and no mass is the origin.

    rounding: below such a sum of second moments about the centre, kg m², a body is a point
    """
    mass = float(j[3, 3])
    com = j[:3, 3] / mass if mass else np.zeros(3)
    second = j[:3, :3] - mass * np.outer(com, com)
    if np.trace(second) < rounding:
        second = np.zeros((3, 3))
    return mass, com, np.trace(second) * np.eye(3) - second


def shared_mass(own: Array, wanted: Array) -> Array:
    """Return pseudo-inertias (k, 4, 4) that sum to `wanted` (4, 4), of links that had `own` (k, 4, 4)."""
    links = _that_can_exist(own)
    whole = links.sum(0)
    shared = np.zeros_like(links)
    if whole[3, 3] > 0.0:
        stretch = _least_map(whole, wanted)
        shared = _that_can_exist(stretch @ links @ stretch.T)
    # The remainder of flat bodies and of rounding.
    shared[int(own[:, 3, 3].argmax())] += wanted - shared.sum(0)
    return shared


def _least_map(whole: Array, wanted: Array) -> Array:
    """Return A with A J Aᵀ = J', (4, 4)."""
    (centre, second), (centre_wanted, second_wanted) = map(_about_centre, (whole, wanted))
    second = second + FLAT * max(np.trace(second), np.trace(second_wanted)) * np.eye(3)
    root = _root(second)
    back = np.linalg.pinv(root, hermitian=True)
    stretch = back @ _root(root @ second_wanted @ root) @ back
    out = np.eye(4)
    out[:3, :3], out[:3, 3] = stretch, centre_wanted - stretch @ centre
    found: Array = np.sqrt(wanted[3, 3] / whole[3, 3]) * out
    return found


def _about_centre(j: Array) -> tuple[Array, Array]:
    """Return the centre of mass, and the second moments about it for each kilogram."""
    centre = j[:3, 3] / j[3, 3]
    return centre, j[:3, :3] / j[3, 3] - np.outer(centre, centre)


def _that_can_exist(own: Array) -> Array:
    """Return the links, without second moments below zero, which rounding gives flat bodies."""
    links = own.copy()
    for j in links:
        mass = j[3, 3]
        shift = np.outer(j[:3, 3], j[:3, 3]) / mass if mass else np.zeros((3, 3))
        sizes, axes = np.linalg.eigh(j[:3, :3] - shift)
        j[:3, :3] = axes * np.maximum(sizes, 0.0) @ axes.T + shift
    return links


def _root(symmetric: Array) -> Array:
    sizes, axes = np.linalg.eigh(symmetric)
    found: Array = axes * np.sqrt(np.maximum(sizes, 0.0)) @ axes.T
    return found
