"""A study's figures of what loads a joint: several causes in a panel with bands, conditions side by side."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from linkwise.analysis.joint_causes import largest_first
from linkwise.analysis.motion_words import MotionWords
from linkwise.analysis.net_causes import NET, label_of
from linkwise.analysis.show.drawn_curves import largest_few
from linkwise.arrays import Array
from linkwise.escape import column_part
from linkwise.extras import extra
from linkwise.plotstyle import GRAVITY, INK, colour, dash, drawn
from linkwise.study.comparisons import Compared
from linkwise.study.plan import SUBJECT, PaperFigure
from linkwise.study.spread import OF_ONE, Spread, columns_of_trials, spread, values_of
from linkwise.study.summary import TrialSummary

MOST = 5
"""Causes of a joint that have curves of their own; all others are summed in one."""
WIDE, HIGH = 3.4, 2.6
"""Width and height of a panel in inches."""
MARK = 0.025
"""Height of a test's mark, as a part of the panel."""
WHOLE, REST = "all causes together", "all others together"


@dataclass(frozen=True, eq=False)
class CausePanels:
    """Panels of one joint: trials by condition, and the columns that each curve is the sum of."""

    joint: str
    unit: str
    levels: dict[str, list[TrialSummary]]
    columns: dict[str, str]
    """Net torques by cause: the cause's name by column."""

    @classmethod
    def of(cls, figure: PaperFigure, joint: str, trials: Sequence[TrialSummary]) -> "CausePanels":
        """Return the panels of a joint whose net torques trials have."""
        levels: dict[str, list[TrialSummary]] = {}
        known, part = columns_of_trials(trials), column_part(joint)
        beginning = f"{NET}/{part}/"
        columns = {name: name.removeprefix(beginning) for name in known if name.startswith(beginning)}
        for trial in trials:
            if any(name in trial.units for name in columns):
                levels.setdefault(trial.labels[figure.by] if figure.by else "", []).append(trial)
        return cls(joint, known[next(iter(columns))], levels, columns)

    def spread_of(self, level: str, columns: Sequence[str]) -> Spread:
        """Return the spread over subjects of the sum of columns; one that a trial lacks is 0 there."""
        trials = self.levels[level]
        whole = values_of(trials, f"tau/{column_part(self.joint)}")
        several = [values_of(trials, name) for name in columns]
        sums = {
            name: np.sum([np.zeros_like(one), *(some[name] for some in several if name in some)], axis=0)
            for name, one in whole.items()
        }
        found = spread(trials, sums)
        return found.over_trials if self.is_of_one else found

    @cached_property
    def is_of_one(self) -> bool:
        """True if each condition is of one subject and some of several trials, over which bands then are."""
        several = self.levels.values()
        is_of_one = all(len({one.labels[SUBJECT] for one in some}) == 1 for some in several)
        return is_of_one and any(len(some) > 1 for some in several)

    @cached_property
    def curves(self) -> dict[str, list[str]]:
        """Columns of each curve by its label: the whole, the largest causes first, then all others."""
        names = list(self.columns)
        by_level = [
            [np.abs(self.spread_of(level, [name]).mean).mean() for name in names] for level in self.levels
        ]
        sizes: Array = np.mean(by_level, axis=0)
        alone, rest = largest_few(sizes, MOST)
        order = [at for at in largest_first(sizes) if at in alone and sizes[at] > 0.0]
        found = {WHOLE: names} | {label_of(self.columns[names[at]]): [names[at]] for at in order}
        return found | ({REST: [names[at] for at in rest]} if rest else {})


