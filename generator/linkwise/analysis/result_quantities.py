"""Quantities of a result: axes, unit and meaning of each, and which are made of which."""

from collections.abc import Mapping
from dataclasses import dataclass

from linkwise_runtime import call_table
from linkwise_runtime.call import Quantity
from linkwise_runtime.call_table import CALLS, DEVIATIONS, PASSIVE_KINDS, PROPAGATION, TORQUE

MOTION = ("tau_qdd", "tau_qd")
"""The parts of a partial torque by the motion of each joint."""
OF_RIGID = (*MOTION, "tau_gravity")
"""The parts that sum to a partial torque of a rigid link."""
TERMS = (*OF_RIGID, "tau_share")
"""The parts that sum to a partial torque: a link that was written by hand has named shares for gravity."""
PASSIVE = {
    "tau_spring": "stiffness",
    "tau_damping": "damping",
    "tau_friction": "friction",
    "tau_armature": "armature",
}
"""Parts of a joint's torque beside those of the links, in the order of `passive_torque`, each with the field
of a `PassiveJoint` that is zero where there is no such part."""
TORQUE_OF = {
    torque.replace("tau", "power", 1): torque for torque in ("tau", "tau_link", "tau_load", *TERMS, *PASSIVE)
}
"""The torque that a power is made of: P = τ q̇_i, term by term."""
POWER, POWER_TERMS = tuple(TORQUE_OF)[:3], tuple(TORQUE_OF)[3:]
"""Power of joints, and parts of it that are in a result only on request; contacts have power of their own, as
they slip."""
FORCE_OF = {torque: torque.replace("tau", "force", 1) for torque in (*PASSIVE, "tau_load")}
"""Constraint forces due to the torques that stand beside those of the links, by torque."""
FORCES = ("force", "force_link", *FORCE_OF.values())
GROUND = ("contact", "slip", "force_measured", "tau_as_loads", "power_contact")
"""Quantities of contacts beside the constraint forces."""
CERTAIN = (
    *("time", "contact", "force_measured", "tau_as_loads", "tau_before_muscles"),
    *("qd_from", "tau_from", "kinetic_from"),
)
"""Quantities without deviations: times, what is on, what was measured, what is traced."""
LOSSES = ("acc_spring", "acc_damping", "acc_friction")
"""Shares of passive torques in an acceleration, in the order of `passive_torque`."""

GAIN = "power that the link gets, or the armature,"
FLOW = "power through the joint"
BY_VELOCITY = "by velocity forces on all links, by the cause's velocity"
ARMATURE = "as an armature is inertia; it is an entry of the array with the other three"

