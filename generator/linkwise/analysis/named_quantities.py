"""Quantities that a result's columns are entries of, with axes, named as in `robot.labelled`."""

from collections.abc import Mapping

from linkwise_runtime.call_table import CALLS, PASSIVE, POWER, PROPAGATION, TORQUE, Quantity

from linkwise.analysis.result_quantities import MEANING
from linkwise.analysis.result_quantities import Quantity as Kind

FORCE = "torque:constraint"
"""Unit of the force in a row of the constraints."""


def _one(column: Kind, name: str, axes: str, unit: str) -> dict[Kind, Quantity]:
    return {column: Quantity(name, tuple(axes.split()), unit, MEANING[column])}


def _by_source(
    columns: tuple[Kind, ...], name: str, axes: str, unit: str, meaning: str
) -> dict[Kind, Quantity]:
    """Return one quantity with springs, damping and so on side by side."""
    sources = [(column, column.rpartition("_")[2]) for column in columns]
    return {c: Quantity(name, tuple(axes.split()), unit, meaning, ("source", kind)) for c, kind in sources}


def _induced(column: Kind, name: str, axes: str = "") -> dict[Kind, Quantity]:
    return _one(column, name, f"point component {axes}", "acceleration:component")


COLUMNS: Mapping[Kind, Quantity] = {
    **_one("q", "q", "joint", "position:joint"),
    **_one("qd", "qd", "joint", "velocity:joint"),
    **_one("qdd", "qdd", "joint", "acceleration:joint"),
    **_one("tau", "torque", "joint", TORQUE),
    "tau_link": CALLS["partial_torque"].answers[0],
    "tau_qdd": PROPAGATION[0],
    "tau_qd": PROPAGATION[1],
    "tau_gravity": PROPAGATION[2],
    "tau_spring": PASSIVE[0],
    "tau_damping": PASSIVE[1],
    "tau_friction": PASSIVE[2],
    "tau_armature": PASSIVE[3],
    **_one("tau_load", "load_torque", "joint load", TORQUE),
    **_one("tau_as_loads", "torque_as_loads", "joint", TORQUE),
    **_one("force", "constraint_force", "constraint", FORCE),
    **_one("force_link", "constraint_force_by_link", "link constraint", FORCE),
    **_one("force_load", "constraint_force_by_load", "constraint load", FORCE),
    **_by_source(
        ("force_spring", "force_damping", "force_friction", "force_armature"),
        "constraint_force_by_source",
        "constraint",
        FORCE,
        "what the constraint bears of what joints have of their own",
    ),
    **_one("force_measured", "measured_force", "constraint", FORCE),
    **_one("contact", "contact_share", "contact", ""),
    **_one("slip", "slip", "constraint", "velocity:constraint"),
    **_one("power", "joint_power", "joint", "W"),
    **_one("power_link", "power", "joint link", "W"),
    **_one("power_load", "load_power", "joint load", "W"),
    **_one("power_contact", "contact_power", "link contact", "W"),
    "power_qdd": POWER[0],
    "power_qd": POWER[1],
    "power_gravity": POWER[2],
    **_by_source(
        ("power_spring", "power_damping", "power_friction", "power_armature"),
        "passive_power",
        "joint",
        "W",
        "power that the joint sends into what it has of its own",
    ),
    **_induced("acc", "induced"),
    **_induced("acc_tau", "induced_actuators", "cause"),
    **_induced("acc_qd", "induced_velocity", "link cause"),
    **_induced("acc_gravity", "induced_gravity", "link"),
    **_by_source(
        ("acc_spring", "acc_damping", "acc_friction"),
        "induced_passive",
        "point component cause",
        "acceleration:component",
        "acceleration by spring, damping and friction of the cause's joint alone",
    ),
    **_induced("acc_load", "induced_loads", "load"),
    **_induced("acc_constraint", "induced_constraints", "cause"),
    **_induced("acc_contact", "induced_contacts", "contact"),
    **_induced("acc_kinematic", "induced_kinematic", "cause"),
}
"""Named quantities by the quantity of the columns; the result has the axes of points."""

WORKS: Mapping[str, Quantity] = {
    name: Quantity(name, axes, "J", meaning)
    for name, axes, meaning in (
        ("work", ("joint", "link"), "what the joint gave to the link, and took back"),
        ("joint_work", ("joint",), "what the joint gave to all links together, and took back"),
        ("load_work", ("joint", "load"), "what the joint gave against the load, and took back"),
        ("contact_work", ("link", "contact"), "what the contact fed into the link, and took back"),
    )
}
"""Work over the whole movement, by the result's own names."""
