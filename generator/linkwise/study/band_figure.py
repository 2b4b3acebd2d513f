"""Figures for a paper, by level of a factor: mean curves over the cycle with bands, or means by subject.

A filled band is of the spread between subjects, a hatched one of what is uncertain.
"""

import textwrap
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from linkwise.analysis.column_titles import column_title
from linkwise.analysis.motion_words import MotionWords
from linkwise.arrays import Array
from linkwise.errors import LinkwiseError
from linkwise.escape import file_name, file_names
from linkwise.extras import extra
from linkwise.plotstyle import INK, colour, dash, drawn, saved, styled
from linkwise.study.causes_figure import drawn_causes
from linkwise.study.comparisons import Compared
from linkwise.study.deviation_columns import fitting_values
from linkwise.study.deviations import Deviations, deviations
from linkwise.study.figure_units import in_unit
from linkwise.study.plan import NARROW, PaperFigure
from linkwise.study.spread import FILLED, FILLED_OF_ONE, Spread, columns_of_trials, spread, values_of
from linkwise.study.summary import TrialSummary, words_of_trials

MOST = 12
"""Most panels of a figure."""
WIDE, HIGH = 3.4, 2.3
"""Width and height of a panel in inches; two stand side by side."""
MM = 1 / 25.4
DOTS, DOTS_OF_ONE = (
    "dots: subjects; bars: ± sd over them",
    "dots: trials of one subject; bars: ± sd over them",
)
HATCHED = {
    "within": "hatched: ± sd within a trial,\nby what is uncertain",
    "mean": "hatched: ± sd of the mean,\nspread and uncertainty together",
    "new": "hatched: ± sd of a new subject's truth,\nspread and uncertainty together",
}
"""Kinds of bands, as a legend calls them."""
BAR = "bar at the bottom: there the levels differ,\nby the test"
LETTERS, MARGIN, LONGEST = 13, 0.8, 110
"""Letters of a title on an inch, inches beside a panel, and most letters of a title."""
EDGE = 0.5
"""Width of a hatched band's lines in points."""
HATCHES = ("////", "\\\\\\\\", "||||", "----")
"""Hatches of levels, so that two that overlap are told apart."""


@dataclass(frozen=True, eq=False)
class BandPanel:
    """A panel: a column, its spread at each level of the factor, and its tests."""

    column: str
    unit: str
    levels: dict[str, Spread]
    tests: tuple[Compared, ...]
    uncertain: dict[str, Deviations]
    """Deviations by level, of curves that have some."""
    is_left_by_muscles: bool = False
    """True for a joint torque that is what muscles leave."""


def figure_files(
    figure: PaperFigure,
    trials: Sequence[TrialSummary],
    tests: Sequence[Compared],
    number: int = 1,
    used: Sequence[str] = (),
) -> Iterator[tuple[str, bytes]]:
    """Yield the name and content of a figure in each of its formats.

    number: of the figure, counted from 1; used: names of files of former ones, without their endings

    Raises LinkwiseError for unknown columns, levels and units, and for deviations that are asked for and are
    not there.
    """
    panels = [] if figure.joints else panels_of(figure, trials, tests)
    name = file_name(figure.name or _name(figure, panels).replace("/", "-") or f"figure{number}")
    *_, name = file_names([*used, name])
    words = words_of_trials(trials)
    with styled() as matplotlib:
        matplotlib.rcParams["hatch.linewidth"] = EDGE
        for kind in figure.formats:
            drawing = (
                _drawn(figure, panels, words)
                if panels
                else drawn_causes(figure, converted(figure, trials), tests, words)
            )
            yield f"{name}.{kind}", saved(drawing, kind)


def _name(figure: PaperFigure, panels: Sequence[BandPanel]) -> str:
    """Return the name of a figure of one column, or of one joint's causes; "" of several."""
    if len(figure.joints) == 1:
        return f"causes-{figure.joints[0]}"
    return panels[0].column if len(panels) == 1 else ""


