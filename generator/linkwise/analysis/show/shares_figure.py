"""What loads each joint over the whole movement, as stacked bars."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from linkwise.analysis.result import AnalysisResult
from linkwise.analysis.result_quantities import PASSIVE, Quantity
from linkwise.extras import extra
from linkwise.package.load import Array
from linkwise.plotstyle import BLUE, GRAVITY, SKY, VERMILION, drawn, tone

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MANY = 12
"""Joints above which a bar has the joint's own motion, the largest other one, and the rest."""


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
    fixed = _fixed(result)
    every = [*fixed[:1], *movement, *fixed[1:]]
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
    left.set_yticks(range(len(robot.driven)), [drawn(joint) for joint in robot.driven_joints])
    left.set_ylim(len(robot.driven) - 0.4, -0.6)
    left.set_ylabel("loaded joint")
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
    """Gravity, what joints have of their own, and loads."""
    own = dict.fromkeys(column.quantity for column in result.columns if column.quantity in PASSIVE)
    count = len(result.robot.driven)
    out = [_SharePart("gravity", _means(result, "tau_gravity"), GRAVITY)]
    for at, quantity in enumerate(own, count):
        out.append(_SharePart(quantity.removeprefix("tau_"), _means(result, quantity), tone(at), "...."))
    for e, label in enumerate(result.load_labels):
        sizes = _means(result, "tau_load", e)
        out.append(_SharePart(drawn(label), sizes, tone(count + len(own) + e), "xx"))
    return out


def _each(result: AnalysisResult) -> list[_SharePart]:
    """Acceleration and velocity of each joint."""
    out = []
    for at, k in enumerate(result.robot.driven):
        joint = drawn(result.robot.joints[k])
        out.append(_SharePart(f"{joint} acceleration", _means(result, "tau_qdd", k), tone(at)))
        out.append(_SharePart(f"{joint} velocity", _means(result, "tau_qd", k), tone(at), "////"))
    return out


def _few(result: AnalysisResult) -> list[_SharePart]:
    """Of many joints: each one's own motion, the largest other motion, and the rest."""
    driven = result.robot.driven
    by = np.stack([_means(result, "tau_qdd", k) + _means(result, "tau_qd", k) for k in driven], axis=1)
    own = by.diagonal()
    others = by * (1.0 - np.eye(len(driven)))
    first = others.argmax(axis=1)
    largest = others.max(axis=1)
    names = tuple(drawn(result.robot.joints[driven[k]]) for k in first)
    return [
        _SharePart("its own motion", own, VERMILION),
        _SharePart("largest motion of another joint", largest, BLUE, names=names),
        _SharePart("motion of all other joints", others.sum(axis=1) - largest, SKY),
    ]


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
        for at, name in enumerate(part.names):
            if widths[at] >= 2.4 * len(name):
                labels[at] = f"{name} {labels[at]}"
        box = {"boxstyle": "round,pad=0.15", "fc": part.fill, "ec": "none"}
        for text in axis.bar_label(bar, labels, label_type="center", color="white", fontsize=8):
            if text.get_text():
                text.set_bbox(box)
        starts = starts + widths
        bars.append(bar)
    axis.set_xlim(0, 100)
    axis.grid(False)
    return bars


def _means(result: AnalysisResult, quantity: Quantity, cause: int | None = None) -> Array:
    """Mean magnitudes of a cause on every joint (joints,), links added up."""
    out = dict.fromkeys(result.robot.driven, 0.0)
    for column, mean in zip(result.columns, result.totals.mean, strict=True):
        if column.quantity == quantity and column.cause == cause and column.joint in out:
            out[column.joint] += float(mean)
    return np.array(list(out.values()))
