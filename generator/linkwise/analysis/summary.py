"""The record that stands beside every result."""

from dataclasses import asdict
from typing import Any

from linkwise.analysis.columns import MEANING
from linkwise.analysis.result import Analysis
from linkwise.analysis.settings import record

SCHEMA = 1


def summary(analysis: Analysis) -> dict[str, Any]:
    """Choices, closure, and each column's meaning, unit, mean magnitude and peak."""
    robot, totals = analysis.robot, analysis.totals
    return {
        "schema": SCHEMA,
        "log": analysis.source,
        "robot": {
            "name": robot.name,
            "joints": list(robot.joints),
            "links": list(robot.links),
            "backend": robot.backend,
            "manifest_sha256": robot.manifest_sha256,
        },
        **record(analysis.reading, analysis.processing),
        "rate_hz": analysis.rate,
        "samples": analysis.total,
        "closure": asdict(analysis.closure),
        "ignored_columns": list(analysis.ignored),
        "warnings": list(analysis.warnings),
        "columns": [
            {
                "name": column.name,
                "unit": column.unit,
                "meaning": MEANING[column.quantity],
                "mean_magnitude": float(mean),
                "peak_magnitude": float(peak),
            }
            for column, mean, peak in zip(analysis.columns, totals.mean, totals.peak, strict=True)
        ],
    }


def provenance(analysis: Analysis) -> str:
    """One line that says how the motion was derived."""
    made = analysis.processing
    parts = [
        f"{analysis.total:,} samples at {analysis.rate:.6g} Hz",
        f"{made.derivative} derivative",
    ]
    if made.derivative == "savitzky-golay":
        parts[-1] += f" (window {made.window}, degree {made.degree})"
    parts.append(
        f"zero-phase Butterworth {made.lowpass.cutoff:g} Hz, order 2x{made.lowpass.order},"
        f" {made.lowpass.padding} padding"
        if made.lowpass is not None
        else "no filter"
    )
    parts += [f"{made.edges} edges", f"{made.convention} convention"]
    if analysis.stride > 1:
        parts.append(f"one sample in {analysis.stride} shown")
    return " · ".join(parts)
