"""The files of each report, by name."""

import csv
import io
from collections.abc import Iterable
from typing import Any

from linkwise.escape import json_text
from linkwise.report.plots import reduction_images, savings_images, savings_lines, terms_images
from linkwise.report.reduction_curve import Study
from linkwise.report.reduction_page import point_row, reduction_json, reduction_markdown
from linkwise.report.seconds_page import seconds_markdown, timings_of
from linkwise.report.terms_page import terms_json, terms_markdown, torque_row
from linkwise.report.torque_terms import TermsReport


def terms_files(result: TermsReport) -> dict[str, bytes]:
    """Return the files of a terms report: data, table, page and plot."""
    texts = {
        "terms.json": report_json(terms_json(result)),
        "terms.csv": terms_table(result),
        "terms.md": terms_markdown(result),
    }
    return _encoded(texts) | terms_images(result)


def study_files(result: Study, measured: dict[str, Any] | None = None) -> dict[str, bytes]:
    """Return the files of a cost-reduction study; measured times go into files of their own."""
    texts = {
        "reduction.json": report_json(reduction_json(result)),
        "reduction.csv": reduction_table(result),
        "reduction.md": reduction_markdown(result, pictures=True),
    }
    images = reduction_images(result)
    images |= savings_images("savings", result.robot, savings_lines(result))
    if measured is not None:
        texts["measured.json"] = report_json(measured)
        texts["measured.md"] = seconds_markdown(result, measured, pictures=True)
        lines = savings_lines(result, timings_of(measured))
        images |= savings_images("savings-measured", result.robot, lines)
    return _encoded(texts) | images


def terms_table(report: TermsReport) -> str:
    """Return every count as comma-separated values, one torque in each row."""
    n = range(1, len(report.joints) + 1)
    header = ["joint", "link", "terms", "kept", "reduction", "gravity"]
    header += [f"acceleration_{k}" for k in n] + [f"velocity_{k}" for k in n]
    rows = map(torque_row, report.rows)
    return _csv_text(
        header,
        (
            [t["joint"], t["link"], t["terms"], t["kept"], t["reduction"], t["gravity"]]
            + t["acceleration"]
            + t["velocity"]
            for t in rows
        ),
    )


def reduction_table(result: Study) -> str:
    """Return the points as comma-separated values."""
    rows = [point_row(point) for point in result.points]
    return _csv_text(rows[0], (row.values() for row in rows))


def report_json(data: Any) -> str:
    """Return JSON that is laid out for people."""
    return f"{json_text(data, indent=2)}\n"


def _csv_text(header: Iterable[str], rows: Iterable[Iterable[object]]) -> str:
    """Return comma-separated values; None is an empty cell."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(header)
    writer.writerows(["" if cell is None else cell for cell in row] for row in rows)
    return out.getvalue()


def _encoded(texts: dict[str, str]) -> dict[str, bytes]:
    return {name: text.encode() for name, text in texts.items()}
