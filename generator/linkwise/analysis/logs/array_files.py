"""Files of named arrays: datasets by path in HDF5, and arrays by name in NumPy's .npz."""

import io
import math
import zipfile
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any

import numpy as np

from linkwise.analysis.logs.array_columns import NAMES, NUMBERS, StoredArray, names_joints
from linkwise.analysis.logs.checks import named_once, read_as, require_held
from linkwise.errors import LinkwiseError, within
from linkwise.escape import short
from linkwise.extras import extra

DEEPEST, LONGEST_PATH = 32, 1_000
"""Most groups in which a dataset lies, one inside the other, and most characters of its path.

Each is looked up from the root, so that a file of megabytes could take hours, or the memory of all its paths.
"""


@dataclass(frozen=True)
class Hdf5Arrays:
    """Datasets in groups; attributes that name joints count as arrays in the item that has them."""

    path: Path

    def found(self) -> Mapping[str, StoredArray]:
        """Return the shapes of all datasets, and the texts of those that name joints.

        Raises LinkwiseError for numbers in other files, and for paths that are deeper than those of any log.
        """
        library = extra("h5py")
        found: dict[str, StoredArray] = {}

        def visit(name: str, item: Any) -> None:
            _require_shallow(name)
            found.update(_named_by_attributes(name, item))
            if not isinstance(item, library.Dataset):
                return
            # Checked before the shape, for which HDF5 opens other files.
            if item.is_virtual or item.external:
                raise LinkwiseError(
                    f"dataset {name!r} has its numbers in other files; write them into this one"
                )
            if item.shape is None:
                return
            texts: tuple[str, ...] = ()
            if names_joints(name, item.shape) and library.check_string_dtype(item.dtype):
                texts = self._texts(item)
            found[name] = StoredArray(item.shape, _size(item), item.dtype.kind in NUMBERS, texts, _unit(item))

        with self._file() as file:
            found.update(_named_by_attributes("", file))
            file.visititems(visit)
        return found

    def _texts(self, item: Any) -> tuple[str, ...]:
        """Return the texts of a dataset, read one after the other: many may refer to one long text."""
        require_held(self.path, _size(item))
        texts, length, readable = list[str](), 0, item.asstr()
        for at in np.ndindex(item.shape):
            texts.append(str(readable[at]))
            length += len(texts[-1])
            require_held(self.path, length)
        return tuple(texts)

    @contextmanager
    def opened(self) -> Iterator[Callable[[str], Any]]:
        """Open the file and give datasets by path, whose numbers are read when they are sliced."""
        with self._file() as file:
            yield file.__getitem__

    @contextmanager
    def _file(self) -> Iterator[Any]:
        library = extra("h5py")
        with read_as("an HDF5 file", self.path), library.File(self.path, "r") as file:
            yield file


def _require_shallow(path: str) -> None:
    """Raise LinkwiseError for a path that is too deep or too long."""
    if path.count("/") > DEEPEST:
        raise LinkwiseError(
            f"groups lie more than {DEEPEST} deep, from {short(path)!r} on; write the arrays nearer"
            " to the root"
        )
    if len(path) > LONGEST_PATH:
        raise LinkwiseError(
            f"the path {short(path)!r} has {len(path):,} characters, and {LONGEST_PATH:,} are the most; give"
            " its groups shorter names"
        )


def _size(item: Any) -> int:
    """Return the bytes that a dataset takes in memory, or one of its chunks if that is more."""
    count: int = max(math.prod(item.shape), math.prod(item.chunks or ()))
    return count * int(item.dtype.itemsize)


def _unit(item: Any) -> str:
    """Return the unit that attributes give for an array; empty if they give none."""
    told = (item.attrs.get(word, "") for word in ("units", "unit"))
    return next((text.strip() for text in told if isinstance(text, str) and text.strip()), "")


def _named_by_attributes(name: str, item: Any) -> dict[str, StoredArray]:
    """Return the attributes of an item that name joints, as if they were arrays in it."""
    found = {}
    for word in NAMES:
        texts = np.asarray(item.attrs.get(word, ()))
        if texts.ndim == 1 and texts.size and texts.dtype.kind in "OSU":
            names = tuple(text.decode() if isinstance(text, bytes) else str(text) for text in texts)
            found[f"{name}/{word}".lstrip("/")] = StoredArray(texts.shape, is_numeric=False, texts=names)
    return found


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
