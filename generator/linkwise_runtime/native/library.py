"""The functions of a robot's compiled C, and how they are called for one sample.

One sample is copied to and from a fixed place in memory: finding the addresses of new arrays costs more.
"""

import ctypes
from collections.abc import Callable, Hashable, Iterable, Sequence
from contextlib import suppress
from functools import cache, partial
from typing import TYPE_CHECKING, Any, Generic, NamedTuple, TypeVar

import numpy as np

from ..call_table import CALLS
from ..constraints.held_frames import ROWS
from .build import Sources, library
from .memory import NumberArray, Place

if TYPE_CHECKING:
    from ctypes import _NamedFuncPointer as CFunction

Key = TypeVar("Key", bound=Hashable)


class Control(NamedTuple):
    """A function of one sample: number of arrays of motion it reads, and whether it takes a frame's point."""

    motion: int
    point: bool = False


CONTROL = {row.c: Control(len(row.motion), "point" in row.options) for row in CALLS.values() if row.one}
"""Functions that take one sample and no count."""
IMPEDANCE = ("partial_impedance", "frame_partial_impedance", "cancel")
"""Functions of one sample for control: of joints, of a frame, and of what is cancelled at an acceleration."""
MOST_CONTACTS = 8
"""Most contacts that C takes at a time."""
MOST_TIED = 200
"""Most joints of robots with functions of tied joints: their matrices lie on the stack."""
TIED = (
    "constraint_rows",
    "closed",
    "following",
    "constrained_coefficients",
    "constrained_propagation",
    "constrained_torque",
    "constrained_response",
    "constrained_response_of_links",
    "constrained_dynamics",
    "constrained_dynamics_of_links",
    "constrained_partial_impedance",
    "constrained_frame_partial_impedance",
    "constrained_cancel",
    "contacts_keep",
    "simulate",
)
"""Functions of joints that are tied, and of motions over time."""


def scratch_numbers(joints: int, kinds: Iterable[str], couplings: int) -> int:
    """Return how many numbers of memory C needs for each motion, as simulation.h lays them out.

    kinds: those of the ties of the robot's file
    """
    rows = sum(len(ROWS[kind]) for kind in kinds) + couplings + 6 * MOST_CONTACTS
    return joints * (4 * joints + rows + 15) + 6


@cache
def function(sources: Sources, call: str, kind: str, arrays: int) -> "CFunction":
    """Return the C function of a call that takes a count and `arrays` pointers; raises as `symbol` does."""
    found = symbol(sources, call, kind)
    found.argtypes = [ctypes.c_size_t] + [ctypes.c_void_p] * arrays
    found.restype = None
    return found


def symbol(sources: Sources, call: str, kind: str) -> "CFunction":
    """Return a C function by its name; the first one of a library compiles it.

    kind: f8 or f4. Raises RuntimeError where it cannot be compiled or loaded.
    """
    real, suffix = {"f8": ("double", ""), "f4": ("float", "f")}[kind]
    path = library(sources, real, _library_of(call))
    try:
        return ctypes.CDLL(str(path))[f"{sources.name}_{call}{suffix}"]
    except (OSError, AttributeError) as error:
        with suppress(OSError):
            path.unlink()  # whole, but of no use: the next call compiles it anew
        raise RuntimeError(
            f"cannot load what was compiled: {error}; point CC to another C compiler, "
            "or LINKWISE_CACHE to a directory whose files may be run"
        ) from None


def _library_of(call: str) -> str:
    """Return which of a robot's libraries, by its key in PARTS, has a function."""
    if call in TIED:
        return "constraints"
    if call in CONTROL or call in IMPEDANCE:
        return "control"
    if call.endswith("position_gradient"):
        return "gradient"
    own = "regressor" in call or "variances" in call or call == "reactions"
    return "regressors" if own else "decomposition"


def start_of(function: "CFunction") -> int:
    """Return the address of a C function."""
    return ctypes.cast(function, ctypes.c_void_p).value or 0


class OneSampleCall(NamedTuple):
    """A C function bound to the memory of its arguments, for one sample."""

    compute: Callable[[], int | None]
    """Calls the function; for a function that may fail, a number other than 0 says that it did."""
    motion: memoryview
    """Bytes of the arguments that change from call to call, such as q, qd and qdd, one after another."""
    results: list[NumberArray]


def one_sample_call(
    function: "CFunction",
    may_fail: bool,
    given: Iterable[object],
    motion: NumberArray,
    results: Sequence[NumberArray | None],
) -> OneSampleCall:
    """Return a call of a C function that takes what is given, then results, and no arrays that are empty.

    given: numbers of ctypes, None for NULL, and arrays; those of the motion lie in its memory
    results: arrays that are written to, None for NULL
    """
    # Without argtypes: the arguments are converted here, not at every call.
    bare = ctypes.CFUNCTYPE(ctypes.c_int if may_fail else None)(start_of(function))
    arguments = [
        _argument(value) for value in (*given, *results) if not isinstance(value, np.ndarray) or value.size
    ]
    asked = [a for a in results if a is not None]
    return OneSampleCall(partial(bare, *arguments), motion.data.cast("B"), asked)


def _argument(value: object) -> object:
    """Return a value as ctypes passes it on: an array by its address."""
    buffer: Any = value
    return ctypes.byref(Place.from_buffer(buffer)) if isinstance(value, np.ndarray) else value


class OneSamplePool(Generic[Key]):
    """Calls for one sample by key, made when none is free.

    A call in use is not in the pool: no other thread, and no signal handler, finds it.
    """

    def __init__(self, make: Callable[[Key], OneSampleCall]) -> None:
        self._make = make
        self.free: dict[Key, list[OneSampleCall]] = {}

    def results(self, key: Key, numbers: bytes) -> list[NumberArray]:
        """Return copies of the results for the bytes of a motion; an empty list where the function failed."""
        try:
            free = self.free[key]
            one = free.pop()
        except LookupError:
            one, free = self._make(key), self.free.setdefault(key, [])
        compute, motion, results = one
        motion[:] = numbers
        failed = compute()
        copies = [] if failed else [a.copy() for a in results]
        free.append(one)
        return copies
