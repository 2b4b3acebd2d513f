"""A short simulated motion of links that were written by hand, on the text of their terms.

Time runs, and each input is a function of time.
"""

from collections.abc import Callable, Sequence

import numpy as np

from linkwise.arrays import Array
from linkwise.check.simulation_checks import SINGULAR, STEP, STEPS, TRIED, SimulatedMotion
from linkwise.oracle.energies import Terms, equations_of_motion
from linkwise.oracle.noisy_numbers import NOISE
from linkwise.oracle.states import States
from linkwise.oracle.written_constraints import TextConstraints, followed, held_acceleration

Instant = tuple[Array, Array, float, float]
"""Mass matrix, bias, power and energy, as `equations_of_motion` returns them."""
UNDEFINED = "it moves to where something is no number"


def simulated_terms(
    terms: Sequence[Terms], inputs: Sequence[str], tried: States, ties: Sequence[TextConstraints] | None
) -> SimulatedMotion | str:
    """Return a motion from the calmest of the first states tried, or why there is none.

    terms: exact ones, then the same with errors in each operation, whose ends tell the scales; ties: likewise
    the constraints, which hold at the states
    """
    given = {name: _course(at) for at, name in enumerate(inputs)}
    tried = tried.at(slice(0, TRIED))
    if not len(tried.q):
        return SINGULAR

    def instant(one: Terms, t: float, q: Array, qd: Array) -> Instant:
        now = {name: course(t) for name, course in given.items()}
        return equations_of_motion([link.at(t, now) for link in one], q, qd)

    held = [None] * len(terms) if ties is None else ties
    starts = [instant(terms[0], 0.0, q, qd) for q, qd in zip(tried.q, tried.qd, strict=True)]
    sizes = [
        np.abs(_accelerated(held[0], q, qd, mass, 1.0 - bias)).max()
        for q, qd, (mass, bias, *_) in zip(tried.q, tried.qd, starts, strict=True)
    ]
    calm = int(np.argmin(np.where(np.isfinite(sizes), sizes, np.inf)))
    q, qd = tried.q[calm], tried.qd[calm]
    mass, bias, *_ = starts[calm]
    tau = mass @ np.random.default_rng(9).uniform(-1.0, 1.0, len(q)) + bias

    def ends(one: Terms, own: TextConstraints | None) -> dict[str, Array]:
        v = qd if own is None else qd[list(own.independent)]
        return _integrated(lambda t, q, qd: instant(one, t, q, qd), own, q, v, tau)

    exact, *changed = (ends(one, own) for one, own in zip(terms, held, strict=True))
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


def _accelerated(ties: TextConstraints | None, q: Array, qd: Array, mass: Array, force: Array) -> Array:
    """Return qdd (n,), or ydd (m,) under constraints."""
    if ties is None:
        return np.asarray(np.linalg.solve(mass, force), np.float64)
    return np.asarray(held_acceleration(ties, q[None], qd[None], mass[None], force[None])[0], np.float64)


def _integrated(
    instant: Callable[[float, Array, Array], Instant],
    ties: TextConstraints | None,
    q: Array,
    v: Array,
    tau: Array,
) -> dict[str, Array]:
    """Return q, qd, work and energy after all steps of Runge and Kutta's method of order 4."""

    def motion(q: Array, v: Array) -> tuple[Array, Array]:
        if ties is None:
            return q, v
        at, rate = followed(ties, q[None], v[None])
        return at[0], rate[0]

    def rates(t: float, q: Array, v: Array) -> tuple[Array, Array, float]:
        at, qd = motion(q, v)
        mass, bias, beside, _ = instant(t, at, qd)
        return qd, _accelerated(ties, at, qd, mass, tau - bias), float(qd @ tau) + beside

    work = 0.0
    for step in range(STEPS):
        slopes: list[tuple[Array, Array, float]] = []
        for part in (0.0, 0.5, 0.5, 1.0):
            by = part * STEP
            at, speed = (q + by * slopes[-1][0], v + by * slopes[-1][1]) if slopes else (q, v)
            slopes.append(rates((step + part) * STEP, at, speed))
        by_q, by_v, by_work = (STEP * (a + 2 * b + 2 * c + d) / 6 for a, b, c, d in zip(*slopes, strict=True))
        q, v, work = motion(q + by_q, v + by_v)[0], v + by_v, work + by_work
    q, qd = motion(q, v)
    energy = instant(STEPS * STEP, q, qd)[3]
    return {"q": q[None], "qd": qd[None], "work": np.array([work]), "energy": np.array([energy])}
