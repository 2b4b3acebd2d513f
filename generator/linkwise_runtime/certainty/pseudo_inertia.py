"""Inertial parameters as pseudo-inertia, which shows whether a body can exist.

    P. Wensing, S. Kim, J.-J. Slotine, IEEE Robotics and Automation Letters 3(1), 2018

With second moments S = 1/2 tr(I) 1 - I about the origin and the first moment h = m c,

    J = [S h; h^T m]

is positive semidefinite if and only if some density of mass, nowhere negative, has these parameters. It is
linear in pi = (m, mcx, mcy, mcz, Ixx, Ixy, Iyy, Ixz, Iyz, Izz), and pi in it.
"""

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

MOMENTS = ((0, 0), (0, 1), (1, 1), (0, 2), (1, 2), (2, 2))
"""Places of the last six parameters in the inertia."""
SMALLEST = 0.05
"""Least size of a link's parameters, as a part of the largest mass, or length."""
CORNERS = tuple((a, b) for b in range(4) for a in range(b + 1))
"""Entries of the upper triangle of J by columns, the order of Clarabel's cone."""


def pseudo_inertia(pi: Floats) -> Floats:
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


def pseudo_inertia_of(mass: float, com: Floats, inertia: Floats) -> Floats:
    """Return J (4, 4) of a mass, its centre (3,) and its inertia about that (3, 3)."""
    j = np.zeros((4, 4))
    j[:3, :3] = 0.5 * np.trace(inertia) * np.eye(3) - inertia + mass * np.outer(com, com)
    j[:3, 3] = j[3, :3] = mass * com
    j[3, 3] = mass
    return j


def central(pi: Floats) -> tuple[float, Floats, Floats]:
    """Return mass, centre of mass (3,) and inertia about it (3, 3) of parameters (10,) with mass above 0."""
    return central_of(pseudo_inertia(pi))


def central_of(j: Floats, rounding: float = 0.0) -> tuple[float, Floats, Floats]:
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


def link_sizes(own: Floats) -> Floats:
    """Return the size of each link's parameters, (N, 10): m, m l, m l^2 of its mass m and its reach l."""
    masses, moments = own[:, 0], np.trace(pseudo_inertia(own)[:, :3, :3], axis1=-2, axis2=-1)
    mass = np.maximum(masses, SMALLEST * (masses.max() or 1.0))
    reach = np.sqrt(np.maximum(moments, 0.0) / mass)
    length = np.maximum(reach, SMALLEST * (reach.max() or 1.0))
    sizes: Floats = mass[:, None] * length[:, None] ** np.array([0, 1, 1, 1, 2, 2, 2, 2, 2, 2])
    return sizes


def triangle(matrices: Floats) -> Floats:
    """Return upper triangles (..., 10) of symmetric matrices (..., 4, 4), in the cone's order.

    Entries off the diagonal are there times the root of 2, so that products of triangles are those of
    matrices.
    """
    return np.stack([matrices[..., a, b] * (1.0 if a == b else np.sqrt(2.0)) for a, b in CORNERS], -1)


def squared(triangles: Floats) -> Floats:
    """Return the symmetric matrices (..., 4, 4) of their upper triangles (..., 10)."""
    matrices = np.empty((*triangles.shape[:-1], 4, 4))
    for at, (a, b) in enumerate(CORNERS):
        matrices[..., a, b] = matrices[..., b, a] = triangles[..., at] / (1.0 if a == b else np.sqrt(2.0))
    return matrices
