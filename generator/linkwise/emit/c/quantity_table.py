"""Table of the quantities in a robot's header: the meaning of each, and its unit."""

from collections.abc import Iterator
from itertools import product

from linkwise.emit.c.header import align_columns
from linkwise.package.potential_word import potential_word
from linkwise.symbolic.system import EnergySystem, System

FORCES = {"rad": "N m", "m": "N"}
"""Units of the force or torque at a joint, by the unit of its coordinate."""
INERTIAS = {
    ("rad", "rad"): "kg m^2",
    ("rad", "m"): "kg m",
    ("m", "rad"): "kg m",
    ("m", "m"): "kg",
}
"""Units of c2, by those of joints i and k."""
STIFFNESSES = {
    ("rad", "rad"): "N m/rad",
    ("rad", "m"): "N",
    ("m", "rad"): "N/rad",
    ("m", "m"): "N/m",
}
"""Units of c0, by those of joints i and k."""


def quantity_lines(system: System, linear: bool) -> Iterator[str]:
    """Return a table: each quantity, its unit for every two units of joints i and k, and its meaning.

    `linear` says whether an energy has terms linear in the velocities.
    """
    units = {coordinate.unit for coordinate in system.coordinates}
    kinds = [unit for unit in FORCES if unit in units]
    pairs = list(product(kinds, kinds))
    inertias = [INERTIAS[pair] for pair in pairs]
    dampings = [f"{unit}/s" for unit in inertias]
    forces = [FORCES[i] for i, _ in pairs]
    rows = [
        ["i, k in", *(f"{i}, {k}" for i, k in pairs), "what it is"],
        ["c2(i, j, k)", *inertias, "mass matrix of link j"],
        ["c1(i, j, k)", *dampings, _velocity(linear)],
        ["g(i, j)", *forces, f"torque at rest: {potential(system)}"],
        ["tau(i, j)", *forces, "the sum above"],
        ["c0(i, j, k)", *(STIFFNESSES[pair] for pair in pairs), "position gradient, d(tau(i, j))/d(q_k)"],
    ]
    if linear:
        what = "what energies linear in qd add to c1, as on a base that is moved"
        rows.append(["h1(i, j, k)", *dampings, what])
    return align_columns(rows)


def causes(system: System) -> str:
    """Return the causes of a link's torques, in words."""
    return (
        f"by its inertia and {'its potential energy' if isinstance(system, EnergySystem) else 'its weight'}"
    )


def _velocity(linear: bool) -> str:
    of = " of what is quadratic in qd, and h1" if linear else ""
    return f"velocity coefficients, 1/2 d(tau)/d(qd){of}"


def potential(system: System) -> str:
    """Return the word for g."""
    return potential_word(not isinstance(system, EnergySystem))
