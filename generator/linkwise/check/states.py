"""The states at which answers are held against each other."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from linkwise.package.load import Array

DRAWS = 40
"""How many times as many states are tried as were asked for, where energies are not defined everywhere."""


@dataclass(frozen=True)
class States:
    """The states of all checks, each array (samples, n)."""

    q: Array
    qd: Array
    qdd: Array

    @property
    def motion(self) -> tuple[Array, Array, Array]:
        """q, qd and qdd."""
        return self.q, self.qd, self.qdd

    def at(self, rows: Any) -> "States":
        """Some of the samples, in any shape (..., n)."""
        return States(self.q[rows], self.qd[rows], self.qdd[rows])


@dataclass(frozen=True)
class Found:
    """States that something is defined at, and how many were tried for them."""

    states: States
    tried: int


def random_states(n: int, samples: int, seed: int = 0) -> States:
    """Random states over all four quadrants, no rate near 0, and states at rest; float32 holds them."""
    generator = np.random.default_rng(seed)
    q = generator.uniform(-np.pi, np.pi, (samples, n))
    return _states(q, samples, generator)


def states_where(defined: Callable[[States], NDArray[np.bool_]], n: int, samples: int) -> Found:
    """States that `defined` says True of, (count,) for `count` of them, up to `samples` and those at rest.

    If that is less than half of the random ones, positions of other sizes are tried too, 1 mm to 30 rad.
    """
    states = random_states(n, samples)
    kept = states.at(defined(states))
    if 2 * len(kept.q) >= samples:
        return Found(kept, len(states.q))
    generator, shape = np.random.default_rng(1), (DRAWS * samples, n)
    q = generator.uniform(-1.0, 1.0, shape) * 10.0 ** generator.uniform(-3.0, 1.5, shape)
    more = _states(q, len(q), generator)
    other = more.at(defined(more))
    both = States(*(np.concatenate(pair) for pair in zip(kept.motion, other.motion, strict=True)))
    return Found(both.at(slice(0, samples + 4)), len(states.q) + len(more.q))


def _states(q: Array, samples: int, generator: np.random.Generator) -> States:
    n = q.shape[1]
    rates = generator.uniform(0.25, 2.5, (2, samples, n)) * generator.choice([-1.0, 1.0], (2, samples, n))
    still = np.zeros((4, n))
    q, qd, qdd = (
        np.concatenate([random, still]).astype(np.float32).astype(float) for random in (q, rates[0], rates[1])
    )
    q[samples + 1 :], qd[samples + 2], qdd[samples + 3] = q[0], qd[0], qdd[0]
    return States(q, qd, qdd)
