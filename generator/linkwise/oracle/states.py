"""States at which answers are compared."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from linkwise.arrays import Array, Mask
from linkwise.package.entries import JointEntry

DRAWS = 40
"""Number of times as many states that are tried as were asked for; energies may not be defined everywhere."""
AT_REST = 4
"""States beside the random ones: without acceleration, without velocity, without either, twice."""
NUMBERS = 1 << 21
"""Most numbers of a quantity (samples, n, N, n) that are computed at a time: large robots have fewer
states."""


@dataclass(frozen=True)
class States:
    """States of all checks, each array (samples, n)."""

    q: Array
    qd: Array
    qdd: Array

    @property
    def motion(self) -> tuple[Array, Array, Array]:
        """Position q, velocity qd and acceleration qdd."""
        return self.q, self.qd, self.qdd

    def at(self, rows: Any) -> "States":
        """Return some of the samples, in any shape (..., n)."""
        return States(self.q[rows], self.qd[rows], self.qdd[rows])


@dataclass(frozen=True)
class Found:
    """States at which something is defined, and how many were tried for them."""

    states: States
    tried: int


def affordable(samples: int, n: int, links: int) -> tuple[int, int]:
    """Return how many of `samples` random states a check's memory allows, 2 at least, and states at rest."""
    few = min(samples, max(2, NUMBERS // (n * n * links) - AT_REST))
    return few, AT_REST if few > 2 or samples <= 2 else 2


def random_states(joints: Sequence[JointEntry], samples: int, seed: int = 0, rest: int = AT_REST) -> States:
    """Return random states, no rate near 0, and states at rest; float32 holds them exactly.

    rest: how many of those at rest, the last ones

    Every other position is within the limits of the joints, the others are in all four quadrants, for
    formulas do not know of limits. A slide without limits moves within half a metre.
    """
    generator = np.random.default_rng(seed)
    lower, upper = np.array([_range(joint) for joint in joints]).reshape(-1, 2).T
    q = generator.uniform(0.0, 1.0, (samples, len(joints)))
    wide = np.array([np.pi if joint.unit == "rad" else 0.5 for joint in joints])
    q = np.where(np.arange(samples)[:, None] % 2 == 0, lower + q * (upper - lower), (2 * q - 1) * wide)
    return _states(q, samples, generator).at(
        [*range(samples), *range(samples + AT_REST - rest, samples + AT_REST)]
    )


def _range(joint: JointEntry) -> tuple[float, float]:
    """Return the limits; ±π rad or ±0.5 m if one is missing, or if they leave no range or a wider one."""
    wide = np.pi if joint.unit == "rad" else 0.5
    if joint.lower is None or joint.upper is None or not 0.0 < joint.upper - joint.lower < 2 * wide:
        return -wide, wide
    return joint.lower, joint.upper


def states_where(defined: Callable[[States], Mask], joints: Sequence[JointEntry], samples: int) -> Found:
    """Return the states for which `defined` is True, up to `samples` and those at rest.

    `defined` returns (count,) for `count` states. If less than half as many as asked for are left, positions
    of other sizes are tried too, 1 mm to 30 rad.
    """
    states = random_states(joints, samples)
    kept = states.at(defined(states))
    if 2 * len(kept.q) >= samples:
        return Found(kept, len(states.q))
    generator, shape = np.random.default_rng(1), (DRAWS * samples, len(joints))
    q = generator.uniform(-1.0, 1.0, shape) * 10.0 ** generator.uniform(-3.0, 1.5, shape)
    more = _states(q, len(q), generator)
    other = more.at(defined(more))
    both = States(*(np.concatenate(pair) for pair in zip(kept.motion, other.motion, strict=True)))
    return Found(both.at(slice(0, samples + AT_REST)), len(states.q) + len(more.q))


def _states(q: Array, samples: int, generator: np.random.Generator) -> States:
    n = q.shape[1]
    rates = generator.uniform(0.25, 2.5, (2, samples, n)) * generator.choice([-1.0, 1.0], (2, samples, n))
    still = np.zeros((AT_REST, n))
    q, qd, qdd = (
        np.concatenate([random, still]).astype(np.float32).astype(float) for random in (q, rates[0], rates[1])
    )
    q[samples + 1 :], qd[samples + 2], qdd[samples + 3] = q[0], qd[0], qdd[0]
    return States(q, qd, qdd)
