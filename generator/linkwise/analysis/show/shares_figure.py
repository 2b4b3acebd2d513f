"""Figure of what loads each joint over the whole movement, as stacked bars."""

from typing import TYPE_CHECKING, Any

import numpy as np

from linkwise.analysis.result import AnalysisResult
from linkwise.analysis.show.share_parts import SharePart, share_parts
from linkwise.extras import extra
from linkwise.plotstyle import drawn

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def shares(result: AnalysisResult, _: int) -> "Figure":
    """Draw two bars for each joint, in % of mean sizes: every cause, and the movement's causes alone."""
    robot = result.robot
    fixed, movement = share_parts(result)
    every = [*fixed, *movement]
    rows = -(-len(every) // 3)
    figure: Figure = extra("matplotlib.figure").Figure(
        figsize=(8.4, 1.3 + (0.42 if len(movement) > 3 else 0.3) * len(robot.driven) + 0.2 * rows),
        layout="constrained",
    )
    left, right = figure.subplots(1, 2, sharey=True, width_ratios=(2, 3))
    bars = _bars(left, every)
    _bars(right, movement)
    out = f"{robot.potential} and loads" if result.loads else robot.potential
    left.set_title(f"everything, {out} too")
    right.set_title(f"the movement alone, without {out}")
    left.set_yticks(range(len(robot.driven)), [drawn(robot.plot_joints[i]) for i in robot.driven])
    left.set_ylim(len(robot.driven) - 0.4, -0.6)
    left.set_ylabel("loaded joint")
    for part in movement:
        if part.names:
            _name_beside(right, part)
    for axis in (left, right):
        axis.set_xlabel("mean size of the net torque, % of all")
    figure.suptitle(
        f"What loads each joint · {drawn(robot.name, 40)} · {drawn(result.source, 50)}",
        x=0.01,
        ha="left",
        fontsize=11,
    )
    figure.legend(
        bars,
        [part.label for part in every],
        loc="outside lower center",
        ncols=3,
        handlelength=2,
        fontsize=8,
    )
    return figure


def _name_beside(axis: Any, part: SharePart) -> None:
    """Name the joint that causes the part, in every row, on the right."""
    beside = axis.twinx()
    beside.set_ylim(axis.get_ylim())
    beside.set_yticks(range(len(part.names)), part.names, color=part.fill)
    beside.set_ylabel(part.label, color=part.fill)
    beside.tick_params(length=0)
    beside.grid(False)


def _bars(axis: Any, parts: list[SharePart]) -> list[Any]:
    wholes = np.sum([part.sizes for part in parts], axis=0)
    wholes[wholes == 0.0] = 1.0
    starts = np.zeros(len(wholes))
    bars = []
    for part in parts:
        widths = 100 * part.sizes / wholes
        bar = axis.barh(
            range(len(widths)),
            widths,
            left=starts,
            height=0.64,
            color=part.fill,
            hatch=part.hatch,
            edgecolor="white",
            linewidth=0.6,
        )
        labels = [f"{width:.0f}" if width >= 8 else "" for width in widths]
        box = {"boxstyle": "round,pad=0.15", "fc": part.fill, "ec": "none"}
        for text in axis.bar_label(bar, labels, label_type="center", color="white", fontsize=8):
            if text.get_text():
                text.set_bbox(box)
        starts = starts + widths
        bars.append(bar)
    axis.set_xlim(0, 100)
    axis.grid(False)
    return bars
