"""Figure of each joint's torque and its largest shares over the cutoff of the low-pass."""

from typing import TYPE_CHECKING, Any

import numpy as np

from linkwise.analysis.cutoff_sweep import SHARES, CutoffSweep
from linkwise.analysis.result import AnalysisResult
from linkwise.analysis.result_quantities import PASSIVE
from linkwise.analysis.result_rows import Column
from linkwise.analysis.show.drawn_curves import largest_few, new_figure, write_note, write_title
from linkwise.arrays import Index
from linkwise.escape import listed
from linkwise.plotstyle import GRAVITY, INK, drawn, tone

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MOST = 6
"""Shares of a joint that have a line."""
JOINTS = 12
"""Most joints that are drawn: those with the shares that change most."""
MARKERS = "osv^DPX"
"""Markers of a joint's shares, so that each differs: one more than `MOST`, as never only one is left out."""
LOOKS = {"tau_qdd": "solid", "tau_qd": "dashed"}
"""Styles of lines by quantity; all others are dotted."""


def cutoff(result: AnalysisResult, _: int) -> "Figure":
    """Draw root mean squares and largest magnitudes over cutoffs, a row of two panels for each joint."""
    sweep = result.cutoff_sweep
    assert sweep is not None, "`check_figure` sees to it"
    joints = _chosen(result, sweep)
    figure = new_figure(1.0 + 1.9 * len(joints))
    panels = figure.subplots(len(joints), 2, squeeze=False, sharex=True)
    for (left, right), i in zip(panels, joints, strict=True):
        _joint(result, sweep, i, left, right)
    for panel in panels[-1]:
        panel.set_xlabel("cutoff (Hz)")
    write_title(figure, result, "What the cutoff does")
    left_out = [drawn(result.robot.figure_joints[i]) for i in result.robot.driven if i not in joints]
    write_note(
        figure,
        "Sizes are over the whole movement; the upright line is at the cutoff of"
        f" {sweep.cutoffs[sweep.own]:.4g} Hz, where the log is analysed. Of each joint the {MOST} largest"
        " shares are drawn, through one link, by one cause.",
        *(["Residuals stand last: nothing drives these."] if result.robot.residuals_apart else []),
        *([f"Not drawn, as their shares change less: {listed(left_out)}."] if left_out else []),
        result.provenance,
    )
    return figure


def _chosen(result: AnalysisResult, sweep: CutoffSweep) -> list[int]:
    """Return the joints that are drawn, in their order, residuals last."""
    driven = list(result.robot.driven)
    first = dict.fromkeys(sweep.columns[row].joint for row in sweep.listed.tolist())
    ranked = [*(i for i in first if i in driven), *(i for i in driven if i not in first)]
    kept = ranked[:JOINTS]
    return [i for i in result.robot.joints_apart if i in kept]


def _joint(result: AnalysisResult, sweep: CutoffSweep, i: int, left: Any, right: Any) -> None:
    """Draw a joint's torque and its largest shares."""
    columns = sweep.columns
    whole = next(row for row, c in enumerate(columns) if c.quantity == "tau" and c.joint == i)
    shares = np.array([r for r, c in enumerate(columns) if c.quantity in SHARES and c.joint == i], np.intp)
    whole_label = "residual" if i in result.robot.residuals_apart else "joint torque"
    for place, row in enumerate([whole, *_largest(sweep, shares)]):
        column = columns[row]
        look: dict[str, Any] = {"color": INK, "linewidth": 2.2, "label": whole_label}
        if row != whole:
            look = {"label": _label(result, sweep, column), "linestyle": LOOKS.get(column.quantity, "dotted")}
            moves = column.quantity in LOOKS and column.cause is not None
            look["color"] = tone(result.robot.driven.index(column.cause)) if moves else GRAVITY
            look |= {"marker": MARKERS[place - 1], "markersize": 3}
        left.plot(sweep.cutoffs, sweep.rms[row], **look)
        right.plot(sweep.cutoffs, np.abs(sweep.peak[row]), **look)
    for panel in (left, right):
        panel.axvline(sweep.cutoffs[sweep.own], color=INK, linewidth=0.8, zorder=0)
        panel.set_ylim(bottom=0.0)
        _frequencies(panel, sweep)
    name = result.robot.named_apart(drawn(result.robot.figure_joints[i]), i)
    left.set_title(f"{name}:\nroot mean square")
    right.set_title("largest magnitude")
    left.set_ylabel(columns[whole].unit)
    right.legend(loc="upper left", bbox_to_anchor=(1.01, 1.05), fontsize=7, handlelength=3)


def _largest(sweep: CutoffSweep, shares: Index) -> list[int]:
    """Return the shares with the largest root mean squares, the largest first; nothing that is tiny."""
    sizes = sweep.rms[shares].max(axis=1)
    named, _ = largest_few(sizes, MOST)
    there = set(sweep.listed.tolist())
    return [r for r in shares[sorted(named, key=lambda at: -sizes[at])].tolist() if r in there]


def _label(result: AnalysisResult, sweep: CutoffSweep, column: Column) -> str:
    """Return a share's label: what it is due to, and through which link."""
    robot = result.robot
    what = {"tau_qdd": "acc.", "tau_qd": "vel."}.get(column.quantity)
    if what is None or column.cause is None:
        cause = drawn(sweep.cause(column))
        cause = f"own {cause}" if column.quantity in PASSIVE else cause
    else:
        cause = f"{what} of {drawn(robot.figure_joints[column.cause])}"
    return cause if column.link is None else f"{cause} through {drawn(robot.plot_links[column.link])}"


def _frequencies(panel: Any, sweep: CutoffSweep) -> None:
    """Give a panel's axis of cutoffs its logarithm, with the ends and the analysis's own as numbers."""
    panel.set_xscale("log")
    told = sorted({sweep.low, sweep.own, sweep.high})
    panel.set_xticks(sweep.cutoffs[told], [f"{one:.3g}" for one in sweep.cutoffs[told]])
    panel.set_xticks([], minor=True)