TABLE = {
    "time": ("time", "time"),
    "q": ("q joint", "joint coordinate"),
    "qd": ("qd joint", "joint velocity"),
    "qdd": ("qdd joint", "joint acceleration"),
    "tau": ("torque joint", "joint torque: all links together, what the joint has of its own, and all loads"),
    "tau_link": ("", "partial torque: on the joint, through the link"),
    "tau_qdd": ("", "propagation torque: on the joint, through the link, by the cause's acceleration"),
    "tau_qd": ("", "propagation torque: on the joint, through the link, by the cause's velocity"),
    "tau_gravity": ("", "on the joint, through the link, by gravity"),
    "tau_share": ("", "on the joint, through the link: the share of this name"),
    "tau_spring": ("", "what the joint takes for its own spring"),
    "tau_damping": ("", "what the joint takes for its own damping"),
    "tau_friction": ("", "what the joint takes for its own Coulomb friction"),
    "tau_armature": ("", "what the joint takes for its own armature, the inertia behind its gear"),
    "tau_load": ("load_torque joint load", "what the joint takes to bear the load"),
    "tau_by": (
        "torque_by joint by",
        "on the joint, all links together, by the cause: a coordinate's acceleration and velocity together,"
        " gravity, a load, or what joints have of their own",
    ),
    "tau_as_loads": (
        "torque_as_loads joint",
        "joint torque with what was measured in place of what contacts bear",
    ),
    "tau_before_muscles": (
        "torque_before_muscles joint",
        "what inverse dynamics asks of the joint: joint torque, and the torques that muscles give about it",
    ),
    "force": (
        "constraint_force constraint",
        "what the constraint bears: all links together, what joints have of their own, and loads",
    ),
    "force_link": ("constraint_force_by_link link constraint", "what the constraint bears of the link"),
    "force_load": ("constraint_force_by_load constraint load", "what the constraint bears of the load"),
    "force_spring": ("", "what the constraint bears of joints' own springs"),
    "force_damping": ("", "what the constraint bears of joints' own damping"),
    "force_friction": ("", "what the constraint bears of joints' own Coulomb friction"),
    "force_armature": ("", "what the constraint bears of joints' own armatures"),
    "force_measured": ("measured_force constraint", "what was measured of the contact"),
    "contact": (
        "contact_share contact",
        "share of the contact in what several could bear; 0 while it is off",
    ),
    "slip": ("slip constraint", "velocity of what the contact holds, while it is on"),
    "power": (
        "joint_power joint",
        "power of the joint: what it sends into all links together, what it has of its own, and loads",
    ),
    "power_link": ("power joint link", "power that the joint sends into the link"),
    "power_load": ("load_power joint load", "power that the joint sends out against the load"),
    "power_contact": (
        "contact_power link contact",
        "power that the contact feeds into the link as what it holds slips",
    ),
    "power_qdd": ("", "power that the joint sends into the link, by the cause's acceleration"),
    "power_qd": ("", "power that the joint sends into the link, by the cause's velocity"),
    "power_gravity": ("", "power that the joint sends into the link, by gravity"),
    "power_share": (
        "named_power joint link share",
        "power that the joint sends into the link, by the share of this name",
    ),
    "power_spring": ("", "power that the joint sends into its own spring"),
    "power_damping": ("", "power that the joint's own damping takes"),
    "power_friction": ("", "power that the joint's own Coulomb friction takes"),
    "power_armature": ("", "power that the joint sends into its own armature"),
    "energy_kinetic": ("kinetic_energy link", "kinetic energy of the link"),
    "energy_potential": ("potential_energy link", "potential energy of the link"),
    "gain": (
        "energy_gain holder",
        "rate of the energy of the link, kinetic and potential, or of the joint's armature",
    ),
    "gain_tau": ("gain_actuators holder cause", f"{GAIN} by what the cause's joint gives alone"),
    "gain_qd": ("gain_velocity holder cause", f"{GAIN} {BY_VELOCITY}"),
    "gain_gravity": ("gain_gravity holder link", f"{GAIN} by the weight of the other link alone"),
    "gain_share": (
        "gain_shares holder link share",
        f"{GAIN} by the share of this name on the other link alone",
    ),
    "gain_spring": ("", f"{GAIN} by the spring of the cause's joint alone"),
    "gain_damping": ("", f"{GAIN} by the damping of the cause's joint alone"),
    "gain_friction": ("", f"{GAIN} by the Coulomb friction of the cause's joint alone"),
    "gain_armature": ("", f"none, {ARMATURE}"),
    "gain_load": ("gain_loads holder load", f"{GAIN} by the load alone"),
    "gain_constraint": (
        "gain_constraints holder cause",
        f"{GAIN} by constraints that turn with the cause's velocity",
    ),
    "gain_contact": (
        "gain_contacts holder contact",
        f"{GAIN} by what the contact itself does, as what it holds turns and slips",
    ),
    "flow_before": ("flow_before joint", "power that the body before the joint gives to it"),
    "flow": ("flow joint", "power that the joint gives to the body behind it: all sources together"),
    "flow_tau": ("flow_actuators joint cause", f"{FLOW} by what the cause's joint gives alone"),
    "flow_qd": ("flow_velocity joint cause", f"{FLOW} {BY_VELOCITY}"),
    "flow_gravity": ("flow_gravity joint link", f"{FLOW} by the weight of the link alone"),
    "flow_spring": ("", f"{FLOW} by the spring of the cause's joint alone"),
    "flow_damping": ("", f"{FLOW} by the damping of the cause's joint alone"),
    "flow_friction": ("", f"{FLOW} by the Coulomb friction of the cause's joint alone"),
    "flow_armature": ("", f"none, {ARMATURE}"),
    "flow_load": ("flow_loads joint load", f"{FLOW} by the load alone"),
    "flow_constraint": (
        "flow_constraints joint cause",
        f"{FLOW} by constraints that turn with the cause's velocity",
    ),
    "flow_contact": (
        "flow_contacts joint contact",
        f"{FLOW} by what the contact itself does, as what it holds turns and slips",
    ),
    "acc": ("induced point component", "acceleration of the point, or joint: all sources together"),
    "acc_tau": (
        "induced_actuators point component cause",
        "acceleration by what the cause's joint gives alone",
    ),
    "acc_qd": (
        "induced_velocity point component link cause",
        "acceleration by velocity forces on the link, by the cause's velocity",
    ),
    "acc_gravity": (
        "induced_gravity point component link",
        "acceleration by the link's weight alone",
    ),
    "acc_weight": ("induced_weight point component", "acceleration by the weight of all links alone"),
    "acc_velocity": (
        "induced_velocities point component",
        "acceleration by all that velocities do: forces on links, ties that turn, and the point's own",
    ),
    "acc_share": (
        "induced_shares point component link share",
        "acceleration by the share of this name on the link alone",
    ),
    "acc_spring": ("", "acceleration by the spring of the cause's joint alone"),
    "acc_damping": ("", "acceleration by the damping of the cause's joint alone"),
    "acc_friction": ("", "acceleration by the Coulomb friction of the cause's joint alone"),
    "acc_armature": ("", f"none, {ARMATURE}"),
    "acc_load": ("induced_loads point component load", "acceleration by the load alone"),
    "acc_constraint": (
        "induced_constraints point component cause",
        "acceleration by constraints that turn with the cause's velocity",
    ),
    "acc_contact": (
        "induced_contacts point component contact",
        "acceleration by what the contact itself does, as what it holds turns and slips",
    ),
    "qd_from": (
        "traced_velocity joint origin",
        "part of the joint's velocity that goes back to the source",
    ),
    "tau_from": (
        "traced_velocity_torque joint cause origin",
        "torque on the joint by the part of the cause's velocity that goes back to the source",
    ),
    "kinetic_from": (
        "traced_energy origin",
        "kinetic energy of the velocities that go back to the source, which it alone changes",
    ),
    "acc_kinematic": (
        "induced_kinematic point component cause",
        "acceleration of the point by the cause's velocity, without any of a joint",
    ),
    "reaction": (
        "reaction bearing wrench",
        "wrench that the joint carries: all links together, loads, and what ties and contacts pass on",
    ),
    "reaction_link": (
        "reaction_by_link bearing wrench link",
        "wrench that the joint carries of the link: of its motion and its weight",
    ),
    "reaction_qdd": (
        "reaction_acceleration bearing wrench cause",
        "wrench that the joint carries by the cause's acceleration, through all links",
    ),
    "reaction_qd": (
        "reaction_velocity bearing wrench cause",
        "wrench that the joint carries by the cause's velocity, through all links",
    ),
    "reaction_gravity": (
        "reaction_gravity bearing wrench link",
        "wrench that the joint carries by the link's weight",
    ),
    "reaction_spring": ("", "wrench that the joint carries as ties bear joints' own springs"),
    "reaction_damping": ("", "wrench that the joint carries as ties bear joints' own damping"),
    "reaction_friction": ("", "wrench that the joint carries as ties bear joints' own Coulomb friction"),
    "reaction_armature": ("", "wrench that the joint carries as ties bear joints' own armatures"),
    "reaction_load": ("reaction_loads bearing wrench load", "wrench that the joint carries of the load"),
}
"""Quantities, in the order of a Dataset: the array there with its axes, and the meaning.

An array without a name is called as in packages, or stands beside others of BY_SOURCE.
"""
DEVIATION_OF = {f"sd/{name}": name for name in TABLE if name not in CERTAIN}
"""Standard deviations, and the quantities that they are of."""
NOISE_OF = {f"sd-motion/{name}": name for name in DEVIATION_OF.values()}
"""Parts of these by noise of motion, where it is not alone, and the quantities that they are of."""
BY_SOURCE = {
    "force": (
        "constraint_force_by_source constraint",
        "what the constraint bears of what joints have of their own",
    ),
    "reaction": (
        "reaction_by_source bearing wrench",
        "wrench that the joint carries as ties bear what joints have of their own",
    ),
    "power": ("passive_power joint", "power that the joint sends into what it has of its own"),
    "gain": (
        "gain_passive holder cause",
        f"{GAIN} by spring, damping and friction of the cause's joint alone",
    ),
    "flow": (
        "flow_passive joint cause",
        f"{FLOW} by spring, damping and friction of the cause's joint alone",
    ),
    "acc": (
        "induced_passive point component cause",
        "acceleration by spring, damping and friction of the cause's joint alone",
    ),
}
"""Name with axes, and meaning, of arrays in which springs, damping and so on stand side by side."""
UNITS = {"tau": TORQUE, "force": "torque:constraint", "power": "W", "acc": "acceleration:component"}
UNITS |= {"time": "s", "q": "position:joint", "qd": "velocity:joint", "qdd": "acceleration:joint"}
UNITS |= {"energy": "J", "kinetic": "J", "gain": "W", "flow": "W", "reaction": "torque:wrench"}
UNITS |= {"contact": "", "slip": "velocity:constraint"}
"""Unit by the first part of a name, as the runtime writes it: torque:joint depends on the joint."""
PLACES = {"tau_link": 0, "tau_qdd": 3, "tau_qd": 4, "tau_gravity": 5, "tau": 6}
"""Places of deviations in what `uncertainty` answers."""
OF_PACKAGES = {
    "tau_link": CALLS["partial_torque"].answers[0],
    **dict(zip(OF_RIGID, PROPAGATION, strict=True)),
    "tau_share": CALLS["named_shares"].answers[0],
    **{f"sd/{name}": DEVIATIONS[number] for name, number in PLACES.items()},
    **dict(zip(PASSIVE, call_table.PASSIVE, strict=True)),
    **dict(zip(POWER_TERMS, call_table.POWER, strict=False)),  # whose last is that of gravity
}
"""Arrays that are called as those of `robot.labelled` in a package."""
LINK_LAST = ("constraint", "contact", "link")
"""Order of these axes in names of columns; an array has the link first."""


