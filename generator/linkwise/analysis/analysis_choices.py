"""Choices of an analysis, named as the flags of `linkwise analyze` and as the keys of a study."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from linkwise_runtime.file_joints import Order

from linkwise.analysis.contacts import Contacts
from linkwise.analysis.contacts.written_contacts import chosen_contacts
from linkwise.analysis.job import Wanted
from linkwise.analysis.loaded_robot import LoadedRobot
from linkwise.analysis.loads import Load, Loads
from linkwise.analysis.phases import Phase
from linkwise.analysis.settings import (
    Convention,
    Derivative,
    Edges,
    Padding,
    Payload,
    Processing,
    Reading,
    Units,
)
from linkwise.analysis.tables import Format
from linkwise.analysis.written_choices import (
    carried,
    chosen_lowpass,
    chosen_processing,
    constant_loads,
    pairs,
)


@dataclass(frozen=True)
class AnalysisChoices:
    """Choices of an analysis; fields have the names and the meaning of the flags of `linkwise analyze`.

    Files are given as paths. Properties and methods raise LinkwiseError, which names the flag, for an invalid
    choice.
    """

    units: Units | None = None
    time: str | None = None
    topic: str | None = None
    qpos: Order | None = None
    map: tuple[str, ...] = ()
    ignore_extra: bool = False
    resample: float | None = None
    loop_tolerance: float = 0.01
    derivative: Derivative = "five-point"
    window: int | None = None
    degree: int | None = None
    cutoff: float | None = None
    filter_order: int | None = None
    padding: Padding | None = None
    edges: Edges = "one-sided"
    convention: Convention = "closing"
    phase: tuple[str, ...] = ()
    power_terms: bool = False
    payload: tuple[str, ...] = ()
    load: tuple[str, ...] = ()
    loads: tuple[str, ...] = ()
    loads_cutoff: float | None = None
    contact: tuple[str, ...] = ()
    contact_while: tuple[str, ...] = ()
    contact_loads: tuple[str, ...] = ()
    contact_threshold: float | None = None
    unactuated: tuple[str, ...] = ()
    induced: tuple[str, ...] = ()

    @property
    def reading(self) -> Reading:
        """Choices of how the log is read."""
        mapping = pairs("--map", self.map)
        how = self.ignore_extra, self.resample, self.loop_tolerance, self.topic
        return Reading(self.units, self.time, mapping, *how, self.qpos)

    @property
    def processing(self) -> Processing:
        """Choices of how velocities and accelerations are computed."""
        lowpass = chosen_lowpass(self.cutoff, self.filter_order, self.padding)
        how = self.derivative, self.window, self.degree
        return chosen_processing(*how, lowpass, self.edges, self.convention)

    def wanted(self, table: Format = "parquet", figures: Sequence[str] = (), page: bool = True) -> Wanted:
        """Return the choice of outputs to write."""
        phases = tuple(map(Phase.of, self.phase))
        return Wanted(table, tuple(figures), page, self.power_terms, self.induced, phases)

    def payloads(self, robot: LoadedRobot) -> tuple[Payload, ...]:
        """Return the point masses that a robot carries."""
        return carried(self.payload, robot)

    def borne(self, robot: LoadedRobot) -> Loads:
        """Return the external loads on a robot."""
        given: list[Load | str] = [*constant_loads(self.load, robot), *self.loads]
        return Loads.of(given, None if self.contact_loads and not self.loads else self.loads_cutoff)

    def contacts(self, robot: LoadedRobot) -> Contacts:
        """Return the contacts on which the robot stands."""
        measured = [Path(path) for path in self.contact_loads]
        above = self.contact_threshold, self.loads_cutoff
        return chosen_contacts(self.contact, self.contact_while, measured, *above, self.unactuated, robot)
