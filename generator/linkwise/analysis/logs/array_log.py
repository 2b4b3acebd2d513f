"""Logs in files of named arrays, read block by block; rows are numbered from 1, the first sample.

Where an array is a simulator's qpos, the columns of joints and torques are computed from it.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from linkwise_runtime.file_joints import FileJoint, Order
from linkwise_runtime.qpos_motion import Earlier, Qpos, QposMotion

from linkwise.analysis.logs.array_columns import (
    ENDING_OF,
    UNITS,
    WORDS,
    ArrayColumns,
    Place,
    StoredArray,
    array_columns,
    names_beside,
    word_of,
)
from linkwise.analysis.logs.checks import named_once, require_finite, require_held
from linkwise.analysis.settings import Reading
from linkwise.arrays import Array
from linkwise.errors import LinkwiseError, within
from linkwise.escape import listed


class ArrayFile(Protocol):
    """A file of arrays by name; raises LinkwiseError that names the file for what cannot be read."""

    @property
    def path(self) -> Path:
        """Path of the file."""

    def found(self) -> Mapping[str, StoredArray]:
        """Return the arrays in the file, by name."""

    def opened(self) -> AbstractContextManager[Callable[[str], Any]]:
        """Open the file, and give arrays by name, or objects that are sliced like arrays."""


@dataclass(frozen=True)
class ArrayLog:
    """Columns of arrays that have the samples along one axis; `places` has the place of each column."""

    source: ArrayFile
    places: Mapping[str, Place]
    size: int
    """Number of samples."""
    warnings: tuple[str, ...] = ()
    degrees: bool | None = None
    first_row: int = 1

    @classmethod
    def open(
        cls,
        source: ArrayFile,
        reading: Reading,
        joints: Sequence[str],
        file_joints: Sequence[FileJoint] = (),
    ) -> "ArrayLog":
        """Find the time and the joints' arrays; raise LinkwiseError where they are ambiguous."""
        found = source.found()
        with within(str(source.path)):
            columns = array_columns(found, reading.time, reading.topic, joints, file_joints)
            log = cls.of(source, columns, reading.time)
        told = tuple(
            f"nothing names the columns of {array!r}: they are taken for the robot's joints {listed(joints)};"
            " add an array 'joint_names'"
            for array in columns.unnamed
        )
        return replace(log, warnings=told)

    @classmethod
    def of(cls, source: ArrayFile, columns: ArrayColumns, time: str | None) -> "ArrayLog":
        """Return the log of the columns that were found; the time has the name that was asked for.

        Raises LinkwiseError for two columns of one name, for positions in arrays that cannot hold them, and
        for arrays that are far larger than the file, before any is read.
        """
        called = time or columns.time.rpartition("/")[2]
        named_once((called, *columns.places))
        places = {called: Place(columns.time, 0)} | columns.places
        columns.check()
        used = {place.array for place in places.values()}
        require_held(source.path, sum(columns.found[array].bytes for array in used))
        return cls(source, places, columns.samples, degrees=columns.degrees)

    @property
    def path(self) -> Path:
        """Path of the file."""
        return self.source.path

    @property
    def columns(self) -> tuple[str, ...]:
        """Names of the columns: the time, then joints, and other arrays by their own names."""
        return tuple(self.places)

    @property
    def brought(self) -> frozenset[str]:
        """Columns of velocities, accelerations and efforts of joints whose positions are there, too."""
        there = [f"{column}{ending}" for column in self.places for ending in WORDS if ending]
        return frozenset(self.places).intersection(there)

    def read(self, columns: Sequence[int], rows: int = 65536) -> Iterator[tuple[Array, int]]:
        """Yield blocks (at most `rows`, len(columns)) and the samples read so far."""
        places = [self.places[self.columns[at]] for at in columns]
        with self.source.opened() as get:
            arrays = {place.array: get(place.array) for place in places}
            for start in range(0, self.size, rows):
                stop = min(start + rows, self.size)
                parts = {name: _rows(array, self.size, start, stop) for name, array in arrays.items()}
                yield np.column_stack([parts[place.array][:, place.at] for place in places]), stop


def _rows(array: Any, samples: int, start: int, stop: int) -> Array:
    """Return samples of an array, (stop - start, numbers per sample), whichever axis they are along."""
    if len(array.shape) == 1:
        part = np.asarray(array[start:stop])[:, None]
    elif array.shape[0] == samples:
        part = np.asarray(array[start:stop])
    else:
        part = np.asarray(array[:, start:stop]).T
    return part.astype(np.float64)


QposOf = Callable[[Order, Sequence[str] | None], Qpos]
"""Conversion of positions of an order to a robot's, given the joint names in the file where it has them."""
EFFORT = "/effort"
RATES = "/velocity", "/acceleration"


