"""Numbers of the causes of one joint's torque in each phase of a movement: means and mean sizes."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from linkwise.analysis.joint_causes import (
    Cause,
    causes_of,
    curves,
    deviation_curves,
    largest_first,
    sizes,
)
from linkwise.analysis.loads.placed import moving_joints
from linkwise.analysis.phases import PlacedPhase
from linkwise.analysis.result import AnalysisResult
from linkwise.analysis.show.drawn_curves import largest_few
from linkwise.arrays import Array, Mask
from linkwise.errors import LinkwiseError
from linkwise.escape import printable
from linkwise.plotstyle import drawn


@dataclass(frozen=True, eq=False)
class ShownPhase:
    """A phase, or the rest of the movement beside it; without a phase, the whole movement."""

    label: str
    placed: PlacedPhase | None = None
    is_rest: bool = False

    def on(self, result: AnalysisResult) -> Mask:
        """Return which samples (S,) of a result, or a part of one, are in it."""
        if self.placed is None:
            return np.ones(len(result.time), dtype=np.bool_)
        contacts = result.values[result.rows["contact"].rows]
        return self.placed.on(result.robot, result.time, result.q, contacts) ^ self.is_rest


def shown_phases(result: AnalysisResult, i: int) -> list[ShownPhase]:
    """Return the phases of `asked_phases`, each followed by the rest of the movement if that is named."""
    found = []
    for phase in asked_phases(result, i):
        found.append(ShownPhase(drawn(phase.name, 34), phase))
        if phase.rest:
            found.append(ShownPhase(drawn(phase.rest, 34), phase, is_rest=True))
    return found


def require_samples(
    result: AnalysisResult, phases: list[ShownPhase], counts: Sequence[int]
) -> list[ShownPhase]:
    """Return the phases, or the whole movement where they distinguish nothing.

    counts: number of samples of each phase

    Raises LinkwiseError for a phase that was asked for and has no sample.
    """
    empty = [phase.label for phase, count in zip(phases, counts, strict=True) if not count]
    if empty and result.phases:
        span = f"{result.time[0]:.4g} and {result.time[-1]:.4g} s"
        raise LinkwiseError(f"--phase: {empty[0]} has no sample between {span}")
    return [ShownPhase("the whole movement")] if empty or not phases else phases


def asked_phases(result: AnalysisResult, i: int) -> tuple[PlacedPhase, ...]:
    """Return the phases that were given, else one while the only load or contact on joint i acts.

    There is no phase if several act on it, or none.
    """
    if result.phases:
        return result.phases
    robot, tree = result.robot, result.robot.package.manifest.tree
    loads = [one for one in result.loads if not one.is_muscle and i in one.joints]
    held: list[int] = []
    if robot.contacts is not None and tree is not None:
        moved = [moving_joints(tree, robot.joint_of(one.frame)) for one in robot.contacts.contacts]
        held = [number for number, joints in enumerate(moved) if i in joints]
    if len(loads) + len(held) != 1:
        return ()
    if loads:
        name = printable(f"load {loads[0].name}")
        return (PlacedPhase(f"{name} acts", f"{name} does not act", load=loads[0]),)
    name = printable(robot.ground.names[held[0]])
    return (PlacedPhase(f"{name} stands", f"{name} does not stand", contact=held[0]),)


MOST = 10
"""Joints whose motions have bars of their own; all other motions are summed in one."""
NOTHING = 1e-9
"""Part of the largest cause below which a cause is only rounding."""


@dataclass(frozen=True, eq=False)
class PhaseNumbers:
    """A phase, and the mean and mean size of each row in it, (rows,); of both deviations at most."""

    phase: ShownPhase
    mean: Array
    size: Array
    deviation: Array


@dataclass(frozen=True, eq=False)
class CauseNumbers:
    """Causes of the joint's torque: all causes together in the first row, and then each."""

    labels: tuple[str, ...]
    phases: tuple[PhaseNumbers, ...]
    apart: bool
    """True if no two phases share a sample."""


class _Tally:
    """Running sums of rows, of their magnitudes and of their deviations, over the samples of a phase."""

    def __init__(self, rows: int) -> None:
        self.count, self._sums = 0, np.zeros((3, rows))

    def __call__(self, values: Array, deviations: Array) -> None:
        """Add samples of the rows, (rows, samples)."""
        self.count += values.shape[1]
        self._sums += [values.sum(axis=1), np.abs(values).sum(axis=1), deviations.sum(axis=1)]

    def numbers(self, phase: ShownPhase) -> PhaseNumbers:
        """Return what the rows come to in a phase."""
        return PhaseNumbers(phase, *(self._sums / self.count))


def cause_numbers(result: AnalysisResult, i: int) -> CauseNumbers:
    """Return the numbers of joint i over all samples; raise LinkwiseError for a phase without any."""
    causes = causes_of(result, result.robot.figure_joints, drawn)
    labels, rows = _rows(result, causes, sizes(result, causes, [i])[:, 0])
    asked = shown_phases(result, i)
    every, *tallies = [_Tally(len(rows)) for _ in range(1 + len(asked))]
    torque = result.rows.deviations(result.rows.numbers("tau", joint=i))
    apart = True
    for part in result.parts():
        values = rows @ np.concatenate([part.torque[:, [i]].T, curves(part, causes, i)])
        spread = rows @ np.concatenate([[part.values[torque].sum(axis=0)], deviation_curves(part, causes, i)])
        on = [phase.on(part) for phase in asked]
        apart &= not on or int(np.sum(on, axis=0).max()) <= 1
        for tally, here in zip(tallies, on, strict=True):
            tally(values[:, here], spread[:, here])
        every(values, spread)
    shown = require_samples(result, asked, [tally.count for tally in tallies])
    found = zip(tallies if shown == asked else [every], shown, strict=True)
    return CauseNumbers(labels, tuple(tally.numbers(phase) for tally, phase in found), apart)


def _rows(result: AnalysisResult, causes: Sequence[Cause], sizes: Array) -> tuple[tuple[str, ...], Array]:
    """Return labels and rows, the largest cause over the movement first, small motions and muscles last.

    A row has ones for the torque itself, at first, and for the causes of which it is the sum.
    """
    alone = np.eye(1 + len(causes))
    order = [at for at in largest_first(sizes) if sizes[at] > NOTHING * sizes.max()]
    muscles = [e for e, load in enumerate(result.loads) if load.is_muscle]
    kinds = {
        "motion of {} others": [at for at in order if causes[at].is_motion],
        "{} other muscles": [
            at for at in order if causes[at].kind == "load" and causes[at].number in muscles
        ],
    }
    small = {
        label: [some[at] for at in largest_few(sizes[some], MOST)[1]] for label, some in kinds.items() if some
    }
    named = [at for at in order if not any(at in some for some in small.values())]
    labels = ["all causes together", *(causes[at].label for at in named)]
    rows = [alone[0], *(alone[1 + at] for at in named)]
    for label, some in small.items():
        if some:
            labels.append(label.format(len(some)))
            rows.append(alone[[1 + at for at in some]].sum(axis=0))
    return tuple(labels), np.array(rows)
