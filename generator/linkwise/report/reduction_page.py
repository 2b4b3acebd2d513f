"""The cost-reduction study as data and as a page."""

from typing import Any

from linkwise.render import render
from linkwise.report.curve_fit import CountPolynomial, Saturation
from linkwise.report.recorded_operations import FORM as RECORDED
from linkwise.report.reduction_curve import CurvePoint, Study
from linkwise.report.reduction_verdicts import verdicts
from linkwise.report.term_count import TermPair
from linkwise.report.uncombined_terms import FORM as UNCOMBINED

DIGITS = 6
"""Decimals of a rate: more would be noise in a file that is compared byte for byte."""


def reduction_json(result: Study) -> dict[str, Any]:
    """Return the whole study as JSON values."""
    return {
        "schema": 1,
        "robot": result.robot,
        "form": result.form,
        "query": "terms of tau_1 = sum over links of tau_1j; kept: those that contain qdd_1",
        "points": [point_row(point) for point in result.points],
        "fit": _saturation(result.fitted),
        "paper": _saturation(result.paper),
        "uncombined": {
            "form": UNCOMBINED,
            "points": [pair_row(dof, pair) for dof, pair in zip(result.dof, result.uncombined, strict=False)],
            "fit": _saturation(result.uncombined_fit),
        },
        **({"recorded": _recorded_json(result)} if result.recorded else {}),
        "polynomials": {"total": _polynomial(result.total), "kept": _polynomial(result.kept)},
        "verdicts": [text.replace("**", "") for text in verdicts(result)],
    }


def _recorded_json(result: Study) -> dict[str, Any]:
    pairs = zip(result.dof, result.recorded, strict=True)
    rows = ({k.replace("terms", "operations"): v for k, v in pair_row(*pair).items()} for pair in pairs)
    counted = [
        row | {"nodes": pair.nodes.total, "kept_nodes": pair.nodes.kept}
        for row, pair in zip(rows, result.recorded, strict=True)
    ]
    return {"form": RECORDED, "points": counted}


def point_row(point: CurvePoint) -> dict[str, Any]:
    """Return one point as JSON values; its keys are the table's column names."""
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


def pair_row(dof: int, pair: TermPair) -> dict[str, Any]:
    """Return one point's terms by another convention as JSON values."""
    return {
        "dof": dof,
        "terms": pair.total,
        "kept": pair.kept,
        "reduction": round(pair.reduction, DIGITS),
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


def reduction_markdown(result: Study, pictures: bool = False) -> str:
    """Return the study as Markdown; `pictures` shows the pictures that lie beside it."""
    view = {
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
        "uncombined": UNCOMBINED,
        "pairs": [_pair(dof, pair) for dof, pair in zip(result.dof, result.uncombined, strict=False)],
        "recorded": RECORDED,
        "graphs": [_pair(dof, pair) for dof, pair in zip(result.dof, result.recorded, strict=False)],
        "costs": [_costs(point) for point in result.points],
    }
    return render("report/reduction.md.j2", view)


def _line(point: CurvePoint, result: Study, at: int) -> tuple[str, ...]:
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


def _pair(dof: int, pair: TermPair) -> tuple[str, ...]:
    return (
        str(dof),
        str(pair.total),
        str(pair.kept),
        f"{pair.reduction:.4f}",
        f"{pair.redundant_per_kept:.1f}",
    )


def _costs(point: CurvePoint) -> tuple[str, ...]:
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
