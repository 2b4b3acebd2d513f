"""The functions of a robot's compiled C, and memory for their results."""

import ctypes
import math
from contextlib import suppress
from functools import cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .native_build import Sources, library
from .native_memory import LARGE, lasting

NumberArray = NDArray[Any]

Place = ctypes.c_char * 0

CARRAY, WARNS = 0x501, 1 << 31
"""Of `flags.num`: an array that C can read and write; one that warns where writing is spoken of."""

LITTLE = 1 << 15
"""Bytes below which where memory starts is of no account."""


class Control(NamedTuple):
    """A function of one sample: how many arrays of the motion it reads, and whether a point of a frame."""

    motion: int
    point: bool = False


CONTROL = {
    "pose": Control(1),
    "jacobian": Control(1, point=True),
    "jacobian_rate": Control(2, point=True),
    "mass_matrix": Control(1),
    "forward_dynamics": Control(3),
    "forward_dynamics_of_links": Control(3),
}
"""Functions that take one sample and no count."""
IMPEDANCE = ("partial_impedance", "frame_partial_impedance")
"""Those beside them for control, which `native_impedance` calls."""


@cache
def function(sources: Sources, call: str, kind: str, arrays: int) -> Any:
    """C function of a call that takes a count and `arrays` pointers; raises as `symbol` does."""
    found = symbol(sources, call, kind)
    found.argtypes = [ctypes.c_size_t] + [ctypes.c_void_p] * arrays
    found.restype = None
    return found


def symbol(sources: Sources, call: str, kind: str) -> Any:
    """C function by its name; the first from a library compiles it.

    kind: f8 or f4. Raises RuntimeError if it cannot be had.
    """
    real, suffix = {"f8": ("double", ""), "f4": ("float", "f")}[kind]
    path = library(sources, real, _library_of(call))
    try:
        return getattr(ctypes.CDLL(str(path)), f"{sources.name}_{call}{suffix}")
    except (OSError, AttributeError) as error:
        with suppress(OSError):
            path.unlink()  # whole as it is, it is of no use: the next time it is made anew
        raise RuntimeError(
            f"cannot load what was compiled: {error}; point CC to another C compiler, "
            "or LINKWISE_CACHE to a directory whose files may be run"
        ) from None


def _library_of(call: str) -> str:
    """Which of a robot's libraries has a function."""
    if call in CONTROL or call in IMPEDANCE:
        return "control"
    if call.endswith("position_gradient"):
        return "gradient"
    return "regressors" if "regressor" in call else "decomposition"


def address(array: NumberArray) -> int:
    """Where an array begins in memory."""
    start: int = array.__array_interface__["data"][0]
    return start


def place(array: NumberArray) -> Any:
    """What ctypes takes for an array's place in memory, quicker than its address where it is writable."""
    buffer: Any = array
    writable = array.flags.num & (CARRAY | WARNS) == CARRAY
    return Place.from_buffer(buffer) if writable else address(array)


def memory(shape: tuple[int, ...], kind: "np.dtype[Any]") -> NumberArray:
    """New memory for an array; unless it is little, it starts on a cache line, as C wants it.

    It is never that of an earlier result that somebody still holds.
    """
    count = math.prod(shape) * kind.itemsize
    if count < LITTLE:
        return np.empty(shape, kind)
    if count >= LARGE:
        return lasting(count)[:count].view(kind).reshape(shape)
    owner = np.empty(count + 64, np.uint8)
    start = -address(owner) % 64
    return owner[start : start + count].view(kind).reshape(shape)
