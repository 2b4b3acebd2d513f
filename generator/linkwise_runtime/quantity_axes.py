"""What a robot computes, call by call: what each axis of an answer counts, and what its unit is made of.

Axes stand in the order of arrays, behind those of the samples: i the joint that is loaded, j the link
through which it is loaded, k the coordinate that moves, which here is called the cause.
"""

from collections.abc import Mapping
from typing import NamedTuple


class Quantity(NamedTuple):
    """An array of an answer."""

    name: str
    axes: tuple[str, ...]
    """Names of `robot_axes.NamedAxis`, such as joint; `moved` is what an induced acceleration is of."""
    unit: str
    """Factors of it over factors below: symbols, or what is measured along which axis."""
    meaning: str
    beside: tuple[str, str] | None = None
    """Where several arrays are entries of one along an axis more: its name, and the name of the entry."""


ORDER = "order"
"""The axis along which shares by acceleration stand beside those by velocity."""
TORQUE = "torque:joint"
PASSIVE_KINDS = ("spring", "damping", "friction", "armature")
IJK = ("joint", "link", "cause")
TAU_IJK = "on the joint, through the link, by the motion of the cause"


def _one(name: str, axes: str, unit: str, meaning: str) -> tuple[Quantity]:
    return (Quantity(name, tuple(axes.split()), unit, meaning),)


def _by_order(
    name: str, unit: tuple[str, str], gravity: tuple[str, str], meaning: str, more: str = ""
) -> tuple[Quantity, ...]:
    """Shares by acceleration, by velocity, and those of gravity, which have no cause: (name, unit)."""
    extra = tuple(more.split())
    return (
        Quantity(name, (*IJK, *extra), unit[0], meaning, (ORDER, "acceleration")),
        Quantity(name, (*IJK, *extra), unit[1], meaning, (ORDER, "velocity")),
        Quantity(gravity[0], (*IJK[:2], *extra), gravity[1], "the share of gravity and other potentials"),
    )


def _by_link(name: str, axes: str, unit: str, meaning: str) -> dict[str, tuple[Quantity, ...]]:
    """A sum over the links, and with the axis of links behind the first one."""
    first, *rest = axes.split()
    return {
        name: _one(name, axes, unit, meaning),
        f"{name}_by_link": _one(name, " ".join([first, "link", *rest]), unit, f"{meaning}, by link"),
    }


COEFFICIENT_UNITS = "~torque:joint / acceleration:cause", "torque:joint / velocity:cause"
"""Of c2 and c1; a ~ is for units that are told in kg, m and s."""
PROPAGATION = _by_order("propagation", (TORQUE, TORQUE), ("gravity", TORQUE), f"torque {TAU_IJK}")
POWER = _by_order("power_propagation", ("W", "W"), ("power_gravity", "W"), f"power {TAU_IJK}")
COEFFICIENTS = _by_order("coefficient", COEFFICIENT_UNITS, ("gravity", TORQUE), f"coefficient {TAU_IJK}")
PASSIVE = tuple(
    Quantity("passive_torque", ("joint",), TORQUE, "what the joint takes of its own", ("source", kind))
    for kind in PASSIVE_KINDS
)
QDD = _one("forward_dynamics", "joint", "acceleration:joint", "joint acceleration")

ARRAYS: Mapping[str, tuple[Quantity, ...]] = {
    "partial_torque": _one("partial_torque", "joint link", TORQUE, "torque on the joint, through the link"),
    "inverse_dynamics": _one("inverse_dynamics", "joint", TORQUE, "joint torque of all links"),
    "passive_torque": PASSIVE,
    "coefficients": COEFFICIENTS,
    "propagation": PROPAGATION,
    "gradient_propagation": PROPAGATION,
    "position_gradient": _one(
        "position_gradient", "joint link cause", "torque:joint / position:cause", f"stiffness {TAU_IJK}"
    ),
    "masked": _one("masked", "joint link", TORQUE, "chosen torques on the joint, through the link"),
    "regressor": _one(
        "regressor", "joint link parameter", "~torque:joint / place:parameter", "torque per parameter"
    ),
    "coefficient_regressors": _by_order(
        "coefficient_regressor",
        (f"{COEFFICIENT_UNITS[0]} place:parameter", f"~{COEFFICIENT_UNITS[1]} place:parameter"),
        ("gravity_regressor", "~torque:joint / place:parameter"),
        f"coefficient per parameter, {TAU_IJK}",
        "parameter",
    ),
    **_by_link("mass_matrix", "joint cause", COEFFICIENT_UNITS[0], "torque per acceleration of the cause"),
    **_by_link("coriolis_matrix", "joint cause", COEFFICIENT_UNITS[1], "torque per velocity of the cause"),
    **_by_link("gravity_torque", "joint", TORQUE, "torque of gravity and other potentials"),
    "forward_dynamics": QDD,
    "forward_dynamics_of_links": QDD,
    "energy": (
        Quantity("kinetic", ("link",), "J", "kinetic energy of the link"),
        Quantity("potential", ("link",), "J", "potential energy of the link"),
    ),
    "power": POWER,
    **_by_link(
        "christoffel",
        "joint cause other_cause",
        "~torque:joint / velocity:cause velocity:other_cause",
        "torque per pair of velocities",
    ),
}
"""Calls of `Dynamics` whose answers have one shape a sample."""

