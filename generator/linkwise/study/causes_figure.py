"""A study's figures of what loads a joint: several causes in a panel with bands, conditions side by side."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from linkwise.analysis.joint_causes import largest_first
from linkwise.analysis.motion_words import MotionWords, shown_joints
from linkwise.analysis.net_causes import NET, label_of
from linkwise.analysis.show.drawn_curves import largest_few, write_note
from linkwise.arrays import Array
from linkwise.escape import column_part
from linkwise.extras import extra
from linkwise.plotstyle import GRAVITY, INK, colour, dash, drawn
from linkwise.study.comparisons import Compared
from linkwise.study.plan import NARROW, SUBJECT, PaperFigure
from linkwise.study.spread import FILLED, FILLED_OF_ONE, Spread, columns_of_trials, spread, values_of
from linkwise.study.summary import TrialSummary
from linkwise.study.t_tests import Cluster

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

    @property
    def is_of_one(self) -> bool:
        """True where each condition is of one subject, whose trials then stand in place of subjects."""
        return all(len({trial.labels[SUBJECT] for trial in some}) == 1 for some in self.levels.values())

    def spread_of(self, level: str, columns: Sequence[str]) -> Spread:
        """Return the spread over subjects of the sum of columns; one that a trial lacks is 0 there.

        Where each condition is of one subject, it is that over trials.
        """
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
    def curves(self) -> dict[str, list[str]]:
        """Columns of each curve by its cause: the whole, the largest causes first, then all others."""
        names = list(self.columns)
        by_level = [
            [np.abs(self.spread_of(level, [name]).mean).mean() for name in names] for level in self.levels
        ]
        sizes: Array = np.mean(by_level, axis=0)
        alone, rest = largest_few(sizes, MOST)
        order = [at for at in largest_first(sizes) if at in alone and sizes[at] > 0.0]
        found = {WHOLE: names} | {self.columns[names[at]]: [names[at]] for at in order}
        return found | ({REST: [names[at] for at in rest]} if rest else {})


def drawn_causes(
    figure: PaperFigure,
    trials: Sequence[TrialSummary],
    tests: Sequence[Compared],
    words: Mapping[str, MotionWords],
) -> Any:
    """Return the figure of causes: a row for each joint, in it a panel for each condition.

    In a narrow figure panels stand below each other, and the legend below all.
    """
    rows = [CausePanels.of(figure, joint, trials) for joint in figure.joints]
    levels = figure.in_order(level for row in rows for level in row.levels)
    is_narrow = figure.width is not None and figure.width < NARROW
    down, across = (len(rows) * len(levels), 1) if is_narrow else (len(rows), len(levels))
    wide = WIDE * max(across, 1) + 1.6 if figure.width is None else figure.width / 25.4
    size = wide, HIGH * down + (0.3 if figure.title else 0.0) + (1.2 if is_narrow else 0.0)
    drawing = extra("matplotlib.figure").Figure(figsize=size, layout="constrained")
    axes = drawing.subplots(down, across, squeeze=False, sharey="none" if is_narrow else "row")
    causes = list(dict.fromkeys(cause for row in rows for cause in row.curves))
    looks = dict(zip(causes, _looks(causes), strict=True))
    marks = 0
    for row, panels in zip(rows, axes.reshape(len(rows), len(levels)), strict=True):
        there = [(level, axis) for level, axis in zip(levels, panels, strict=True) if level in row.levels]
        for level, axis in there:
            _panel(axis, row, level, CauseLook(figure, words, looks))
        said = words.get(row.joint)
        for axis in panels if is_narrow else panels[:1]:
            axis.set_ylabel(row.unit if said is None else f"{row.unit}\n{said.signs}")
        marked = [(axis, _clusters(row, level, figure, tests)) for level, axis in there]
        _make_room([axis for axis, _ in marked], max(len(some) for _, some in marked))
        for axis, some in marked:
            _mark(axis, some, looks)
            marks += len(some)
        for axis in set(panels) - {axis for _, axis in there}:
            axis.set_axis_off()
        if not is_narrow:
            handles, names = there[0][1].get_legend_handles_labels()
            panels[-1].legend(handles, names, fontsize=7, loc="upper left", bbox_to_anchor=(1.02, 1.0))
    if is_narrow:
        every = [axis.get_legend_handles_labels() for axis in axes.ravel()]
        by_name = {name: one for some in every for one, name in zip(*some, strict=True)}
        where = {"loc": "upper left", "bbox_to_anchor": (-0.1, -0.24), "ncols": 2, "handlelength": 2.5}
        axes[-1, 0].legend(by_name.values(), by_name.keys(), fontsize=7, **where)
    if figure.title:
        drawing.suptitle(drawn(figure.title, 120), x=0.01, ha="left", fontsize=11)
    write_note(drawing, " ".join(_notes(figure, rows, marks > 0)))
    return drawing


def _notes(figure: PaperFigure, rows: Sequence[CausePanels], is_marked: bool) -> Iterator[str]:
    """Yield what a reader of the figure must know."""
    yield "A coordinate's motion is its acceleration and velocity together."
    if figure.band in FILLED:
        # A band about a curve, or the bar at a dot: of trials only where a whole row of panels is of one.
        kinds = dict.fromkeys((FILLED_OF_ONE if row.is_of_one else FILLED)[figure.band] for row in rows)
        yield f"{'; '.join(kinds).capitalize()}."
    if is_marked:
        yield "Bars below: where the test finds a difference, in the cause's colour."


@dataclass(frozen=True, eq=False)
class CauseLook:
    """Look of causes in a figure: their names, and colour and line of each."""

    figure: PaperFigure
    words: Mapping[str, MotionWords]
    looks: Mapping[str, dict[str, Any]]

    def label(self, cause: str, columns: Sequence[str], joint: str) -> str:
        """Return what a cause is called: by `names` of its column, else in words."""
        if cause == WHOLE:
            return drawn(self.figure.names.get(f"tau/{column_part(joint)}", WHOLE), 40)
        own = REST if cause == REST else label_of(cause, self.words)
        return drawn(self.figure.names.get(columns[0], own) if len(columns) == 1 else own, 40)

    def title(self, joint: str, level: str) -> str:
        """Return the title of a panel."""
        own = self.figure.names.get(joint, shown_joints([joint], self.words)[0])
        told = [own, *([self.figure.named(level)] if level else [])]
        return " · ".join(drawn(one, 40) for one in told)


def _looks(causes: Sequence[str]) -> Iterator[dict[str, Any]]:
    """Yield colour and line of each curve."""
    number = 0
    for cause in causes:
        if cause == WHOLE:
            yield {"color": INK, "linewidth": 1.8}
        elif cause in ("gravity", REST):
            yield {"color": GRAVITY, "linestyle": ":" if cause == REST else "-"}
        else:
            yield {"color": colour(number), "linestyle": dash(number)}
            number += 1


def _panel(axis: Any, row: CausePanels, level: str, look: CauseLook) -> None:
    band = look.figure.band
    for at, (cause, columns) in enumerate(row.curves.items()):
        found, line = row.spread_of(level, columns), look.looks[cause]
        label = look.label(cause, columns, row.joint)
        low, high = found.each.min(axis=0), found.each.max(axis=0)
        if band == "deviation":
            low, high = found.mean - found.deviation, found.mean + found.deviation
        if found.each.shape[1] == 1:
            middle = found.mean[0]
            ends = [[middle - low[0]], [high[0] - middle]] if band != "none" else None
            axis.errorbar([at], [middle], yerr=ends, fmt="o", capsize=3, label=label, color=line["color"])
            continue
        percent = np.linspace(0, 100, found.each.shape[1])
        axis.plot(percent, found.mean, label=label, **line)
        if band != "none" and len(found.each) > 1:
            axis.fill_between(percent, low, high, color=line["color"], alpha=0.13, linewidth=0)
    axis.axhline(0, color=INK, linewidth=0.5)
    axis.set_title(look.title(row.joint, level), fontsize=9)
    if found.each.shape[1] > 1:
        axis.set_xlabel("% of the cycle")
        axis.set_xlim(0, 100)
    else:
        axis.set_xticks([])


def _clusters(
    row: CausePanels, level: str, figure: PaperFigure, tests: Sequence[Compared]
) -> list[tuple[str, Sequence[Cluster]]]:
    """Return where the torque by a cause, or the whole, differs between this condition and another."""
    of_column = {columns[0]: cause for cause, columns in row.curves.items() if len(columns) == 1}
    of_column[f"tau/{column_part(row.joint)}"] = WHOLE
    about = [one for one in tests if one.column in of_column and one.comparison.factor == figure.by]
    return [
        (of_column[one.column], one.clusters)
        for one in about
        if level in one.comparison.between and len(one.statistic) > 1 and one.clusters
    ]


def _make_room(axes: Sequence[Any], marks: int) -> None:
    """Give a joint's panels one range, and keep its lowest part for marks, so that these hide no curve."""
    ranges = [axis.get_ylim() for axis in axes]
    low, high = min(low for low, _ in ranges), max(high for _, high in ranges)
    floor = MARK * marks
    for axis in axes:
        axis.set_ylim(low - (high - low) * floor / (1 - floor), high)


def _mark(axis: Any, marks: Sequence[tuple[str, Sequence[Cluster]]], looks: Mapping[str, Any]) -> None:
    for number, (cause, clusters) in enumerate(marks):
        where = {"ymin": MARK * number, "ymax": MARK * (number + 0.8)}
        for part in clusters:
            axis.axvspan(part.start, part.end, color=looks[cause]["color"], linewidth=0, **where)
