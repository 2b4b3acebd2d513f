"""Motions over time by the compiled C: steps of RK4 of many motions at once."""

import ctypes
import math
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext
from functools import cache
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from ..answers.packed import AskedMotion, ReachedMotion
from ..interface import Numbers
from ..motion.c_controller import CONTROLLER, CController
from ..rule.joint_tree import JointTree
from .calls import NativeCalls, plain
from .constraints import NativeTies
from .control import RealType
from .library import MOST_TIED, scratch_numbers, symbol
from .memory import NumberArray, NumberType, address

if TYPE_CHECKING:
    from ctypes import _NamedFuncPointer as CFunction

REFUSED = -1
"""Status of a controller of Python that raised an error."""


@cache
def simulation_struct(real: RealType) -> type[ctypes.Structure]:
    """Return the struct NAME_simulation of double or float.

    Its last field is there in C only where joints have springs, damping, friction or armature.
    """
    fields: list[tuple[str, Any]] = [
        ("instants", ctypes.c_size_t),
        ("time", ctypes.c_void_p),
        ("step", ctypes.c_double),
        ("controller", ctypes.c_void_p),
        ("context", ctypes.c_void_p),
        ("tau", ctypes.c_void_p),
        ("constraints", ctypes.c_void_p),
        ("reached", ctypes.c_void_p),
        ("of_links", ctypes.c_int),
    ]
    return type("SimulationStruct", (ctypes.Structure,), {"_fields_": fields})


class CalledBack:
    """Controller of Python that C calls, on memory in which C has the motion; keeps what it raised."""

    def __init__(self, tau: Callable[[float, Numbers, Numbers], Numbers], memory: NumberArray) -> None:
        """Read q and qd from memory (3, ..., n), and write torques behind them."""
        self._tau, self._memory = tau, memory
        self.error: BaseException | None = None

    def __call__(self, context: int, time: float, count: int, q: int, qd: int, tau: int) -> int:
        """Write the torques of an instant; return 0, or `REFUSED` where the controller raised an error."""
        if self.error is not None:
            return REFUSED
        try:
            at, moved = self._memory[:2].copy()
            self._memory[2] = cast(NumberArray, self._tau(time, cast(Numbers, at), cast(Numbers, moved)))
        except BaseException as error:
            self.error = error
            return REFUSED
        return 0

    @contextmanager
    def hearing(self) -> Iterator[None]:
        """Keep what handlers of signals raise before or behind a call, which ctypes takes for not raised."""
        before = sys.unraisablehook

        def hear(told: Any) -> None:
            # From Python 3.14 on, the object is told in the text alone.
            if told.object is self or (told.object is None and repr(self) in (told.err_msg or "")):
                self.error = told.exc_value
            else:
                before(told)

        sys.unraisablehook = hear
        try:
            yield
        finally:
            sys.unraisablehook = before

    def check(self) -> None:
        """Raise what the controller raised, unchanged."""
        error, self.error = self.error, None
        if error is None:
            return
        try:
            raise error
        finally:
            del error


class NativeMotions:
    """C function of a package for motions over time, for numbers that stay as they are."""

    def __init__(self, calls: NativeCalls, tree: JointTree) -> None:
        self._calls = calls
        kinds = (tie.kind for tie in tree.ties)
        self._scratch = scratch_numbers(calls.structure.n, kinds, len(tree.couplings))
        self._functions: dict[NumberType, CFunction] = {}

    def moved(self, asked: AskedMotion) -> ReachedMotion | None:
        """Return a motion as far as C gets; None where C has no function for it.

        Raises what a controller of Python raises, and ValueError for the status of one of C.
        """
        calls, n = self._calls, self._calls.structure.n
        q, qd = (plain(cast(NumberArray, a)) for a in (asked.q, asked.qd))
        if calls.learned or n > MOST_TIED or not q.size:
            return None
        kind, batch, rows, given = q.dtype, q.shape[:-1], len(asked.times), asked.tau
        count = math.prod(batch)
        scratch, reached = np.empty(count * self._scratch, kind), ctypes.c_size_t(0)
        back = None
        if callable(given) and not isinstance(given, CController):
            back = CalledBack(given, scratch[: 3 * count * n].reshape(3, *batch, n))
        results = [np.empty((rows, *batch, n), kind) for _ in range(3)] + [np.empty((rows, *batch), kind)]
        told, kept = _told(asked, kind, back, reached)
        arrays = [q, qd, *([calls.constants(kind)] if calls.parameters else [])]
        function = self._function(kind)
        with nullcontext() if back is None else back.hearing():
            status = function(
                ctypes.c_size_t(count),
                *(ctypes.c_void_p(address(a)) for a in arrays),
                ctypes.byref(told),
                *(ctypes.c_void_p(address(a)) for a in (scratch, *results)),
            )
        del kept
        if back is not None:
            back.check()
        if status < 0 and isinstance(given, CController):
            raise given.refusal(status, f"after t = {asked.times[max(reached.value - 1, 0)]:g} s")
        return ReachedMotion(*(cast(Numbers, a[: reached.value]) for a in results))

    def _function(self, kind: NumberType) -> "CFunction":
        """Return the C function for a dtype, compiled if it is not there yet."""
        if kind not in self._functions:
            found = self._functions[kind] = symbol(self._calls.sources, "simulate", kind.str[1:])
            found.restype = ctypes.c_int
        return self._functions[kind]


def _told(
    asked: AskedMotion, kind: NumberType, back: CalledBack | None, reached: ctypes.c_size_t
) -> tuple[ctypes.Structure, object]:
    """Return what C is told of a motion, and what has to stay where it is until C is done."""
    given, times = asked.tau, np.array(asked.times, float)
    settings = None if asked.ties is None else cast(NativeTies, asked.ties).settings(kind)
    pointer = None if back is None else CONTROLLER(back)
    torques = None if callable(given) else plain(cast(NumberArray, given))
    driven = given if isinstance(given, CController) else None
    controller = (
        driven.address if driven else ctypes.cast(pointer, ctypes.c_void_p).value if pointer else None
    )
    struct = simulation_struct(ctypes.c_double if kind.itemsize == 8 else ctypes.c_float)(
        len(times),
        address(times),
        asked.step or 0.0,
        controller,
        driven.context if driven else None,
        None if torques is None else address(torques),
        None if settings is None else ctypes.addressof(settings.struct),
        ctypes.addressof(reached),
        not asked.passive,
    )
    return struct, (times, settings, pointer, torques)