SOURCES = (
    ("actuators", "cause", "by what the actuator of the cause gives"),
    ("velocity", "link cause", "by velocity forces on the link, by the velocity of the cause"),
    ("gravity", "link", "by the weight of the link and other potentials"),
    ("passive", "source cause", "by spring, damping and friction of the cause"),
    ("loads", "load", "by the load"),
    ("constraints", "cause", "by constraints that turn with the velocity of the cause"),
    ("kinematic", "cause", "by the velocity of the cause, without any acceleration of a joint"),
)


def _induced(unit: str, what: str) -> tuple[Quantity, ...]:
    return tuple(Quantity(n, ("moved", *a.split()), unit, f"{what} {meaning}") for n, a, meaning in SOURCES)


MOTIONS: Mapping[str, tuple[Quantity, ...]] = {
    "natural_impedance": (
        Quantity("inertia", IJK, COEFFICIENT_UNITS[0], "torque per acceleration of the cause"),
        Quantity("damping", IJK, COEFFICIENT_UNITS[1], "torque per velocity of the cause"),
        Quantity("stiffness", IJK, "torque:joint / position:cause", "torque per position of the cause"),
    ),
    "induced_accelerations": _induced("acceleration:moved", "acceleration"),
    "induced_reactions": _induced("torque:moved", "force of the constraint"),
    "simulate": (
        Quantity("time", (), "s", "time"),
        Quantity("q", ("joint",), "position:joint", "joint position"),
        Quantity("qd", ("joint",), "velocity:joint", "joint velocity"),
        Quantity("tau", ("joint",), TORQUE, "what the actuators gave"),
        Quantity("energy", (), "J", "energy of links, springs and armature"),
        Quantity("work", (), "J", "work of actuators and loads, less what was lost"),
    ),
}
"""Calls of `Dynamics` on motion, whose axes hang on what is asked."""


def _frame(name: str, axes: str, unit: str, meaning: str) -> dict[str, tuple[Quantity, ...]]:
    return {f"kinematics.{name}": _one(name, axes, unit, meaning)}


KINEMATICS: Mapping[str, tuple[Quantity, ...]] = {
    **_frame("pose", "world own", "place:world / place:own", "of a place in the frame to one in the world"),
    **_frame(
        "poses", "frame world own", "place:world / place:own", "of a place in the frame to one in the world"
    ),
    **_frame(
        "jacobian",
        "component cause",
        "position:component / position:cause",
        "motion of the frame per motion of the cause",
    ),
    **_frame("jacobian_rate", "component cause", "velocity:component / position:cause", "its rate"),
    **_frame("velocity", "component", "velocity:component", "velocity of the frame"),
    **_frame("acceleration", "component", "acceleration:component", "acceleration of the frame"),
    **_frame("load_torque", "joint", TORQUE, "what the joint takes to bear the load"),
    **_frame("centre_of_mass", "axis", "position:axis", "centre of mass in the world"),
    **_frame("centre_of_mass_jacobian", "axis cause", "position:axis / position:cause", "its Jacobian"),
    **_frame("centre_of_mass_jacobian_rate", "axis cause", "velocity:axis / position:cause", "rate of that"),
}
"""Those of `Kinematics`."""


def _driven(quantity: Quantity) -> Quantity:
    """The same of the joints that constraints leave independent."""
    named = {"joint": "independent", "cause": "independent_cause"}
    unit = quantity.unit.replace("joint", "independent").replace("cause", "independent_cause")
    return quantity._replace(axes=tuple(named.get(axis, axis) for axis in quantity.axes), unit=unit)


def _tied(name: str, axes: str, unit: str, meaning: str) -> dict[str, tuple[Quantity, ...]]:
    return {f"constraints.{name}": _one(name, axes, unit, meaning)}


FORCE = "torque:constraint"
CONSTRAINTS: Mapping[str, tuple[Quantity, ...]] = {
    **_tied("violation", "constraint", "position:constraint", "how far the row is from closing"),
    **_tied(
        "jacobian", "constraint cause", "position:constraint / position:cause", "row per motion of the cause"
    ),
    **_tied("jacobian_rate", "constraint cause", "velocity:constraint / position:cause", "its rate"),
    **_tied("closed", "joint", "position:joint", "joint position in which all ties close"),
    **_tied(
        "velocity_map",
        "joint independent_cause",
        "position:joint / position:independent_cause",
        "motion of the joint per motion of the cause",
    ),
    **_tied("velocity", "joint", "velocity:joint", "joint velocity"),
    **_tied("acceleration", "joint", "acceleration:joint", "joint acceleration"),
    **_tied("velocity_accelerations", "joint cause", "acceleration:joint", "by the velocity of the cause"),
    **_tied("projected", "independent", "torque:independent", "torque on the independent joint"),
    **_tied("projected_by_link", "independent part", "torque:independent", "torque on the independent joint"),
    **{
        f"constraints.{call}": tuple(map(_driven, ARRAYS[call]))
        for call in ("inverse_dynamics", "partial_torque", "coefficients", "propagation")
    },
    **_tied("forces", "constraint link", FORCE, "what the row bears of the link"),
    **_tied("forces_of", "constraint", FORCE, "what the row bears"),
    **_tied("forces_of_by_link", "constraint part", FORCE, "what the row bears"),
    "constraints.forward_dynamics": (
        Quantity("qdd", ("joint",), "acceleration:joint", "joint acceleration"),
        Quantity("forces", ("constraint",), FORCE, "what the row bears"),
    ),
}
"""Those of `Constraints`."""

QUANTITIES: Mapping[str, tuple[Quantity, ...]] = {**ARRAYS, **MOTIONS, **KINEMATICS, **CONSTRAINTS}
"""Arrays of each call's answer, in order, by the call's name; `_by_link` is for calls with by_link=True."""
