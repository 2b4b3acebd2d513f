"""Figure of the causes of one joint's torque, in each phase of the movement: stance against swing.

Bars are the mean and the root mean square over each phase, the largest cause first.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from linkwise.analysis.joint_causes import Cause, causes_of, curves
from linkwise.analysis.loads.placed import moving_joints
from linkwise.analysis.phases import PlacedPhase
from linkwise.analysis.result import AnalysisResult
from linkwise.analysis.show.drawn_curves import (
    drawn_curves,
    foot,
    largest_few,
    new_figure,
    time_axis,
    write_note,
    write_title,
    zero_line,
)
from linkwise.arrays import Array, Mask
from linkwise.errors import LinkwiseError
from linkwise.escape import printable
from linkwise.plotstyle import BLUE, INK, colour, drawn

if TYPE_CHECKING:
    from matplotlib.figure import Figure


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
    loads = [one for one in result.loads if i in one.acts_on.joints]
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
        values = np.concatenate([part.torque[:, [i]].T, curves(part, causes, i)])
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


GAP = 9.0
"""Total gap between a bar, its label and the panel's edge, in pixels of the figure."""


def causes(result: AnalysisResult, i: int) -> "Figure":
    """Draw the joint's torque over time, and bars of each cause's mean and r.m.s. in each phase."""
    numbers = cause_numbers(result, i)
    phases = numbers.phases
    height = (0.17 * len(phases) + 0.13) * len(numbers.labels)
    figure = new_figure(8.4, 3.3 + height)
    grid = figure.add_gridspec(2, 2, height_ratios=(1.3, height))
    over_time = figure.add_subplot(grid[0, :])
    means = figure.add_subplot(grid[1, 0])
    sizes = figure.add_subplot(grid[1, 1], sharey=means)
    _over_time(over_time, result, i, numbers)
    _both_bars(means, sizes, numbers, result.robot.torque_units[i])
    over_time.legend(
        *means.get_legend_handles_labels(),
        loc="lower right",
        bbox_to_anchor=(1, 1),
        ncols=len(phases),
        handlelength=1.5,
        borderaxespad=0.3,
    )
    write_title(figure, result, f"What loads {drawn(result.robot.joints[i], 40)}")
    told = [phase.told for phase in asked_phases(result, i)]
    write_note(figure, " · ".join(["motion: acceleration and velocity together", *told, foot(result)]))
    figure.draw_without_rendering()  # places the panels, so that labels have their final width
    for panel in (means, sizes):
        _make_room(panel)
    return figure


def _over_time(panel: Any, result: AnalysisResult, i: int, numbers: CauseNumbers) -> None:
    phases = [one.phase for one in numbers.phases]

    def curves(part: AnalysisResult) -> Any:
        return np.concatenate([part.torque[:, [i]].T, [phase.on(part) for phase in phases]])

    found = drawn_curves(result, curves)
    time = found.middle
    edges = np.concatenate([time[:1], (time[1:] + time[:-1]) / 2, time[-1:]])
    for at, on in enumerate(found.greatest[1:] if len(phases) > 1 else []):
        low, high = (0.0, 1.0) if numbers.apart else (at / len(phases), (at + 1) / len(phases))
        steps = np.diff(np.concatenate([[0], on.astype(int), [0]]))
        for start, end in zip(np.flatnonzero(steps > 0), np.flatnonzero(steps < 0), strict=True):
            panel.axvspan(
                edges[start], edges[end], low, high, color=colour(at), alpha=0.16, linewidth=0, zorder=0
            )
    panel.plot(found.time[0], found.values[0], color=INK, linewidth=1.6)
    zero_line(panel)
    panel.set_title("all causes together")
    panel.set_ylabel(result.robot.torque_units[i])
    time_axis(panel, result)


def _both_bars(means: Any, sizes: Any, numbers: CauseNumbers, unit: str) -> None:
    labels = [one.phase.label for one in numbers.phases]
    _bars(means, labels, [one.mean.tolist() for one in numbers.phases])
    _bars(sizes, labels, [one.rms.tolist() for one in numbers.phases])
    means.set_title(f"mean ({unit})")
    sizes.set_title(f"root mean square ({unit})")
    means.set_yticks(range(len(numbers.labels)), numbers.labels)
    means.get_yticklabels()[0].set_fontweight("bold")
    means.invert_yaxis()
    sizes.tick_params(labelleft=False)


def _bars(panel: Any, phases: list[str], numbers: list[list[float]]) -> None:
    """Draw a group of bars for each cause, one bar for each phase, with its number at its end."""
    thick = 0.8 / len(phases)
    most = max(abs(value) for values in numbers for value in values)
    decimals = max(0, 2 - math.floor(math.log10(most))) if most > 0.0 else 0
    for at, (phase, values) in enumerate(zip(phases, numbers, strict=True)):
        places = np.arange(len(values)) - 0.4 + (at + 0.5) * thick
        ink = colour(at) if len(phases) > 1 else BLUE
        bars = panel.barh(places, values, height=0.9 * thick, color=ink, label=phase)
        panel.bar_label(
            bars, [f"{round(value, decimals) + 0.0:.{decimals}f}" for value in values], padding=2, fontsize=7
        )
    panel.axvline(0, color=INK, linewidth=0.8)
    panel.axhline(0.5, color="#9AA3AF", linewidth=0.8)
    panel.grid(axis="y", visible=False)


def _make_room(panel: Any) -> None:
    """Widen the panel's range until the labels beside its bars fit in it."""
    ends = [float(label.xy[0]) for label in panel.texts]
    low, high = min(0.0, *ends), max(0.0, *ends)
    whole = panel.get_window_extent().width
    shares = [(label.get_window_extent().width + GAP) / whole for label in panel.texts]
    left = max((share for end, share in zip(ends, shares, strict=True) if end < 0.0), default=0.0)
    right = max((share for end, share in zip(ends, shares, strict=True) if end >= 0.0), default=0.0)
    if high > low and left + right < 1.0:
        span = (high - low) / (1.0 - left - right)
        panel.set_xlim(low - left * span, high + right * span)
