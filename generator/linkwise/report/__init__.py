"""Term counts, operation counts and the cost-reduction curve.

A report is first counted (`terms_report`, `study`, `measure`), then written: as JSON values (`terms_json`,
…), as a page (`terms_markdown`, …), or as all files that go into a directory (`terms_files`,
`study_files`).
"""

from linkwise.report.curve_fit import CountPolynomial, Saturation, count_polynomial, fit, held_against
from linkwise.report.derivation_seconds import DerivationTime, measure_derivations
from linkwise.report.expanded_torques import LinkTorques, link_torques
from linkwise.report.operations import LinkOperations, Operations, link_operations
from linkwise.report.plots import SavingsLine, draw_savings, reduction_images, savings_lines, terms_images
from linkwise.report.reduction_curve import PAPER, CurvePoint, Study, curve, study
from linkwise.report.reduction_page import reduction_json, reduction_markdown
from linkwise.report.reduction_verdicts import verdicts
from linkwise.report.report_files import report_json, study_files, terms_files
from linkwise.report.seconds import Timing, measure
from linkwise.report.seconds_page import read_seconds, seconds_json, seconds_markdown
from linkwise.report.term_count import RunningCount, TermCount, TermQuery, count_terms, position
from linkwise.report.terms_page import progress_line, terms_json, terms_markdown
from linkwise.report.torque_terms import TermsReport, TorqueTerms, terms_report

__all__ = [
    "PAPER",
    "CountPolynomial",
    "CurvePoint",
    "DerivationTime",
    "LinkOperations",
    "LinkTorques",
    "Operations",
    "RunningCount",
    "Saturation",
    "SavingsLine",
    "Study",
    "TermCount",
    "TermQuery",
    "TermsReport",
    "Timing",
    "TorqueTerms",
    "count_polynomial",
    "count_terms",
    "curve",
    "draw_savings",
    "fit",
    "held_against",
    "link_operations",
    "link_torques",
    "measure",
    "measure_derivations",
    "position",
    "progress_line",
    "read_seconds",
    "reduction_images",
    "reduction_json",
    "reduction_markdown",
    "report_json",
    "savings_lines",
    "seconds_json",
    "seconds_markdown",
    "study",
    "study_files",
    "terms_files",
    "terms_images",
    "terms_json",
    "terms_markdown",
    "terms_report",
    "verdicts",
]