@dataclass(frozen=True)
class QposLog:
    """Columns of arrays, with joints and their torques in place of the arrays that they are computed from."""

    arrays: ArrayLog
    """Log with the columns of every array by its own name: qpos[0], qpos[1]."""
    qpos: Qpos
    joints: tuple[str, ...]
    positions: tuple[str, ...]
    """Names of the columns of the qpos."""
    torques: tuple[str, ...]
    """Names of the columns of torques along the simulator's axes; empty if there are none."""
    rates: frozenset[str]
    """Names of the columns of velocities and accelerations."""
    degrees: bool | None = False

    @classmethod
    def open(
        cls, source: ArrayFile, reading: Reading, joints: Sequence[str], order: Order, qpos_of: QposOf
    ) -> "QposLog":
        """Find the arrays; raise LinkwiseError where none can be a qpos of that order."""
        found = source.found()
        with within(str(source.path)):
            numbers = {array: has for array, has in found.items() if not has.texts}
            columns = array_columns(numbers, reading.time, reading.topic, ())
            arrays = ArrayLog.of(source, columns, reading.time)
            with within(f"--qpos {order}"):
                chosen = _positions(arrays, found)
                try:
                    qpos = qpos_of(order, names_beside(found, chosen) or None)
                except ValueError as error:
                    raise LinkwiseError(str(error)) from error
            positions = _columns(arrays, chosen)
            if len(positions) != qpos.width:
                raise LinkwiseError(
                    f"array {chosen!r} is {found[chosen].shape}, and {qpos.why_not(len(positions))}"
                )
        of_joints = [array for array in _arrays(arrays) if len(_columns(arrays, array)) == qpos.n]
        torques = [array for array in of_joints if ENDING_OF.get(word_of(array)) == EFFORT]
        rates = [
            column
            for array in of_joints
            if ENDING_OF.get(word_of(array)) in RATES
            for column in _columns(arrays, array)
        ]
        efforts = _columns(arrays, torques[0]) if torques else ()
        return cls(arrays, qpos, tuple(joints), positions, efforts, frozenset(rates))

    @property
    def path(self) -> Path:
        """Path of the file."""
        return self.arrays.path

    @property
    def warnings(self) -> tuple[str, ...]:
        """No warnings, as the order of the columns was given."""
        return ()

    @property
    def size(self) -> int:
        """Number of samples."""
        return self.arrays.size

    @property
    def first_row(self) -> int:
        """Number of the first row, 1."""
        return self.arrays.first_row

    @cached_property
    def columns(self) -> tuple[str, ...]:
        """Names of the columns: the time, the joints, their torques, and all others."""
        time, *others = self.arrays.columns
        taken = {*self.positions, *self.torques}
        return (time, *self.joints, *self._efforts, *(name for name in others if name not in taken))

    @property
    def brought(self) -> frozenset[str]:
        """Columns of torques, and of the simulator's velocities and accelerations."""
        return self.rates.union(self._efforts)

    @property
    def _efforts(self) -> tuple[str, ...]:
        return tuple(f"{joint}{EFFORT}" for joint in self.joints) if self.torques else ()

    def read(self, columns: Sequence[int], rows: int = 65536) -> Iterator[tuple[Array, int]]:
        """Yield blocks (at most `rows`, len(columns)) and the samples read so far.

        Angles continue from block to block. Raises LinkwiseError, naming the row, for what is no qpos.
        """
        names = [self.columns[at] for at in columns]
        has_torques = not set(self._efforts).isdisjoint(names)
        is_made = has_torques or not set(self.joints).isdisjoint(names)
        rest = [name for name in names if name not in (*self.joints, *self._efforts)]
        sources = [*rest, *(self.positions if is_made else ()), *(self.torques if has_torques else ())]
        end = len(rest) + len(self.positions)
        earlier = Earlier(self.first_row)  # so that errors name samples by their rows
        for block, done in self.arrays.read(list(map(self.arrays.columns.index, sources)), rows):
            values = dict(zip(rest, block.T, strict=False))
            if is_made:
                torques = block[:, end:] if has_torques else None
                motion = self._motion(block[:, len(rest) : end], torques, earlier)
                earlier = Earlier(self.first_row + done, motion.q[-1])
                values |= zip(self.joints, motion.q.T, strict=True)
                values |= {} if motion.tau is None else zip(self._efforts, motion.tau.T, strict=True)
            yield np.column_stack([values[name] for name in names]), done

    def _motion(self, positions: Array, torques: Array | None, earlier: Earlier) -> QposMotion:
        with within(str(self.path)):
            require_finite(positions, self.positions, earlier.samples)
            try:
                return self.qpos.motion(positions, tau=torques, earlier=earlier)
            except ValueError as error:
                raise LinkwiseError(str(error)) from error


def _arrays(log: ArrayLog) -> list[str]:
    """Return the arrays that have columns, the likeliest names first."""
    return list(dict.fromkeys(place.array for place in log.places.values()))


def _columns(log: ArrayLog, array: str) -> tuple[str, ...]:
    return tuple(column for column, place in log.places.items() if place.array == array)


def _positions(log: ArrayLog, found: Mapping[str, StoredArray]) -> str:
    """Return the array of positions; raise LinkwiseError where there is none, or in degrees."""
    named = [array for array in _arrays(log) if ENDING_OF.get(word_of(array)) == ""]
    if not named:
        raise LinkwiseError("there is no array of positions; call it 'qpos'")
    chosen = min(named, key=lambda array: word_of(array) != "qpos")
    if UNITS.get(found[chosen].unit.lower()):
        raise LinkwiseError(f"array {chosen!r} is in degrees, as it says; a qpos is in rad and m")
    return chosen
