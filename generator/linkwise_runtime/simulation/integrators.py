"""States over time: Runge and Kutta's method of order 4 at fixed steps, or a solver of SciPy."""

import math
from collections.abc import Callable, Iterator, Sequence
from importlib import import_module
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .equations_of_motion import State

Rates = Callable[[float, State], State]
ADAPTIVE = ("RK23", "RK45", "DOP853", "Radau", "BDF", "LSODA")
"""Methods of SciPy's solve_ivp."""


def in_fixed_steps(
    rates: Rates, settle: Rates, start: State, times: Sequence[float], step: float | None
) -> Iterator[State]:
    """States at `times`, between which there are as many equal steps as make none longer than `step`.

    settle: what is made of an instant and a state after each step
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
    start: State,
    times: Sequence[float],
    method: str,
    step: float | None,
    tolerances: tuple[float, float],
) -> Iterator[State]:
    """States at `times` of NumPy arrays, by steps that keep the error of each within the tolerances.

    Raises ImportError without SciPy, ValueError where the solver gives up.
    """
    try:
        solve_ivp = import_module("scipy.integrate").solve_ivp
    except ImportError:
        raise ImportError(
            f"method {method!r} is SciPy's, which is not installed here: pip install scipy, or take method "
            "'RK4'"
        ) from None

    exact = State(*(np.asarray(a, float) for a in start))

    def flat_rates(t: float, values: NDArray[Any]) -> NDArray[Any]:
        return _flat(rates(float(t), _shaped(values, exact)))

    if len(times) == 1:
        return iter([start])
    span, most = (times[0], times[-1]), math.inf if step is None else step
    rtol, atol = tolerances
    found = solve_ivp(
        flat_rates, span, _flat(exact), method, t_eval=times, max_step=most, rtol=rtol, atol=atol
    )
    if not found.success:
        raise ValueError(f"{method} gave up after t = {times[max(0, found.t.size - 1)]:g} s: {found.message}")
    return (_shaped(values, start) for values in found.y.T)


def _step(rates: Rates, t: float, length: float, state: State) -> State:
    """y + h/6 (k1 + 2 k2 + 2 k3 + k4)."""

    def moved(by: float, slope: State) -> State:
        return State(*(a + by * b for a, b in zip(state, slope, strict=True)))

    k1 = rates(t, state)
    k2 = rates(t + length / 2, moved(length / 2, k1))
    k3 = rates(t + length / 2, moved(length / 2, k2))
    k4 = rates(t + length, moved(length, k3))
    mean = (a + 2.0 * b + 2.0 * c + d for a, b, c, d in zip(k1, k2, k3, k4, strict=True))
    return moved(length / 6.0, State(*mean))


def _flat(state: State) -> NDArray[Any]:
    return np.concatenate([np.asarray(a, float).reshape(-1) for a in state])


def _shaped(values: NDArray[Any], like: State) -> State:
    parts, begin = [], 0
    for a in like:
        size = int(np.size(a))
        parts.append(values[begin : begin + size].reshape(np.shape(a)).astype(np.asarray(a).dtype))
        begin += size
    return State(*parts)
