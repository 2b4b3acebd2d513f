"""A log brought to evenly spaced joint coordinates in SI units, checked row by row.

Columns of joints that follow others by the robot's file, or are held, are left out, but checked.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Literal

import numpy as np
from linkwise_runtime.chosen_names import end_of_path
from linkwise_runtime.rule.joint_tree import TreeCurve
from numpy.polynomial import polynomial

from linkwise.analysis.column_matching import (
    SPEED,
    Peak,
    far_warnings,
    radians_per_unit,
    select,
    unit_warnings,
)
from linkwise.analysis.disk_rows import collected, first_column
from linkwise.analysis.even_time import TOLERANCE, even_rate, resampled
from linkwise.analysis.logs import Log
from linkwise.analysis.logs.checks import require_finite
from linkwise.analysis.settings import Reading
from linkwise.arrays import Array
from linkwise.errors import within
from linkwise.package.manifest import Manifest
from linkwise.progress import Progress

SLOW = 5.0
"""Rate in Hz below which hardly any movement is recorded; milliseconds taken for seconds look like it."""
CLOCKS = {"ms": 1000, "µs": 10**6, "ns": 10**9}


@dataclass(frozen=True, eq=False)
class Samples:
    """Evenly spaced samples: `time` (S,) in s, `q` (S, n) in rad or m, `inputs` (S, m), `rate` in Hz."""

    time: Array
    q: Array
    rate: float
    ignored: tuple[str, ...]
    """Columns of the log that belong to no joint."""
    warnings: tuple[str, ...]
    first_row: int | None = None
    """Number of the first sample's row in the log; None where they were resampled."""
    inputs: Array = field(default_factory=lambda: np.zeros((0, 0)))
    """Inputs of written energies; not filtered."""

    def within(self, start: int, stop: int) -> "Samples":
        """Return the samples start..stop alone."""
        some = slice(start, stop)
        first = None if self.first_row is None else self.first_row + start
        return replace(self, time=self.time[some], q=self.q[some], inputs=self.inputs[some], first_row=first)


WRAPPED = 0.1
"""Largest part of a turn by which a step from sample to sample differs from a turn, where angles leap."""
CLOSE = {"rad": 0.01, "m": 0.001}
"""Largest difference between a column and the motion of its joint: logs are rounded, joints have play."""


@dataclass(frozen=True)
class FollowingJoint:
    """A joint of the file that is no joint of the robot, but follows one by a curve.

    A joint without a leader is held.
    """

    name: str
    unit: Literal["rad", "m"]
    is_always_in_radians: bool
    leader: str | None
    curve: TreeCurve

    @classmethod
    def of(cls, manifest: Manifest) -> tuple["FollowingJoint", ...]:
        """Return all joints that a package knows to follow or to be held."""
        return tuple(
            cls(
                one.name,
                one.unit,
                one.name in manifest.in_radians,
                None if one.joint is None else manifest.joints[one.joint].name,
                one.curve,
            )
            for one in manifest.followers
        )

    def at(self, leader: Array) -> Array:
        """Return the joint's position (S,), in its unit, at positions (S,) of its leader."""
        starts = np.array(self.curve.starts)
        piece = np.searchsorted(starts[1:], leader, side="right")
        found = np.zeros_like(leader)
        for number, powers in enumerate(self.curve.pieces):
            inside = piece == number
            found[inside] = polynomial.polyval(leader[inside] - starts[number], powers)
        return found

    def slope(self, leader: Array) -> Array:
        """Return the derivative of the joint's position (S,) by that of its leader."""
        slopes = tuple(tuple(polynomial.polyder(powers).tolist()) for powers in self.curve.pieces)
        return replace(self, curve=replace(self.curve, pieces=slopes)).at(leader)


