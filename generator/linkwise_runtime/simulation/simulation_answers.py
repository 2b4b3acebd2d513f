"""The call `simulate` behind its face: arguments are checked, the motion is integrated and collected."""

import math
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from ..arguments import as_array, check_numbers, shape_of
from ..chosen_names import short
from ..induced.responses import constraints_of
from ..motion_quantities import Trajectory
from ..sums.namespace import namespace
from .equations_of_motion import EquationsOfMotion, State, checked_torques
from .integrators import ADAPTIVE, by_scipy, in_fixed_steps
from .tied_motion import TiedMotion


def simulated(
    robot: Any,
    q: Any,
    qd: Any,
    time: Any,
    tau: Any,
    loads: Any,
    passive: bool,
    step: Any,
    method: str,
    tolerances: tuple[float, float],
    constraints: Any,
) -> Trajectory[Any]:
    """See `MotionCalls.simulate`."""
    constraints = constraints_of(robot, constraints)
    q, qd = (q, qd) if constraints is None else _of_all_joints(constraints, q, qd)
    named = {"q": q, "qd": qd}
    q, qd = robot.backend.arrays(named, robot.n)
    check_numbers(named, robot.joint_names)
    times, step = _instants(time), None if step is None else _positive("step", step)
    equations, start = _started(robot, q, qd, tau, loads, passive, constraints)
    if method == "RK4":
        states = in_fixed_steps(equations.rates, equations.settled, start, times, step)
    elif method in ADAPTIVE:
        if not isinstance(q, np.ndarray):
            raise TypeError(
                f"method {method!r} computes with arrays and keeps no gradient; take 'RK4', or load numpy"
            )
        known = _positive("rtol", tolerances[0]), _positive("atol", tolerances[1])
        states = by_scipy(equations.rates, start, times, method, step, known)
    else:
        raise ValueError(f"method is {short(method)}; choose RK4 or, of SciPy, {', '.join(ADAPTIVE)}")
    return _collected(equations, times, _finite(states, times, q))


def _of_all_joints(constraints: Any, q: Any, qd: Any) -> tuple[Any, Any]:
    """The start of all joints, where it is given of the independent ones."""
    m = len(constraints.independent)
    if shape_of(q)[-1:] == (m,):
        q = constraints.closed(q)
    if shape_of(qd)[-1:] == (m,):
        qd = constraints.velocity(constraints.closed(q), qd)
    return q, qd


def _started(
    robot: Any, q: Any, qd: Any, tau: Any, loads: Any, passive: bool, constraints: Any
) -> tuple[EquationsOfMotion, State]:
    """The equations, and the state that they start from."""
    work, passive = 0.0 * q.sum(-1), passive and bool(robot.structure.passive)
    if not callable(tau):
        tau = 0.0 * q if tau is None else checked_torques(robot, tau, q)
    if constraints is None:
        return EquationsOfMotion(robot, tau, loads, passive, None), State(q, qd, work)
    answers = constraints._answers
    place = answers.closed_place(q, None)
    equations = EquationsOfMotion(robot, tau, loads, passive, TiedMotion(answers, place))
    return equations, State(place.q, place.own(qd), work)


def _finite(states: Iterator[State], times: Sequence[float], like: Any) -> Iterator[State]:
    """The states; raises ValueError for the first that is not finite."""
    xp = namespace(like)
    for t, state in zip(times, states, strict=True):
        if not bool(xp.isfinite(state.q).all() & xp.isfinite(state.v).all()):
            raise ValueError(
                f"the motion is not finite at t = {t:g} s; take smaller steps, or look at the torques"
            )
        yield state


def _collected(
    equations: EquationsOfMotion, times: Sequence[float], states: Iterator[State]
) -> Trajectory[Any]:
    """The motion at all instants."""
    rows = []
    for t, state in zip(times, states, strict=True):
        q, qd = equations.motion(t, state)
        tau = equations.torques(t, q, qd)
        rows.append((q, qd, tau, equations.energy(q, qd), state.work))
    like = rows[0][0]
    xp = namespace(like)
    columns = (xp.stack(column) for column in zip(*rows, strict=True))
    return Trajectory(equations.robot.backend.weights("time", list(times), like), *columns)


def _instants(time: Any) -> list[float]:
    """Raises ValueError for what is not a list of rising finite numbers."""
    instants = as_array("time", time)
    if instants.ndim != 1 or not len(instants) or instants.dtype.kind not in "iuf":
        raise ValueError(
            f"time has shape {instants.shape} and dtype {instants.dtype}; give the instants in s, such as "
            "numpy.linspace(0, 1, 101)"
        )
    values: list[float] = instants.astype(float).tolist()
    for k, (one, after) in enumerate(zip(values, [*values[1:], math.inf], strict=True)):
        if not one < after or not math.isfinite(one):
            raise ValueError(f"time[{k}] is {one:g}; instants must be finite, each later than the one before")
    return values


def _positive(name: str, value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not 0.0 < value < math.inf:
        raise ValueError(f"{name} is {short(value)}; give a number above 0")
    return float(value)
