"""A short simulated motion of links that were written by hand, on the text of their terms.

Time runs, and each input is a function of time.
"""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from linkwise.arrays import Array
from linkwise.check.simulation_checks import SINGULAR, STEP, STEPS, TRIED, SimulatedMotion
from linkwise.check.sum_checks import regular
from linkwise.oracle.energies import Terms, equations_of_motion
from linkwise.oracle.noisy_numbers import NOISE
from linkwise.oracle.reference import Reference

UNDEFINED = "it moves to where something is no number"


def simulated_terms(
    terms: Sequence[Terms], inputs: Sequence[str], reference: Reference
) -> SimulatedMotion | str:
    """Return a motion from the calmest of the first states, or why there is none.

    terms: exact ones, then the same with errors in each operation, whose ends tell the scales
    """
    given = {name: _course(at) for at, name in enumerate(inputs)}
    tried = reference.states.at(np.flatnonzero(regular(reference))[:TRIED])
    if not len(tried.q):
        return SINGULAR

    def instant(one: Terms, t: float, q: Array, qd: Array) -> tuple[Array, Array, float, float]:
        now = {name: course(t) for name, course in given.items()}
        return equations_of_motion([link.at(t, now) for link in one], q, qd)

    starts = [instant(terms[0], 0.0, q, qd) for q, qd in zip(tried.q, tried.qd, strict=True)]
    sizes = [np.abs(np.linalg.solve(mass, 1.0 - bias)).max() for mass, bias, *_ in starts]
    calm = int(np.argmin(np.where(np.isfinite(sizes), sizes, np.inf)))
    q, qd = tried.q[calm], tried.qd[calm]
    mass, bias, *_ = starts[calm]
    tau = mass @ np.random.default_rng(9).uniform(-1.0, 1.0, len(q)) + bias

    def ends(one: Terms) -> dict[str, Array]:
        return _integrated(lambda t, q, qd: instant(one, t, q, qd), q, qd, tau)

    exact, *changed = map(ends, terms)
    if not all(np.isfinite(value).all() for value in exact.values()):
        return UNDEFINED
    scales = {
        what: np.max([np.abs(value), *(np.abs(other[what] - value) / NOISE for other in changed)], axis=0)
        for what, value in exact.items()
    }
    return SimulatedMotion(
        q[None], qd[None], tau[None], exact, scales, inputs=given, source="energies differentiated"
    )


def _course(at: int) -> Callable[..., float]:
    """Return an input as a function of time that `simulate` takes: each begins and changes differently."""
    return lambda t, *_: 0.4 + 0.1 * at + (2.0 + at) * t


Instant = Callable[[float, Array, Array], tuple[Array, Array, float, float]]
"""Function of t, q and qd: what `equations_of_motion` returns."""


def _integrated(instant: Instant, q: Array, qd: Array, tau: Array) -> dict[str, Array]:
    """Return q, qd, work and energy after all steps of Runge and Kutta's method of order 4."""

    def rates(t: float, q: Array, qd: Array) -> tuple[Array, Array, float]:
        mass, bias, beside, _ = instant(t, q, qd)
        qdd: Any = np.linalg.solve(mass, tau - bias)
        return qd, qdd, float(qd @ tau) + beside

    work = 0.0
    for step in range(STEPS):
        slopes: list[tuple[Array, Array, float]] = []
        for part in (0.0, 0.5, 0.5, 1.0):
            by = part * STEP
            at, speed = (q + by * slopes[-1][0], qd + by * slopes[-1][1]) if slopes else (q, qd)
            slopes.append(rates((step + part) * STEP, at, speed))
        by_q, by_v, by_work = (STEP * (a + 2 * b + 2 * c + d) / 6 for a, b, c, d in zip(*slopes, strict=True))
        q, qd, work = q + by_q, qd + by_v, work + by_work
    energy = instant(STEPS * STEP, q, qd)[3]
    return {"q": q[None], "qd": qd[None], "work": np.array([work]), "energy": np.array([energy])}
