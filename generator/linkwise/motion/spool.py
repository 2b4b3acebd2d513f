"""Rows that arrive in blocks and are wanted as one array, on disk if there may be hours of them."""

import tempfile
from pathlib import Path

import numpy as np

from linkwise.motion.log import Array


class Spool:
    """Collects blocks of `width` numbers a row, in memory or in a file under `directory`."""

    def __init__(self, width: int, directory: Path | None) -> None:
        self._width = width
        self._blocks: list[Array] = []
        self._file = (
            tempfile.NamedTemporaryFile(dir=directory, suffix=".f64")  # noqa: SIM115
            if directory is not None
            else None
        )

    def append(self, block: Array) -> None:
        """Add rows (any, width)."""
        if self._file is None:
            self._blocks.append(block)
        else:
            self._file.write(np.ascontiguousarray(block).tobytes())

    def finish(self) -> Array:
        """All rows, writable; the file behind them is gone once the array is."""
        if self._file is None:
            return np.concatenate(self._blocks) if self._blocks else np.empty((0, self._width))
        self._file.flush()
        if not self._file.tell():
            self._file.close()
            return np.empty((0, self._width))
        # The mapping outlives the name: POSIX keeps an unlinked file until its last user is gone.
        rows = np.memmap(self._file.name, np.float64, "r+").reshape(-1, self._width)
        self._file.close()
        return rows
