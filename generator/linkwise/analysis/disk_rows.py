"""Rows of numbers in a file instead of in memory, for logs of any length."""

import mmap
import tempfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from linkwise.package.load import Array
from linkwise.runtime.native.native_system import system_here

AT_ONCE = 1 << 18


def collected(blocks: Iterator[Array], width: int, directory: Path | None) -> Array:
    """All rows of blocks (any, width) as one writable array, in memory or in a file in `directory`."""
    if directory is None:
        return np.concatenate([np.empty((0, width)), *blocks])
    # The file has no name from the start: the system removes it with its last user, however that ends. Where
    # an open file keeps a name, that must not be among results.
    place = None if system_here().keeps_open_files else directory
    with tempfile.TemporaryFile(dir=place) as file:
        for block in blocks:
            file.write(np.ascontiguousarray(block).tobytes())
        file.flush()
        if not file.tell():
            return np.empty((0, width))
        # The array holds the file behind it, and outlives this function.
        return np.frombuffer(mmap.mmap(file.fileno(), 0)).reshape(-1, width)


def let_go(rows: Array) -> None:
    """Have memory not hold what the file behind these rows does; nothing for rows in memory."""
    base: object = rows
    while isinstance(base, np.ndarray):
        base = base.base
    behind = base.obj if isinstance(base, memoryview) else None
    if isinstance(behind, mmap.mmap) and hasattr(mmap, "MADV_DONTNEED"):
        behind.madvise(mmap.MADV_DONTNEED)  # of a shared file, so that what was written stays


def first_column(rows: Array) -> Array:
    """A copy of the first column of rows that may be in a file."""
    column = np.empty(len(rows))
    for at in range(0, len(rows), AT_ONCE):
        column[at : at + AT_ONCE] = rows[at : at + AT_ONCE, 0]
        let_go(rows)
    return column
