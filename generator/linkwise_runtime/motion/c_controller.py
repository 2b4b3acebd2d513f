"""Controllers that are functions of C."""

import ctypes
from dataclasses import dataclass
from typing import Any, cast

import numpy as np

from ..interface import Numbers

CONTROLLER = ctypes.CFUNCTYPE(
    ctypes.c_int,
    ctypes.c_void_p,
    ctypes.c_double,
    ctypes.c_size_t,
    ctypes.c_void_p,
    ctypes.c_void_p,
    ctypes.c_void_p,
)
"""Type of NAME_controller in a package's header: (context, time, count, q, qd, tau) -> 0, or a status."""
FUNCTION = cast(type, CONTROLLER.__base__)
"""Class of functions of ctypes."""


@dataclass(frozen=True)
class CController:
    """Controller that is a function of C, as `simulate` accepts it for its torques."""

    address: int
    context: int | None
    """Address that the function is given first; None for NULL."""
    kept: object
    """Object that keeps function and context where they are, as the caller gave it."""

    def __call__(self, t: float, q: Numbers, qd: Numbers) -> Numbers:
        """Return the torques (..., n) of arrays (..., n), as the function writes them.

        Raises TypeError for what is not NumPy's, ValueError where the function answers with a status.
        """
        if not isinstance(q, np.ndarray):
            raise TypeError("tau is a function of C, which takes NumPy arrays: give q and qd as these")
        at, moved = (np.ascontiguousarray(cast(Any, a)) for a in (q, qd))
        tau = np.zeros_like(at)
        count = at.size // at.shape[-1]
        places = (a.ctypes.data for a in (at, moved, tau))
        status = CONTROLLER(self.address)(self.context, t, count, *places)
        if status:
            raise self.refusal(status, f"at t = {t:g} s")
        return cast(Numbers, tau)

    def refusal(self, status: int, when: str) -> ValueError:
        """Return the error for a status that is not 0."""
        return ValueError(f"the controller answered with status {abs(status)} {when}; 0 is for torques")


def controller_of(tau: object) -> object:
    """Return a function of C as a controller: of ctypes, or in SciPy's LowLevelCallable; else what is given.

    Raises TypeError for a LowLevelCallable of what is not of ctypes.
    """
    function, context = tau, None
    if type(tau).__name__ == "LowLevelCallable":
        function, context = cast(Any, tau).function, cast(Any, tau).user_data
        if not isinstance(function, FUNCTION):
            raise TypeError("tau is a LowLevelCallable; make it of a function of ctypes")
    if not isinstance(function, FUNCTION):
        return tau
    start = ctypes.cast(cast(Any, function), ctypes.c_void_p).value or 0
    if not start:
        raise ValueError("tau is a function of C at address 0; give one that is there, or None for none")
    place = None if context is None else ctypes.cast(context, ctypes.c_void_p).value
    return CController(start, place, tau)
