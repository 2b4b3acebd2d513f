"""Table of an analysis for a notebook: each joint's torque and work, and its largest cause."""

import numpy as np
from linkwise_runtime.html_tables import page_part, remark, table

from linkwise.analysis.joint_causes import are_motions_whole, causes_of, sizes
from linkwise.analysis.result import AnalysisResult
from linkwise.analysis.result_columns import load_unit
from linkwise.analysis.work import Work

HEAD = ("joint", "peak |τ|", "mean |τ|", "largest cause", "its share", "gave", "took back")


def result_table(result: AnalysisResult) -> str:
    """Return the HTML of a result; peaks, means, shares and work are over all samples of the movement.

    Causes and shares are those of `--figure shares`.
    """
    joints, totals = result.robot.joints, result.totals
    torques = {
        column.joint: (float(mean), float(peak))
        for column, mean, peak in zip(result.columns, totals.mean, totals.peak, strict=True)
        if column.quantity == "tau"
    }
    causes = causes_of(result, joints, together=are_motions_whole(result))
    rows = []
    for i, loading in zip(result.robot.driven, sizes(result, causes).T, strict=True):
        unit, (mean, peak) = load_unit(result.robot.units[i]), torques[i]
        most, whole = int(loading.argmax()), float(loading.sum())
        rows.append(
            (
                joints[i],
                f"{peak:.4g} {unit}",
                f"{mean:.4g} {unit}",
                causes[most].label if whole else "",
                f"{100 * loading[most] / whole:.0f} %" if whole else "",
                *_work(result.joint_work, i),
            )
        )
    title = f"{result.robot.name}: who loads whom in {result.source}"
    warnings = (*result.warnings, *result.load_warnings)
    return page_part(title, table(HEAD, rows)) + remark(result.provenance, *warnings)


def _work(work: Work, joint: int) -> tuple[str, str]:
    """Return the work that a joint gave and the work that it took back, as text in J."""
    return f"{float(np.asarray(work.given)[joint]):.4g} J", f"{float(np.asarray(work.taken)[joint]):.4g} J"
