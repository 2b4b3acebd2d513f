"""Five panels below one another, laid out like the paper's Fig. 5-9 and 10-14."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from linkwise.analysis.result import AnalysisResult
from linkwise.analysis.show.bands import Bands, draw_band
from linkwise.analysis.show.drawn_curves import (
    drawn_curves,
    foot,
    largest_few,
    new_figure,
    time_axis,
    write_note,
    zero_line,
)
from linkwise.extras import extra
from linkwise.plotstyle import colour, dash, drawn

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MANY, MOST = 12, 7
"""Joints, or links and loads, above which only the largest, so many, have looks of their own."""
OTHERS: dict[str, Any] = {"color": "#B4BAC4", "linewidth": 0.7, "zorder": 1.5}
PANEL, LINE = 1.75, 0.22
"""Heights in inches of a panel and of a legend's line."""


@dataclass(frozen=True)
class _Panel:
    """A panel, and which rows of the result it draws, each by the number of its joint, or link or load."""

    title: str
    symbol: str
    lines: list[tuple[int, int]]
    named: tuple[int, ...]
    """Numbers of those with a look of their own, in the order of their looks; others are thin and grey."""


def paper(result: AnalysisResult, i: int) -> "Figure":
    """Draw coordinates, τ_i, and for joint i τ_ij, τp_ij(q̇_j) and τp_ij(q̈_j), by j's own coordinate."""
    robot, panels = result.robot, _panels(result, i)
    carried = (*robot.plot_links, *result.load_labels)
    some = _legend_of("Joints", robot.figure_joints, panels[0])
    others = _legend_of("Links and loads" if result.loads else "Links", carried, panels[2])
    named = (some, others)
    legends = [_legend_rows(names) for _, names in named]
    heights = [PANEL] * len(panels) + [LINE * (rows + 1) for rows in legends]
    figure = new_figure(sum(heights) + 0.9)
    grid = figure.add_gridspec(len(heights), 1, height_ratios=heights)
    axes = [figure.add_subplot(grid[0])]
    axes += [figure.add_subplot(grid[row], sharex=axes[0]) for row in range(1, len(panels))]
    for axis in axes[:-1]:
        axis.tick_params(labelbottom=False)
    for axis, panel in zip(axes, panels, strict=True):
        _draw(axis, result, panel)
    time_axis(axes[-1], result)
    figure.align_ylabels(axes)
    for row, (title, names) in enumerate(named, len(panels)):
        _legend(figure.add_subplot(grid[row]), title, names)
    figure.suptitle(f"{drawn(robot.name, 60)} · {drawn(result.source, 60)}", x=0.01, ha="left", fontsize=11)
    write_note(figure, _left_out(result), foot(result))
    return figure


def _panels(result: AnalysisResult, i: int) -> tuple[_Panel, ...]:
    robot = result.robot
    units = " or ".join(dict.fromkeys(robot.units))
    loads = " or ".join(dict.fromkeys(robot.torque_units))
    on = f"on {drawn(robot.figure_joints[i])} ({robot.torque_units[i]})"
    rows, number = result.rows, i + 1

    def lines(name: str, axis: str, first: int = 0, **where: int) -> list[tuple[int, int]]:
        return [(row, first + rows.index(row, axis)) for row in rows.numbers(name, **where).tolist()]

    def own_terms(name: str) -> list[tuple[int, int]]:
        every = enumerate(own_joints(result))
        return [line for j, k in every for line in lines(name, "link", joint=i, link=j, cause=k)]

    through = lines("tau_link", "link", joint=i) + lines("tau_load", "load", len(robot.links), joint=i)
    joints, carried = _named_joints(result, i), _named_links(result, through)
    return (
        _Panel(f"Joint coordinates ({units})", "$q_i$", lines("q", "joint"), joints),
        _Panel(f"Joint torques ({loads})", r"$\tau_i$", lines("tau", "joint"), joints),
        _Panel(
            f"Partial torques {on}, through each link{' and by each load' if result.loads else ''}",
            rf"$\tau_{{{number}j}}$",
            through,
            carried,
        ),
        _Panel(
            f"Propagation torques {on}: each link's own joint only, velocity",
            rf"$\tau^p_{{{number}j}}(\dot q_j)$",
            own_terms("tau_qd"),
            carried,
        ),
        _Panel(
            f"Propagation torques {on}: each link's own joint only, acceleration",
            rf"$\tau^p_{{{number}j}}(\ddot q_j)$",
            own_terms("tau_qdd"),
            carried,
        ),
    )


