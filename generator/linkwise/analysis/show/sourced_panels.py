"""Panels of quantities that sources make up, with a curve for each source, in figures and on the page."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from linkwise.analysis.result import AnalysisResult
from linkwise.analysis.show.bands import Bands, draw_band
from linkwise.analysis.show.drawn_curves import (
    PIECES,
    DrawnCurves,
    drawn_curves,
    foot,
    largest_few,
    new_figure,
    time_axis,
    write_note,
    write_title,
    zero_line,
)
from linkwise.arrays import Array, Index
from linkwise.plotstyle import BROWN, COLOURS, DASHES, GRAVITY, INK, colour, dash, drawn

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Kind = Literal["sum", "joint", "others", "named", "velocity", "passive", "load", "contact", "start"]
STYLES = {
    "velocity": "dashed",
    "passive": "dotted",
    "contact": "dashdot",
    "start": (0, (1, 3)),
}


@dataclass(frozen=True, eq=False)
class SourceCurve:
    """Sources of one kind, with a curve in each panel."""

    kind: Kind
    label: str
    number: int
    """Index of the joint among those that have torques, of the load or of the named share; else 0."""
    rows: tuple[Index, ...]
    """Rows of the result that the curve sums up, for each panel."""
    window: int = 0
    """Index of the window of time in which the source acted; each has dashes of its own, or is fainter."""

    def values(self, part: AnalysisResult) -> Array:
        """Return the curve in each panel, (panels, S)."""
        return np.array([part.values[some].sum(axis=0) for some in self.rows])

    def look(self, joints: int, loads: int) -> dict[str, Any]:
        """Return how matplotlib draws the curve, where there are so many joints and loads."""
        match self.kind:
            case "sum":
                return {"color": INK, "linewidth": 2.4}
            case "joint":
                again = dash(self.number + self.window * len(COLOURS))
                return {"color": colour(self.number), "linewidth": 1.4, "linestyle": again}
            case "others":
                return {"color": BROWN, "linewidth": 1.0}
            case "load":
                again = dash((self.window + DASHES.index("dashdot")) * len(COLOURS))
                return {"color": colour(joints + self.number), "linewidth": 1.4, "linestyle": again}
            case "named" if self.number:  # the first is grey
                shade = colour(joints + loads + self.number - 1)
                return {"color": shade, "linewidth": 1.4, "linestyle": "solid"}
        if self.kind in STYLES:  # whose dashes say the kind
            faint = max(0.3, 1.0 - 0.25 * self.window)
            return {"color": GRAVITY, "linewidth": 1.4, "linestyle": STYLES[self.kind], "alpha": faint}
        return {"color": GRAVITY, "linewidth": 1.4, "linestyle": dash(self.window * len(COLOURS))}


@dataclass(frozen=True, eq=False)
class SourcedPanels:
    """Panels of one thing, such as a point that is accelerated, and the sources of what they show."""

    title: str
    """Title in words; what comes from the robot's file is not made printable."""
    panels: Sequence[tuple[str, str]]
    """Name and unit of what each panel shows."""
    sources: Sequence[SourceCurve]
    """The sum first."""
    notes: Sequence[str] = ()

    @property
    def count(self) -> int:
        """Number of curves."""
        return len(self.panels) * len(self.sources)

    def curves(self, result: AnalysisResult, pieces: int = PIECES) -> list[tuple[SourceCurve, DrawnCurves]]:
        """Return the curves of each source, (panels, ...), over all samples."""
        found = drawn_curves(
            result, lambda part: np.concatenate([one.values(part) for one in self.sources]), pieces
        )
        count = len(self.panels)
        return [(one, found.only(slice(at * count, (at + 1) * count))) for at, one in enumerate(self.sources)]

    def bands(self, result: AnalysisResult, pieces: int = PIECES) -> Bands:
        """Return the bands of the curves, source by source and, of each, panel by panel."""
        return Bands(result, [rows for one in self.sources for rows in one.rows], pieces)


def largest_alone(
    result: AnalysisResult, every: Sequence[SourceCurve], most: int
) -> tuple[list[int], list[int]]:
    """Return the indices of the `most` largest sources, and of the others but those that are zero.

    The size is the mean magnitude, as a part of the largest one of a panel.
    """
    sizes = np.zeros((len(every), len(every[0].rows) if every else 0))
    for part in result.parts():
        sizes += np.array([np.abs(one.values(part)).sum(axis=1) for one in every])
    largest = sizes.max(axis=0, initial=0.0)
    weight = (sizes / np.where(largest > 0.0, largest, 1.0)).max(axis=1, initial=0.0)
    there = np.flatnonzero(weight)
    alone, rest = largest_few(weight[there], most)
    return [int(there[at]) for at in alone], [int(there[at]) for at in rest]


def figure_of(
    panels: Callable[[AnalysisResult, int], SourcedPanels],
) -> Callable[[AnalysisResult, int], "Figure"]:
    """Return the function that draws the panels of the thing with a number."""

    def draw(result: AnalysisResult, number: int) -> "Figure":
        return _drawn(result, panels(result, number))

    return draw


def _drawn(result: AnalysisResult, shown: SourcedPanels) -> "Figure":
    figure = new_figure(1.2 + 1.6 * len(shown.panels))
    panels = figure.subplots(len(shown.panels), 1, sharex=True, squeeze=False)[:, 0]
    joints, loads = len(result.robot.driven), len(result.load_labels)
    curves, bands, count = shown.curves(result), shown.bands(result), len(shown.panels)
    for at, (panel, (name, unit)) in enumerate(zip(panels, shown.panels, strict=True)):
        for number, (source, found) in enumerate(curves):
            label, look = drawn(source.label, 34), source.look(joints, loads)
            panel.plot(found.time[at], found.values[at], label=label, **look)
            draw_band(panel, bands[number * count + at], look["color"])
        zero_line(panel)
        panel.set_ylabel(f"{drawn(name)} ({unit})")
    panels[0].legend(loc="upper left", bbox_to_anchor=(1.01, 1), fontsize=8, handlelength=2.6)
    time_axis(panels[-1], result)
    write_title(figure, result, drawn(shown.title, 70))
    write_note(figure, *shown.notes, *bands.notes, foot(result))
    return figure
