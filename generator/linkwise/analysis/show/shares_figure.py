"""What loads each joint over the whole movement, as stacked bars."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from linkwise.analysis.result import AnalysisResult
from linkwise.analysis.result_quantities import PASSIVE, Quantity
from linkwise.extras import extra
from linkwise.plotstyle import GRAVITY, drawn, tone

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True)
class _Cause:
    """What loads a joint, and how its part of the bar looks."""

    quantity: Quantity
    coordinate: int | None
    label: str
    fill: str
    hatch: str = ""


def shares(result: AnalysisResult, _: int) -> "Figure":
    """Two bars for each joint: every cause, and those of the movement alone, in % of mean magnitudes."""
    robot = result.robot
    movement = []
    for at, k in enumerate(robot.driven):
        joint = drawn(robot.joints[k])
        movement.append(_Cause("tau_qdd", k, f"{joint} acceleration", tone(at)))
        movement.append(_Cause("tau_qd", k, f"{joint} velocity", tone(at), "////"))
    own = dict.fromkeys(column.quantity for column in result.columns if column.quantity in PASSIVE)
    passive = [
        _Cause(quantity, None, quantity.removeprefix("tau_"), tone(len(robot.driven) + at), "....")
        for at, quantity in enumerate(own)
    ]
    first = len(robot.driven) + len(passive)
    loads = [
        _Cause("tau_load", e, drawn(label), tone(first + e), "xx")
        for e, label in enumerate(result.load_labels)
    ]
    every = [_Cause("tau_gravity", None, "gravity", GRAVITY), *movement, *passive, *loads]
    rows = -(-len(every) // 3)
    figure = extra("matplotlib.figure").Figure(
        figsize=(8.4, 1.3 + 0.42 * len(robot.driven) + 0.2 * rows), layout="constrained"
    )
    left, right = figure.subplots(1, 2, sharey=True, width_ratios=(2, 3))
    bars = _bars(left, result, every)
    _bars(right, result, movement)
    left.set_title("everything")
    right.set_title("the movement alone, without gravity")
    left.set_yticks(range(len(robot.driven)), [drawn(joint) for joint in robot.driven_joints])
    left.invert_yaxis()
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
        [cause.label for cause in every],
        loc="outside lower center",
        ncols=3,
        handlelength=2,
        fontsize=8,
    )
    return figure  # type: ignore[no-any-return]


def _bars(axis: Any, result: AnalysisResult, causes: list[_Cause]) -> list[Any]:
    joints = range(len(result.robot.driven))
    loads = [[_mean(result, i, cause) for cause in causes] for i in result.robot.driven]
    wholes = [sum(row) or 1.0 for row in loads]
    starts = [0.0 for _ in joints]
    bars = []
    for at, cause in enumerate(causes):
        widths = [100 * loads[i][at] / wholes[i] for i in joints]
        bar = axis.barh(
            joints,
            widths,
            left=starts,
            height=0.64,
            color=cause.fill,
            hatch=cause.hatch,
            edgecolor="white",
            linewidth=0.6,
        )
        labels = [f"{width:.0f}" if width >= 8 else "" for width in widths]
        box = {"boxstyle": "round,pad=0.15", "fc": cause.fill, "ec": "none"}
        for text in axis.bar_label(bar, labels, label_type="center", color="white", fontsize=8):
            if text.get_text():
                text.set_bbox(box)
        starts = [start + width for start, width in zip(starts, widths, strict=True)]
        bars.append(bar)
    axis.set_xlim(0, 100)
    axis.grid(False)
    return bars


def _mean(result: AnalysisResult, i: int, cause: _Cause) -> float:
    return float(
        sum(
            mean
            for column, mean in zip(result.columns, result.totals.mean, strict=True)
            if column.key[:2] == (cause.quantity, i) and column.cause == cause.coordinate
        )
    )
