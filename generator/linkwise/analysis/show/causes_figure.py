"""What loads one joint, by cause, in each phase of the movement: stance against swing."""

import math
import textwrap
from typing import TYPE_CHECKING, Any

import numpy as np

from linkwise.analysis.result import AnalysisResult
from linkwise.analysis.result_columns import load_unit
from linkwise.analysis.show.cause_curves import CauseCurve, cause_curves, largest, rms
from linkwise.analysis.show.shown_phases import ShownPhase, asked_phases, phases_of
from linkwise.extras import extra
from linkwise.package.load import Array
from linkwise.plotstyle import BLUE, INK, colour, drawn

if TYPE_CHECKING:
    from matplotlib.figure import Figure

GAP = 9.0
"""Between a bar, its label and the panel's edge together, in points of the figure's own resolution."""


def causes(result: AnalysisResult, i: int) -> "Figure":
    """The joint's torque over time, and bars of each cause's mean and r.m.s. in each phase."""
    phases = phases_of(result, i)
    rows = [CauseCurve("all causes together", _torque(result, i)), *largest(cause_curves(result, i))]
    height = (0.17 * len(phases) + 0.13) * len(rows)
    figure = extra("matplotlib.figure").Figure(figsize=(8.4, 3.3 + height), layout="constrained")
    grid = figure.add_gridspec(2, 2, height_ratios=(1.3, height))
    over_time = figure.add_subplot(grid[0, :])
    means = figure.add_subplot(grid[1, 0])
    sizes = figure.add_subplot(grid[1, 1], sharey=means)
    _over_time(over_time, result, i, phases)
    _both_bars(means, sizes, rows, phases, load_unit(result.robot.units[i]))
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
    told = [phase.told for phase in asked_phases(result, i)] if len(phases) > 1 else []
    foot = " · ".join(["motion: acceleration and velocity together", *told, result.provenance])
    figure.supxlabel(textwrap.fill(foot, 140), x=0.01, ha="left", fontsize=7, color="#5A6270")
    figure.draw_without_rendering()  # places the panels, so that labels have a width in their numbers
    for panel in (means, sizes):
        _make_room(panel)
    return figure  # type: ignore[no-any-return]


def _torque(result: AnalysisResult, i: int) -> Array:
    found: Array = result.torque[:, i]
    return found


def _over_time(panel: Any, result: AnalysisResult, i: int, phases: list[ShownPhase]) -> None:
    apart = np.sum([phase.on for phase in phases], axis=0).max() == 1
    time = result.time
    edges = np.concatenate([time[:1], (time[1:] + time[:-1]) / 2, time[-1:]])
    for at, phase in enumerate(phases if len(phases) > 1 else []):
        low, high = (0.0, 1.0) if apart else (at / len(phases), (at + 1) / len(phases))
        steps = np.diff(np.concatenate([[0], phase.on.astype(int), [0]]))
        for start, end in zip(np.flatnonzero(steps > 0), np.flatnonzero(steps < 0), strict=True):
            panel.axvspan(
                edges[start], edges[end], low, high, color=colour(at), alpha=0.16, linewidth=0, zorder=0
            )
    panel.plot(result.time, _torque(result, i), color=INK, linewidth=1.6)
    panel.axhline(0, color="#9AA3AF", linewidth=0.6, zorder=0)
    panel.set_title("all causes together")
    panel.set_ylabel(load_unit(result.robot.units[i]))
    panel.set_xlabel("time (s)")
    panel.set_xlim(result.time[0], result.time[-1])


def _both_bars(means: Any, sizes: Any, rows: list[CauseCurve], phases: list[ShownPhase], unit: str) -> None:
    _bars(means, rows, phases, np.mean)
    _bars(sizes, rows, phases, rms)
    means.set_title(f"mean ({unit})")
    sizes.set_title(f"root mean square ({unit})")
    means.set_yticks(range(len(rows)), [row.label for row in rows])
    means.get_yticklabels()[0].set_fontweight("bold")
    means.invert_yaxis()
    sizes.tick_params(labelleft=False)


def _bars(panel: Any, rows: list[CauseCurve], phases: list[ShownPhase], number: Any) -> None:
    """A group of bars for each cause, one bar for each phase, with its number at its end."""
    thick = 0.8 / len(phases)
    numbers = [[float(number(row.values[phase.on])) for row in rows] for phase in phases]
    most = max(abs(value) for values in numbers for value in values)
    decimals = max(0, 2 - math.floor(math.log10(most))) if most > 0.0 else 0
    for at, (phase, values) in enumerate(zip(phases, numbers, strict=True)):
        places = np.arange(len(rows)) - 0.4 + (at + 0.5) * thick
        ink = colour(at) if len(phases) > 1 else BLUE
        bars = panel.barh(places, values, height=0.9 * thick, color=ink, label=phase.label)
        panel.bar_label(
            bars, [f"{round(value, decimals) + 0.0:.{decimals}f}" for value in values], padding=2, fontsize=7
        )
    panel.axvline(0, color=INK, linewidth=0.8)
    panel.axhline(0.5, color="#9AA3AF", linewidth=0.8)
    panel.grid(axis="y", visible=False)


def _make_room(panel: Any) -> None:
    """Widen the panel's range until the labels beside its bars stand within it."""
    ends = [float(label.xy[0]) for label in panel.texts]
    low, high = min(0.0, *ends), max(0.0, *ends)
    whole = panel.get_window_extent().width
    shares = [(label.get_window_extent().width + GAP) / whole for label in panel.texts]
    left = max((share for end, share in zip(ends, shares, strict=True) if end < 0.0), default=0.0)
    right = max((share for end, share in zip(ends, shares, strict=True) if end >= 0.0), default=0.0)
    if high > low and left + right < 1.0:
        span = (high - low) / (1.0 - left - right)
        panel.set_xlim(low - left * span, high + right * span)
