"""Figures for a paper, by level of a factor: mean curves over the cycle with bands, or means by subject."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from linkwise.errors import LinkwiseError
from linkwise.escape import file_name, file_names
from linkwise.extras import extra
from linkwise.plotstyle import INK, colour, dash, drawn, saved, styled
from linkwise.study.comparisons import Compared
from linkwise.study.patterns import fitting
from linkwise.study.plan import PaperFigure
from linkwise.study.spread import Spread, columns_of_trials, spread, values_of
from linkwise.study.summary import TrialSummary

MOST = 12
"""Most panels of a figure."""
FORMATS = ("svg", "pdf")
WIDE, HIGH = 3.4, 2.3
"""Width and height of a panel in inches; two stand side by side."""


@dataclass(frozen=True, eq=False)
class BandPanel:
    """A panel: a column, its spread at each level of the factor, and its tests."""

    column: str
    unit: str
    levels: dict[str, Spread]
    tests: tuple[Compared, ...]


def band_figures(
    figures: Sequence[PaperFigure], trials: Sequence[TrialSummary], tests: Sequence[Compared]
) -> Iterator[tuple[str, bytes]]:
    """Yield the name and content of all figures, each as SVG and as PDF.

    Raises LinkwiseError for unknown columns.
    """
    drawn_of = [panels_of(figure, trials, tests) for figure in figures]
    names = [
        figure.name or (panels[0].column if len(panels) == 1 else f"figure{number}")
        for number, (figure, panels) in enumerate(zip(figures, drawn_of, strict=True), 1)
    ]
    for figure, panels, name in zip(figures, drawn_of, file_names(map(file_name, names)), strict=True):
        with styled():
            drawing = _drawn(figure, panels)
            for kind in FORMATS:
                yield f"{name}.{kind}", saved(drawing, kind)


def panels_of(
    figure: PaperFigure, trials: Sequence[TrialSummary], tests: Sequence[Compared]
) -> list[BandPanel]:
    """Return a panel for each column of a figure."""
    known = columns_of_trials(trials)
    return [
        BandPanel(name, known[name], _levels(figure, trials, name), _about(figure, name, tests))
        for name in figure_columns(figure, known)
    ]


def figure_columns(figure: PaperFigure, names: Iterable[str]) -> list[str]:
    """Return those of the columns `names` that a figure shows.

    Raises LinkwiseError for unknown columns, and for too many.
    """
    found = fitting("[[figure]]", names, figure.columns)
    if len(found) > MOST:
        raise LinkwiseError(f"[[figure]]: {len(found)} columns; {MOST} are legible, so give fewer")
    return found


def _levels(figure: PaperFigure, trials: Sequence[TrialSummary], name: str) -> dict[str, Spread]:
    found: dict[str, list[TrialSummary]] = {}
    for trial in trials:
        found.setdefault(trial.labels[figure.by] if figure.by else "", []).append(trial)
    return {
        level: spread(members, values)
        for level, members in found.items()
        if (values := values_of(members, name))
    }


def _about(figure: PaperFigure, name: str, tests: Sequence[Compared]) -> tuple[Compared, ...]:
    return tuple(test for test in tests if test.column == name and test.comparison.factor == figure.by)


def _drawn(figure: PaperFigure, panels: Sequence[BandPanel]) -> Any:
    across = min(2, len(panels))
    down = -(-len(panels) // across)
    drawing = extra("matplotlib.figure").Figure(figsize=(WIDE * across, HIGH * down), layout="constrained")
    axes = drawing.subplots(down, across, squeeze=False).ravel()
    for axis, panel in zip(axes, panels, strict=False):
        _panel(axis, panel, figure.band)
    for axis in axes[len(panels) :]:
        axis.set_axis_off()
    if len(panels[0].levels) > 1:
        axes[0].legend(title=drawn(figure.by), fontsize=8, handlelength=2.5)
    return drawing


def _panel(axis: Any, panel: BandPanel, band: str) -> None:
    for number, (level, found) in enumerate(panel.levels.items()):
        if found.each.shape[1] == 1:
            _dots(axis, number, level, found)
        else:
            _curve(axis, number, level, found, band)
    axis.set_title(drawn(panel.column, 48), fontsize=9)
    axis.set_ylabel(panel.unit)
    if next(iter(panel.levels.values())).each.shape[1] == 1:
        axis.set_xticks(range(len(panel.levels)), [drawn(level) for level in panel.levels])
        return
    axis.set_xlabel("% of the cycle")
    axis.set_xlim(0, 100)
    for test in panel.tests:
        for cluster in test.clusters:
            axis.axvspan(cluster.start, cluster.end, ymax=0.025, color=INK, linewidth=0)


def _curve(axis: Any, number: int, level: str, found: Spread, band: str) -> None:
    percent = np.linspace(0, 100, found.each.shape[1])
    axis.plot(percent, found.mean, color=colour(number), linestyle=dash(number), label=drawn(level))
    if band == "none" or len(found.each) < 2:
        return
    low, high = (
        (found.each.min(axis=0), found.each.max(axis=0))
        if band == "range"
        else (found.mean - found.deviation, found.mean + found.deviation)
    )
    axis.fill_between(percent, low, high, color=colour(number), alpha=0.2, linewidth=0)


def _dots(axis: Any, number: int, level: str, found: Spread) -> None:
    values = found.each[:, 0]
    axis.plot(np.full(len(values), number), values, "o", color=colour(number), alpha=0.5, label=drawn(level))
    axis.errorbar(
        number, values.mean(), yerr=found.deviation[0], color=INK, capsize=4, marker="_", markersize=12
    )
