"""The columns of a result: what each holds, of which joint, link and cause, in which unit."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Literal

from linkwise.analysis.loaded_robot import LoadedRobot
from linkwise.analysis.loads.placed_load import PlacedLoad
from linkwise.escape import column_part
from linkwise.package.load import PackedLayout

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
    "power",
    "power_link",
    "power_load",
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
    "power": "power of the joint: what it sends into all links together, what it has of its own, and loads",
    "power_link": "power that the joint sends into the link",
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
"""Beside the links' what a joint's torque consists of, in the order of `passive_torque`, and the number that
says whether a joint has it."""
POWER: tuple[Quantity, ...] = ("power", "power_link", "power_load")
POWER_TERMS: tuple[Quantity, ...] = (
    "power_qdd",
    "power_qd",
    "power_gravity",
    "power_spring",
    "power_damping",
    "power_friction",
    "power_armature",
)
"""The parts of what a joint sends into a link, or into its own; in a result where they are asked for."""
TORQUE_OF: dict[Quantity, Quantity] = dict(
    zip((*POWER, *POWER_TERMS), ("tau", "tau_link", "tau_load", *TERMS, *PASSIVE), strict=True)
)
"""The torque that a power is made of: P = τ q̇_i, term by term."""

FORCES: tuple[Quantity, ...] = ("force", "force_link")

Key = tuple[Quantity, int | None, int | None, int | None]
"""What identifies a column, without names: quantity, joint, link, cause."""


@dataclass(frozen=True)
class Column:
    """One column; `joint`, `link` and `cause` are indices, None where they mean nothing.

    The cause is a coordinate; of what a load asks for the load, of what a constraint bears its row. An
    induced acceleration is of a point, by its number, and has a row of that point's.
    """

    quantity: Quantity
    name: str
    unit: str
    joint: int | None = None
    link: int | None = None
    cause: int | None = None
    point: int | None = None
    row: int | None = None

    @property
    def key(self) -> Key:
        """What identifies the column, without names."""
        return self.quantity, self.joint, self.link, self.cause


def load_unit(unit: str) -> str:
    """Unit of the load on a joint whose coordinate is in `unit`, "rad" or "m"."""
    return "N·m" if unit == "rad" else "N"


def force_unit(row: str) -> str:
    """Unit of what a row of the constraints bears; a coupling's is on the unit of its sum."""
    return "N·m" if " moment" in row else "N" if " force" in row else "N·m or N"


def columns_of(
    robot: LoadedRobot, layout: PackedLayout, loads: Sequence[PlacedLoad] = (), power_terms: bool = False
) -> tuple[Column, ...]:
    """Columns in order: time, motion, τ_i, τ_ij, terms, the joints' own, loads, power; none for what is 0."""
    out = [Column("time", "time", "s")]
    motions: tuple[tuple[Quantity, str], ...] = (("q", ""), ("qd", "/s"), ("qdd", "/s²"))
    for quantity, suffix in motions:
        for i, joint in enumerate(robot.joints):
            out.append(Column(quantity, f"{quantity}/{column_part(joint)}", robot.units[i] + suffix, i))
    for i in robot.driven:
        out.append(Column("tau", f"tau/{column_part(robot.joints[i])}", load_unit(robot.units[i]), i))

    def load(quantity: Quantity, prefix: str, i: int, j: int, k: int | None = None) -> None:
        parts = [robot.joints[i], robot.links[j], *([robot.joints[k]] if k is not None else [])]
        name = "/".join([prefix, *map(column_part, parts)])
        out.append(Column(quantity, name, load_unit(robot.units[i]), i, j, k))

    for i, j in sorted(map(tuple, layout.torque.tolist())):
        load("tau_link", "tau", i, j)
    for i, j, k, _ in mirrored(layout):
        load("tau_qdd", "tau_qdd", i, j, k)
    for i, j, k in sorted(map(tuple, layout.velocity.tolist())):
        load("tau_qd", "tau_qd", i, j, k)
    for i, j in sorted(map(tuple, layout.gravity.tolist())):
        load("tau_gravity", "tau_gravity", i, j)
    for share, number in PASSIVE.items():
        for i in robot.borne_by({own.coordinate for own in robot.passive if getattr(own, number)}):
            out.append(Column(share, f"{share}/{column_part(robot.joints[i])}", load_unit(robot.units[i]), i))
    for e, borne in enumerate(loads):
        for i in robot.borne_by(borne.seat.joints):
            name = "/".join(["tau_load", *map(column_part, (robot.joints[i], borne.name))])
            out.append(Column("tau_load", name, load_unit(robot.units[i]), i, cause=e))
    return *out, *_forces(robot), *_powers(out, (*POWER, *POWER_TERMS) if power_terms else POWER)


def _forces(robot: LoadedRobot) -> Iterator[Column]:
    """What each row of the constraints bears, of all and of each link."""
    if robot.constrained is None:
        return
    for row, name in enumerate(robot.constrained.constraints.rows):
        part, unit = column_part(name), force_unit(name)
        yield Column("force", f"force/{part}", unit, cause=row)
        for j, link in enumerate(robot.links):
            yield Column("force_link", f"force/{part}/{column_part(link)}", unit, link=j, cause=row)


def _powers(columns: Sequence[Column], quantities: Sequence[Quantity]) -> Iterator[Column]:
    """The powers of all torques that are asked for, named like these."""
    for quantity in quantities:
        for c in columns:
            if c.quantity == TORQUE_OF[quantity]:
                name = c.name.replace("tau", "power", 1)
                yield Column(quantity, name, "W", c.joint, c.link, c.cause)


def mirrored(layout: PackedLayout) -> list[tuple[int, int, int, int]]:
    """All (i, j, k, source) of c2, sorted: only i ≤ k is stored, and c2 is symmetric in i and k."""
    rows = set()
    for source, (i, j, k) in enumerate(layout.acceleration.tolist()):
        rows |= {(i, j, k, source), (k, j, i, source)}
    return sorted(rows)
