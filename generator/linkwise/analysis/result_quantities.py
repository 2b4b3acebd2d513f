"""Quantities of a result, what they mean, and which are made of which."""

from typing import Literal

Quantity = Literal[
    "time",
    "q",
    "qd",
    "qdd",
    "tau",
    "tau_link",
    "tau_qdd",
    "tau_qd",
    "tau_gravity",
    "tau_spring",
    "tau_damping",
    "tau_friction",
    "tau_armature",
    "tau_load",
    "force",
    "force_link",
    "force_spring",
    "force_damping",
    "force_friction",
    "force_armature",
    "force_load",
    "force_measured",
    "tau_as_loads",
    "contact",
    "slip",
    "power",
    "power_link",
    "power_load",
    "power_contact",
    "power_qdd",
    "power_qd",
    "power_gravity",
    "power_spring",
    "power_damping",
    "power_friction",
    "power_armature",
    "acc",
    "acc_tau",
    "acc_qd",
    "acc_gravity",
    "acc_spring",
    "acc_damping",
    "acc_friction",
    "acc_load",
    "acc_constraint",
    "acc_contact",
    "acc_kinematic",
]
MEANING: dict[Quantity, str] = {
    "time": "time",
    "q": "joint coordinate",
    "qd": "joint velocity",
    "qdd": "joint acceleration",
    "tau": "joint torque: all links together, what the joint has of its own, and all loads",
    "tau_link": "partial torque: on the joint, through the link",
    "tau_qdd": "propagation torque: on the joint, through the link, by the cause's acceleration",
    "tau_qd": "propagation torque: on the joint, through the link, by the cause's velocity",
    "tau_gravity": "on the joint, through the link, by gravity and other potentials",
    "tau_spring": "what the joint takes for its own spring",
    "tau_damping": "what the joint takes for its own damping",
    "tau_friction": "what the joint takes for its own Coulomb friction",
    "tau_armature": "what the joint takes for its own armature, the inertia behind its gear",
    "tau_load": "what the joint takes to bear the load",
    "force": "what the constraint bears: all links together, what joints have of their own, and loads",
    "force_link": "what the constraint bears of the link",
    "force_spring": "what the constraint bears of joints' own springs",
    "force_damping": "what the constraint bears of joints' own damping",
    "force_friction": "what the constraint bears of joints' own Coulomb friction",
    "force_armature": "what the constraint bears of joints' own armatures",
    "force_load": "what the constraint bears of the load",
    "force_measured": "what was measured of the contact",
    "tau_as_loads": "joint torque with what was measured in place of what contacts bear",
    "contact": "share of the contact in what several could bear; 0 while it is off",
    "slip": "velocity of what the contact holds, while it is on",
    "power": "power of the joint: what it sends into all links together, what it has of its own, and loads",
    "power_link": "power that the joint sends into the link",
    "power_contact": "power that the contact feeds into the link as what it holds slips",
    "power_load": "power that the joint sends out against the load",
    "power_qdd": "power that the joint sends into the link, by the cause's acceleration",
    "power_qd": "power that the joint sends into the link, by the cause's velocity",
    "power_gravity": "power that the joint sends into the link, by gravity and other potentials",
    "power_spring": "power that the joint sends into its own spring",
    "power_damping": "power that the joint's own damping takes",
    "power_friction": "power that the joint's own Coulomb friction takes",
    "power_armature": "power that the joint sends into its own armature",
    "acc": "acceleration of the point, or joint: all sources together",
    "acc_tau": "acceleration by what the cause's joint gives alone",
    "acc_qd": "acceleration by velocity forces on the link, by the cause's velocity",
    "acc_gravity": "acceleration by the link's weight and other potentials alone",
    "acc_spring": "acceleration by the spring of the cause's joint alone",
    "acc_damping": "acceleration by the damping of the cause's joint alone",
    "acc_friction": "acceleration by the Coulomb friction of the cause's joint alone",
    "acc_load": "acceleration by the load alone",
    "acc_constraint": "acceleration by constraints that turn with the cause's velocity",
    "acc_contact": "acceleration by what the contact itself does, as what it holds turns and slips",
    "acc_kinematic": "acceleration of the point by the cause's velocity, without any of a joint",
}
INDUCED: tuple[Quantity, ...] = (
    "acc",
    "acc_tau",
    "acc_qd",
    "acc_gravity",
    "acc_spring",
    "acc_damping",
    "acc_friction",
    "acc_load",
    "acc_constraint",
    "acc_contact",
    "acc_kinematic",
)
"""An acceleration, and its shares by source."""
TERMS: tuple[Quantity, ...] = ("tau_qdd", "tau_qd", "tau_gravity")
"""The parts that sum to a partial torque."""
PASSIVE: dict[Quantity, str] = {
    "tau_spring": "stiffness",
    "tau_damping": "damping",
    "tau_friction": "friction",
    "tau_armature": "armature",
}
"""Parts of a joint's torque beside those of the links, in the order of `passive_torque`, each with the field
of a `PassiveEntry` that is zero where there is no such part."""
POWER: tuple[Quantity, ...] = ("power", "power_link", "power_load")
"""Power of joints, torque times velocity; contacts have power of their own, as they slip."""
POWER_TERMS: tuple[Quantity, ...] = (
    "power_qdd",
    "power_qd",
    "power_gravity",
    "power_spring",
    "power_damping",
    "power_friction",
    "power_armature",
)
"""Parts of the power that a joint sends into a link or its passive elements; in a result only on request."""
TORQUE_OF: dict[Quantity, Quantity] = dict(
    zip((*POWER, *POWER_TERMS), ("tau", "tau_link", "tau_load", *TERMS, *PASSIVE), strict=True)
)
"""The torque that a power is made of: P = τ q̇_i, term by term."""

FORCE_OF: dict[Quantity, Quantity] = {
    "tau_spring": "force_spring",
    "tau_damping": "force_damping",
    "tau_friction": "force_friction",
    "tau_armature": "force_armature",
    "tau_load": "force_load",
}
"""Constraint forces due to the torques that stand beside those of the links, by torque."""
FORCES: tuple[Quantity, ...] = ("force", "force_link", *FORCE_OF.values())
GROUND: tuple[Quantity, ...] = ("contact", "slip", "force_measured", "tau_as_loads", "power_contact")
"""Quantities of contacts beside the constraint forces."""
