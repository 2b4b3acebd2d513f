"""The functions of a robot's compiled C, and memory for their results."""

import ctypes
import sys
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .native_build import Sources, library

NumberArray = NDArray[Any]


@cache
def function(sources: Sources, call: str, kind: str, arrays: int) -> Any:
    """C function of a call that takes a count and `arrays` pointers; the first from a library compiles it.

    call: decomposition, torque or position_gradient; kind: f8 or f4
    """
    real, suffix = {"f8": ("double", ""), "f4": ("float", "f")}[kind]
    what = "gradient" if call == "position_gradient" else "decomposition"
    path = library(sources, real, what)
    try:
        loaded = ctypes.CDLL(str(path))
    except OSError:
        path.unlink(missing_ok=True)  # cut short by a full disk, say: build it again
        loaded = ctypes.CDLL(str(library(sources, real, what)))
    found = getattr(loaded, f"{sources.name}_{call}{suffix}")
    found.argtypes = [ctypes.c_size_t] + [ctypes.c_void_p] * arrays
    found.restype = None
    return found


def address(array: NumberArray) -> int:
    """Where an array begins in memory."""
    start: int = array.__array_interface__["data"][0]
    return start


class Memory:
    """Memory for results: new, or that of earlier results which nobody holds any more.

    The system hands out new memory page by page, which costs more than computing what goes into it.
    """

    LEAST, MOST, KEPT = 1 << 15, 1 << 24, 4

    def __init__(self) -> None:
        self._earlier: list[NDArray[np.uint8]] = []

    def __call__(self, size: int, kind: "np.dtype[Any]") -> NumberArray:
        """NumberArray of `size` numbers, starting on a cache line so that C can write whole lines."""
        count = size * kind.itemsize + 64
        if count < self.LEAST:
            return np.empty(size, kind)
        if count > self.MOST:
            return _aligned(np.empty(count, np.uint8), size, kind)
        for _ in range(len(self._earlier)):
            try:
                owner = self._earlier.pop(0)  # at once, so that no other thread looks at it
            except IndexError:
                continue
            # Held by `owner` and by this very look alone.
            if count <= owner.nbytes <= 2 * count and sys.getrefcount(owner) == 2:
                break
            self._earlier.append(owner)
        else:
            owner = np.empty(count, np.uint8)
        array = _aligned(owner, size, kind)
        self._earlier.append(owner)
        del self._earlier[: -self.KEPT]
        return array


def _aligned(owner: NDArray[np.uint8], size: int, kind: "np.dtype[Any]") -> NumberArray:
    start = -address(owner) % 64
    return owner[start : start + size * kind.itemsize].view(kind)
