"""When contacts are on: always, by a column of the motion's log, or by measured loads on their bodies."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from linkwise.analysis.column_matching import time_column
from linkwise.analysis.contacts.given_contacts import Contacts, WhileColumn
from linkwise.analysis.loaded_robot import LoadedRobot
from linkwise.analysis.loads.placed_load import PlacedLoad, Wrench, model_pose
from linkwise.analysis.loads.read_loads import placed_loads
from linkwise.analysis.logs import open_log
from linkwise.analysis.samples import collected, finite_blocks
from linkwise.analysis.settings import Reading
from linkwise.errors import LinkwiseError, within
from linkwise.escape import listed
from linkwise.package.load import Array, Model
from linkwise.progress import Progress

TINY = 1e-6
"""N; nothing, beside what a force plate reads."""


@dataclass(frozen=True, eq=False)
class ContactTimes:
    """Which contacts are on at an instant, and what was measured of them."""

    series: tuple[Array | None, ...]
    """Of each contact rows of time in s, value, and the value above which it is on, (S, 3); or None."""
    measured: tuple[tuple[PlacedLoad, ...], ...]
    """Of each contact the loads on its body, where such were given."""
    least_force: float
    """In N."""

    @property
    def loads(self) -> tuple[PlacedLoad, ...]:
        """Those of all contacts."""
        return tuple(load for some in self.measured for load in some)

    def shares(self, model: Model, time: Array, q: Array) -> Array:
        """Of what contacts could bear in several ways, (S, contacts): 0 of those that are off, 1 in all.

        At instants (S,) with the robot at q (S, n). In proportion to the measured forces where all contacts
        have such, else alike.
        """
        out = np.ones((len(time), len(self.series)))
        for number, (series, loads) in enumerate(zip(self.series, self.measured, strict=True)):
            pushes = [wrench.force for wrench in _wrenches(loads, model, time, q)]
            force = np.linalg.norm(sum(pushes, np.zeros((len(time), 3))), axis=1)
            if series is not None:
                is_on = np.interp(time, series[:, 0], series[:, 1]) > series[0, 2]
            else:
                is_on = force > self.least_force if loads else np.ones(len(time), dtype=bool)
            out[:, number] = is_on * (np.maximum(force, TINY) if all(self.measured) else 1.0)
        shares: Array = out / np.maximum(out.sum(axis=1, keepdims=True), TINY)
        return shares

    def torque(self, model: Model, time: Array, q: Array) -> Array:
        """What joints would take to bear the measured loads, (S, n)."""
        return sum((load.torque(model, time, q) for load in self.loads), np.zeros_like(q))

    def wrench(self, number: int, model: Model, time: Array, q: Array, place: Array) -> Array:
        """What was measured of a contact: moment about a place (S, 3) in the world, and force, (S, 6)."""
        out = np.zeros((len(time), 6))
        for load in _wrenches(self.measured[number], model, time, q):
            out[:, :3] += load.moment + np.cross(load.place - place, load.force)
            out[:, 3:] += load.force
        return out


def _wrenches(loads: Sequence[PlacedLoad], model: Model, time: Array, q: Array) -> list[Wrench]:
    return [load.wrench(time, q, model_pose(model)) for load in loads]


def contact_times(
    contacts: Contacts,
    log: Path,
    robot: LoadedRobot,
    reading: Reading,
    motion: Array,
    progress: Progress,
    buffer: Path | None,
) -> ContactTimes | None:
    """When a robot's contacts are on over the motion's time (S,) of its log; None without contacts.

    Raises LinkwiseError for columns that are not there, and loads that belong to no contact.
    """
    if robot.contacts is None:
        return None
    loads = placed_loads(contacts.measured, robot, motion, reading.ignore_extra, progress, buffer)
    names = robot.contacts.names
    series = tuple(_series(contacts.columns.get(name), log, reading, progress) for name in names)
    found = _by_contact(robot, loads)
    for name, column, some in zip(names, series, found, strict=True):
        if contacts.loads and column is None and not some:
            raise LinkwiseError(
                f"contact {name!r}: no load of --contact-loads acts on its body ({_told(loads)}); say when"
                f" it is on with --contact-while {name}=COLUMN"
            )
    return ContactTimes(series, found, contacts.least_force)


def _told(loads: Sequence[PlacedLoad]) -> str:
    return listed([f"{load.name} is on {load.seat.frame.name}" for load in loads])


def switch_columns(contacts: Contacts, log: Path) -> tuple[str, ...]:
    """Columns of the motion's log that say when contacts are on; raises LinkwiseError for one not there."""
    there = open_log(log).columns if contacts.columns else ()
    for name, given in contacts.columns.items():
        if given.column not in there:
            raise LinkwiseError(
                f"{log}: --contact-while {name}={given.column}: no column {given.column!r}; the log has"
                f" {listed(map(repr, there))}"
            )
    return tuple(given.column for given in contacts.columns.values())


def _series(given: WhileColumn | None, log: Path, reading: Reading, progress: Progress) -> Array | None:
    if given is None:
        return None
    opened = open_log(log)
    with within(str(log)):
        columns = time_column(opened.columns, reading), list(opened.columns).index(given.column)
    rows = collected(finite_blocks(opened, log, columns, progress), 2, None)
    return np.column_stack([rows, np.full(len(rows), given.above)])


def _by_contact(robot: LoadedRobot, loads: Sequence[PlacedLoad]) -> tuple[tuple[PlacedLoad, ...], ...]:
    """Loads on the body of each contact; raises LinkwiseError for one on another, or on that of two."""
    tree, ground = robot.package.manifest.tree, robot.contacts
    assert tree is not None
    assert ground is not None
    body = {frame.name: frame.body for frame in tree.frames}
    found: list[list[PlacedLoad]] = [[] for _ in ground.contacts]
    for load in loads:
        there = [
            number
            for number, contact in enumerate(ground.contacts)
            if body[str(contact.frame)] == load.seat.frame.body
        ]
        if len(there) != 1:
            stands = "two contacts are, of which it cannot be told apart" if there else "no contact is"
            raise LinkwiseError(
                f"--contact-loads: load {load.name!r} acts on {load.seat.frame.name!r}, where {stands}; give"
                " it with --loads, or leave it out"
            )
        found[there[0]].append(load)
    return tuple(map(tuple, found))
