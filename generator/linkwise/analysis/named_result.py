"""A result as xarray's Dataset, each quantity with names along its axes, and as the table of a notebook."""

from collections.abc import Iterator
from typing import Any

import numpy as np
from linkwise_runtime.html_tables import page_part, remark, table
from linkwise_runtime.named_arrays import Part, dataset
from linkwise_runtime.version import VERSION

from linkwise.analysis.joint_causes import are_motions_whole, causes_of, sizes
from linkwise.analysis.result import AnalysisResult
from linkwise.analysis.result_quantities import QUANTITIES, WORKS
from linkwise.analysis.result_rows import load_unit
from linkwise.analysis.work import Work
from linkwise.extras import extra
from linkwise.package.load import Array


def named_result(result: AnalysisResult) -> Any:
    """Return the Dataset of `Analysis.to_xarray`."""
    extra("xarray")
    arrays = {one.array.name for name, one in QUANTITIES.items() if name in result.rows and name != "time"}
    parts: list[Part] = [
        (one.array, _values(result, name)) for name, one in QUANTITIES.items() if one.array.name in arrays
    ]
    about = {
        "robot": result.robot.name,
        "log": result.source,
        "backend": result.robot.backend,
        "convention": result.processing.convention,
        "rate_hz": result.rate,
        "provenance": result.provenance,
        "linkwise": VERSION,
    }
    found = dataset(parts, result.rows.axes, ["time"], {"time": ("time", result.time, {"units": "s"})}, about)
    return found.merge(dataset(list(_works(result)), result.rows.axes, [], {}, {}))


def _works(result: AnalysisResult) -> Iterator[Part]:
    """Yield the work that was given and the work that was taken back, over the whole movement."""
    of = {"work": result.work, "joint_work": result.joint_work}
    of |= {"load_work": result.load_work} if result.loads else {}
    of |= {"contact_work": result.contact_work} if result.robot.contacts is not None else {}
    for name, work in of.items():
        for way, values in (("given", work.given), ("taken", work.taken)):
            yield WORKS[name]._replace(beside=("way", way)), values


def _values(result: AnalysisResult, name: str) -> Array:
    """Return a quantity as one array, zeros where it has no row, NaN for components that a point lacks."""
    out = result.dense(name)
    if "point" in QUANTITIES[name].axes:
        components = result.rows.axes["component"].names
        for number, point in enumerate(result.rows.points):
            out[:, number, [at for at, row in enumerate(components) if row not in point.rows]] = np.nan
    return out


HEAD = ("joint", "peak |τ|", "mean |τ|", "largest cause", "its share", "gave", "took back")


def result_table(result: AnalysisResult) -> str:
    """Return the HTML of a result; peaks, means, shares and work are over all samples of the movement.

    Causes and shares are those of `--figure shares`.
    """
    joints, torques = result.robot.joints, result.rows["tau"].rows
    mean, peak = result.totals.mean[torques], result.totals.peak[torques]
    causes = causes_of(result, joints, together=are_motions_whole(result))
    rows = []
    for at, (i, loading) in enumerate(zip(result.robot.driven, sizes(result, causes).T, strict=True)):
        unit = load_unit(result.robot.units[i])
        most, whole = int(loading.argmax()), float(loading.sum())
        rows.append(
            (
                joints[i],
                f"{peak[at]:.4g} {unit}",
                f"{mean[at]:.4g} {unit}",
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
