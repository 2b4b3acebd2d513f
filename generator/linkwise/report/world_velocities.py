"""A serial arm's links, expanded: centres of mass in the world's axes, angular velocities in their own.

p_j = p_j−1 + R_j−1 t_j      R_j = R_j−1 E_j Rz(q_j)      r_j = p_j + R_j c_j      ω_j = R_jᵀ Σ_k z_k q̇_k
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TypeAlias

import sympy as sp

from linkwise.report.expand import Expansion, snapped
from linkwise.report.laurent import ONE, ZERO, Laurent, add, constant, multiply
from linkwise.robot import Coordinate, Joint
from linkwise.symbolic.link_energy import exact
from linkwise.symbolic.system import RigidSystem

Vector: TypeAlias = list[Laurent]
Columns: TypeAlias = list[Vector]


@dataclass(frozen=True)
class ExpandedBody:
    """A link: where its centre of mass is and how it turns, and what it carries; in m, rad/s, kg, kg·m²."""

    place: Vector
    turning: Vector
    mass: Laurent
    inertia: Columns


def expanded_bodies(system: RigidSystem, expansion: Expansion) -> Iterator[ExpandedBody]:
    """Links of a serial arm one after another; raises BudgetExceededError at one too large."""
    columns: Columns = [[ONE, ZERO, ZERO], [ZERO, ONE, ZERO], [ZERO, ZERO, ONE]]
    origin, spin = [ZERO] * 3, [ZERO] * 3
    links, reached = iter(system.links), 0
    for link in links:
        for joint in link.joints[reached:]:
            columns, origin, spin = _moved(expansion, joint, system.coordinates, columns, origin, spin)
        reached = len(link.joints)
        centre = _combined(expansion, columns, [expansion(c) for c in exact(link.com)])
        turning = [_dot(expansion, column, spin) for column in columns]
        mass = expansion(exact((link.mass, 0, 0))[0])
        inertia = [[expansion(e) for e in exact(row)] for row in link.inertia]
        yield ExpandedBody(_sum(origin, centre), turning, mass, inertia)


def _moved(
    expansion: Expansion,
    joint: Joint,
    coordinates: Sequence[Coordinate],
    columns: Columns,
    origin: Vector,
    spin: Vector,
) -> tuple[Columns, Vector, Vector]:
    """Axes, origin and angular velocity behind a joint."""
    ratio = exact((joint.ratio, 0, 0))[0]
    coordinate = coordinates[joint.coordinate]
    angle, rate = ratio * coordinate.q, expansion(ratio * coordinate.qd)
    origin = _sum(origin, _combined(expansion, columns, [expansion(t) for t in exact(joint.translation)]))
    turned = [
        _combined(expansion, columns, [constant(snapped(e)) for e in column])
        for column in zip(*joint.rotation, strict=True)
    ]
    if joint.kind == "prismatic":
        return turned, _sum(origin, _scaled(expansion, turned[2], expansion(angle))), spin
    c, s = expansion(sp.cos(angle)), expansion(sp.sin(angle))
    x, y, z = turned
    columns = [
        _sum(_scaled(expansion, x, c), _scaled(expansion, y, s)),
        _sum(_scaled(expansion, y, c), _scaled(expansion, x, s.scaled(-1))),
        z,
    ]
    return columns, origin, _sum(spin, _scaled(expansion, z, rate))


def _combined(expansion: Expansion, columns: Columns, weights: Vector) -> Vector:
    """A matrix, by columns, times a vector."""
    parts = [_scaled(expansion, column, weight) for column, weight in zip(columns, weights, strict=True)]
    return _sum(*parts)


def _scaled(expansion: Expansion, a: Vector, factor: Laurent) -> Vector:
    return [multiply(e, factor, expansion.budget).pruned(expansion.rounding) for e in a]


def _sum(*vectors: Vector) -> Vector:
    return [add(entries) for entries in zip(*vectors, strict=True)]


def _dot(expansion: Expansion, a: Vector, b: Vector) -> Laurent:
    return add(multiply(x, y, expansion.budget) for x, y in zip(a, b, strict=True)).pruned(expansion.rounding)
