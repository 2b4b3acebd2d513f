"""Columns of a result: the quantity of each, its joint, link and cause, and its unit."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from linkwise.analysis.loaded_robot import LoadedRobot
from linkwise.analysis.loads.placed_load import PlacedLoad
from linkwise.analysis.result_quantities import FORCE_OF, PASSIVE, POWER, POWER_TERMS, TORQUE_OF, Quantity
from linkwise.analysis.term_rows import TermRows
from linkwise.escape import column_part

Key = tuple[Quantity, int | None, int | None, int | None]
"""Identity of a column, without names: quantity, joint, link, cause."""


@dataclass(frozen=True)
class Column:
    """One column; `joint`, `link` and `cause` are indices, None where they mean nothing.

    The cause is a coordinate; for the torque of a load it is that load, for share and power of a contact that
    contact, and for a force or slip the row of the constraint, where `load` is the load that causes a force,
    if one does. An induced acceleration has the number of its point and of a row of that point.
    """

    quantity: Quantity
    name: str
    unit: str
    joint: int | None = None
    link: int | None = None
    cause: int | None = None
    point: int | None = None
    row: int | None = None
    load: int | None = None

    @property
    def key(self) -> Key:
        """Identity of the column, without names: quantity, joint, link, cause."""
        return self.quantity, self.joint, self.link, self.cause


def load_unit(unit: str) -> str:
    """Return the unit of torque or force on a joint whose coordinate is in `unit`, "rad" or "m"."""
    return "N·m" if unit == "rad" else "N"


def force_unit(row: str) -> str:
    """Return the unit of force in a constraint's row; a coupling's depends on the unit of its sum."""
    return "N·m" if " moment" in row else "N" if " force" in row else "N·m or N"


def columns_of(
    robot: LoadedRobot,
    terms: TermRows,
    loads: Sequence[PlacedLoad] = (),
    power_terms: bool = False,
    measured: Sequence[int] = (),
) -> tuple[Column, ...]:
    """Return the columns of a result; what is identically 0 has none.

    They are in order: time, motion, τ_i, τ_ij, terms, passive torques, loads, forces, contacts, power.

    measured: contacts whose loads were measured
    """
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

    for i, j, _ in terms.torque:
        load("tau_link", "tau", i, j)
    for i, j, k, _ in terms.acceleration:
        load("tau_qdd", "tau_qdd", i, j, k)
    for i, j, k, _ in terms.velocity:
        load("tau_qd", "tau_qd", i, j, k)
    for i, j, _ in terms.gravity:
        load("tau_gravity", "tau_gravity", i, j)
    for share, number in PASSIVE.items():
        for i in robot.borne_by({own.coordinate for own in robot.passive if getattr(own, number)}):
            out.append(Column(share, f"{share}/{column_part(robot.joints[i])}", load_unit(robot.units[i]), i))
    for e, borne in enumerate(loads):
        for i in robot.borne_by(borne.seat.joints):
            name = "/".join(["tau_load", *map(column_part, (robot.joints[i], borne.name))])
            out.append(Column("tau_load", name, load_unit(robot.units[i]), i, cause=e))
    powers = _powers(out, (*POWER, *POWER_TERMS) if power_terms else POWER)
    return *out, *_forces(robot, loads), *_ground(robot, measured), *powers


def _forces(robot: LoadedRobot, loads: Sequence[PlacedLoad]) -> Iterator[Column]:
    """Yield the columns of constraint forces, row by row: whole, by link, by passive torque, by load."""
    own = [share for share, number in PASSIVE.items() if any(getattr(one, number) for one in robot.passive)]
    for row, name in enumerate(robot.constraint_rows):
        part, unit = column_part(name), force_unit(name)
        yield Column("force", f"force/{part}", unit, cause=row)
        for j, link in enumerate(robot.links):
            yield Column("force_link", f"force/{part}/{column_part(link)}", unit, link=j, cause=row)
        for share in own:
            yield Column(FORCE_OF[share], f"{FORCE_OF[share]}/{part}", unit, cause=row)
        for e, borne in enumerate(loads):
            yield Column(
                "force_load", f"force_load/{part}/{column_part(borne.name)}", unit, cause=row, load=e
            )


def _ground(robot: LoadedRobot, measured: Sequence[int]) -> Iterator[Column]:
    """Yield the columns of contacts: shares, power into links, slip, and what was measured there."""
    ground = robot.contacts
    if ground is None:
        return
    for number, name in enumerate(ground.names):
        yield Column("contact", f"contact/{column_part(name)}", "1", cause=number)
    for number, name in enumerate(ground.names):
        for j, link in enumerate(robot.links):
            named = "/".join(["power_contact", column_part(name), column_part(link)])
            yield Column("power_contact", named, "W", link=j, cause=number)
    first = len(robot.constraint_rows) - len(ground.rows)
    for row, name in enumerate(ground.rows, first):
        unit = "rad/s" if force_unit(name) == "N·m" else "m/s"
        yield Column("slip", f"slip/{column_part(slip_name(name))}", unit, cause=row)
    for row, name in enumerate(ground.rows, first):
        if ground.owners[row - first] in measured and ground.wrench_rows[row - first] is not None:
            yield Column("force_measured", f"force_measured/{column_part(name)}", force_unit(name), cause=row)
    for i in robot.driven if measured else ():
        joint = column_part(robot.joints[i])
        yield Column("tau_as_loads", f"tau_as_loads/{joint}", load_unit(robot.units[i]), i)


def slip_name(row: str) -> str:
    """Return the name of a row's slip: "foot angular_x" for "foot moment_x", "foot x" for "foot force_x"."""
    name, _, force = row.rpartition(" ")
    return f"{name} {force.replace('moment_', 'angular_').replace('force_', '')}"


def _powers(columns: Sequence[Column], quantities: Sequence[Quantity]) -> Iterator[Column]:
    """Yield the power columns of the given quantities, named like the torques that they are made of."""
    for quantity in quantities:
        for c in columns:
            if c.quantity == TORQUE_OF[quantity]:
                name = c.name.replace("tau", "power", 1)
                yield Column(quantity, name, "W", c.joint, c.link, c.cause)
