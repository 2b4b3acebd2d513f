"""Part of the page on what the cutoff of the low-pass does to the shares."""

from typing import Any

import numpy as np

from linkwise.analysis.cutoff_sweep import CutoffSweep
from linkwise.analysis.result import AnalysisResult
from linkwise.escape import printable

MOST = 200
"""Shares that a page lists, those that change most."""


def cutoff_data(result: AnalysisResult) -> dict[str, Any] | None:
    """Return what the page says, in texts made printable; None where cutoffs were not swept."""
    sweep = result.cutoff_sweep
    if sweep is None:
        return None
    ends = [sweep.low, sweep.own, sweep.high]
    return {
        "sentence": printable(sweep.sentence),
        "cutoffs": [f"{cutoff:.4g} Hz" for cutoff in sweep.cutoffs[ends]],
        "count": len(sweep.listed),
        "shares": [_share(result, sweep, row) for row in sweep.listed[:MOST].tolist()],
    }


def _share(result: AnalysisResult, sweep: CutoffSweep, row: int) -> list[str]:
    """Return the cells of a share: cause, joint, link, root mean squares, unit, change, largest values."""
    column, ends = sweep.columns[row], [sweep.low, sweep.own, sweep.high]
    assert column.joint is not None
    link = "" if column.link is None else result.robot.plot_links[column.link]
    rms = [f"{size:.3g}" for size in sweep.rms[row, ends]]
    peaks = ", ".join(f"{size:.3g}" for size in sweep.peak[row, ends])
    sign = " (another sign)" if sweep.changes_sign[row] else ""
    robot = result.robot
    joint = robot.named_apart(robot.figure_joints[column.joint], column.joint)
    names = [sweep.cause(column).removeprefix("the "), joint, link]
    change = float(np.round(100 * sweep.change[row], 1))
    return [*map(printable, names), *rms, column.unit, f"{change:+.3g} %", peaks + sign]
