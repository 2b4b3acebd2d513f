"""Phases of a movement, such as stance and swing: while a load or contact acts, by a column, or by time."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from linkwise.analysis.contacts import THRESHOLD, WhileColumn
from linkwise.analysis.contacts.times import Switch, read_switch
from linkwise.analysis.loads.placed import PlacedLoad, PlacedWrench, model_pose
from linkwise.analysis.logs import Log
from linkwise.analysis.opened_robot import OpenedRobot
from linkwise.analysis.settings import Reading
from linkwise.arrays import Array, Mask
from linkwise.errors import LinkwiseError
from linkwise.escape import listed, printable
from linkwise.progress import Progress

FORM = "write it as NAME=LOAD, NAME=COLUMN>VALUE or NAME=FROM..TO in s, and NAME/REST=… to name what is left"


@dataclass(frozen=True)
class Phase:
    """A phase as a user gives it: the condition for it, and the name of the rest of the movement."""

    name: str
    rest: str
    what: str
    """Load, contact or column of the log that sets the phase; empty where times are given."""
    above: float | None
    spans: tuple[tuple[float, float], ...] = ()

    @classmethod
    def of(cls, text: str) -> "Phase":
        """Read NAME[/REST]=WHAT[>VALUE], or =FROM..TO[,FROM..TO].

        Raises LinkwiseError for other text.
        """
        names, sign, what = text.partition("=")
        name, slash, rest = names.partition("/")
        if not (sign and name and what) or (slash and not rest):
            raise LinkwiseError(f"--phase {text}: {FORM}")
        if spans := _spans(what):
            for start, end in spans:
                if start >= end:
                    raise LinkwiseError(f"--phase {text}: {start:g} s is not before {end:g} s; {FORM}")
            return cls(name, rest, "", None, spans)
        column, above, value = what.rpartition(">")
        if not above:
            return cls(name, rest, what, None)
        try:
            least = float(value)
        except ValueError:
            least = math.nan
        if not (column and math.isfinite(least)):
            raise LinkwiseError(f"--phase {text}: {FORM}")
        return cls(name, rest, column, least)


def _spans(text: str) -> tuple[tuple[float, float], ...]:
    """Return the times of FROM..TO[,FROM..TO], in s; none where the text is something else."""
    try:
        ends = [tuple(float(end) for end in span.split("..")) for span in text.split(",")]
    except ValueError:
        return ()
    return tuple((a, b) for a, b in ends) if all(len(span) == 2 for span in ends) else ()


@dataclass(frozen=True, eq=False)
class PlacedPhase:
    """A phase of one movement: it is on while any of these conditions holds."""

    name: str
    rest: str
    spans: tuple[tuple[float, float], ...] = ()
    switch: Switch | None = None
    contact: int | None = None
    load: PlacedLoad | None = None
    above: float = THRESHOLD
    """Force of a load in N above which the phase is on."""

    @property
    def pressing(self) -> PlacedWrench | None:
        """Wrench whose force switches the phase, before any low-pass; None where no load does."""
        # A phase is by no muscle, and other loads are one wrench.
        return None if self.load is None else self.load.as_measured.wrenches[0]

    @property
    def told(self) -> str:
        """Conditions of the phase, in words."""
        said = [f"from {start:g} to {end:g} s" for start, end in self.spans]
        if self.switch is not None:
            said.append(f"{self.switch.given.column} above {self.switch.given.above:g}")
        if self.contact is not None:
            said.append("its contact is on")
        if self.load is not None:
            said.append(f"force of {self.load.name} above {self.above:g} N")
        return printable(f"{self.name}: {' or '.join(said)}")

    def on(self, robot: OpenedRobot, time: Array, q: Array, contacts: Array) -> Mask:
        """Return whether the phase is on at instants (S,).

        q: positions of the robot (S, n); contacts: shares of its contacts, (contacts, S)
        """
        found = np.zeros(len(time), dtype=np.bool_)
        for start, end in self.spans:
            found |= (time >= start) & (time <= end)
        if self.switch is not None:
            found |= self.switch.on(time)
        if self.contact is not None:
            found |= contacts[self.contact] > 0.0
        if self.pressing is not None:
            force = self.pressing.wrench(time, q, model_pose(robot.model)).force
            found |= np.linalg.norm(force, axis=1) > self.above
        return found


def phase_columns(phases: Sequence[Phase], log: Log) -> tuple[str, ...]:
    """Return the columns of the motion's log that phases may need."""
    return tuple(dict.fromkeys(phase.what for phase in phases if phase.what in log.columns))


def placed_phases(
    phases: Sequence[Phase],
    log: Log,
    robot: OpenedRobot,
    loads: Sequence[PlacedLoad],
    reading: Reading,
    progress: Progress,
) -> tuple[PlacedPhase, ...]:
    """Find what sets each phase: times, else a load, else a contact, else a column of the log.

    Raises LinkwiseError for a name that is none of them.
    """
    by_name = {load.name: load for load in loads if not load.is_muscle}
    contacts = () if robot.contacts is None else robot.contacts.names
    found = []
    for phase in phases:
        name, rest, what = phase.name, phase.rest, phase.what
        if not what:
            found.append(PlacedPhase(name, rest, phase.spans))
        elif what in by_name:
            above = THRESHOLD if phase.above is None else phase.above
            found.append(PlacedPhase(name, rest, load=by_name[what], above=above))
        elif what in contacts and phase.above is None:
            found.append(PlacedPhase(name, rest, contact=list(contacts).index(what)))
        elif what in log.columns:
            column = WhileColumn(what) if phase.above is None else WhileColumn(what, phase.above)
            found.append(PlacedPhase(name, rest, switch=read_switch(column, log, reading, progress)))
        else:
            there = [*by_name, *contacts, *log.columns]
            raise LinkwiseError(
                f"--phase {name}={what}: no load, contact or column {what!r}; there are {listed(there)}"
            )
    return tuple(found)
