"""A serial arm's links, expanded: centres of mass in the world's axes, angular velocities in the links' own.

p_j = p_j−1 + R_j−1 t_j      R_j = R_j−1 E_j Rz(q_j)      r_j = p_j + R_j c_j      ω_j = R_jᵀ Σ_k z_k q̇_k
"""

from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from itertools import islice
from typing import TypeAlias, TypeVar

import sympy as sp

from linkwise.report.expand import ROUNDING, Expansion, angle_units, snap_number
from linkwise.report.expanded_torques import is_exact
from linkwise.report.laurent import ONE, ZERO, BudgetExceededError, Laurent, add, constant, multiply
from linkwise.robot import Coordinate, Joint
from linkwise.symbolic.link_energy import exact, link_energies
from linkwise.symbolic.system import RigidSystem

Vector: TypeAlias = list[Laurent]
Columns: TypeAlias = list[Vector]
Item = TypeVar("Item")


@dataclass(frozen=True)
class ExpandedArm:
    """An arm's first links, as far as a budget of terms reaches, and gravity in the world's axes in m/s²."""

    expansion: Expansion
    bodies: tuple["ExpandedBody", ...]
    gravity: Vector


@dataclass(frozen=True)
class ExpandedBody:
    """A link: its centre of mass, angular velocity, mass and inertia, in m, rad/s, kg, kg·m²."""

    place: Vector
    turning: Vector
    mass: Laurent
    inertia: Columns


def expanded_arm(system: RigidSystem, links: int, budget: int) -> ExpandedArm:
    """Expand the first `links` links of a serial arm, or as many as the budget of terms allows."""
    turns = [joint for joint in system.links[links - 1].joints if joint.kind == "revolute"]
    waves = [sp.cos(exact((j.ratio, 0, 0))[0] * system.coordinates[j.coordinate].q) for j in turns]
    rounding = 0.0 if is_exact(system, link_energies(system)) else ROUNDING
    expansion = Expansion(system.coordinates, angle_units(system.coordinates, waves), budget, rounding)
    gravity = [expansion(a) for a in exact(system.robot.gravity)]
    return ExpandedArm(expansion, tuple(affordable(islice(_bodies(system, expansion), links))), gravity)


def affordable(found: Iterator[Item]) -> Iterator[Item]:
    """Yield the items that come before a budget of terms is exceeded."""
    with suppress(BudgetExceededError):
        yield from found


def _bodies(system: RigidSystem, expansion: Expansion) -> Iterator[ExpandedBody]:
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
    """Return axes, origin and angular velocity behind a joint."""
    ratio = exact((joint.ratio, 0, 0))[0]
    coordinate = coordinates[joint.coordinate]
    angle, rate = ratio * coordinate.q, expansion(ratio * coordinate.qd)
    origin = _sum(origin, _combined(expansion, columns, [expansion(t) for t in exact(joint.translation)]))
    turned = [
        _combined(expansion, columns, [constant(snap_number(e)) for e in column])
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
    """Return a matrix, given by columns, times a vector."""
    parts = [_scaled(expansion, column, weight) for column, weight in zip(columns, weights, strict=True)]
    return _sum(*parts)


def _scaled(expansion: Expansion, a: Vector, factor: Laurent) -> Vector:
    return [multiply(e, factor, expansion.budget).pruned(expansion.rounding) for e in a]


def _sum(*vectors: Vector) -> Vector:
    return [add(entries) for entries in zip(*vectors, strict=True)]


def _dot(expansion: Expansion, a: Vector, b: Vector) -> Laurent:
    return add(multiply(x, y, expansion.budget) for x, y in zip(a, b, strict=True)).pruned(expansion.rounding)
