"""Settings of an analysis: how a log is read and its movement derived, as recorded in every output."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from typing import Any, Literal

from linkwise_runtime.file_joints import Order

from linkwise.errors import LinkwiseError
from linkwise.option import REQUIRED, option

Units = Literal["rad", "deg"]
Derivative = Literal["five-point", "savitzky-golay", "spline"]
Padding = Literal["odd", "even", "constant", "none"]
Edges = Literal["one-sided", "trim"]
Convention = Literal["closing", "gradient"]


def pairs(flag: str, given: Sequence[str]) -> tuple[tuple[str, str], ...]:
    """Return the columns and joints of a flag's COLUMN=JOINT.

    Raises LinkwiseError for text of another form.
    """
    found = []
    for text in given:
        column, sign, joint = text.rpartition("=")
        if not (sign and column and joint):
            raise LinkwiseError(f"{flag} {text}: write it as COLUMN=JOINT")
        found.append((column, joint))
    return tuple(found)


@dataclass(frozen=True)
class Reading:
    """Choices of how columns become joint coordinates.

    `units` is the angles' unit; None takes what the file says (`inDegrees`), else radians. Lengths
    are always metres. `time` names the column of the time, in s; None takes "time" or "t". `mapping`
    holds (column, joint) pairs, or is a dict of them; other joints take the column of their name, or
    OpenSim's state of that coordinate. `ignore_extra` leaves out columns that belong to no joint.

    Raises LinkwiseError for values that are impossible or do not go together.
    """

    units: Units | None = option(
        None, "Unit of the angles, lengths are metres; the file's own, else rad, if not given"
    )
    time: str | None = option(None, "Column of the time, in s")
    mapping: tuple[tuple[str, str], ...] | Mapping[str, str] = option(
        (),
        "Column of a joint; may be repeated",
        "--map",
        metavar="COLUMN=JOINT",
        read=partial(pairs, "--map"),
    )
    ignore_extra: bool = option(False, "Leave out columns no joint has")
    resample: float | None = option(None, "Bring uneven time to this rate, Hz, by splines")
    loop_tolerance: float = option(0.01, "How far the log may be from closing the robot's loops, m and rad")
    topic: str | None = option(
        None, "Topic of a bag, group of an HDF5 file: where the joints are, if several have some"
    )
    qpos: Order | None = option(
        None, "Take the array of positions, and of torques, as this simulator has them"
    )

    def __post_init__(self) -> None:
        if self.qpos is not None and self.units is not None:
            raise LinkwiseError(f"--units {self.units}: a --qpos is in rad and m; leave --units out")
        if self.resample is not None and not 0 < self.resample < float("inf"):
            raise LinkwiseError(f"--resample {self.resample:g}: give a rate in Hz above 0")
        if not all(isinstance(pair, (tuple, list)) and len(pair) == 2 for pair in self.pairs):
            raise LinkwiseError(f"mapping {self.mapping!r}: give pairs of a column and a joint, or a dict")
        if not 0 <= self.loop_tolerance < float("inf"):
            raise LinkwiseError(f"--loop-tolerance {self.loop_tolerance:g}: give m and rad, 0 or more")

    @property
    def pairs(self) -> tuple[tuple[str, str], ...]:
        """The mapping as (column, joint) pairs."""
        return tuple(self.mapping.items() if isinstance(self.mapping, Mapping) else self.mapping)


SPLINE_DEGREE, SPLINE_REACH = 5, 64
"""Degree of the spline of derivatives, OpenSim's, and the samples after which it has forgotten one: the
influence of one falls by 0.43 from sample to sample, to 1e-23 there."""


@dataclass(frozen=True)
class Lowpass:
    """A Butterworth low-pass run forwards and backwards, so without a shift in time.

    `cutoff` is in Hz, `order` that of one pass: both together have twice the order and -6 dB at the cutoff.
    `padding` says how the log is continued past its ends while filtering. Raises LinkwiseError for impossible
    values.
    """

    cutoff: float = option(REQUIRED, "Zero-phase Butterworth low-pass, Hz; no filter if not given")
    order: int = option(
        2, "The filter's order, of one pass; 2 if not given", "--filter-order", needs="--cutoff"
    )
    padding: Padding = option(
        "odd", "How the filter continues the log past its ends; odd if not given", needs="--cutoff"
    )

    def __post_init__(self) -> None:
        if not 0 < self.cutoff < float("inf"):
            raise LinkwiseError(f"--cutoff {self.cutoff:g}: give a frequency in Hz above 0")
        if not 1 <= self.order <= 12:
            raise LinkwiseError(f"--filter-order {self.order}: give an order from 1 to 12")


@dataclass(frozen=True)
class Processing:
    """Choices of how velocities and accelerations are derived, and the convention of the terms.

    "spline" is OpenSim's derivative: of a spline of degree 5 through the samples, continued past the ends of
    the log as the filter continues it.

    The low-pass, if any, is applied to q before it is differentiated; both are linear, so away from
    the ends this equals the paper's filter after the derivative. `window` (in samples) and `degree` are
    Savitzky–Golay's. `edges` says whether samples near the ends get one-sided formulas or are cut off.
    `convention` "closing" makes velocity terms sum to the torque; "gradient" is the paper's Eq. 1, twice
    that. `start` and `stop`, in s, are the range of time that is analysed; all of the log is filtered, and
    derivatives at its ends see what is beyond. Raises LinkwiseError for impossible values.
    """

    derivative: Derivative = option("five-point", "How velocities and accelerations are made")
    window: int = option(
        11, "Savitzky-Golay: samples a window; 11 if not given", needs="--derivative savitzky-golay"
    )
    degree: int = option(
        4, "Savitzky-Golay: degree of the fit; 4 if not given", needs="--derivative savitzky-golay"
    )
    lowpass: Lowpass | None = None
    edges: Edges = option("one-sided", "First and last samples: one-sided formulas, or cut off")
    convention: Convention = option(
        "closing", "Velocity terms: closing sums to the torque, gradient is Eq. 1"
    )
    start: float | None = option(
        None,
        "Time in s from which the log is analysed, once all of it is filtered",
        "--from",
        key="from_time",
    )
    stop: float | None = option(None, "Time in s up to which it is analysed", "--to", key="to_time")

    def __post_init__(self) -> None:
        for flag, time in (("--from", self.start), ("--to", self.stop)):
            if time is not None and not math.isfinite(time):
                raise LinkwiseError(f"{flag} {time:g}: give a time in s")
        if self.start is not None and self.stop is not None and self.start >= self.stop:
            raise LinkwiseError(f"--from {self.start:g} is not before --to {self.stop:g}")
        if self.derivative == "savitzky-golay":
            if self.degree < 2:
                raise LinkwiseError(f"--degree {self.degree}: an acceleration needs 2 or more")
            if self.window % 2 == 0 or self.window <= self.degree:
                raise LinkwiseError(
                    f"--window {self.window}: give an odd number above the degree {self.degree}"
                )

    @property
    def span(self) -> int:
        """Number of samples that one derivative needs."""
        return {"five-point": 5, "savitzky-golay": self.window, "spline": SPLINE_DEGREE + 1}[self.derivative]

    @property
    def reach(self) -> int:
        """Number of samples to either side that one derivative sees."""
        return SPLINE_REACH if self.derivative == "spline" else self.span - 1


@dataclass(frozen=True)
class Payload:
    """A point mass in kg on a body of the robot's file, at a point in m in that body's own axes.

    The name, "payload BODY" unless given, stands beside those of the links. Raises LinkwiseError for a mass
    that is not above 0 and a point that is not three numbers.
    """

    body: str
    mass: float
    point: tuple[float, float, float] = (0.0, 0.0, 0.0)
    name: str = ""

    def __post_init__(self) -> None:
        if not 0 < self.mass < math.inf:
            raise LinkwiseError(f"payload on {self.body!r}: mass {self.mass:g}; give kg above 0")
        if len(self.point) != 3 or not all(map(math.isfinite, self.point)):
            raise LinkwiseError(f"payload on {self.body!r}: give its place as three numbers x, y, z, in m")

    @property
    def title(self) -> str:
        """Name of the payload among the links."""
        return self.name or f"payload {self.body}"

    def record(self) -> dict[str, Any]:
        """Return this as plain data, to record in the outputs; kg and m."""
        return {"name": self.title, "body": self.body, "mass": self.mass, "point": list(self.point)}


def choices(reading: Reading, processing: Processing) -> dict[str, Any]:
    """Return all choices as plain data, to record in the outputs."""
    kept = asdict(processing)
    if processing.derivative != "savitzky-golay":
        del kept["window"], kept["degree"]
    return {"reading": asdict(reading), "processing": kept}
