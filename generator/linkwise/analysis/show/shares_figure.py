"""What loads each joint over the whole movement, as stacked bars."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from linkwise.analysis.joint_causes import causes_of, sizes
from linkwise.analysis.result import AnalysisResult
from linkwise.extras import extra
from linkwise.package.load import Array
from linkwise.plotstyle import BLUE, GRAVITY, SKY, VERMILION, drawn, tone

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MANY = 12
"""Joints above which a bar has the joint's own motion, the largest other one, and the rest."""
HATCHES = {"acceleration": "", "velocity": "////", "own": "....", "load": "xx"}
LARGEST = "largest motion of another joint"


@dataclass(frozen=True, eq=False)
class _SharePart:
    """A part of every joint's bar, of mean magnitudes (joints,), and how it looks."""

    label: str
    sizes: Array
    fill: str
    hatch: str = ""
    names: tuple[str, ...] = ()
    """Of what the part is, where that differs from joint to joint."""


def shares(result: AnalysisResult, _: int) -> "Figure":
    """Two bars for each joint: every cause, and those of the movement alone, in % of mean magnitudes."""
    robot = result.robot
    movement = _few(result) if len(robot.driven) > MANY else _each(result)
    every = [*_fixed(result), *movement]
    rows = -(-len(every) // 3)
    figure = extra("matplotlib.figure").Figure(
        figsize=(8.4, 1.3 + (0.42 if len(movement) > 3 else 0.3) * len(robot.driven) + 0.2 * rows),
        layout="constrained",
    )
    left, right = figure.subplots(1, 2, sharey=True, width_ratios=(2, 3))
    bars = _bars(left, every)
    _bars(right, movement)
    out = "gravity and loads" if result.loads else "gravity"
    left.set_title(f"everything, {out} too")
    right.set_title(f"the movement alone, without {out}")
    left.set_yticks(range(len(robot.driven)), [drawn(robot.plot_joints[i]) for i in robot.driven])
    left.set_ylim(len(robot.driven) - 0.4, -0.6)
    left.set_ylabel("loaded joint")
    for part in movement:
        if part.names:
            _name_beside(right, part)
    for axis in (left, right):
        axis.set_xlabel("% of the mean magnitude")
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
    return figure  # type: ignore[no-any-return]


def _fixed(result: AnalysisResult) -> list[_SharePart]:
    """Gravity, loads, and what joints have of their own."""
    causes = [cause for cause in causes_of(result, result.robot.plot_joints, drawn) if not cause.is_motion]
    own = [cause for cause in causes if cause.kind == "own"]
    tones = [*own, *(cause for cause in causes if cause.kind == "load")]  # as the page has them
    out = []
    for cause, values in zip(causes, sizes(result, causes), strict=True):
        if cause.kind == "gravity":
            out.append(_SharePart(cause.label, values, GRAVITY))
        else:
            fill = tone(len(result.robot.driven) + tones.index(cause))
            out.append(_SharePart(cause.label, values, fill, HATCHES[cause.kind]))
    return out


def _each(result: AnalysisResult) -> list[_SharePart]:
    """Acceleration and velocity of each joint."""
    every = causes_of(result, result.robot.plot_joints, drawn, together=False)
    causes = [cause for cause in every if cause.is_motion]
    place = {k: at for at, k in enumerate(result.robot.driven)}
    return [
        _SharePart(cause.label, values, tone(place[cause.number or 0]), HATCHES[cause.kind])
        for cause, values in zip(causes, sizes(result, causes), strict=True)
    ]


def _few(result: AnalysisResult) -> list[_SharePart]:
    """Of many joints: each one's own motion, the largest other motion, and the rest."""
    driven, names = result.robot.driven, result.robot.plot_joints
    by = sizes(result, [cause for cause in causes_of(result, names) if cause.is_motion]).T
    own = by.diagonal()
    others = by * (1.0 - np.eye(len(driven)))
    largest = others.max(axis=1)
    first = tuple(drawn(names[driven[k]]) for k in others.argmax(axis=1))
    return [
        _SharePart("its own motion", own, VERMILION),
        _SharePart(LARGEST, largest, BLUE, names=first),
        _SharePart("motion of all other joints", others.sum(axis=1) - largest, SKY),
    ]


def _name_beside(axis: Any, part: _SharePart) -> None:
    """Of which joint the part is, in every row, on the right."""
    beside = axis.twinx()
    beside.set_ylim(axis.get_ylim())
    beside.set_yticks(range(len(part.names)), part.names, color=part.fill)
    beside.set_ylabel(part.label, color=part.fill)
    beside.tick_params(length=0)
    beside.grid(False)


def _bars(axis: Any, parts: list[_SharePart]) -> list[Any]:
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