class FollowerColumns:
    """Columns of following and held joints among a log's free ones, and their distance from these joints.

    columns: all names of the log's columns; free: those that no joint has
    joints: those that are read, in their order; radians: factor that brings the log's angles to radians
    """

    def __init__(
        self,
        columns: Sequence[str],
        free: Sequence[str],
        followers: Sequence[FollowingJoint],
        joints: Sequence[str],
        radians: float,
    ) -> None:
        by_name = {one.name: one for one in followers if one.leader is None or one.leader in joints}
        positions = [name for name in free if not name.endswith(SPEED)]
        self._names = [name for name in positions if end_of_path(name) in by_name]
        self._followers = [by_name[end_of_path(name)] for name in self._names]
        self._leaders = [0 if one.leader is None else joints.index(one.leader) for one in self._followers]
        turned = [one.unit == "rad" and not one.is_always_in_radians for one in self._followers]
        self._factors = np.where(turned, radians, 1.0)
        self._largest = [0.0] * len(self._names)
        self.numbers = tuple(columns.index(name) for name in self._names)

    def look(self, q: Array, own: Array) -> None:
        """Note the distances in a block; NaN counts as no value.

        q: positions of the joints (S, joints) in rad or m; own: the columns (S, columns) as in the log
        """
        for at, (follower, leader) in enumerate(zip(self._followers, self._leaders, strict=True)):
            apart = np.abs(own[:, at] * self._factors[at] - follower.at(q[:, leader]))
            self._largest[at] = float(np.fmax.reduce(apart, initial=self._largest[at]))

    def warnings(self) -> Iterator[str]:
        """Yield a warning for each column that is far from its joint."""
        for name, one, largest in zip(self._names, self._followers, self._largest, strict=True):
            if largest > CLOSE[one.unit]:
                held = f"where the robot holds {one.name!r}"
                following = f"what {one.name!r} does by following {one.leader!r}"
                yield (
                    f"column {name!r} is left out, and is up to {largest:.3g} {one.unit} from"
                    f" {held if one.leader is None else following}"
                )


class TurnLeaps:
    """Angles that leap by a turn from one sample to the next, as those do that are wrapped at one.

    joints: names of the joints that turn; radians: factor that brings the log's angles to radians
    """

    def __init__(self, joints: Sequence[str], radians: float) -> None:
        self._joints, self._turn = joints, 2.0 * np.pi / radians
        self._found, self._last = np.zeros(len(joints), dtype=np.intp), np.zeros((0, len(joints)))

    def look(self, angles: Array) -> None:
        """Count the leaps in a block (S, joints), and to it from the one before."""
        steps = np.abs(np.diff(np.concatenate([self._last, angles]), axis=0))
        self._found += (np.abs(steps - self._turn) < WRAPPED * self._turn).sum(axis=0)
        self._last = angles[-1:].copy()

    def warnings(self) -> Iterator[str]:
        """Yield a warning for each joint that leaps."""
        for joint, count in zip(self._joints, self._found.tolist(), strict=True):
            if count:
                times = {1: "once", 2: "twice"}.get(count, f"{count} times")
                yield f"joint {joint!r} leaps by a turn {times}: unwrap its angles, as numpy.unwrap does"


