"""Simulation of a robot over time: arguments are checked, the motion is integrated and collected."""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from importlib import import_module
from itertools import pairwise
from numbers import Real
from typing import Any, NamedTuple, cast

import numpy as np
from numpy.typing import NDArray

from ..arguments import check_numbers, rising_instants, shape_of
from ..chosen_names import short
from ..constraints.robot_constraints import Constraints
from ..interface import Numbers, array_of, namespace
from ..quantities import Trajectory
from .c_controller import controller_of
from .equations_of_motion import EquationsOfMotion, Given, ReadLoads, State, varying_of
from .induced_accelerations import DrivenRobot, constraints_of
from .reached_motion import by_functions
from .source_forces import loads_of
from .tied_motion import TiedMotion, TiesLost

Rates = Callable[[float, State], State]
ADAPTIVE = ("RK23", "RK45", "DOP853", "Radau", "BDF", "LSODA")
"""Methods of SciPy's solve_ivp."""
PARTS = 17
"""Instants of a solver's step at which it is looked at, if it is too long to be told at once."""


def in_fixed_steps(
    rates: Rates, settle: Rates, start: State, times: Sequence[float], step: float | None
) -> Iterator[State]:
    """Yield states at `times`, with as many equal steps between them as make none longer than `step`.

    settle: function of an instant and the state after each step, which returns the state to go on from
    """
    yield start
    state = start
    for begin, end in pairwise(times):
        count = 1 if step is None else max(1, math.ceil((end - begin) / step * (1.0 - 1e-12)))
        length = (end - begin) / count
        for k in range(count):
            state = settle(begin + (k + 1) * length, _step(rates, begin + k * length, length, state))
        yield state


def by_scipy(
    rates: Rates,
    settle: Rates,
    start: State,
    times: Sequence[float],
    method: str,
    step: float | None,
    tolerances: tuple[float, float],
) -> Iterator[State]:
    """Yield states at `times`, of NumPy arrays, by steps whose errors are each within the tolerances.

    settle: function of an instant and the state after each step, which is told of it
    Raises ImportError without SciPy, ValueError where the solver gives up.
    """
    try:
        solvers = import_module("scipy.integrate")
    except ImportError:
        raise ImportError(
            f"method {method!r} is SciPy's, which is not installed here: pip install scipy, or take method "
            "'RK4'"
        ) from None

    exact = State(*(np.asarray(a, float) for a in start))
    lost: TiesLost | None = None
    told: ValueError | None = None

    def flat_rates(t: float, values: NDArray[np.float64]) -> NDArray[np.float64]:
        nonlocal lost, told
        try:
            return _flat(rates(float(t), _shaped(values, exact)))
        except TiesLost as error:  # of a state that is tried; solvers take a shorter step for what is NaN
            lost = error.with_traceback(None)
            return np.full_like(values, np.nan)
        except ValueError as error:
            told = error
            raise

    yield start
    rest, (rtol, atol) = list(times[1:]), tolerances
    if not rest:
        return
    most, again = math.inf if step is None else step, -math.inf

    def begun(t: float, values: NDArray[np.float64]) -> Any:
        make = getattr(solvers, method)
        return make(flat_rates, t, values, times[-1], max_step=most, rtol=rtol, atol=atol)

    solver = begun(times[0], _flat(exact))
    while rest:
        known = lost
        try:
            message = solver.step()
        except ValueError as error:
            # Implicit methods grow the way by which they ask for slopes while nothing changes along it, and
            # what they find there is NaN where a joint has become independent since: they begin anew.
            if lost is None or error is told:
                raise
            if solver.t == again:
                raise lost from None
            again = solver.t
            solver = begun(solver.t, solver.y)
            continue
        if solver.status == "failed":
            if lost is not None and lost is not known:
                raise lost
            raise ValueError(f"{method} gave up after t = {solver.t:g} s: {message}")
        between = solver.dense_output()
        begin, end = float(solver.t_old), float(solver.t)
        try:
            settle(end, _shaped(between(end), exact))
        except TiesLost:  # of a step that is too long to tell, perhaps
            for part in np.linspace(begin, end, PARTS)[1:]:
                settle(float(part), _shaped(between(part), exact))
        while rest and rest[0] <= solver.t:
            yield _shaped(between(rest.pop(0)), start)


def _step(rates: Rates, t: float, length: float, state: State) -> State:
    """Return the state after a step of length h: y + h/6 (k1 + 2 k2 + 2 k3 + k4)."""

    def moved(by: float, slope: State) -> State:
        return State(*(a + by * b for a, b in zip(state, slope, strict=True)))

    k1 = rates(t, state)
    k2 = rates(t + length / 2, moved(length / 2, k1))
    k3 = rates(t + length / 2, moved(length / 2, k2))
    k4 = rates(t + length, moved(length, k3))
    mean = (a + 2.0 * b + 2.0 * c + d for a, b, c, d in zip(k1, k2, k3, k4, strict=True))
    return moved(length / 6.0, State(*mean))


def _flat(state: State) -> NDArray[np.float64]:
    return np.concatenate([np.asarray(a, float).reshape(-1) for a in state])


def _shaped(values: NDArray[np.float64], like: State) -> State:
    parts, begin = [], 0
    for a in map(array_of, like):
        parts.append(values[begin : begin + a.size].reshape(a.shape).astype(a.dtype))
        begin += a.size
    return State(*parts)


class Simulated(NamedTuple):
    """Arguments of `Dynamics.simulate`."""

    q: object
    qd: object
    time: object
    tau: object
    loads: object
    passive: bool
    step: object
    method: object
    rtol: object
    atol: object
    constraints: object
    inputs: object


