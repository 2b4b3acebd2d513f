"""Memory for results: large results lie in huge pages, used again once nobody holds what was in them.

The system clears fresh memory page by page, which costs more than computing large results, so blocks are
kept. An array over a block has a `Lease` as its base: the lease ends with the last array, view, tensor or
buffer over it, and only then is the block free again. Meanwhile the system may take the pages of a free
block, if it needs them (MADV_FREE).
"""

import ctypes
import math
import mmap
from contextlib import suppress
from typing import Any

import numpy as np
from numpy.typing import NDArray

NumberArray = NDArray[np.floating]
NumberType = np.dtype[np.floating]
"""dtype of the numbers: float64 or float32."""

Place = ctypes.c_char * 0

CARRAY, WARNS = 0x501, 1 << 31
"""Bits of `flags.num`: an array that C can read and write; an array that warns when it is written to."""

LITTLE = 1 << 15
"""Bytes below which the alignment of memory does not matter."""

LARGE = 1 << 20
"""Bytes from which results lie in blocks."""
MOST = 1 << 29
"""Most bytes of blocks that are kept while nobody needs them."""
PAGE = 1 << 21
APART: dict[str, int] = (
    {"flags": mmap.MAP_PRIVATE | mmap.MAP_ANONYMOUS} if hasattr(mmap, "MAP_ANONYMOUS") else {}
)
"""Arguments that give a forked process memory of its own, on systems that fork."""

_free: dict[int, list[mmap.mmap]] = {}
"""Free blocks by size. No lock is needed though a lease may end anywhere: lists append and pop atomically."""


class Lease:
    """A block of memory that arrays lie in, until the last of them is gone."""

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
            with suppress(OSError):  # a system without it
                block.madvise(mmap.MADV_FREE)
        _free.setdefault(self._size, []).append(block)


def lasting(count: int) -> NDArray[np.uint8]:
    """Return the bytes of a block, at least `count` of them, which start on a page."""
    return np.asarray(Lease(-(-count // PAGE) * PAGE))


def _new(size: int) -> mmap.mmap:
    try:
        block = mmap.mmap(-1, size, **APART)
    except (OSError, OverflowError):
        raise MemoryError(f"no memory for results of {size} bytes") from None
    if hasattr(mmap, "MADV_HUGEPAGE"):
        with suppress(OSError):  # a system without them
            block.madvise(mmap.MADV_HUGEPAGE)
    return block


def address(array: NDArray[np.generic]) -> int:
    """Return the address of an array's first number."""
    start: int = array.__array_interface__["data"][0]
    return start


def place(array: NumberArray) -> "ctypes.Array[ctypes.c_char] | int":
    """Return an array's place in memory for ctypes: quicker than its address where the array is writable."""
    buffer: Any = array  # it is a buffer, which numpy declares from Python 3.12 on
    writable = array.flags.num & (CARRAY | WARNS) == CARRAY
    return Place.from_buffer(buffer) if writable else address(array)


def memory(shape: tuple[int, ...], kind: NumberType) -> NumberArray:
    """Return new memory for an array; unless it is small, it starts on a cache line, as C needs it.

    It is never the memory of an earlier result that somebody still holds.
    """
    count = math.prod(shape) * kind.itemsize
    if count < LITTLE:
        return np.empty(shape, kind)
    if count >= LARGE:
        return lasting(count)[:count].view(kind).reshape(shape)
    owner = np.empty(count + 64, np.uint8)
    start = -address(owner) % 64
    return owner[start : start + count].view(kind).reshape(shape)