def panels_of(
    figure: PaperFigure, trials: Sequence[TrialSummary], tests: Sequence[Compared]
) -> list[BandPanel]:
    """Return a panel for each column of a figure."""
    trials = converted(figure, trials)
    known = columns_of_trials(trials)
    asked = figure_columns(figure, known)
    panels = [
        BandPanel(
            name,
            known[name],
            *_levels(figure, trials, name, tests),
            name.startswith("tau/") and name.replace("tau", "tau_before_muscles", 1) in known,
        )
        for name in asked
    ]
    if figure.hatched in ("mean", "new") and not any(panel.uncertain for panel in panels):
        raise LinkwiseError(
            f"[[figure]]: 'hatched' is {figure.hatched!r}, and no curve has deviations; give all trials the"
            " key 'uncertain', or leave it out"
        )
    return panels


def converted(figure: PaperFigure, trials: Sequence[TrialSummary]) -> Sequence[TrialSummary]:
    """Return trials with what a figure shows in its unit."""
    if not figure.unit:
        return trials
    columns = figure_columns(figure, columns_of_trials(trials))
    return in_unit(trials, [*columns, *figure.wholes], figure.unit)


def figure_columns(figure: PaperFigure, names: Iterable[str]) -> list[str]:
    """Return those of the columns `names` that a figure shows, in the order in which it names them.

    Raises LinkwiseError for unknown columns, for deviations as columns of their own, and for too many.
    """
    names = list(names)
    parts = (fitting_values("[[figure]]", names, [pattern]) for pattern in figure.patterns)
    found = list(dict.fromkeys(name for part in parts for name in part))
    if len(found) > MOST and not figure.joints:
        raise LinkwiseError(f"[[figure]]: {len(found)} columns; {MOST} are legible, so give fewer")
    return found


def _levels(
    figure: PaperFigure, trials: Sequence[TrialSummary], name: str, tests: Sequence[Compared]
) -> tuple[dict[str, Spread], tuple[Compared, ...], dict[str, Deviations]]:
    """Return the spread of a column at each level, tests, and deviations at each level that has them."""
    found: dict[str, list[TrialSummary]] = {}
    for trial in trials:
        found.setdefault(trial.labels[figure.by] if figure.by else "", []).append(trial)
    levels = {
        level: spread(found[level], values)
        for level in figure.in_order(found)
        if (values := values_of(found[level], name))
    }
    uncertain = {level: deviations(found[level], name, one) for level, one in levels.items()}
    if all(len(one.each) == 1 for one in levels.values()):
        levels = {level: one.over_trials for level, one in levels.items()}
    return levels, _about(figure, name, tests), {k: one for k, one in uncertain.items() if one is not None}


def _about(figure: PaperFigure, name: str, tests: Sequence[Compared]) -> tuple[Compared, ...]:
    return tuple(test for test in tests if test.column == name and test.comparison.factor == figure.by)


