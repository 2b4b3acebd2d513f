"""Recordings of markers, and of the plates beside them, as a user gives them."""

from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

from linkwise.errors import LinkwiseError

SUFFIXES = (".trc", ".c3d")
PLATE_THRESHOLD = 20.0


class PlateUnder(NamedTuple):
    """A plate under a body: name of its load, number in the file, from 1, and name of the body."""

    name: str
    number: int
    body: str


@dataclass(frozen=True)
class MarkerChoices:
    """Model of OpenSim whose markers are followed, and how markers and plates are read.

    `tasks` is a file of OpenSim's inverse kinematics, a setup or its tasks, with weights. `plates` are
    written NUMBER=BODY or NAME:NUMBER=BODY, `axes` X,UP: axes of the laboratory that are the model's x, and
    up. Wrenches of plates whose force is below `threshold` in N, 20 if not given, count as nothing.

    Raises LinkwiseError for what is not written so.
    """

    model: Path
    tasks: Path | None = None
    plates: tuple[str, ...] = ()
    axes: str = ""
    threshold: float | None = None
    cutoff: float | None = None
    """Cutoff in Hz of the low-pass filter of plates; None for none."""

    def __post_init__(self) -> None:
        if not 0 <= self.least < float("inf"):
            raise LinkwiseError(f"--plate-threshold {self.least:g}: give a force in N, 0 or more")
        numbers = [one.number for one in self.under]
        if len(set(numbers)) < len(numbers):
            raise LinkwiseError("--plate: a plate is given twice; it is under one body")

    @property
    def least(self) -> float:
        """Force in N below which a plate counts as bare."""
        return PLATE_THRESHOLD if self.threshold is None else self.threshold

    @property
    def is_of_plates(self) -> bool:
        """True if something is said that only a file with plates and a laboratory's axes has."""
        return bool(self.plates or self.axes or self.threshold is not None)

    @property
    def under(self) -> tuple[PlateUnder, ...]:
        """Plates that are given, and the body on each."""
        found = []
        for text in self.plates:
            given, sign, body = text.partition("=")
            name, colon, number = given.rpartition(":")
            if not (sign and body and number.isdecimal() and int(number) and bool(name) == bool(colon)):
                raise LinkwiseError(
                    f"--plate {text}: write it as NUMBER=BODY, plates counted from 1, or NAME:NUMBER=BODY"
                )
            found.append(PlateUnder(name or f"plate {number}", int(number), body))
        return tuple(found)
