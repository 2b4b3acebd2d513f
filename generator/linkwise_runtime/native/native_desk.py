"""One sample through ctypes, copied to and from a known place: to find out where arrays lie costs more."""

import ctypes
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from numpy import ndarray

from .native_library import NumberArray, Place


class Desk(NamedTuple):
    """Memory for one sample, and a C function that knows where it is."""

    compute: Callable[[], int | None]
    """Of a function that may fail, a number other than 0 says that it did."""
    motion: memoryview
    """Bytes of what changes from call to call: q, qd and qdd, say, one after another."""
    results: list[NumberArray]


def new_desk(function: Any, given: Sequence[Any], memory: NumberArray, results: list[NumberArray]) -> Desk:
    """A desk for a C function that takes what is given, then results, and no arrays that are empty.

    given: numbers as ctypes has them, None for NULL, and arrays, those of the motion in this memory
    """
    bare = type(function)(ctypes.cast(function, ctypes.c_void_p).value)
    bare.restype = function.restype  # and no argtypes: its arguments are made here, not at every call
    arguments = [
        _argument(value) for value in (*given, *results) if not isinstance(value, ndarray) or value.size
    ]
    return Desk(partial(bare, *arguments), memory.data.cast("B"), results)


def _argument(value: Any) -> Any:
    """As ctypes passes it on: an array by its place."""
    buffer: Any = value
    return ctypes.byref(Place.from_buffer(buffer)) if isinstance(value, ndarray) else value


class Desks:
    """Desks by call and dtype; one in use is not among them: no thread or signal handler finds it."""

    def __init__(self, n: int, new: Callable[[str, "np.dtype[Any]"], Desk]) -> None:
        """`new` makes a desk for a call of a robot of n joints."""
        self._shape, self._new = (n,), new
        self._free: dict[tuple[str, np.dtype[Any]], list[Desk]] = {}

    def at_once(self, call: str, motion: Sequence[Any]) -> list[NumberArray] | None:
        """Results for what is plainly one sample and has a free desk; None where one has to look twice."""
        kind: Any = getattr(motion[0], "dtype", None)
        shape = self._shape
        for a in motion:
            if type(a) is not ndarray or a.dtype is not kind or a.shape != shape:
                return None
        try:
            numbers = b"".join(motion)
            free = self._free[call, kind]
            desk = free.pop()
        except (TypeError, LookupError):  # TypeError for an array with gaps
            return None
        return _computed(desk, free, numbers)

    def results(self, call: str, motion: Sequence[NumberArray]) -> list[NumberArray]:
        """Results for one sample of arrays of one dtype, float32 or float64."""
        kind = motion[0].dtype
        free = self._free.setdefault((call, kind), [])
        try:
            desk = free.pop()
        except IndexError:
            desk = self._new(call, kind)
        return _computed(desk, free, b"".join(a.tobytes() for a in motion))


def _computed(desk: Desk, free: list[Desk], numbers: bytes) -> list[NumberArray]:
    compute, motion, results = desk
    motion[:] = numbers
    compute()
    copies = [a.copy() for a in results]
    free.append(desk)
    return copies