@dataclass(frozen=True)
class ResultQuantity:
    """A quantity of a result: an array over time and along its axes, whose entries are columns."""

    name: str
    """Name, which those of its columns begin with; shares by link begin as their sum does."""
    meaning: str
    array: Quantity
    """Array of a Dataset that this is, or of which it is an entry along a further axis."""

    @property
    def axes(self) -> tuple[str, ...]:
        """Axes after that of time: joint, link, holder, cause, load, constraint, contact, point, ..."""
        return self.array.axes

    @property
    def written_axes(self) -> tuple[str, ...]:
        """Axes in their order in names of columns."""
        moved = iter(sorted(set(LINK_LAST).intersection(self.axes), key=LINK_LAST.index))
        return tuple(next(moved) if axis in LINK_LAST else axis for axis in self.axes)


def _array(name: str) -> Quantity:
    if name in OF_PACKAGES:
        return OF_PACKAGES[name]
    for of, suffix in ((DEVIATION_OF, "sd"), (NOISE_OF, "motion_sd")):
        if name in of:
            own = _array(of[name])
            return own._replace(name=f"{own.name}_{suffix}", meaning=f"standard deviation of: {own.meaning}")
    first, _, source = name.partition("_")
    beside = ("source", source) if source in PASSIVE_KINDS else None
    text, meaning = TABLE[name] if beside is None else BY_SOURCE[first]
    array, *axes = text.split()
    return Quantity(array, tuple(axes), UNITS[first], meaning, beside)


