"""Rows of numbers in a file instead of in memory, for logs of any length."""

import mmap
import tempfile
from collections.abc import Iterator
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import numpy as np
from linkwise_runtime.native.system import system_here

from linkwise.arrays import Array

AT_ONCE = 1 << 18


def collected(blocks: Iterator[Array], width: int, directory: Path | None) -> Array:
    """Return all rows of blocks (any, width) as one writable array, in memory or in a file in `directory`."""
    if directory is None:
        return np.concatenate([np.empty((0, width)), *blocks])
    with _nameless(directory) as file:
        for block in blocks:
            file.write(np.ascontiguousarray(block).tobytes())
        file.flush()
        if not file.tell():
            return np.empty((0, width))
        # The array holds the file behind it, and outlives this function.
        return np.frombuffer(mmap.mmap(file.fileno(), 0)).reshape(-1, width)


def copied(rows: Array, directory: Path | None) -> Array:
    """Return a writable copy of rows (any, width) that may be in a file, in memory or in a file."""

    def blocks() -> Iterator[Array]:
        for at in range(0, len(rows), AT_ONCE):
            yield rows[at : at + AT_ONCE]
            let_go(rows)

    return collected(blocks(), rows.shape[1], directory)


class EverySample:
    """A sink that keeps all samples as one array (columns, samples), in memory or in a file in `directory`.

    To be closed by `with`; `values` is read before, and stays valid afterwards.
    """

    def __init__(self, columns: int, samples: int, directory: Path | None = None) -> None:
        self._shape, self._seen = (columns, samples), 0
        self._file = None if directory is None else _nameless(directory)
        self._held = np.empty(self._shape) if directory is None else None

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._file is not None:
            self._file.close()

    def __call__(self, block: Array) -> None:
        """Store a block (columns, any)."""
        first, self._seen = self._seen, self._seen + block.shape[1]
        if self._held is not None:
            self._held[:, first : self._seen] = block
            return
        assert self._file is not None
        for row, values in enumerate(block):
            self._file.seek(8 * (row * self._shape[1] + first))
            self._file.write(values.tobytes())

    @property
    def values(self) -> Array:
        """All samples (columns, samples), for reading."""
        if self._held is not None:
            return self._held
        assert self._file is not None
        self._file.flush()
        mapped = mmap.mmap(self._file.fileno(), 0, access=mmap.ACCESS_READ)
        return np.frombuffer(mapped).reshape(self._shape)


def _nameless(directory: Path) -> Any:
    """Return an open file that has no name: the system removes it with its last user, however that ends.

    On systems where an open file keeps a name, it is not made among the results.
    """
    return tempfile.TemporaryFile(dir=None if system_here().keeps_open_files else directory)


def let_go(rows: Array) -> None:
    """Release the memory that holds the file behind these rows; do nothing for rows in memory."""
    base: object = rows
    while isinstance(base, np.ndarray):
        base = base.base
    behind = base.obj if isinstance(base, memoryview) else None
    if isinstance(behind, mmap.mmap) and hasattr(mmap, "MADV_DONTNEED"):
        behind.madvise(mmap.MADV_DONTNEED)  # of a shared file, so that what was written stays


def first_column(rows: Array, directory: Path | None) -> Array:
    """Return a copy (any,) of the first column of rows that may be in a file, in memory or in a file."""
    return copied(rows[:, :1], directory)[:, 0]