def _drawn(figure: PaperFigure, panels: Sequence[BandPanel], words: Mapping[str, MotionWords]) -> Any:
    across = 1 if figure.width is not None and figure.width < NARROW else min(2, len(panels))
    wide = WIDE if figure.width is None else figure.width * MM / across
    down = -(-len(panels) // across)
    size = wide * across, HIGH * min(1.2, max(0.7, wide / WIDE)) * down + (0.3 if figure.title else 0.0)
    drawing = extra("matplotlib.figure").Figure(figsize=size, layout="constrained")
    axes = drawing.subplots(down, across, squeeze=False).ravel()
    for axis, panel in zip(axes, panels, strict=False):
        _panel(axis, panel, figure, words)
    for axis in axes[len(panels) :]:
        axis.set_axis_off()
    if len(panels[0].levels) > 1:
        axes[0].legend(title=drawn(figure.named(figure.by)), fontsize=8, handlelength=2.5)
    if figure.title:
        drawing.suptitle(drawn(figure.title, 120), x=0.01, ha="left", fontsize=11)
    if bands := _kinds_of_bands(figure, panels):
        handles, texts = zip(*bands, strict=True)
        drawing.legend(handles, texts, loc="outside lower left", ncols=across, fontsize=8, handlelength=2.5)
    return drawing


def _kinds_of_bands(figure: PaperFigure, panels: Sequence[BandPanel]) -> list[tuple[Any, str]]:
    """Return a sample of each kind of band and what it is, where a reader must be told."""
    patch = extra("matplotlib.patches").Patch
    some = [spread for panel in panels for spread in panel.levels.values() if len(spread.each) > 1]
    dots, curves = ([one for one in some if (one.each.shape[1] == 1) is is_dot] for is_dot in (True, False))
    is_hatched = figure.hatched != "none" and any(panel.uncertain for panel in panels)
    kinds = []
    for text in dict.fromkeys(DOTS_OF_ONE if one.is_of_trials else DOTS for one in dots):
        dot = extra("matplotlib.lines").Line2D([], [], color=INK, marker="o", linewidth=0)
        kinds.append((dot, text))
    filled = [FILLED_OF_ONE if one.is_of_trials else FILLED for one in curves]
    for text in dict.fromkeys(texts[figure.band] for texts in filled if figure.band in texts):
        kinds.append((patch(facecolor=INK, alpha=0.2, linewidth=0), text))
    if is_hatched:
        hatched = patch(fill=False, edgecolor=INK, hatch=HATCHES[0], linewidth=EDGE)
        kinds.append((hatched, HATCHED[figure.hatched]))
    if any(test.clusters for panel in panels for test in panel.tests if len(test.statistic) > 1):
        bar = extra("matplotlib.lines").Line2D([], [], color=INK, linewidth=3)
        kinds.append((bar, BAR))
    return kinds


def _panel(axis: Any, panel: BandPanel, figure: PaperFigure, words: Mapping[str, MotionWords]) -> None:
    for number, (key, found) in enumerate(panel.levels.items()):
        level = figure.named(key)
        if found.each.shape[1] == 1:
            _dots(axis, number, level, found)
        else:
            _curve(axis, number, level, found, figure.band)
            if key in panel.uncertain and figure.hatched != "none":
                _hatched(axis, number, found, getattr(panel.uncertain[key], figure.hatched))
    told = column_title(panel.column, words, panel.unit)
    title = f"{told.title} left by muscles" if panel.is_left_by_muscles else told.title
    room = int((axis.figure.get_figwidth() / axis.get_gridspec().ncols - MARGIN) * LETTERS)
    title = textwrap.fill(drawn(figure.names.get(panel.column, title), LONGEST), room)
    axis.set_title(title, fontsize=9)
    axis.set_ylabel(told.unit(panel.unit))
    if next(iter(panel.levels.values())).each.shape[1] == 1:
        axis.set_xticks(range(len(panel.levels)), [drawn(figure.named(one)) for one in panel.levels])
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


def _hatched(axis: Any, number: int, found: Spread, deviation: Array) -> None:
    percent = np.linspace(0, 100, found.each.shape[1])
    edge, hatch = colour(number), HATCHES[number % len(HATCHES)]
    low, high = found.mean - deviation, found.mean + deviation
    axis.fill_between(percent, low, high, facecolor="none", edgecolor=edge, hatch=hatch, linewidth=EDGE)


def _dots(axis: Any, number: int, level: str, found: Spread) -> None:
    values = found.each[:, 0]
    axis.plot(np.full(len(values), number), values, "o", color=colour(number), alpha=0.5, label=drawn(level))
    axis.errorbar(
        number, values.mean(), yerr=found.deviation[0], color=INK, capsize=4, marker="_", markersize=12
    )
