"""The cost-reduction study as data, as a table and as a page."""

from typing import Any

from linkwise.emit.render import render
from linkwise.report.files import csv_text
from linkwise.report.fit import Saturation
from linkwise.report.polynomial import CountPolynomial
from linkwise.report.reduction import Point
from linkwise.report.study import Study, verdicts

DIGITS = 6
"""Decimals of a rate: more would be noise in a file that is compared byte for byte."""


def data(result: Study) -> dict[str, Any]:
    """Return the whole study as JSON values."""
    return {
        "schema": 1,
        "robot": result.robot,
        "form": result.form,
        "question": "terms of tau_1 = sum over links of tau_1j; kept: those that contain qdd_1",
        "points": [_point(point) for point in result.points],
        "fit": _saturation(result.fitted),
        "paper": _saturation(result.paper),
        "polynomials": {"total": _polynomial(result.total), "kept": _polynomial(result.kept)},
        "verdicts": [text.replace("**", "") for text in verdicts(result)],
    }


def _point(point: Point) -> dict[str, Any]:
    return {
        "dof": point.dof,
        "terms": point.total,
        "kept": point.kept,
        "reduction": round(point.reduction, DIGITS),
        "operations": point.torque.shared,
        "operations_written_out": point.torque.written,
        "kept_operations": point.part.shared,
        "kept_operations_written_out": point.part.written,
        "operations_reduction": round(point.operations_reduction, DIGITS),
        "written_out_reduction": round(point.written_reduction, DIGITS),
        "decomposition_operations": point.everything.shared,
    }


def _saturation(curve: Saturation | None) -> dict[str, Any] | None:
    if curve is None:
        return None
    return {
        "A": round(curve.a, DIGITS),
        "lambda": round(curve.rate, DIGITS),
        "rmse": round(curve.rmse, DIGITS),
        "residuals": [round(r, DIGITS) for r in curve.residuals],
    }


def _polynomial(found: CountPolynomial | None) -> dict[str, Any] | None:
    if found is None:
        return None
    return {
        "newton_coefficients": list(found.coefficients),
        "fitted_to_dof": found.fitted,
        "checked_to_dof": found.checked,
    }


def table(result: Study) -> str:
    """Return the points as comma-separated values."""
    rows = [_point(point) for point in result.points]
    return csv_text(rows[0], (row.values() for row in rows))


def page(result: Study, pictures: bool = False) -> str:
    """Return the study as Markdown; with pictures where they lie beside it."""
    return render("report/reduction.md.j2", view(result, pictures))


def view(result: Study, pictures: bool) -> dict[str, Any]:
    """Fields of the page's template."""
    return {
        "pictures": pictures,
        "robot": result.robot,
        "form": result.form,
        "dof": f"{result.dof[0]}..{result.dof[-1]}",
        "verdicts": list(verdicts(result)),
        "points": [_line(point, result, at) for at, point in enumerate(result.points)],
        "polynomials": [
            (name, str(p), p.fitted, p.checked)
            for name, p in (("total", result.total), ("kept", result.kept))
            if p is not None
        ],
        "costs": [_costs(point) for point in result.points],
    }


def _line(point: Point, result: Study, at: int) -> tuple[str, ...]:
    fitted = "–" if result.fitted is None else f"{result.fitted.residuals[at]:+.4f}"
    return (
        str(point.dof),
        str(point.total),
        str(point.kept),
        f"{point.reduction:.4f}",
        f"{point.redundant_per_kept:.1f}",
        fitted,
        f"{result.paper.residuals[at]:+.4f}",
    )


def _costs(point: Point) -> tuple[str, ...]:
    return (
        str(point.dof),
        str(point.torque.shared),
        str(point.part.shared),
        f"{point.operations_reduction:.4f}",
        str(point.torque.written),
        str(point.part.written),
        f"{point.written_reduction:.4f}",
        str(point.everything.shared),
    )
