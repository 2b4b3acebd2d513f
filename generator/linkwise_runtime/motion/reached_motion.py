"""Motions over time by a back end's own functions, and where the equations in arrays go on from them."""

from collections.abc import Sequence
from typing import NamedTuple

from ..answers.packed import AskedMotion, ReachedMotion
from .c_controller import CController
from .equations_of_motion import EquationsOfMotion, State


class Reached(NamedTuple):
    """Instants of a motion that functions have reached, and those from the last of them on."""

    motion: ReachedMotion
    rest: Sequence[float]
    state: State
    """State at the last instant that was reached."""


def by_functions(
    equations: EquationsOfMotion, state: State, times: Sequence[float], step: float | None
) -> Reached | None:
    """Return the motion as far as the back end's own functions get; None where it has none for it.

    Functions stop where the equations in arrays, which then go on, say what is wrong.
    """
    loads, ties, functions = equations.loads, equations.ties, None
    if callable(loads) or loads.loads.each or equations.varying is not None:
        return None
    if ties is not None:
        functions = ties.functions
        if functions is None:
            return None
    tau = equations.tau
    drives = equations.torques if callable(tau) and not isinstance(tau, CController) else tau
    asked = AskedMotion(state.q, state.v, times, step, drives, equations.passive, functions)
    motion = equations.backend.moved(asked)
    if motion is None or not len(motion.q):
        return None
    state = State(motion.q[-1], motion.qd[-1], motion.work[-1])
    rest = times[len(motion.q) - 1 :]
    if ties is not None and len(rest) > 1:
        ties.go_on_from(state.q)
    return Reached(motion, rest, state)
