"""The files of each report, by name."""

from typing import Any

from linkwise.report import measured_text, plots, study_text, terms_text
from linkwise.report.files import json_text
from linkwise.report.readings import readings
from linkwise.report.study import Study
from linkwise.report.terms import TermsReport


def terms_files(result: TermsReport) -> dict[str, bytes]:
    """Files of a terms report: data, table, page and plot."""
    texts = {
        "terms.json": json_text(terms_text.data(result)),
        "terms.csv": terms_text.table(result),
        "terms.md": terms_text.page(result),
    }
    return _encoded(texts) | plots.terms_images(result)


def study_files(result: Study, measured: dict[str, Any] | None = None) -> dict[str, bytes]:
    """Files of a cost-reduction study; what was measured stays in files of its own."""
    texts = {
        "reduction.json": json_text(study_text.data(result)),
        "reduction.csv": study_text.table(result),
        "reduction.md": study_text.page(result, pictures=True),
    }
    images = plots.reduction_images(result)
    images |= plots.readings_images("readings", result.robot, readings(result))
    if measured is not None:
        texts["measured.json"] = json_text(measured)
        texts["measured.md"] = measured_text.page(result, measured, pictures=True)
        lines = readings(result, measured_text.timings_of(measured))
        images |= plots.readings_images("readings-measured", result.robot, lines)
    return _encoded(texts) | images


def _encoded(texts: dict[str, str]) -> dict[str, bytes]:
    return {name: text.encode() for name, text in texts.items()}
