"""Mean and r.m.s. torque of one joint in each phase of the movement, by cause, the largest cause first."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from linkwise.analysis.joint_causes import Cause, causes_of, curves
from linkwise.analysis.result import AnalysisResult
from linkwise.analysis.show.largest_few import largest_few
from linkwise.analysis.show.shown_phases import ShownPhase, require_samples, shown_phases
from linkwise.package.load import Array
from linkwise.plotstyle import drawn

MOST = 10
"""Joints whose motions have bars of their own; all other motions are summed in one."""
NOTHING = 1e-9
"""Part of the largest cause below which a cause is only rounding."""


@dataclass(frozen=True, eq=False)
class PhaseNumbers:
    """A phase, and the mean and root mean square of each row in it, (rows,)."""

    phase: ShownPhase
    mean: Array
    rms: Array


@dataclass(frozen=True, eq=False)
class CauseNumbers:
    """Causes of the joint's torque: all causes together in the first row, and then each."""

    labels: tuple[str, ...]
    phases: tuple[PhaseNumbers, ...]
    apart: bool
    """True if no two phases share a sample."""


class _Tally:
    """Running sums of curves and of their products, over the samples of a phase."""

    def __init__(self, curves: int) -> None:
        self.count, self.sums, self.products = 0, np.zeros(curves), np.zeros((curves, curves))

    def __call__(self, values: Array) -> None:
        self.count += values.shape[1]
        self.sums += values.sum(axis=1)
        self.products += values @ values.T

    def mean(self, rows: Array) -> Array:
        """Return the mean of sums of curves; rows (rows, curves) has ones for the curves of each sum."""
        mean: Array = rows @ self.sums / self.count
        return mean

    def rms(self, rows: Array) -> Array:
        """Return the root mean square of sums of curves, with rows as for `mean`."""
        squares = np.einsum("ra,ab,rb->r", rows, self.products, rows)
        root: Array = np.sqrt(np.maximum(squares, 0.0) / self.count)
        return root


def cause_numbers(result: AnalysisResult, i: int) -> CauseNumbers:
    """Return the numbers of joint i over all samples; raise LinkwiseError for a phase without any."""
    causes = causes_of(result, result.robot.plot_joints, drawn)
    asked = shown_phases(result, i)
    every, tallies = _Tally(1 + len(causes)), [_Tally(1 + len(causes)) for _ in asked]
    peaks, apart = np.zeros(len(causes)), True
    for part in result.parts():
        values = np.concatenate([torque_curve(part, i), curves(part, causes, i)])
        on = [phase.on(part) for phase in asked]
        np.maximum(peaks, np.abs(values[1:]).max(axis=1), out=peaks)
        apart &= not on or int(np.sum(on, axis=0).max()) <= 1
        for tally, here in zip(tallies, on, strict=True):
            tally(values[:, here])
        every(values)
    shown = require_samples(result, asked, [tally.count for tally in tallies])
    labels, rows = _rows(causes, every, peaks > NOTHING * peaks.max(initial=0.0))
    found = zip(shown, tallies if shown == asked else [every], strict=True)
    numbers = tuple(PhaseNumbers(phase, tally.mean(rows), tally.rms(rows)) for phase, tally in found)
    return CauseNumbers(labels, numbers, apart)


def torque_curve(result: AnalysisResult, i: int) -> Array:
    """Return the joint's torque, (1, S) in its unit."""
    found: Array = result.torque[:, [i]].T
    return found


def _rows(causes: Sequence[Cause], every: _Tally, there: Array) -> tuple[tuple[str, ...], Array]:
    """Return labels and rows, the largest cause over the movement first, small motions summed last."""
    alone = np.eye(1 + len(causes))
    sizes = every.rms(alone)[1:]
    order = sorted(np.flatnonzero(there).tolist(), key=lambda at: -float(sizes[at]))
    motions = [at for at in order if causes[at].is_motion]
    small = [motions[at] for at in largest_few(sizes[motions], MOST)[1]]
    named = [at for at in order if at not in small]
    labels = ["all causes together", *(causes[at].label for at in named)]
    rows = [alone[0], *(alone[1 + at] for at in named)]
    if small:
        labels.append(f"motion of {len(small)} others")
        rows.append(alone[[1 + at for at in small]].sum(axis=0))
    return tuple(labels), np.array(rows)
