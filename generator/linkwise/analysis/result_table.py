"""An analysis as a notebook shows it: each joint's torque and work, and through which link most comes."""

import numpy as np

from linkwise.analysis.result import AnalysisResult
from linkwise.analysis.result_columns import load_unit
from linkwise.analysis.work import Work
from linkwise.runtime.html_tables import page_part, remark, table

HEAD = ("joint", "peak |τ|", "mean |τ|", "most through link", "peak of it", "gave", "took back")


def result_table(result: AnalysisResult) -> str:
    """HTML of a result; peaks, means and work are over all samples of the movement."""
    peaks: dict[tuple[str, int | None, int | None], float] = {}
    means: dict[int | None, float] = {}
    for column, mean, peak in zip(result.columns, result.totals.mean, result.totals.peak, strict=True):
        peaks[column.quantity, column.joint, column.link] = float(peak)
        if column.quantity == "tau":
            means[column.joint] = float(mean)
    rows = []
    for i in result.robot.driven:
        unit = load_unit(result.robot.units[i])
        through = {j: peaks.get(("tau_link", i, j), 0.0) for j in range(len(result.robot.links))}
        most = max(through, key=lambda j: through[j])
        rows.append(
            (
                result.robot.joints[i],
                f"{peaks['tau', i, None]:.4g} {unit}",
                f"{means[i]:.4g} {unit}",
                result.robot.links[most] if through[most] else "",
                f"{through[most]:.4g} {unit}",
                *_work(result.joint_work, i),
            )
        )
    title = f"{result.robot.name}: who loads whom in {result.source}"
    warnings = (*result.warnings, *result.load_warnings)
    return page_part(title, table(HEAD, rows)) + remark(result.provenance, *warnings)


def _work(work: Work, joint: int) -> tuple[str, str]:
    """What a joint gave and took back."""
    return f"{float(np.asarray(work.given)[joint]):.4g} J", f"{float(np.asarray(work.taken)[joint]):.4g} J"
