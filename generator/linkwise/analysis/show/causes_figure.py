"""Figure of the causes of one joint's torque, in each phase of the movement: stance against swing."""

import math
import textwrap
from typing import TYPE_CHECKING, Any

import numpy as np

from linkwise.analysis.result import AnalysisResult
from linkwise.analysis.result_columns import load_unit
from linkwise.analysis.show.cause_curves import CauseNumbers, cause_numbers, torque_curve
from linkwise.analysis.show.drawn_curves import drawn_curves, foot
from linkwise.analysis.show.shown_phases import asked_phases
from linkwise.extras import extra
from linkwise.plotstyle import BLUE, INK, colour, drawn

if TYPE_CHECKING:
    from matplotlib.figure import Figure

GAP = 9.0
"""Total gap between a bar, its label and the panel's edge, in pixels of the figure."""


def causes(result: AnalysisResult, i: int) -> "Figure":
    """Draw the joint's torque over time, and bars of each cause's mean and r.m.s. in each phase."""
    numbers = cause_numbers(result, i)
    phases = numbers.phases
    height = (0.17 * len(phases) + 0.13) * len(numbers.labels)
    figure: Figure = extra("matplotlib.figure").Figure(figsize=(8.4, 3.3 + height), layout="constrained")
    grid = figure.add_gridspec(2, 2, height_ratios=(1.3, height))
    over_time = figure.add_subplot(grid[0, :])
    means = figure.add_subplot(grid[1, 0])
    sizes = figure.add_subplot(grid[1, 1], sharey=means)
    _over_time(over_time, result, i, numbers)
    _both_bars(means, sizes, numbers, load_unit(result.robot.units[i]))
    over_time.legend(
        *means.get_legend_handles_labels(),
        loc="lower right",
        bbox_to_anchor=(1, 1),
        ncols=len(phases),
        handlelength=1.5,
        borderaxespad=0.3,
    )
    figure.suptitle(
        f"What loads {drawn(result.robot.joints[i], 40)} · {drawn(result.robot.name, 40)}"
        f" · {drawn(result.source, 50)}",
        x=0.01,
        ha="left",
        fontsize=11,
    )
    told = [phase.told for phase in asked_phases(result, i)]
    below = " · ".join(["motion: acceleration and velocity together", *told, foot(result)])
    figure.supxlabel(textwrap.fill(below, 140), x=0.01, ha="left", fontsize=7, color="#5A6270")
    figure.draw_without_rendering()  # places the panels, so that labels have their final width
    for panel in (means, sizes):
        _make_room(panel)
    return figure


def _over_time(panel: Any, result: AnalysisResult, i: int, numbers: CauseNumbers) -> None:
    phases = [one.phase for one in numbers.phases]

    def curves(part: AnalysisResult) -> Any:
        return np.concatenate([torque_curve(part, i), [phase.on(part) for phase in phases]])

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
    panel.axhline(0, color="#9AA3AF", linewidth=0.6, zorder=0)
    panel.set_title("all causes together")
    panel.set_ylabel(load_unit(result.robot.units[i]))
    panel.set_xlabel("time (s)")
    panel.set_xlim(result.time[0], result.time[-1])


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
