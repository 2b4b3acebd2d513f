"""Arrays by name in NumPy's .npz files."""

import io
import math
import zipfile
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any

import numpy as np

from linkwise.analysis.logs.array_columns import NUMBERS, StoredArray, names_joints
from linkwise.analysis.logs.damaged_files import read_as
from linkwise.analysis.logs.named_once import named_once
from linkwise.analysis.logs.promised_size import require_held
from linkwise.errors import LinkwiseError, within

LONGEST_HEADER = 10_000
"""Most bytes of an array's header, the limit of NumPy for untrusted files; numbers need a hundred."""


@dataclass(frozen=True)
class NpzArrays:
    """Arrays in a file that `numpy.savez` wrote, compressed or not."""

    path: Path

    def found(self) -> Mapping[str, StoredArray]:
        """Return the shapes of all arrays, from their headers.

        Raises LinkwiseError for names of joints that are pickled, for two arrays of one name, and for an
        array whose header is far longer than numbers need.
        """
        found = {}
        with self.opened() as get, zipfile.ZipFile(self.path) as file:
            members = file.infolist()
            names = named_once([member.filename.removesuffix(".npy") for member in members], "arrays")
            for name, member in zip(names, members, strict=True):
                with file.open(member) as array, within(f"array {name!r}"):
                    shape, dtype = _header(array)
                size = math.prod(shape) * dtype.itemsize
                if dtype.kind != "O" and size > member.file_size:
                    raise LinkwiseError(
                        f"array {name!r} has {member.file_size:,} of its {size:,} bytes; write the file again"
                    )
                texts: tuple[str, ...] = ()
                if names_joints(name, shape) and dtype.kind == "O":
                    raise LinkwiseError(
                        f"array {name!r} holds Python objects; save texts, as numpy.array([...]) makes them"
                    )
                if names_joints(name, shape) and dtype.kind in "US":
                    require_held(self.path, size)
                    texts = tuple(get(name).astype(str).ravel().tolist())
                found[name] = StoredArray(shape, size, dtype.kind in NUMBERS, texts)
        return found

    @contextmanager
    def opened(self) -> Iterator[Callable[[str], Any]]:
        """Open the file and give arrays by name, each read as a whole."""
        with read_as("an .npz file", self.path), self.path.open("rb") as file:
            yield np.load(file, allow_pickle=False).__getitem__


def _header(array: IO[bytes]) -> tuple[tuple[int, ...], np.dtype[Any]]:
    """Return the shape of an array, and the type of its numbers.

    Raises LinkwiseError for a header longer than NumPy reads, which NumPy reports only after reading it
    whole.
    """
    version = np.lib.format.read_magic(array)
    if version > (2, 0):  # a table of fields with names in Unicode, not an array of numbers
        return (), np.dtype("V")
    is_first = version == (1, 0)
    reader = np.lib.format.read_array_header_1_0 if is_first else np.lib.format.read_array_header_2_0
    length = array.read(2 if is_first else 4)
    if (promised := int.from_bytes(length, "little")) > LONGEST_HEADER:
        raise LinkwiseError(
            f"its header promises {promised:,} bytes, and an array of numbers has no more than"
            f" {LONGEST_HEADER:,}; write the file again"
        )
    shape, _, dtype = reader(io.BytesIO(length + array.read(promised)))
    return shape, dtype
