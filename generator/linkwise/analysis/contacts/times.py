"""Times at which contacts are on: always, by a column of the motion's log, or by measured loads."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from linkwise_runtime.chosen_names import nearest_first
from linkwise_runtime.dynamics import Dynamics

from linkwise.analysis.column_matching import time_column
from linkwise.analysis.contacts import Contacts, WhileColumn
from linkwise.analysis.contacts.pressed import PRESSED
from linkwise.analysis.disk_rows import collected
from linkwise.analysis.loads import FORCE
from linkwise.analysis.loads.placed import PlacedLoad, Wrench, model_pose
from linkwise.analysis.loads.read import placed_loads
from linkwise.analysis.logs import Log
from linkwise.analysis.opened_robot import OpenedRobot
from linkwise.analysis.samples import finite_blocks
from linkwise.analysis.settings import Reading
from linkwise.arrays import Array, Mask
from linkwise.errors import LinkwiseError, within
from linkwise.escape import listed
from linkwise.progress import Progress

FLOOR = 1e-3
"""Least weight of a contact that is on, relative to the largest measured force: a plate may be missed."""


@dataclass(frozen=True, eq=False)
class Switch:
    """A column of the motion's log, (S, 2) of time in s and value; above a limit a contact is on."""

    given: WhileColumn
    rows: Array

    def on(self, time: Array) -> Mask:
        """Return whether the contact is on at each of the instants (S,)."""
        is_on: Mask = np.interp(time, self.rows[:, 0], self.rows[:, 1]) > self.given.above
        return is_on


@dataclass(frozen=True, eq=False)
class ContactTimes:
    """Contacts that are on at an instant, and the loads measured on them."""

    switches: tuple[Switch | None, ...]
    """Switch of each contact, None where no column says when it is on."""
    measured: tuple[tuple[PlacedLoad, ...], ...]
    """Measured loads on the body of each contact, empty where none were given."""
    least_force: float
    """Force in N above which measured loads switch a contact on."""

    @property
    def loads(self) -> tuple[PlacedLoad, ...]:
        """Measured loads of all contacts."""
        return tuple(load for some in self.measured for load in some)

    def record(self, number: int) -> dict[str, Any]:
        """Return, as plain data, when a contact is on and which loads were measured on it."""
        switch, loads = self.switches[number], self.measured[number]
        told: dict[str, Any] = {"on": "always"}
        if switch is not None:
            told = {"on": {"column": switch.given.column, "above": switch.given.above}}
        elif loads:
            told = {"on": {"force_above": self.least_force}}
        return told | ({"measured": [load.record() for load in loads]} if loads else {})

    def largest(self, number: int) -> str:
        """Return in words the largest value of what switches a contact on: a column, or measured loads."""
        switch = self.switches[number]
        if switch is not None:
            return f"{switch.given.column!r} is {switch.rows[:, 1].max():.4g} at most"
        force = [
            np.linalg.norm(load.as_measured.wrenches[0].table[:, FORCE], axis=1).max()
            for load in self.measured[number]
        ]
        return f"the loads on its body are {sum(force):.4g} N at most"

    def shares(self, model: Dynamics, time: Array, q: Array) -> Array:
        """Return the share (S, contacts) of each contact in forces that several could carry, 1 in all.

        The share of a contact that is off is 0. The instants are (S,), with the robot at q (S, n). Shares are
        in proportion to the measured forces if all contacts have them, else equal.
        """
        force = np.stack([_force(loads, model, time, q) for loads in self.measured], 1)
        on = np.stack([self._on(number, model, time, q) for number in range(len(self.switches))], 1)
        out = np.ones_like(force)
        if all(self.measured):
            out = np.maximum(force, FLOOR * force.max(axis=1, keepdims=True, initial=0.0))
            out = np.where(out.max(axis=1, keepdims=True) > 0.0, out, 1.0)
        out = out * on
        whole = out.sum(axis=1, keepdims=True)
        shares: Array = out / np.where(whole > 0.0, whole, 1.0)
        return shares

    def _on(self, number: int, model: Dynamics, time: Array, q: Array) -> Mask:
        switch, loads = self.switches[number], self.measured[number]
        if switch is not None:
            return switch.on(time)
        if not loads:
            return np.ones(len(time), dtype=np.bool_)
        is_on: Mask = _force([load.as_measured for load in loads], model, time, q) > self.least_force
        return is_on

    def press(self, model: Dynamics, time: Array, q: Array) -> Array:
        """Return where a load that is measured on each contact's body acts in the world, (S, contacts, 3).

        It is zero where no load is measured.
        """
        out = np.zeros((len(time), len(self.measured), 3))
        for number, loads in enumerate(self.measured):
            for load in _wrenches(loads[:1], model, time, q):
                out[:, number] = load.place
        return out

    def torque(self, model: Dynamics, time: Array, q: Array) -> Array:
        """Return the torques (S, n) that joints would need to carry the measured loads."""
        return sum((load.torque(model, time, q) for load in self.loads), np.zeros_like(q))

    def wrench(self, number: int, model: Dynamics, time: Array, q: Array, place: Array) -> Array:
        """Return the measured wrench (S, 6) in the world: moment about a place (S, 3), then force."""
        out = np.zeros((len(time), 6))
        for load in _wrenches(self.measured[number], model, time, q):
            out[:, :3] += load.moment + np.cross(load.place - place, load.force)
            out[:, 3:] += load.force
        return out


