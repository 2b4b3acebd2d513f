"""Totals, work and errors of a movement, added up part by part, whose own sums any thread may take."""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from linkwise.analysis.certain_signs import LargestTorques
from linkwise.analysis.opened_robot import OpenedRobot
from linkwise.analysis.phases import PlacedPhase
from linkwise.analysis.residuals import ResidualReport
from linkwise.analysis.result_quantities import POWER_OF, WORK_BY_SOURCE
from linkwise.analysis.result_rows import ResultRows
from linkwise.analysis.turned_rows import scratch
from linkwise.analysis.verify import Closure
from linkwise.analysis.whole_movement import Totals, WholeMovement, Work
from linkwise.arrays import Array
from linkwise.errors import LinkwiseError

NEAREST = 1 << 17
"""Approximate size in bytes of what is read several times in a row."""


class PartSums(NamedTuple):
    """Sums over a part of a movement, and what joins it to the parts beside it."""

    total: Array
    """Σ |x| of each row over the samples, (rows,); not finite where a value is not."""
    peak: Array
    """Largest |x| of each row, (rows,)."""
    squares: Array
    """Σ x² of joint torques."""
    energy: Array
    """∫ max(P, 0) and ∫ max(-P, 0) of each power in each span, in steps, (spans, 2, powers)."""
    steps: Array
    """Number of steps of each span, (spans,)."""
    ends: tuple[Array, Array]
    """Powers at the first and the last sample, (powers,) each."""
    on: tuple[Array, Array]
    """1 where the first and the last sample is in a span, else 0, (spans,) each."""


class MovementSums:
    """Totals, work and errors of a movement, added up part by part.

    Samples are evenly spaced, and work is summed by the trapezoidal rule: with Δt between them
    ∫ P dt = Δt Σ_s (P_s + P_(s+1))/2. A phase has the steps both of whose samples are in it.
    """

    def __init__(self, rows: ResultRows, robot: OpenedRobot, phases: Sequence[PlacedPhase] = ()) -> None:
        self.closure, self._rows, self._samples = Closure(), rows, 0
        self._robot, self._phases = robot, phases
        self._total, self._peak = np.zeros((2, len(rows)))
        self._torques = rows.numbers("tau", "tau_before_muscles")
        self._squares = np.zeros(len(self._torques))
        self._power = rows.numbers(*POWER_OF.values(), *WORK_BY_SOURCE)
        self._energy = np.zeros((1 + len(phases), 2, len(self._power)))
        self._last: PartSums | None = None
        self._steps = np.zeros(1 + len(phases))
        self._search = LargestTorques(rows)

    def of_part(self, part: Array) -> PartSums:
        """Return the sums over a part of the movement, (rows, samples)."""
        total, peak = np.zeros((2, len(part)))
        few = max(1, NEAREST // (8 * part.shape[1]))
        for at in range(0, len(part), few):
            some = part[at : at + few]
            magnitude = np.abs(some, out=scratch("magnitude", *some.shape))
            np.add.reduce(magnitude, axis=1, out=total[at : at + few])
            np.maximum.reduce(magnitude, axis=1, out=peak[at : at + few])
        power = part[self._power]
        on = np.stack([np.ones(part.shape[1]), *self._on(part)])
        steps = on[:, 1:] * on[:, :-1]
        weights = np.zeros_like(on)  # halves of the steps beside each sample
        weights[:, 1:] += 0.5 * steps
        weights[:, :-1] += 0.5 * steps
        given = np.maximum(power, 0.0)
        taken = given - power
        energy = np.stack([weights @ given.T, weights @ taken.T], axis=1)
        ends, sides = (power[:, 0].copy(), power[:, -1].copy()), (on[:, 0].copy(), on[:, -1].copy())
        squares = np.square(part[self._torques]).sum(axis=1)
        return PartSums(total, peak, squares, energy, steps.sum(axis=1), ends, sides)

    def add(self, part: Array, sums: PartSums, closure: Closure) -> bool:
        """Add the next part (rows, samples), its sums and errors; return whether its values are finite."""
        self.closure |= closure
        if not np.isfinite(sums.total).all():
            return False
        self._samples += part.shape[1]
        self._total += sums.total
        self._squares += sums.squares
        np.maximum(self._peak, sums.peak, out=self._peak)
        self._search.add(part)
        self._energy += sums.energy
        self._steps += sums.steps
        if self._last is not None:  # the step from the last part to this one
            steps = self._last.on[1] * sums.on[0]
            ends = np.stack([self._last.ends[1], sums.ends[0]])
            halves = 0.5 * np.stack([np.maximum(ends, 0.0).sum(axis=0), np.maximum(-ends, 0.0).sum(axis=0)])
            self._energy += steps[:, None, None] * halves
            self._steps += steps
        self._last = sums
        return True

    def _on(self, block: Array) -> Iterator[Array]:
        """Yield for each phase 1 at samples in it, else 0, (S,)."""
        q = self._rows.dense("q", block) if self._phases else block
        contacts = block[self._rows["contact"].rows]
        for phase in self._phases:
            yield phase.on(self._robot, block[0], q, contacts).astype(float)

    def movement(self, step: float) -> WholeMovement:
        """Return what the whole movement comes to; samples are `step` s apart.

        Raises LinkwiseError for a phase that is over before any work is, where its work is told.
        """
        told = any(name in self._rows for name in WORK_BY_SOURCE)
        for phase, steps in zip(self._phases, self._steps[1:].tolist(), strict=True):
            if told and not steps:
                raise LinkwiseError(
                    f"--phase {phase.name}: no two samples follow each other in it, so that it has no work"
                )
        energy = np.zeros((1 + len(self._phases), 2, len(self._rows), 1))
        energy[:, :, self._power, 0] = step * self._energy
        kept = [name for name in POWER_OF.values() if name not in self._rows.left_out]
        kept += [name for name in WORK_BY_SOURCE if name in self._rows]
        whole, *phases = (
            {power: Work(*(self._rows.dense(power, way)[0] for way in part)) for power in kept}
            for part in energy
        )
        rms = np.zeros(len(self._rows))
        rms[self._torques] = np.sqrt(self._squares / self._samples)
        return WholeMovement(
            totals=Totals(self._total / self._samples, self._peak, rms),
            closure=self.closure,
            total=self._samples,
            peaks=self._search.peaks(),
            cutoff_sweep=None,
            residual_report=ResidualReport((), None, None),
            work_by_source={power: work for power, work in whole.items() if power in WORK_BY_SOURCE},
            work_in_phases=tuple(phases),
            works={power: work for power, work in whole.items() if power not in WORK_BY_SOURCE},
        )