def _named_joints(result: AnalysisResult, i: int) -> tuple[int, ...]:
    """Return the joints that are told apart: all if there are few, else joint i and the most loaded ones."""
    driven = list(result.robot.driven)
    if len(driven) <= MANY:
        return tuple(range(len(result.robot.joints)))
    largest, _ = largest_few(result.totals.mean[result.rows["tau"].rows], MOST)
    return tuple(sorted({i, *(driven[at] for at in largest)}))


def _named_links(result: AnalysisResult, through: Sequence[tuple[int, int]]) -> tuple[int, ...]:
    """Return the links and loads that are told apart: all if there are few, else those that load most."""
    count = len(result.robot.links) + len(result.load_labels)
    if count <= MANY:
        return tuple(range(count))
    largest, _ = largest_few([result.totals.mean[row] for row, _ in through], MOST)
    return tuple(through[at][1] for at in largest)


def own_joints(result: AnalysisResult) -> tuple[int, ...]:
    """Return the coordinate of each link's own joint: the manifest's, else the last that carries the link.

    If that joint follows others, the last of these counts.
    """
    robot = result.robot
    known = {
        joint.link: robot.joints_supporting([joint.coordinate])[-1:]
        for joint in (robot.tree.joints if robot.tree else ())
    }
    last = [(0,)] * len(robot.links)
    for i, j in result.rows["tau_link"].at.tolist():
        last[j] = max(last[j], (i,))
    return tuple((known.get(link) or last[j])[0] for j, link in enumerate(robot.links))


def _draw(axis: Any, result: AnalysisResult, panel: _Panel) -> None:
    rows = [row for row, _ in panel.lines]
    found = drawn_curves(result, lambda part: part.values[rows])
    bands = Bands(result, [np.array([row]) for row in rows])
    looks = {number: place for place, number in enumerate(panel.named)}
    for at, ((_, number), time, values) in enumerate(zip(panel.lines, found.time, found.values, strict=True)):
        if number not in looks:
            axis.plot(time, values, **OTHERS)
            continue
        axis.plot(time, values, **_style(looks[number]))
        draw_band(axis, bands[at], colour(looks[number]))
    zero_line(axis)
    axis.set_title(panel.title)
    axis.set_ylabel(panel.symbol, fontsize=11, parse_math=True)


def _style(at: int) -> dict[str, Any]:
    return {"color": colour(at), "linestyle": dash(at), "linewidth": 1.5}


def _legend_of(title: str, names: Sequence[str], panel: _Panel) -> tuple[str, list[str]]:
    """Return the title of a legend, and names; of many, how many others there are stands in the title."""
    named = [names[number] for number in panel.named]
    others = len({number for _, number in panel.lines}.difference(panel.named))
    return f"{title}, thin: {others} others" if others else title, named


def _legend_columns(names: Sequence[str]) -> int:
    """Return how many names fit side by side."""
    return max(1, min(6, 93 // (max((len(drawn(name)) for name in names), default=0) + 6)))


def _legend_rows(names: Sequence[str]) -> int:
    return max(1, -(-len(names) // _legend_columns(names)))


def _legend(axis: Any, title: str, names: Sequence[str]) -> None:
    """Draw one legend for all panels that show these names, on an axis of its own."""
    line = extra("matplotlib.lines").Line2D
    axis.set_axis_off()
    legend = axis.legend(
        [line([], [], **_style(at)) for at in range(len(names))],
        [drawn(name) for name in names],
        title=title,
        loc="upper left",
        bbox_to_anchor=(0, 1),
        borderaxespad=0,
        ncols=_legend_columns(names),
        alignment="left",
        handlelength=2,
        fontsize=8,
    )
    legend.set_in_layout(False)


def _left_out(result: AnalysisResult) -> str:
    """Return a note on what the last two panels do not show, and on which torques are residuals."""
    own, robot = own_joints(result), result.robot
    others = [robot.figure_joints[at] for at in robot.driven if at not in own]
    text = "The last two panels show each link's own joint only; the table and the page have every joint."
    if result.uncertain is not None:
        text += " Bands are one standard deviation to either side."
    if others:
        text += f" Not in them, as they carry no link with mass directly: {', '.join(map(drawn, others))}."
    if robot.residuals_apart:
        some = ", ".join(drawn(robot.figure_joints[i]) for i in sorted(robot.residuals_apart))
        text += f" Torques of {some} are residuals: nothing drives these."
    return text
