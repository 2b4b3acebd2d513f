"""Rows that arrive in blocks and are wanted as one array, on disk if there may be hours of them."""

import mmap
import tempfile
from pathlib import Path
from typing import Self

import numpy as np

from linkwise.analysis.log import Array


class Spool:
    """Collects blocks of `width` numbers a row, in memory or in a file under `directory`.

    The file has no name from the start: the system drops it with its last user, however that ends.
    """

    def __init__(self, width: int, directory: Path | None) -> None:
        self._width = width
        self._blocks: list[Array] = []
        self._file = tempfile.TemporaryFile(dir=directory) if directory is not None else None  # noqa: SIM115

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        if self._file is not None:
            self._file.close()

    def append(self, block: Array) -> None:
        """Add rows (any, width)."""
        if self._file is None:
            self._blocks.append(block)
        else:
            self._file.write(np.ascontiguousarray(block).tobytes())

    def finish(self) -> Array:
        """All rows, writable; the array holds the file behind it and outlives the spool."""
        if self._file is None:
            return np.concatenate(self._blocks) if self._blocks else np.empty((0, self._width))
        self._file.flush()
        if not self._file.tell():
            return np.empty((0, self._width))
        return np.frombuffer(mmap.mmap(self._file.fileno(), 0)).reshape(-1, self._width)