QUANTITIES: Mapping[str, ResultQuantity] = {
    **{name: ResultQuantity(name, meaning, _array(name)) for name, (_, meaning) in TABLE.items()},
    **{
        name: ResultQuantity(name, f"standard deviation{by} of: {TABLE[of][1]}", _array(name))
        for every, by in ((DEVIATION_OF, ""), (NOISE_OF, " by noise of motion"))
        for name, of in every.items()
    },
}
"""All quantities by name, in the order of a Dataset."""
REACTION_OF = {torque: torque.replace("tau", "reaction", 1) for torque in PASSIVE}
"""Parts of a reaction by what ties do not carry of joints' passive torques, by torque."""
REACTIONS = tuple(name for name in QUANTITIES if name.partition("_")[0] == "reaction")
"""Wrenches of joints, and their shares by cause."""
TRACED = ("qd_from", "tau_from", "kinetic_from")
"""Velocities, what they ask for, and their energies, by the sources that they came from."""
INDUCED = tuple(name for name in QUANTITIES if name.partition("_")[0] == "acc")
"""An acceleration, and its shares by source."""
BY_POWER = tuple(name for name in QUANTITIES if name.partition("_")[0] in ("energy", "gain", "flow"))
"""Energies of links, the power that they get by source, and that which flows through joints."""
WORK_BY_SOURCE = tuple(name for name in BY_POWER if not name.startswith("energy"))
"""Powers by source, whose work is kept too."""
OVER_MOVEMENT = {
    "work": ("power_link", "what the joint gave to the link, and took back"),
    "joint_work": ("power", "what the joint gave to all links together, and took back"),
    "load_work": ("power_load", "what the joint gave against the load, and took back"),
    "contact_work": ("power_contact", "what the contact fed into the link, and took back"),
}
POWER_OF = {name: power for name, (power, _) in OVER_MOVEMENT.items()}
"""The power that a work over the whole movement is the integral of, by the result's own names."""
WORKS: Mapping[str, Quantity] = {
    name: Quantity(name, QUANTITIES[power].axes, "J", meaning)
    for name, (power, meaning) in OVER_MOVEMENT.items()
}
"""Work over the whole movement."""
OF_BODIES = frozenset(
    name
    for name in DEVIATION_OF.values()
    if name.partition("_")[0] in ("force", "energy", "gain", "flow", "acc", "reaction")
) | {*OF_RIGID, "tau", "tau_link", *(power for power, torque in TORQUE_OF.items() if torque in OF_RIGID)}
OF_BODIES |= {"tau_by", "power", "power_link", "power_contact"}
"""Quantities that bodies make uncertain."""
OF_LOADS = frozenset(name for name in OF_BODIES if name not in OF_RIGID and not name.startswith("energy")) | {
    "tau_load",
    "power_load",
}
"""Quantities that loads make uncertain."""