def drawn_causes(
    figure: PaperFigure,
    trials: Sequence[TrialSummary],
    tests: Sequence[Compared],
    words: Mapping[str, MotionWords],
) -> Any:
    """Return the figure of causes: a row for each joint, in it a panel for each condition."""
    rows = [CausePanels.of(figure, joint, trials) for joint in figure.joints]
    levels = figure.in_order(level for row in rows for level in row.levels)
    wide = WIDE * max(len(levels), 1) + 1.6 if figure.width is None else figure.width / 25.4
    size = wide, HIGH * len(rows) + (0.3 if figure.title else 0.0)
    drawing = extra("matplotlib.figure").Figure(figsize=size, layout="constrained")
    axes = drawing.subplots(len(rows), len(levels), squeeze=False, sharey="row")
    labels = list(dict.fromkeys(label for row in rows for label in row.curves))
    looks = dict(zip(labels, _looks(labels), strict=True))
    for row, panels in zip(rows, axes, strict=True):
        for level, axis in zip(levels, panels, strict=True):
            if level not in row.levels:
                axis.set_axis_off()
                continue
            _panel(axis, row, level, figure, looks)
            _marks(axis, row, level, figure, tests, looks)
        said = words.get(row.joint)
        panels[0].set_ylabel(row.unit if said is None else f"{row.unit}\n{said.signs}")
        handles, names = next(axis for axis in panels if axis.lines).get_legend_handles_labels()
        panels[-1].legend(handles, names, fontsize=7, loc="upper left", bbox_to_anchor=(1.02, 1.0))
    if figure.title:
        drawing.suptitle(drawn(figure.title, 120), x=0.01, ha="left", fontsize=11)
    drawing.supxlabel("\n".join(_told(figure, rows, tests)), fontsize=7)
    return drawing


def _told(figure: PaperFigure, rows: Sequence[CausePanels], tests: Sequence[Compared]) -> Iterator[str]:
    """Yield lines for below a figure: what curves, marks and bands are of, where that has to be told."""
    bars = " Bars below: where the test finds a difference, in the cause's colour." if tests else ""
    yield f"A coordinate's motion is its acceleration and velocity together.{bars}"
    if figure.band != "none" and any(row.is_of_one for row in rows):
        yield f"Bands: {OF_ONE[figure.band]}."


def _looks(labels: Sequence[str]) -> Iterator[dict[str, Any]]:
    """Yield colour and line of each curve."""
    number = 0
    for label in labels:
        if label == WHOLE:
            yield {"color": INK, "linewidth": 1.8}
        elif label in ("gravity", REST):
            yield {"color": GRAVITY, "linestyle": ":" if label == REST else "-"}
        else:
            yield {"color": colour(number), "linestyle": dash(number)}
            number += 1


def _panel(axis: Any, row: CausePanels, level: str, figure: PaperFigure, looks: dict[str, Any]) -> None:
    for label, columns in row.curves.items():
        found, look = row.spread_of(level, columns), looks[label]
        low, high = found.each.min(axis=0), found.each.max(axis=0)
        if figure.band == "deviation":
            low, high = found.mean - found.deviation, found.mean + found.deviation
        if found.each.shape[1] == 1:
            at, middle = list(row.curves).index(label), found.mean[0]
            ends = [[middle - low[0]], [high[0] - middle]] if figure.band != "none" else None
            axis.errorbar(
                [at], [middle], yerr=ends, fmt="o", capsize=3, label=drawn(label), color=look["color"]
            )
            axis.plot([], [])  # a line, by which the legend finds the panel
            continue
        percent = np.linspace(0, 100, found.each.shape[1])
        axis.plot(percent, found.mean, label=drawn(label), **look)
        if figure.band != "none" and len(found.each) > 1:
            axis.fill_between(percent, low, high, color=look["color"], alpha=0.13, linewidth=0)
    axis.axhline(0, color=INK, linewidth=0.5)
    told = (figure.named(one) for one in (row.joint, level) if one)
    axis.set_title(" · ".join(drawn(one, 40) for one in told), fontsize=9)
    if found.each.shape[1] > 1:
        axis.set_xlabel("% of the cycle")
        axis.set_xlim(0, 100)
    else:
        axis.set_xticks([])


def _marks(
    axis: Any,
    row: CausePanels,
    level: str,
    figure: PaperFigure,
    tests: Sequence[Compared],
    looks: dict[str, Any],
) -> None:
    """Mark where the torque by a cause, or the whole, differs between this condition and another."""
    of_column = {columns[0]: label for label, columns in row.curves.items() if len(columns) == 1}
    of_column[f"tau/{column_part(row.joint)}"] = WHOLE
    about = [one for one in tests if one.column in of_column and one.comparison.factor == figure.by]
    for number, test in enumerate(one for one in about if level in one.comparison.between):
        for cluster in test.clusters:
            where = {"ymin": MARK * number, "ymax": MARK * (number + 0.8)}
            axis.axvspan(
                cluster.start, cluster.end, color=looks[of_column[test.column]]["color"], linewidth=0, **where
            )
