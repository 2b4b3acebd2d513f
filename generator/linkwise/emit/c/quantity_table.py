"""Table of the quantities in a robot's header: the meaning of each, and its unit."""

from collections.abc import Iterator
from itertools import product

from linkwise.emit.c.header import align_columns
from linkwise.escape import c_comment
from linkwise.package.share_word import share_word
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


def quantity_lines(system: System, nonquadratic: bool) -> Iterator[str]:
    """Return a table: each quantity, its unit for every two units of joints i and k, and its meaning.

    `nonquadratic` says whether links have terms that are not quadratic in the velocities.
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
        ["c1(i, j, k)", *dampings, _velocity(nonquadratic)],
        ["g(i, j)", *forces, f"what has a name of its own: {potential(system)}"],
        ["tau(i, j)", *forces, "the sum above"],
        ["c0(i, j, k)", *(STIFFNESSES[pair] for pair in pairs), "position gradient, d(tau(i, j))/d(q_k)"],
    ]
    if nonquadratic:
        what = "2 c1 - d(tau)/d(qd): not all terms are quadratic in qd"
        rows.append(["h1(i, j, k)", *dampings, what])
    return align_columns(rows)


def causes(system: System) -> str:
    """Return the causes of a link's torques, in words."""
    return f"by its inertia and {potential(system) if isinstance(system, EnergySystem) else 'its weight'}"


def _velocity(nonquadratic: bool) -> str:
    more = " + h1/2" if nonquadratic else ""
    return f"velocity coefficients, 1/2 d(tau)/d(qd){more}"


def potential(system: System) -> str:
    """Return the word for g, for a comment."""
    return c_comment(share_word(system.share_names))
