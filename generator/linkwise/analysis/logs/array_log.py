"""Logs in files of named arrays, read block by block; rows are numbered from 1, the first sample."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from linkwise_runtime.file_joints import FileJoint

from linkwise.analysis.logs.array_columns import WORDS, ArrayColumns, Place, StoredArray, array_columns
from linkwise.analysis.logs.named_once import named_once
from linkwise.analysis.logs.promised_size import require_held
from linkwise.analysis.settings import Reading
from linkwise.errors import within
from linkwise.escape import listed
from linkwise.package.load import Array


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
