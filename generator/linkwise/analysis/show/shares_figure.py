"""Figure of what loads each joint over the whole movement, as stacked bars: gravity, loads, motions."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from linkwise.analysis.joint_causes import Cause, are_motions_whole, causes_of, sizes
from linkwise.analysis.result import AnalysisResult
from linkwise.analysis.show.drawn_curves import new_figure, write_title
from linkwise.arrays import Array
from linkwise.plotstyle import BLUE, GRAVITY, SKY, VERMILION, drawn, tone

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MANY = 12
"""Number of joints above which a bar has the joint's own motion, the largest other one, and the rest."""
HATCHES = {"motion": "", "acceleration": "", "velocity": "////", "own": "....", "load": "xx", "named": ""}
LEANING = (
    "Net torques are of all links together: joint torques determine them.\n"
    "What goes through one link leans on how the file spreads mass over the links."
)
"""Remark on what rests on the file's masses, for rigid links."""
LARGEST, REST = "largest motion of another joint", "motions of all other joints, shares added"


@dataclass(frozen=True, eq=False)
class SharePart:
    """A part of every joint's bar: mean sizes of net torques (joints,), and how it looks."""

    label: str
    sizes: Array
    fill: str
    hatch: str = ""
    names: tuple[str, ...] = ()
    """Name of the cause at each joint, where it differs from joint to joint."""


def share_parts(result: AnalysisResult) -> tuple[list[SharePart], list[SharePart]]:
    """Return parts for gravity, loads and joints' own torques, and parts for motions.

    Motions are grouped if there are more joints than `MANY`.
    """
    robot = result.robot
    causes = causes_of(result, robot.plot_joints, drawn, together=are_motions_whole(result))
    found = list(zip(causes, sizes(result, causes), strict=True))
    moving = [(cause, size) for cause, size in found if cause.is_motion]
    fixed = [(cause, size) for cause, size in found if not cause.is_motion]
    return _fixed(result, fixed), _few(result, moving) if len(robot.driven) > MANY else _each(result, moving)


def _fixed(result: AnalysisResult, found: Sequence[tuple[Cause, Array]]) -> list[SharePart]:
    """Return parts for gravity or shares with names, loads, and joints' own torques."""
    own = [cause for cause, _ in found if cause.kind == "own"]
    named = [cause for cause, _ in found if cause.kind == "named"][1:]  # the first is grey
    tones = [*own, *(cause for cause, _ in found if cause.kind == "load"), *named]  # in the page's order
    out = []
    for cause, values in found:
        if cause.kind == "named" and cause not in named:
            out.append(SharePart(cause.label, values, GRAVITY))
        else:
            fill = tone(len(result.robot.driven) + tones.index(cause))
            out.append(SharePart(cause.label, values, fill, HATCHES[cause.kind]))
    return out


def _each(result: AnalysisResult, found: Sequence[tuple[Cause, Array]]) -> list[SharePart]:
    """Return a part for every motion, or for its acceleration and its velocity."""
    place = {k: at for at, k in enumerate(result.robot.driven)}
    return [
        SharePart(cause.label, values, tone(place[cause.number or 0]), HATCHES[cause.kind])
        for cause, values in found
    ]


def _few(result: AnalysisResult, found: Sequence[tuple[Cause, Array]]) -> list[SharePart]:
    """Return parts for many joints: each one's own motion, the largest other one, and the sum of the rest."""
    driven, names = result.robot.driven, result.robot.plot_joints
    by = np.array([size for _, size in found]).T
    own = by.diagonal()
    others = by * (1.0 - np.eye(len(driven)))
    largest = others.max(axis=1)
    first = tuple(drawn(names[driven[k]]) for k in others.argmax(axis=1))
    return [
        SharePart("its own motion", own, VERMILION),
        SharePart(LARGEST, largest, BLUE, names=first),
        SharePart(REST, others.sum(axis=1) - largest, SKY),
    ]


def shares(result: AnalysisResult, _: int) -> "Figure":
    """Draw two bars for each joint, in % of mean sizes: every cause, and the movement's causes alone."""
    robot = result.robot
    fixed, movement = share_parts(result)
    every = [*fixed, *movement]
    rows = -(-len(every) // 3)
    row = 0.42 if len(movement) > 3 else 0.3
    figure = new_figure(8.4, 1.3 + row * len(robot.driven) + 0.2 * rows)
    left, right = figure.subplots(1, 2, sharey=True, width_ratios=(2, 3))
    bars = _bars(left, every)
    _bars(right, movement)
    out = f"{robot.potential} and loads" if result.loads else robot.potential
    told = len(robot.share_names) == 1  # several are in the legend
    left.set_title(f"everything, {out} too" if told else "everything")
    right.set_title(f"the movement alone, without {out}" if told else "the movement alone")
    left.set_yticks(range(len(robot.driven)), [drawn(robot.plot_joints[i]) for i in robot.driven])
    left.set_ylim(len(robot.driven) - 0.4, -0.6)
    left.set_ylabel("loaded joint")
    for part in movement:
        if part.names:
            _name_beside(right, part)
    for axis in (left, right):
        axis.set_xlabel("mean size of the net torque, % of all")
    write_title(figure, result, "What loads each joint")
    figure.legend(
        bars,
        [part.label for part in every],
        loc="outside lower center",
        ncols=3,
        handlelength=2,
        fontsize=8,
        title=LEANING if robot.tree is not None else None,
        title_fontsize=7,
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
