"""Figure of the causes of one joint's torque, in each phase of the movement: stance against swing.

Bars are the mean and the mean size over each phase, the largest cause first.
"""

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from linkwise.analysis.result import AnalysisResult
from linkwise.analysis.show.bands import ADDED, Bands, draw_band
from linkwise.analysis.show.cause_numbers import CauseNumbers, asked_phases, cause_numbers
from linkwise.analysis.show.drawn_curves import (
    drawn_curves,
    foot,
    new_figure,
    time_axis,
    write_note,
    write_title,
    zero_line,
)
from linkwise.arrays import Array
from linkwise.plotstyle import BLUE, INK, colour, drawn

if TYPE_CHECKING:
    from matplotlib.figure import Figure


WHISKERS = f"Whiskers are one standard deviation, at most: {ADDED}."
GAP = 9.0
"""Total gap between a bar, its label and the panel's edge, in pixels of the figure."""


def causes(result: AnalysisResult, i: int) -> "Figure":
    """Draw the joint's torque over time, and bars of each cause's mean and mean size in each phase."""
    numbers = cause_numbers(result, i)
    phases = numbers.phases
    height = (0.17 * len(phases) + 0.13) * len(numbers.labels)
    figure = new_figure(3.3 + height)
    grid = figure.add_gridspec(2, 2, height_ratios=(1.3, height))
    over_time = figure.add_subplot(grid[0, :])
    means = figure.add_subplot(grid[1, 0])
    sizes = figure.add_subplot(grid[1, 1], sharey=means)
    bands = _over_time(over_time, result, i, numbers)
    _both_bars(means, sizes, numbers, result.robot.torque_units[i])
    over_time.legend(
        *means.get_legend_handles_labels(),
        loc="lower right",
        bbox_to_anchor=(1, 1),
        ncols=len(phases),
        handlelength=1.5,
        borderaxespad=0.3,
    )
    write_title(
        figure,
        result,
        f"What loads {'the ' if result.robot.words[i] else ''}{drawn(result.robot.figure_joints[i], 40)}",
    )
    told = [phase.told for phase in asked_phases(result, i)]
    note = " · ".join(
        ["motion: acceleration and velocity together; size: mean of the magnitude", *told, foot(result)]
    )
    write_note(figure, *bands.notes, *([WHISKERS] if len(bands) else []), note)
    figure.draw_without_rendering()  # places the panels, so that labels have their final width
    for panel in (means, sizes):
        _make_room(panel)
    return figure


def _over_time(panel: Any, result: AnalysisResult, i: int, numbers: CauseNumbers) -> Bands:
    """Draw the torque with its band over phases in colour; return the band."""
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
    bands = Bands(result, [result.rows.numbers("tau", joint=i)])
    draw_band(panel, bands[0], INK)
    zero_line(panel)
    panel.set_title("all causes together")
    panel.set_ylabel(result.robot.with_signs(result.robot.torque_units[i], i))
    time_axis(panel, result)
    return bands


def _both_bars(means: Any, sizes: Any, numbers: CauseNumbers, unit: str) -> None:
    labels = [one.phase.label for one in numbers.phases]
    _bars(means, labels, [(one.mean, one.deviation) for one in numbers.phases])
    _bars(sizes, labels, [(one.size, one.deviation) for one in numbers.phases])
    means.set_title(f"mean ({unit})")
    sizes.set_title(f"mean size ({unit})")
    means.set_yticks(range(len(numbers.labels)), numbers.labels)
    means.get_yticklabels()[0].set_fontweight("bold")
    means.invert_yaxis()
    sizes.tick_params(labelleft=False)


def _bars(panel: Any, phases: list[str], numbers: list[tuple[Array, Array]]) -> None:
    """Draw a group of bars for each cause, one bar for each phase, with its number at its end.

    numbers: values and their deviations, which are whiskers, by phase
    """
    thick = 0.8 / len(phases)
    most = max(float(np.abs(values).max()) for values, _ in numbers)
    decimals = max(0, 2 - math.floor(math.log10(most))) if most > 0.0 else 0
    for at, (phase, (values, deviations)) in enumerate(zip(phases, numbers, strict=True)):
        places = np.arange(len(values)) - 0.4 + (at + 0.5) * thick
        ink = colour(at) if len(phases) > 1 else BLUE
        whiskers = {"xerr": deviations, "ecolor": INK, "capsize": 2} if deviations.any() else {}
        bars = panel.barh(places, values, height=0.9 * thick, color=ink, label=phase, **whiskers)
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
