"""Memory for large results, in huge pages, and taken again once nobody holds what was in it.

The system clears fresh memory page by page, which costs more than large results do, so blocks are kept.
An array over a block has a `Lease` for a base: that is gone when the last array, view, tensor or buffer over
it is, and only then is the block free again. Meanwhile the system may take its pages, if it needs them
(MADV_FREE).
"""

import mmap
from contextlib import suppress
from typing import Any

import numpy as np
from numpy.typing import NDArray

LARGE = 1 << 20
"""Bytes from which results lie in blocks."""
MOST = 1 << 29
"""Bytes of blocks that are kept while nobody needs them."""
PAGE = 1 << 21
APART: dict[str, Any] = (
    {"flags": mmap.MAP_PRIVATE | mmap.MAP_ANONYMOUS} if hasattr(mmap, "MAP_ANONYMOUS") else {}
)
"""Has a fork have memory of its own, where there are forks."""

_free: dict[int, list[mmap.mmap]] = {}
"""Free blocks by size. Nothing is locked, as a lease may end anywhere: lists give and take in one step."""


class Lease:
    """A block that arrays lie in, until the last of them is gone."""

    def __init__(self, size: int) -> None:
        try:
            self._block = _free[size].pop()
        except (KeyError, IndexError):
            self._block = _new(size)
        self._size = size
        start = np.frombuffer(self._block, np.uint8).__array_interface__["data"][0]
        self.__array_interface__ = {"version": 3, "data": (start, False), "shape": (size,), "typestr": "|u1"}

    def __del__(self) -> None:
        block = getattr(self, "_block", None)
        if block is None:
            return
        if self._size > MOST:
            return
        if self._size + sum(size * len(blocks) for size, blocks in tuple(_free.items())) > MOST:
            _free.clear()
        if hasattr(mmap, "MADV_FREE"):
            with suppress(OSError):  # a kernel without it
                block.madvise(mmap.MADV_FREE)
        _free.setdefault(self._size, []).append(block)


def lasting(count: int) -> NDArray[Any]:
    """Bytes of a block, at least `count` of them, that start on a page."""
    return np.asarray(Lease(-(-count // PAGE) * PAGE))


def _new(size: int) -> mmap.mmap:
    try:
        block = mmap.mmap(-1, size, **APART)
    except (OSError, OverflowError):
        raise MemoryError(f"no memory for results of {size} bytes") from None
    if hasattr(mmap, "MADV_HUGEPAGE"):
        with suppress(OSError):  # a kernel without them
            block.madvise(mmap.MADV_HUGEPAGE)
    return block