def simulate_motion(robot: DrivenRobot, asked: Simulated) -> Trajectory[Any]:
    """Return the answer of `Dynamics.simulate`."""
    constraints = constraints_of(robot, asked.constraints)
    q, qd = asked.q, asked.qd
    if constraints is not None:
        q, qd = _of_all_joints(constraints, q, qd)
    named: dict[str, object] = {"q": q, "qd": qd}
    drive = controller_of(asked.tau)
    if drive is not None and not callable(drive):
        named["tau"] = drive
    loads = loads_of(robot.backend, () if callable(asked.loads) else asked.loads)
    backend, numbers = robot.door.read(named, beside=loads.beside)
    motion = dict(zip(named, numbers[: len(named)], strict=True))
    check_numbers(motion, robot.joint_names)
    start, rate = motion["q"], motion["qd"]
    tau = cast(Given, drive) if callable(drive) else motion.get("tau", 0.0 * start)
    pulls = ReadLoads(loads, numbers[len(named) :])
    given = cast(Given, asked.loads) if callable(asked.loads) else pulls
    times = rising_instants("time", asked.time)
    step = None if asked.step is None else _positive("step", asked.step)
    tolerances = _positive("rtol", asked.rtol), _positive("atol", asked.atol)
    passive = asked.passive and bool(backend.structure.passive)
    varying = varying_of(backend, asked.inputs)
    if varying is not None:
        backend = varying.backend
    equations, state = _started(
        EquationsOfMotion(backend, tau, given, passive, None, varying), start, rate, constraints
    )
    if asked.method == "RK4":
        return _by_fixed_steps(equations, state, times, step)
    if asked.method not in ADAPTIVE:
        raise ValueError(f"method is {short(asked.method)}; choose RK4 or, of SciPy, {', '.join(ADAPTIVE)}")
    if not isinstance(start, np.ndarray):
        raise TypeError(
            f"method {asked.method!r} computes with arrays and keeps no gradient; take 'RK4', or load numpy"
        )
    states = by_scipy(equations.rates, equations.close_ties, state, times, asked.method, step, tolerances)
    return _collected(equations, times, states)


def _by_fixed_steps(
    equations: EquationsOfMotion, state: State, times: Sequence[float], step: float | None
) -> Trajectory[Any]:
    """Return the motion by RK4, as far as they get by the back end's own functions."""
    reached = by_functions(equations, state, times, step)
    rest, begun = (times, state) if reached is None else (reached.rest, reached.state)
    states = in_fixed_steps(equations.rates, equations.close_ties, begun, rest, step)
    if reached is None:
        return _collected(equations, times, states)
    q, qd, tau, work = reached.motion
    before = [q, qd, tau, equations.energy(times[0], q, qd), work]
    next(states)
    if len(rest) > 1:
        after = _collected(equations, rest[1:], states)[1:]
        before = [namespace(q).concat(both) for both in zip(before, after, strict=True)]
    return Trajectory[Any](_instants(equations, times, q), *before)


def _of_all_joints(constraints: Constraints[Any], q: object, qd: object) -> tuple[object, object]:
    """Return q and qd of all joints at the start, also where they are given for the independent ones."""
    m = len(constraints.independent)
    if shape_of(q)[-1:] == (m,):
        q = constraints.closed(cast(Any, q))
    if shape_of(qd)[-1:] == (m,):
        qd = constraints.velocity(constraints.closed(cast(Any, q)), cast(Any, qd))
    return q, qd


def _started(
    free: EquationsOfMotion, q: Numbers, qd: Numbers, constraints: Constraints[Any] | None
) -> tuple[EquationsOfMotion, State]:
    """Return equations for an open tree, or with constraints, and the state that they start from."""
    work = 0.0 * q.sum(-1)
    if constraints is None:
        return free, State(q, qd, work)
    ties = TiedMotion(constraints.ties, free.backend, q)
    place = ties.start
    return replace(free, ties=ties), State(place.q, place.velocity(place.own(qd)), work)


def _finite(states: Iterator[State], times: Sequence[float]) -> Iterator[State]:
    """Yield the states; raises ValueError for the first that is not finite."""
    for t, state in zip(times, states, strict=True):
        xp = namespace(state.q)
        if not bool(xp.isfinite(state.q).all() & xp.isfinite(state.v).all()):
            raise ValueError(
                f"the motion is not finite at t = {t:g} s; take smaller steps, or look at the torques"
            )
        yield state


def _collected(
    equations: EquationsOfMotion, times: Sequence[float], states: Iterator[State]
) -> Trajectory[Any]:
    """Return the motion at all instants."""
    rows = []
    for t, state in zip(times, _finite(states, times), strict=True):
        q, qd = equations.motion(t, state)
        tau = equations.torques(t, q, qd)
        rows.append((q, qd, tau, equations.energy(t, q, qd), state.work))
    like = rows[0][0]
    xp = namespace(like)
    columns = (xp.stack(column) for column in zip(*rows, strict=True))
    return Trajectory(_instants(equations, times, like), *columns)


def _instants(equations: EquationsOfMotion, times: Sequence[float], like: Numbers) -> Numbers:
    return equations.backend.weights("time", list(times), like)


def _positive(name: str, value: object) -> float:
    if isinstance(value, bool) or not isinstance(value, Real) or not 0.0 < float(value) < math.inf:
        raise ValueError(f"{name} is {short(value)}; give a number above 0")
    return float(value)