def _force(loads: Sequence[PlacedLoad], model: Dynamics, time: Array, q: Array) -> Array:
    """Return the magnitude (S,) of the force of loads together, in N."""
    pushes = [wrench.force for wrench in _wrenches(loads, model, time, q)]
    size: Array = np.linalg.norm(sum(pushes, np.zeros((len(time), 3))), axis=1)
    return size


def _wrenches(loads: Sequence[PlacedLoad], model: Dynamics, time: Array, q: Array) -> list[Wrench]:
    return [one.wrench(time, q, model_pose(model)) for load in loads for one in load.wrenches]


def contact_times(
    contacts: Contacts,
    log: Log,
    robot: OpenedRobot,
    reading: Reading,
    motion: Array,
    progress: Progress,
    buffer: Path | None,
) -> ContactTimes | None:
    """Return when a robot's contacts are on over the time (S,) of the motion; None without contacts.

    Raises LinkwiseError for columns that do not exist, and for loads that belong to no contact.
    """
    if robot.contacts is None:
        return None
    loads = placed_loads(contacts.measured, robot, motion, reading.ignore_extra, progress, buffer)
    names = robot.contacts.names
    given = [contacts.columns.get(name) for name in names]
    switches = tuple(None if one is None else read_switch(one, log, reading, progress) for one in given)
    found = _by_contact(robot, loads)
    for name, column, some in zip(names, switches, found, strict=True):
        if contacts.loads and column is None and not some:
            raise LinkwiseError(
                f"contact {name!r}: no load of --contact-loads acts on its body ({_told(loads)}); say when"
                f" it is on with --contact-while {name}=COLUMN"
            )
    for contact, some in zip(robot.ground.contacts, found, strict=True):
        if contact.kind in PRESSED and len(some) != 1:
            raise LinkwiseError(
                f"contact {contact.name!r} is {contact.kind}, and {len(some)} loads are measured on its body:"
                " it is where one presses; give that one with --contact-loads"
            )
    return ContactTimes(switches, found, contacts.least_force)


def _told(loads: Sequence[PlacedLoad]) -> str:
    return listed([f"{load.name} is on {load.bodies[0]}" for load in loads])


def switch_columns(contacts: Contacts, log: Log) -> tuple[str, ...]:
    """Return the columns of the motion's log that say when contacts are on.

    Raises LinkwiseError for a column that the log does not have.
    """
    for name, given in contacts.columns.items():
        if given.column not in log.columns:
            near = listed(map(repr, nearest_first(given.column, log.columns)))
            raise LinkwiseError(
                f"{log.path}: --contact-while {name}={given.column}: no column {given.column!r}; the log has"
                f" {near}; write it as NAME=COLUMN>VALUE"
            )
    return tuple(given.column for given in contacts.columns.values())


def read_switch(given: WhileColumn, log: Log, reading: Reading, progress: Progress) -> Switch:
    """Read the column of a switch from the log, with its time."""
    with within(str(log.path)):
        columns = time_column(log.columns, reading), list(log.columns).index(given.column)
    return Switch(given, collected(finite_blocks(log, columns, progress), 2, None))


def _by_contact(robot: OpenedRobot, loads: Sequence[PlacedLoad]) -> tuple[tuple[PlacedLoad, ...], ...]:
    """Return the loads on the body of each contact.

    Raises LinkwiseError for a load on another body, or on a body with two contacts.
    """
    bodies = [robot.joint_of(contact.frame) for contact in robot.ground.contacts]
    found: list[list[PlacedLoad]] = [[] for _ in bodies]
    for load in loads:
        there = [number for number, body in enumerate(bodies) if body == robot.joint_of(load.bodies[0])]
        if len(there) != 1:
            mend = "where no contact is; give it with --loads, or leave it out"
            if there:
                mend = (
                    "where two contacts are, of which it cannot be told apart; leave it out, and say when"
                    " they stand with --contact-while"
                )
            raise LinkwiseError(f"--contact-loads: load {load.name!r} acts on {load.bodies[0]!r}, {mend}")
        found[there[0]].append(load)
    return tuple(map(tuple, found))
