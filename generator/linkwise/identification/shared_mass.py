"""Links that are one rigid body of which only the whole is known: its mass is shared among them.

Each link is stretched, shifted and made heavier alike. With the mass m and centre c of the links together,
its second moments S about c for each kilogram, and the wanted m', c', S',

    x -> M (x - c) + c',    M = S^-1/2 (S^1/2 S' S^1/2)^1/2 S^-1/2,    m'/m times as heavy

takes the one to the other, and of all linear maps that do so moves the mass the least (I. Olkin, F.
Pukelsheim, Linear Algebra and its Applications 48, 1982). A body that can exist stays one, and links that fit
already stay as they are.
"""

import numpy as np

from linkwise.arrays import Array

FLAT = 1e-9
"""Second moment, as a part of the largest, of a body in a direction without extent."""


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
