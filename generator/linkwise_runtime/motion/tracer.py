"""Steps of a trace, block by block: from one sample to the next, and what is told at each."""

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..interface import Numbers, array_of, namespace
from ..structure import Structure
from .between_samples import SampledMotion
from .collocation import STAGES, B, linear_steps
from .trace_equations import TraceAt, TraceEquations

AT_ONCE = 1 << 22
"""Numbers of the steps that are computed at once."""
LEAP = 1.0
"""Largest angle in rad between where a step leads and where the velocities at its ends do."""


class TraceParts(NamedTuple):
    """Where a trace begins anew, and the windows of its sources, by the numbers of samples."""

    restarts: Sequence[int]
    """First sample of each part that is traced by itself, ascending, 0 first."""
    cuts: Sequence[int]
    """First sample of each window, ascending, 0 first."""

    def acting(self, first: int, count: int) -> NDArray[np.float64]:
        """Return a one for the window in which each of some samples lies, and zeros, (count, W)."""
        windows = np.searchsorted(self.cuts, np.arange(first, first + count), side="right") - 1
        return np.eye(len(self.cuts))[windows]


class TraceState(NamedTuple):
    """State at a sample, by window."""

    w: Numbers
    """(W, ..., m, X)"""
    work: Numbers
    """(W, ..., X)"""


class TraceBlock(NamedTuple):
    """Arrays of a `TracedMotion` for some of its samples."""

    time: Numbers
    velocity: Numbers
    energy: Numbers
    power: Numbers
    work: Numbers
    coriolis: Numbers

    def without_last(self) -> "TraceBlock":
        """Return the block without its last sample."""
        return TraceBlock(*(a[:-1] for a in self))


@dataclass(frozen=True)
class Tracer:
    """Traces a motion, block by block."""

    equations: TraceEquations
    parts: TraceParts

    def advance(
        self, motion: SampledMotion, first: int, state: TraceState | None
    ) -> tuple[TraceBlock, TraceState | None]:
        """Return the trace of some samples, and the state at the last one, from which it can go on.

        first: number of the first sample; state: that there, None where the trace starts
        """
        last, size = first + len(motion.time) - 1, self._steps_at_once(math.prod(motion.q.shape[1:-1]))
        restarts = set(self.parts.restarts)
        ends = sorted({last, *(at for at in restarts if first < at < last), *range(first + size, last, size)})
        parts = []
        for begin, end in pairwise([first, *ends]):
            known = None if begin in restarts else state
            some = motion.some(begin - first, end - first + 1)
            try:
                part, state = self._part(some, begin, known)
            except ValueError as error:
                raise ValueError(_timed(str(error), some.time)) from error
            # Its last sample is the first of the next part, which may begin anew there.
            parts.append(part if end == last else part.without_last())
        xp = namespace(motion.q)
        return TraceBlock._make(xp.concat(list(values), 0) for values in zip(*parts, strict=True)), state

    def _steps_at_once(self, motions: int) -> int:
        structure = self.equations.backend.structure
        n, links, windows = structure.n, structure.N, len(self.parts.cuts)
        m, columns = len(self.equations.coordinates), len(self.equations.sources)
        coefficients, solved, told = 2 * n * links * n, 3 * m * (4 * m + 2 * columns), n * columns * windows
        return max(1, AT_ONCE // ((3 * (coefficients + solved) + told) * max(1, motions)))

    def _part(
        self, motion: SampledMotion, first: int, begin: TraceState | None
    ) -> tuple[TraceBlock, TraceState]:
        """Return what `advance` does, for samples within which nothing begins anew."""
        equations = self.equations
        xp, at = namespace(motion.q), equations.at(motion, True)
        acting = equations.backend.weights("windows", self.parts.acting(first, len(motion.time)), motion.q)
        wide = acting.reshape(*acting.shape, *[1] * motion.q.ndim)
        _refuse_leaps(motion, at.qd, equations.backend.structure)
        begin = begin or self._start(at, wide[0])
        stages = [equations.at(motion.within_steps(part), False).equations for part in STAGES]
        lengths = motion.lengths.reshape(-1, *[1] * (motion.q.ndim - 2))
        steps = linear_steps(equations.backend, stages, lengths, equations.coordinates)
        states = [begin.w]
        for k in range(len(lengths)):
            states.append(steps.transition[k] @ states[-1] + wide[k] * steps.gain[k])
        w = xp.stack(states, 0)
        own = (wide[:-1] * w[:-1]).sum(1)
        power = [
            ((transition @ own + gain) * stage.forces).sum(-2)
            for (transition, gain), stage in zip(steps.stages, stages, strict=True)
        ]
        gained = lengths[..., None] * sum(weight * a for weight, a in zip(B, power, strict=True))
        by_window = wide[:-1, ..., 0] * gained[:, None]
        work = xp.cumsum(xp.concat([begin.work[None], by_window], 0), 0)
        return self._told(motion, at, wide, w, work), TraceState(w[-1], work[-1])

    def _start(self, at: TraceAt, acting: Numbers) -> TraceState:
        """Return the state where a trace starts: all velocities are those of the start."""
        own = at.own_velocity[0][..., None]
        unit = np.eye(len(self.equations.sources))[-1]
        w = acting * (own * self.equations.backend.constant(unit, own))
        return TraceState(w, 0.0 * w.sum(-2))

    def _told(
        self, motion: SampledMotion, at: TraceAt, wide: Numbers, w: Numbers, work: Numbers
    ) -> TraceBlock:
        """Return velocities, energies and powers for w (T, W, ..., m, X)."""
        xp, equations = namespace(w), at.equations
        velocity = w if at.place is None else at.place.found.map[:, None] @ w
        energy = 0.5 * (w * (equations.mass[:, None] @ w)).sum(-2)
        power = (wide * w * equations.forces[:, None]).sum(-2)
        velocity, energy, power, work = (xp.moveaxis(a, 1, -1) for a in (velocity, energy, power, work))
        return TraceBlock(motion.time, velocity, energy, power, work, equations.coriolis)


def _refuse_leaps(motion: SampledMotion, qd: Numbers, structure: Structure) -> None:
    """Raise ValueError for angles that go elsewhere than their velocities say.

    Such are angles that are wrapped at a turn, another unit of time, and loops that close the other way.
    """
    q, speed, lengths = (array_of(a) for a in (motion.q, qd, motion.lengths))
    steps = lengths.reshape(-1, *[1] * (q.ndim - 1))
    gone, told = np.diff(q, axis=0), 0.5 * steps * (speed[:-1] + speed[1:])
    turns = np.array([unit == "rad" for unit in structure.joint_units])
    leaps = np.argwhere(turns & (np.abs(gone - told) > LEAP))
    if len(leaps):
        at = tuple(leaps[0])
        raise ValueError(
            f"q of {structure.joint_names[at[-1]]!r} goes by {gone[at]:.3g} in the step at sample {at[0]}, "
            f"where its velocities lead by {told[at]:.3g}: unwrap angles, give time in s, close loops one way"
        )


def _timed(text: str, time: Numbers) -> str:
    """Return the text of an error with an instant next to it in place of a sample's number among some."""
    found = re.search(r" at sample (\d+)", text)
    if found is None:
        return text
    instant = float(time[min(int(found[1]), len(time) - 1)])
    return text.replace(found[0], f" next to {instant:.6g} s", 1)