def read_samples(
    log: Log,
    joints: tuple[str, ...],
    joint_units: tuple[str, ...],
    reading: Reading,
    progress: Progress,
    buffer: Path | None = None,
    beside: Sequence[str] = (),
    reach: Sequence[float] = (),
    followers: Sequence[FollowingJoint] = (),
) -> Samples:
    """Read, convert to SI and check a log.

    joints: names of the robot's joints in the log, then of its inputs
    joint_units: one for each joint, "rad" for those that are in degrees in a log in degrees, "" for an input
    buffer: a directory on whose disk, as a rule, a buffer keeps the samples; None keeps them in memory
    beside: columns that are read elsewhere
    reach: the largest magnitude that each joint's limits allow, in its unit, of all joints or none
    followers: joints whose columns may be left out without `reading.ignore_extra`

    Raises LinkwiseError that names file, row and column for what cannot be analysed.
    """
    with within(str(log.path)):
        inputs = [name for name, unit in zip(joints, joint_units, strict=True) if not unit]
        coupled = [one.name for one in followers]
        selection = select(log.columns, joints, reading, beside, log.brought, coupled, inputs)
    angles = [at for at, unit in enumerate(joint_units, 1) if unit == "rad"]
    factor = radians_per_unit(log, reading)
    width = 1 + len(joints)
    peaks = np.zeros(width)
    leaps = TurnLeaps([joints[at - 1] for at in angles], factor)
    following = FollowerColumns(log.columns, selection.ignored, followers, joints, factor)

    def in_si() -> Iterator[Array]:
        for whole in finite_blocks(log, selection.columns, progress, following.numbers):
            block = whole[:, :width]
            leaps.look(block[:, angles])
            np.maximum(peaks, np.abs(block).max(axis=0, initial=0.0), out=peaks)
            block[:, angles] *= factor
            following.look(block[:, 1:], whole[:, width:])
            yield block

    samples = collected(in_si(), width, buffer)
    time = first_column(samples, buffer)
    with within(str(log.path)):
        rate = even_rate(time, log.first_row, strict=reading.resample is None)
        warnings = (
            *log.warnings,
            *slowness(rate),
            *leaps.warnings(),
            *following.warnings(),
            *_thinned(rate, reading.resample),
        )
        if reading.resample is not None:
            rate = reading.resample
            samples = collected(resampled(samples, rate, progress=progress), width, buffer)
            time = first_column(samples, buffer)
    columns = [log.columns[at] for at in selection.joints]
    largest = map(Peak, columns, peaks[1:].tolist(), reach or [np.inf] * len(joints))
    with within(str(log.path)):
        warnings += _size_warnings(log, reading, joint_units, tuple(largest))
    first_row = log.first_row if reading.resample is None else None
    n = 1 + sum(unit != "" for unit in joint_units)
    return Samples(time, samples[:, 1:n], rate, selection.ignored, warnings, first_row, samples[:, n:])


def _size_warnings(
    log: Log, reading: Reading, units: Sequence[str], largest: Sequence[Peak]
) -> tuple[str, ...]:
    """Return warnings about joints whose largest magnitudes are hardly in the unit of the log."""
    angles, lengths = (
        [peak for peak, own in zip(largest, units, strict=True) if own == unit] for unit in ("rad", "m")
    )
    return unit_warnings(log, reading, angles) + far_warnings(lengths)


def finite_blocks(
    log: Log, columns: Sequence[int], progress: Progress, others: Sequence[int] = ()
) -> Iterator[Array]:
    """Yield blocks (rows, columns and others) of the log.

    Raises LinkwiseError for values of the columns that are not finite; those of the others may be.
    """
    row, width, names = log.first_row, len(columns), [log.columns[at] for at in columns]
    for block, done in log.read((*columns, *others)):
        with within(str(log.path)):
            require_finite(block[:, :width], names, row)
        yield block
        row += len(block)
        progress("reading", done, log.size)


def slowness(rate: float) -> tuple[str, ...]:
    """Return a warning, in a tuple, where a rate in Hz is hardly that of a movement; else an empty one."""
    if rate >= SLOW:
        return ()
    unit = next((unit for unit, factor in CLOCKS.items() if rate * factor >= 1.0), "ns")
    return (f"{rate:.4g} samples a second are few: if time is in {unit}, divide it by {CLOCKS[unit]}",)


def _thinned(rate: float, wanted: float | None) -> tuple[str, ...]:
    """Return a warning, in a tuple, where resampling to `wanted` Hz turns fast motion into slow motion."""
    if wanted is None or wanted >= rate * (1 - TOLERANCE):
        return ()
    return (
        f"--resample {wanted:g} of {rate:.6g} samples a second: what moves faster than {wanted / 2:g} Hz"
        f" comes out as something slower; resample at {rate:.6g} or more",
    )
