"""Kinetic and potential energies of rigid links, all at once.

With v and omega the twist of a link about the origin o, c its centre of mass seen from there, J its inertia
about c and w = R^T omega in its own axes,

    K = 1/2 (m |v + omega x c|^2 + w . J w)        P = -m a_g . c, c from the world's origin
"""

from typing import Any

from .kinematics import KinematicTables, Poses, around, cross, poses, taken, twists
from .tree_arrays import TreeArrays


def link_energies(
    xp: Any, tables: KinematicTables, joints: Any, numbers: TreeArrays, q: Any, qd: Any
) -> list[Any]:
    """K and P in J, (N, samples) each.

    joints: of the links; q, qd: (n, samples)
    """
    position, velocity = taken(q, tables.coordinates), taken(qd, tables.coordinates)
    placed = poses(xp, tables, numbers.translations, position)
    moved = twists(xp, tables, placed, numbers.gravity, velocity, 0.0 * velocity)
    twist, axes = taken(moved.twists, joints), taken(placed.axes, joints)
    omega, centre = twist[:, 0], _centres(placed, joints, numbers)
    speed = twist[:3, 1] + cross(omega, around(xp, centre))
    own = (axes * omega[:3, None]).sum(0)
    spin = (own[:, None] * numbers.inertias * own[None]).sum((0, 1))
    kinetic = 0.5 * (numbers.masses * (speed * speed).sum(0) + spin)
    # Counted from the world's origin, where what has a hinge before it is counted from there otherwise.
    whole = tables._replace(behind=xp.ones_like(tables.behind))
    height = _centres(poses(xp, whole, numbers.translations, position), joints, numbers)
    return [kinetic, -numbers.masses * (numbers.gravity * height).sum(0)]


def _centres(placed: Poses, joints: Any, numbers: TreeArrays) -> Any:
    """Centres of mass (3, N, samples), from where places are counted."""
    axes, c = taken(placed.axes, joints), numbers.centres
    return taken(placed.places, joints) + axes[:, 0] * c[0] + axes[:, 1] * c[1] + axes[:, 2] * c[2]
