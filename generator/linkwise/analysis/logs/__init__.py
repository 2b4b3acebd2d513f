"""Motion logs as blocks of numbers: text, Parquet, ROS bags and files of arrays behind one interface."""

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Protocol

from linkwise_runtime.file_joints import FileJoint

from linkwise.analysis.logs.array_files import Hdf5Arrays, NpzArrays
from linkwise.analysis.logs.array_log import ArrayFile, ArrayLog, QposLog, QposOf
from linkwise.analysis.logs.bag import BagLog
from linkwise.analysis.logs.checks import named_once
from linkwise.analysis.logs.parquet import ParquetLog
from linkwise.analysis.logs.text import open_delimited, open_storage
from linkwise.analysis.settings import Reading
from linkwise.arrays import Array
from linkwise.errors import LinkwiseError, within
from linkwise.escape import listed
from linkwise.input_file import require_file

AS_IT_IS = Reading()
DELIMITED, STORAGE = (".csv", ".tsv", ".txt"), (".mot", ".sto")
ARRAYS: dict[str, Callable[[Path], ArrayFile]] = {
    ".npz": NpzArrays,
    **dict.fromkeys((".h5", ".hdf5", ".hdf"), Hdf5Arrays),
}
BAGS = ".mcap", ".db3", ".bag"
"""Suffixes of bags of ROS 2; the last is of ROS 1."""
MARKERS = ".trc", ".c3d"
"""Suffixes of recordings of cameras and force plates."""


class Log(Protocol):
    """A table of numbers on disk, read from top to bottom."""

    @property
    def path(self) -> Path:
        """Path of the file, or of a bag's folder."""

    @property
    def columns(self) -> tuple[str, ...]:
        """Column names, in the file's order, each once."""

    @property
    def brought(self) -> frozenset[str]:
        """Columns that the format itself adds; it is no error if the robot does not need them."""

    @property
    def degrees(self) -> bool | None:
        """True if angles are in degrees, False if in rad; None where the file does not say."""

    @property
    def warnings(self) -> tuple[str, ...]:
        """Warnings about what looks wrong in the file and may be right."""

    @property
    def size(self) -> int:
        """Total that `read` counts up to: bytes of text, rows, or messages."""

    @property
    def first_row(self) -> int:
        """Number of the first sample as an editor or a spreadsheet counts rows, from 1."""

    def read(self, columns: Sequence[int], rows: int = ...) -> Iterator[tuple[Array, int]]:
        """Yield blocks (at most `rows`, len(columns)), which may have NaN, and how much of `size` is done.

        columns: positions in `columns`, in the order wanted. Raises LinkwiseError, naming file, row and
        column, for what is not a number.
        """


def open_log(
    path: Path,
    reading: Reading = AS_IT_IS,
    joints: Sequence[str] = (),
    file_joints: Sequence[FileJoint] = (),
    qpos_of: QposOf | None = None,
) -> Log:
    """Open a log by its suffix; open a folder as a bag of ROS 2.

    reading: the topic or group of the joints, and the array of the time, for formats that have these
    joints: names of the columns of arrays, in this order, where the file names none
    file_joints: joints of the robot's file; qpos_of: conversion of a simulator's positions to the robot's

    Raises LinkwiseError for a missing file, an unknown suffix, a header that cannot be read, or one that
    gives two columns the same name.
    """
    with within(str(path)):
        if not path.is_dir():
            require_file(path)
        opened = _opener(path, reading, joints, file_joints, qpos_of)
    try:
        log = opened()
    except UnicodeDecodeError as error:
        raise LinkwiseError(f"{path}: not UTF-8 text; save it as UTF-8") from error
    except OSError as error:
        raise LinkwiseError(f"{path}: cannot be read: {error.strerror}") from error
    with within(str(path)):
        named_once(log.columns)
    return log


def _opener(
    path: Path,
    reading: Reading,
    joints: Sequence[str],
    file_joints: Sequence[FileJoint],
    qpos_of: QposOf | None,
) -> Callable[[], Log]:
    """Return the function that opens a log; raise LinkwiseError for an unsupported kind of file or flag."""
    suffix = path.suffix.lower()
    order = reading.qpos
    if order is not None and suffix not in ARRAYS:
        raise LinkwiseError(f"--qpos goes with files of arrays, {listed(ARRAYS)}; save the qpos in one")
    if path.is_dir() or suffix in BAGS:
        return lambda: BagLog.open(path, reading.topic)
    if suffix in ARRAYS:
        source = ARRAYS[suffix](path)
        if order is not None and qpos_of is not None:
            return lambda: QposLog.open(source, reading, joints, order, qpos_of)
        return lambda: ArrayLog.open(source, reading, joints, file_joints)
    if reading.topic is not None:
        raise LinkwiseError("--topic goes with bags and files of arrays; leave it out")
    if suffix in DELIMITED:
        return lambda: open_delimited(path)
    if suffix in STORAGE:
        return lambda: open_storage(path)
    if suffix == ".parquet":
        return lambda: ParquetLog.open(path)
    if suffix in MARKERS:
        raise LinkwiseError(
            "this holds markers and force plates, not joints; give the .mot or .sto that inverse kinematics,"
            " as OpenSim's, makes of it"
        )
    known = [*DELIMITED, *STORAGE, ".parquet", *ARRAYS, *BAGS]
    raise LinkwiseError(f"unknown suffix; give a {', '.join(known)} file, or a bag's folder")
