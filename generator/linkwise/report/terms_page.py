"""The terms report as data and as a page."""

from collections.abc import Sequence
from typing import Any

from linkwise.render import render
from linkwise.report.operations import NO_OPERATIONS, LinkOperations, Operations
from linkwise.report.torque_terms import TermsReport, TorqueTerms

DIGITS = 6
"""Decimals of a rate: more would be noise in a file that is compared byte for byte."""


def terms_json(report: TermsReport) -> dict[str, Any]:
    """Return the whole report as JSON values; joints and links count from 1."""
    return {
        "schema": 1,
        "robot": report.robot,
        "form": report.form,
        "kept": report.kept,
        "joints": list(report.joints),
        "links": list(report.links),
        "complete": report.complete,
        "links_counted": report.counted,
        "term_budget": report.budget,
        "torques": [torque_row(row) for row in report.rows],
        "operations": [_operations(cost) for cost in report.operations],
        "operations_of_sums": {
            str(i + 1): {"torque": _pair(torque), "kept": _pair(part)}
            for i, (torque, part) in report.sums.items()
        },
    }


def torque_row(row: TorqueTerms) -> dict[str, Any]:
    """Return one torque as JSON values."""
    return {
        "joint": row.joint + 1,
        "link": "all" if row.link is None else row.link + 1,
        "terms": row.count.total,
        "kept": row.kept,
        "reduction": None if row.reduction is None else round(row.reduction, DIGITS),
        "acceleration": list(row.count.acceleration),
        "velocity": list(row.count.velocity),
        "gravity": row.count.gravity,
    }


def _operations(cost: LinkOperations) -> dict[str, Any]:
    return {
        "link": cost.link + 1,
        "everything": _pair(cost.everything),
        "torque": {str(i + 1): _pair(row.torque) for i, row in cost.rows.items()},
        "kept": {str(i + 1): _pair(row.part) for i, row in cost.rows.items()},
    }


def _pair(cost: Operations | None) -> dict[str, int]:
    cost = cost or NO_OPERATIONS
    return {"before_sharing": cost.written, "after_sharing": cost.shared}


def terms_markdown(report: TermsReport) -> str:
    """Return the report as Markdown."""
    moving = _in_a_term(report)
    view = {
        "robot": report.robot,
        "form": report.form,
        "potential": report.potential,
        "kept": report.kept,
        "progress": progress_line(report),
        "summary": [_summary(row, report.links) for row in report.rows],
        "coordinates": [k + 1 for k in moving],
        "buckets": [
            (
                _name(row),
                row.count.gravity,
                [row.count.acceleration[k] for k in moving],
                [row.count.velocity[k] for k in moving],
            )
            for row in report.rows
        ],
        "operations": _operation_lines(report),
    }
    return render("report/terms.md.j2", view)


def _in_a_term(report: TermsReport) -> list[int]:
    """Return the coordinates whose motion is in some term: in a large robot, many load no counted torque."""
    counts = [row.count for row in report.rows]
    return [k for k in range(len(report.joints)) if any(c.acceleration[k] or c.velocity[k] for c in counts)]


def progress_line(report: TermsReport) -> str:
    """Return a sentence on how far the count got."""
    if report.complete:
        return f"Links counted: all {report.counted} asked for."
    stopped = report.links[report.counted]
    return (
        f"Stopped early: links 1 to {report.counted} of {report.wanted} were counted; link "
        f"{stopped} needs more than the budget of {report.budget} terms. Sums are over the links counted."
    )


def _name(row: TorqueTerms) -> str:
    return f"τ_{row.joint + 1}" + ("" if row.link is None else f",{row.link + 1}")


def _summary(row: TorqueTerms, links: Sequence[str]) -> tuple[str, str, int, int, str]:
    link = "all counted" if row.link is None else links[row.link]
    share = "–" if row.reduction is None else f"{100 * row.reduction:.1f} %"
    return _name(row), link, row.count.total, row.kept, share


def _operation_lines(report: TermsReport) -> list[tuple[str, int, int]]:
    lines: list[tuple[str, Operations | None]] = []
    for cost in report.operations:
        j = cost.link + 1
        lines.append((f"link {j}: everything", cost.everything))
        for i, row in cost.rows.items():
            lines += _whole_and_part(f"τ_{i + 1},{j}", row.torque, row.part)
    for i, (torque, part) in report.sums.items():
        lines += _whole_and_part(f"τ_{i + 1} over all links", torque, part)
    return [(name, pair.written, pair.shared) for name, pair in ((n, c or NO_OPERATIONS) for n, c in lines)]


def _whole_and_part(
    name: str, torque: Operations | None, part: Operations | None
) -> list[tuple[str, Operations | None]]:
    return [(f"{name} as a whole", torque), (f"{name}, the part kept alone", part)]
