"""Rows of a result: the entries of each quantity that may differ from 0, and their places along its axes.

A result is one array (rows, samples). Quantity by quantity, a row is an entry of an array with the axes of
`QUANTITIES`; what is identically 0 has no row. Rows have names and units as columns of tables.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from linkwise_runtime.robot_axes import WRENCH, NamedAxis, axes_of

from linkwise.analysis.induced_points import InducedPoint
from linkwise.analysis.loads.placed import PlacedLoad
from linkwise.analysis.net_causes import cause_names
from linkwise.analysis.opened_robot import OpenedRobot, load_unit
from linkwise.analysis.result_quantities import (
    FORCE_OF,
    PASSIVE,
    POWER,
    POWER_TERMS,
    QUANTITIES,
    TORQUE_OF,
    ResultQuantity,
)
from linkwise.analysis.term_rows import TermArrays
from linkwise.arrays import Array, Index
from linkwise.escape import column_part

Place = tuple[str, tuple[int, ...]]
"""A quantity, and the index along each of its axes."""
DEVIATION, OF_MOTION = "sd/", "sd-motion/"
"""Beginning of the name of a quantity that is the standard deviation of the one named behind it."""
OVER_TIME = {"velocity": "/s", "acceleration": "/s²"}
FIELD_OF = {"load": "cause", "share": "cause", "contact": "cause", "constraint": "cause", "component": "row"}
FIELD_OF |= {"bearing": "point", "wrench": "row", "by": "cause"}
"""Fields of `Column` that have the indices along axes of other names."""


class QuantityRows(NamedTuple):
    """Rows of a quantity, ascending."""

    rows: slice | Index
    """Rows, as a slice where they follow each other."""
    numbers: Index
    """Numbers of the rows."""
    at: Index
    """Index along each axis of the quantity, (entries, axes)."""

    def listed(self) -> Iterator[tuple[int, list[int]]]:
        """Yield the number of each row, and its index along each axis."""
        return zip(self.numbers.tolist(), self.at.tolist(), strict=True)


@dataclass(frozen=True)
class Column:
    """A row as a column of a table; `joint`, `link` and `cause` are indices, None where they mean nothing.

    The cause is a coordinate; for a share with a name it is that share, for the torque of a load that load,
    for share and power of a contact that contact, for a net torque its number among all causes, and for a
    force or slip the row of the constraint, where `load` is the load that causes a force, if one does. An
    induced acceleration has the number of its point and of a row of that point, a reaction that of its joint
    among those asked for, and of a component of the wrench; the gain of energy has the holder of that energy,
    a link or, behind these, a joint's armature, and what is traced its source.
    """

    quantity: str
    name: str
    unit: str
    joint: int | None = None
    link: int | None = None
    cause: int | None = None
    point: int | None = None
    row: int | None = None
    load: int | None = None
    origin: int | None = None
    holder: int | None = None


@dataclass(frozen=True, eq=False)
class ResultRows:
    """The rows of a result of one robot; points are those whose acceleration is split."""

    axes: Mapping[str, NamedAxis]
    points: tuple[InducedPoint, ...]
    places: tuple[Place, ...]
    left_out: frozenset[str] = frozenset()
    """Quantities of which rows are left out, as nobody asked for them."""

    @classmethod
    def of(
        cls,
        robot: OpenedRobot,
        places: Iterable[Place],
        loads: Sequence[PlacedLoad] = (),
        points: Sequence[InducedPoint] = (),
        bearings: Sequence[str] = (),
        origins: Sequence[str] = (),
        left_out: frozenset[str] = frozenset(),
    ) -> "ResultRows":
        """Return rows at these places of the quantities of a robot with loads, points and bearing joints.

        origins: names of the sources of a trace, window of time by window
        left_out: quantities of which rows are left out
        """
        rows = robot.constraint_rows
        bases = tuple("rad" if " moment" in row else "m" if " force" in row else "" for row in rows)
        contacts = () if robot.contacts is None else robot.contacts.names
        components = {
            row: unit.partition("/")[0] for p in points for row, unit in zip(p.rows, p.units, strict=True)
        }
        axes = axes_of(robot.joints, robot.units, robot.links, robot.share_names) | {
            "load": NamedAxis("load", tuple(borne.name for borne in loads)),
            "by": NamedAxis("by", cause_names(robot, loads)),
            "constraint": NamedAxis("constraint", rows, bases),
            "contact": NamedAxis("contact", contacts),
            "holder": NamedAxis("holder", robot.holders),
            "point": NamedAxis("point", tuple(point.name for point in points)),
            "component": NamedAxis("component", tuple(components), tuple(components.values())),
            "origin": NamedAxis("origin", tuple(origins)),
            "bearing": NamedAxis("bearing", tuple(bearings)),
            "wrench": NamedAxis("wrench", WRENCH, ("rad",) * 3 + ("m",) * 3),
        }
        return cls(axes, tuple(points), tuple(places), left_out)

    def __len__(self) -> int:
        return len(self.places)

    def __contains__(self, name: object) -> bool:
        return name in self.named

    def __getitem__(self, name: str) -> QuantityRows:
        """Return the entries of a quantity; none where nothing of it is in the result."""
        found = self._entries.get(name)
        if found is None:
            found = self._entries[name] = self._entries_at(name, [])
        return found

    @cached_property
    def named(self) -> frozenset[str]:
        """Quantities that have rows."""
        return frozenset(name for name, _ in self.places)

    @cached_property
    def _entries(self) -> dict[str, QuantityRows]:
        found: dict[str, list[int]] = {}
        for row, (name, _) in enumerate(self.places):
            found.setdefault(name, []).append(row)
        return {name: self._entries_at(name, rows) for name, rows in found.items()}

    def _entries_at(self, name: str, rows: list[int]) -> QuantityRows:
        numbers, count = np.array(rows, np.intp), len(QUANTITIES[name].axes)
        at = np.array([self.places[row][1] for row in rows], np.intp).reshape(len(rows), count)
        first, end = (rows[0], rows[-1] + 1) if rows else (0, 0)
        return QuantityRows(slice(first, end) if end - first == len(rows) else numbers, numbers, at)

    def numbers(self, *names: str, **where: int | Sequence[int]) -> Index:
        """Return the numbers of the rows of quantities, at the given indices along axes only: joint=2."""
        found = [np.zeros(0, np.intp)]
        for name in names:
            _, numbers, at = self[name]
            for axis, index in where.items():
                along = at[:, QUANTITIES[name].axes.index(axis)]
                asked = along == index if isinstance(index, int) else np.isin(along, index)
                numbers, at = numbers[asked], at[asked]
            found.append(numbers)
        return np.concatenate(found)

    @cached_property
    def plain(self) -> int:
        """Number of the rows before those of deviations, which come last."""
        return sum(not name.startswith((DEVIATION, OF_MOTION)) for name, _ in self.places)

    @cached_property
    def _beside(self) -> dict[int, int]:
        places = {place: row for row, place in enumerate(self.places) if place[0].startswith(DEVIATION)}
        found = ((row, places.get((f"{DEVIATION}{name}", at))) for row, (name, at) in enumerate(self.places))
        return {row: beside for row, beside in found if beside is not None} if places else {}

    def deviations(self, numbers: Index) -> Index:
        """Return the numbers of the rows with the standard deviations of rows, of those that have one."""
        found = (self._beside.get(row) for row in numbers.tolist())
        return np.array([row for row in found if row is not None], np.intp)

    def index(self, row: int, axis: str) -> int:
        """Return the index of a row along an axis of its quantity."""
        name, at = self.places[row]
        return at[QUANTITIES[name].axes.index(axis)]

    def dense(self, name: str, values: Array) -> Array:
        """Return a quantity (S, *axes), zero where it has no row, from the rows of a result (rows, S)."""
        rows, _, at = self[name]
        out = np.zeros((values.shape[1], *(len(self.axes[axis].names) for axis in QUANTITIES[name].axes)))
        out[:, *at.T] = values[rows].T
        return out

    def put(self, out: Array, name: str, dense: Array) -> None:
        """Fill the rows of a quantity in `out` (rows, S) from its whole array (S, *axes)."""
        rows, _, at = self[name]
        out[rows] = dense[:, *at.T].T

    @cached_property
    def columns(self) -> tuple[Column, ...]:
        """Rows as columns of a table, with names and units."""
        return tuple(self._column(QUANTITIES[name], at) for name, at in self.places)

    def _column(self, quantity: ResultQuantity, at: tuple[int, ...]) -> Column:
        index = dict(zip(quantity.axes, at, strict=True))
        names = [self.axes[axis].names[index[axis]] for axis in quantity.written_axes]
        if quantity.name.rpartition("/")[2] == "slip":
            names = list(map(slip_name, names))
        fields: dict[str, int] = {}
        for axis, number in index.items():
            field = FIELD_OF.get(axis, axis)
            fields[field if field not in fields else axis] = number
        what, _, axis = quantity.array.unit.partition(":")
        base = self.axes[axis].units[index[axis]] if axis else what or "1"
        if "point" in index:
            point = self.points[index["point"]]
            fields["row"] = point.rows.index(names[1])
            base = point.units[fields["row"]].partition("/")[0]
        unit = load_unit(base) if what == "torque" else base + OVER_TIME.get(what, "")
        name = "/".join([quantity.name.removesuffix("_link"), *map(column_part, names)])
        return Column(quantity.name, name, unit, **fields)


def torque_places(
    robot: OpenedRobot,
    terms: TermArrays,
    loads: Sequence[PlacedLoad] = (),
    power_terms: bool = False,
    measured: Sequence[int] = (),
) -> list[Place]:
    """Return the places of a result's rows: time, motion, τ_i, τ_ij, terms, passive, loads, forces, power.

    measured: contacts whose loads were measured
    """
    out: list[Place] = [("time", ())]
    out += [(name, (i,)) for name in ("q", "qd", "qdd") for i in range(len(robot.joints))]
    out += [("tau", (i,)) for i in robot.driven]
    out += [("tau_link", (i, j)) for i, j, _ in terms.torque]
    out += [("tau_qdd", (i, j, k)) for i, j, k, _ in terms.acceleration]
    out += [("tau_qd", (i, j, k)) for i, j, k, _ in terms.velocity]
    if robot.is_written:
        out += [("tau_share", (i, j, m)) for i, j, m in robot.share_rows]
    else:
        out += [("tau_gravity", (i, j)) for i, j, _ in terms.gravity]
    own = {name: robot.with_own(field) for name, field in PASSIVE.items()}
    out += [(name, (i,)) for name, joints in own.items() for i in robot.joints_supporting(joints)]
    out += [
        ("tau_load", (i, e)) for e, borne in enumerate(loads) for i in robot.joints_supporting(borne.joints)
    ]
    if any(borne.is_muscle for borne in loads):
        out += [("tau_before_muscles", (i,)) for i in robot.driven]
    powers = (*POWER, *POWER_TERMS) if power_terms else POWER
    power = [(name, at) for name in powers for torque, at in out if torque == TORQUE_OF[name]]
    forces = [FORCE_OF[name] for name, joints in own.items() if joints]
    return [*out, *_forces(robot, forces, len(loads)), *_ground(robot, measured), *power]


def _forces(robot: OpenedRobot, own: Sequence[str], loads: int) -> Iterator[Place]:
    """Yield the places of constraint forces, row by row: whole, by link, by passive torque, by load."""
    for row in range(len(robot.constraint_rows)):
        yield "force", (row,)
        yield from (("force_link", (j, row)) for j in range(len(robot.links)))
        yield from ((name, (row,)) for name in own)
        yield from (("force_load", (row, e)) for e in range(loads))


def _ground(robot: OpenedRobot, measured: Sequence[int]) -> Iterator[Place]:
    """Yield the places of contacts: shares, power into links, slip, and what was measured there."""
    ground = robot.contacts
    if ground is None:
        return
    contacts = range(len(ground.names))
    yield from (("contact", (c,)) for c in contacts)
    yield from (("power_contact", (j, c)) for c in contacts for j in range(len(robot.links)))
    rows = range(robot.contact_rows.start, robot.contact_rows.stop)
    yield from (("slip", (row,)) for row in rows)
    for row, owner, part in zip(rows, ground.owners, ground.wrench_rows, strict=True):
        if owner in measured and part is not None:
            yield "force_measured", (row,)
    yield from (("tau_as_loads", (i,)) for i in robot.driven if measured)


def slip_name(row: str) -> str:
    """Return the name of a row's slip: "foot angular_x" for "foot moment_x", "foot x" for "foot force_x"."""
    name, _, force = row.rpartition(" ")
    return f"{name} {force.replace('moment_', 'angular_').replace('force_', '')}"
