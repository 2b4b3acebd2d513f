"""Loads as a user gives them: forces and moments on bodies, constant, over time, or in columns of a log."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from linkwise.arrays import Array
from linkwise.errors import LinkwiseError

FORCE, MOMENT, POINT = slice(1, 4), slice(4, 7), slice(7, 10)
"""Columns of a load's table after the time in s: force in N, moment in N·m, point in m."""
PARTS = {"force": FORCE, "moment": MOMENT, "point": POINT}
WIDTH = 10
WORLD = "world"


@dataclass(frozen=True, eq=False)
class Load:
    """A force in N and a moment in N·m on a body of the robot's file, (3,), or (S, 3) at `time` (S,) in s.

    `axes` names the frame in whose axes they are given: the world, or a body. The force acts at `point` in m,
    given in `point_in`: the world, a body, or if None the loaded body itself. Values are linear in time
    between samples.
    """

    name: str
    body: str
    force: ArrayLike = (0.0, 0.0, 0.0)
    moment: ArrayLike = (0.0, 0.0, 0.0)
    point: ArrayLike = (0.0, 0.0, 0.0)
    time: ArrayLike | None = None
    axes: str = WORLD
    point_in: str | None = None
    source: str = ""
    """Name of the file that the values are from, which records tell."""
    filtered: float | None = None
    """Cutoff in Hz of a low-pass filter that the values have gone through, which records tell."""
    unfiltered: "Load | None" = None
    """The load before that filter, by whose force phases, cycles and contacts begin; None if it is this."""

    def table(self) -> Array:
        """Return rows (S, 10) of time, force, moment, point; a single row, at time 0, if all is constant.

        Raises LinkwiseError for other shapes and for values that are not finite.
        """
        time = np.zeros(1) if self.time is None else np.asarray(self.time, dtype=float)
        if time.ndim != 1 or not len(time):
            raise LinkwiseError(f"load {self.name!r}: time has shape {time.shape}; give (S,), in s")
        rows = np.zeros((len(time), WIDTH))
        rows[:, 0] = time
        for what, columns in PARTS.items():
            values = np.asarray(getattr(self, what), dtype=float)
            if values.shape not in ((3,), (len(time), 3)):
                wanted = "(3,), or time beside it" if self.time is None else f"(3,) or ({len(time)}, 3)"
                raise LinkwiseError(f"load {self.name!r}: {what} has shape {values.shape}; give {wanted}")
            rows[:, columns] = values
        if not np.isfinite(rows).all():
            raise LinkwiseError(f"load {self.name!r}: a value is not finite; fill the gap")
        return rows


@dataclass(frozen=True, eq=False)
class Loads:
    """All loads of an analysis: values, and files, which are logs or OpenSim's external-loads XML.

    `cutoff` in Hz is that of a low-pass filter for the data of files, of second order, run forwards and
    backwards; None for no filter. Raises LinkwiseError for a cutoff that is not above 0, or without files,
    and for a file that is given twice.
    """

    given: tuple[Load, ...] = ()
    paths: tuple[Path, ...] = ()
    cutoff: float | None = None

    def __post_init__(self) -> None:
        if self.cutoff is not None and not 0 < self.cutoff < float("inf"):
            raise LinkwiseError(f"--loads-cutoff {self.cutoff:g}: give a frequency in Hz above 0")
        if self.cutoff is not None and not self.paths:
            raise LinkwiseError("--loads-cutoff goes with --loads, or with --contact-loads; add one")
        for path, count in Counter(path.resolve() for path in self.paths).items():
            if count > 1:
                raise LinkwiseError(f"{path.name} is given {count} times, as loads; give it once")

    @classmethod
    def of(cls, several: Sequence[Load | str | Path], cutoff: float | None = None) -> "Loads":
        """Return the loads of one list of values and files."""
        given = tuple(one for one in several if isinstance(one, Load))
        return cls(given, tuple(Path(one) for one in several if not isinstance(one, Load)), cutoff)


@dataclass(frozen=True)
class Muscles:
    """File of actuators' forces over time in N or N·m, and the model of OpenSim that has their paths.

    `groups` are written NAME=MUSCLE,MUSCLE, with * for anything in a name, or as the name of a group of
    forces in the model; each group is one load. Raises LinkwiseError for a model that is no .osim file.
    """

    forces: Path
    model: Path
    groups: tuple[str, ...] = ()
    force_sets: tuple[Path, ...] = ()

    def __post_init__(self) -> None:
        if self.model.suffix.lower() != ".osim" or not self.model.is_file():
            raise LinkwiseError(
                f"--muscles {self.forces}: paths of muscles are in a model of OpenSim, and {self.model} is"
                " none; give its .osim file as --robot"
            )

    @property
    def files(self) -> tuple[Path, ...]:
        """Paths of the files that are read beside the robot's."""
        return (self.forces, *self.force_sets)


@dataclass(frozen=True)
class LoadColumns:
    """A load in a log: numbers of its time column, and of its three columns of force, moment and point."""

    name: str
    body: str
    log: Path
    time: int
    columns: dict[str, tuple[int, ...]]
    axes: str = WORLD
    point_in: str | None = None
    """None for the loaded body; a force without a point acts at its origin."""
    warnings: tuple[str, ...] = ()
    """Warnings about the file that describes the load; each names the file."""
