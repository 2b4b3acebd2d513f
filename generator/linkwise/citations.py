"""References for what a result was made by, as BibTeX: only for methods that this result used."""

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from linkwise_runtime.version import VERSION

from linkwise.errors import LinkwiseError
from linkwise.escape import one_line
from linkwise.extras import extra
from linkwise.input_file import is_file
from linkwise.package.decode import parse_json, require

YEAR = "2026"
AUTHORS = "{The linkwise developers}"
"""Authors of linkwise, as BibTeX lists them; `make identity` writes them."""


@dataclass(frozen=True)
class Citation:
    """A reference, as BibTeX has it, and why a result has it."""

    key: str
    kind: str
    fields: Mapping[str, str]
    why: str = field(default="", compare=False)

    @property
    def bibtex(self) -> str:
        """The entry, with why it stands here above it."""
        lines = [f"% {self.why}", f"@{self.kind}{{{self.key},"]
        lines += [f"  {name} = {{{text}}}," for name, text in self.fields.items()]
        return "\n".join([*lines, "}"])


def _article(key: str, author: str, title: str, journal: str, year: str, **more: str) -> Citation:
    return Citation(
        key, "article", {"author": author, "title": title, "journal": journal, "year": year} | more
    )


SOFTWARE = Citation(
    "linkwise",
    "software",
    {
        "author": AUTHORS,
        "title": "linkwise: which joint's movement loads which joint, through which link",
        "version": VERSION,
        "year": YEAR,
    },
)
PARTIAL_LAGRANGIAN = _article(
    "gunji2025",
    "Gunji, Hironori and Kusaka, Takashi and Tanaka, Takayuki",
    "A Motion Propagation Force Analysis of Multi-DoF Systems Using the Partial Lagrangian Method",
    "Robotics",
    "2025",
    volume="14",
    number="5",
    pages="54",
    doi="10.3390/robotics14050054",
)
OPENSIM = _article(
    "seth2018",
    "Seth, Ajay and Hicks, Jennifer L. and Uchida, Thomas K. and Habib, Ayman and Dembia, Christopher L. and"
    " Dunne, James J. and Ong, Carmichael F. and DeMers, Matthew S. and Rajagopal, Apoorva and Millard,"
    " Matthew and Hamner, Samuel R. and Arnold, Edith M. and Yong, Jennifer R. and Lakshmikanth, Shrinidhi K."
    " and Sherman, Michael A. and Ku, Joy P. and Delp, Scott L.",
    "OpenSim: Simulating musculoskeletal dynamics and neuromuscular control to study human and animal"
    " movement",
    "PLoS Computational Biology",
    "2018",
    volume="14",
    number="7",
    pages="e1006223",
    doi="10.1371/journal.pcbi.1006223",
)
RESIDUALS = _article(
    "hicks2015",
    "Hicks, Jennifer L. and Uchida, Thomas K. and Seth, Ajay and Rajagopal, Apoorva and Delp, Scott L.",
    "Is My Model Good Enough? Best Practices for Verification and Validation of Musculoskeletal Models and"
    " Simulations of Movement",
    "Journal of Biomechanical Engineering",
    "2015",
    volume="137",
    number="2",
    pages="020905",
    doi="10.1115/1.4029304",
)
POLYNOMIALS = _article(
    "savitzky1964",
    "Savitzky, Abraham and Golay, Marcel J. E.",
    "Smoothing and Differentiation of Data by Simplified Least Squares Procedures",
    "Analytical Chemistry",
    "1964",
    volume="36",
    number="8",
    pages="1627--1639",
    doi="10.1021/ac60214a047",
)
SEGMENTS = Citation(
    "zatsiorsky2002",
    "book",
    {
        "author": "Zatsiorsky, Vladimir M.",
        "title": "Kinetics of Human Motion",
        "publisher": "Human Kinetics",
        "year": "2002",
    },
)
PRODUCTS = _article(
    "goodman1960",
    "Goodman, Leo A.",
    "On the Exact Variance of Products",
    "Journal of the American Statistical Association",
    "1960",
    volume="55",
    number="292",
    pages="708--713",
    doi="10.1080/01621459.1960.10483369",
)
DIFFERENCES = _article(
    "norgaard2000",
    "N{\\o}rgaard, Magnus and Poulsen, Niels K. and Ravn, Ole",
    "New Developments in State Estimation for Nonlinear Systems",
    "Automatica",
    "2000",
    volume="36",
    number="11",
    pages="1627--1638",
    doi="10.1016/S0005-1098(00)00089-3",
)
CURVES = _article(
    "pataky2012",
    "Pataky, Todd C.",
    "One-dimensional statistical parametric mapping in Python",
    "Computer Methods in Biomechanics and Biomedical Engineering",
    "2012",
    volume="15",
    number="3",
    pages="295--301",
    doi="10.1080/10255842.2010.527837",
)
EFFECTS = _article(
    "hedges1981",
    "Hedges, Larry V.",
    "Distribution Theory for Glass's Estimator of Effect Size and Related Estimators",
    "Journal of Educational Statistics",
    "1981",
    volume="6",
    number="2",
    pages="107--128",
    doi="10.3102/10769986006002107",
)
HOLM = _article(
    "holm1979",
    "Holm, Sture",
    "A Simple Sequentially Rejective Multiple Test Procedure",
    "Scandinavian Journal of Statistics",
    "1979",
    volume="6",
    number="2",
    pages="65--70",
)
FALSE_DISCOVERIES = _article(
    "benjamini1995",
    "Benjamini, Yoav and Hochberg, Yosef",
    "Controlling the False Discovery Rate: A Practical and Powerful Approach to Multiple Testing",
    "Journal of the Royal Statistical Society: Series B",
    "1995",
    volume="57",
    number="1",
    pages="289--300",
    doi="10.1111/j.2517-6161.1995.tb02031.x",
)


RECORDS = ("analysis.json", "study.json", "manifest.json")
"""Records of results, one of which a folder has."""
OF_PRODUCT = re.compile(r"sd(-\w+)*/(tau_qdd|tau_qd|power\w*)/")
"""Columns of deviations of products: a share times its cause's motion, and a torque times a velocity."""
SUMMARY = "summary.parquet"
"""A study's table with a row for each trial and column."""
IDENTIFIED = "identified.json"
"""Record of an identification."""


def record_of(result: Path) -> tuple[Path, dict[str, Any]]:
    """Return the path of a result's record and its content; of a study, rows of its tables as well.

    These are `tests`, and `columns` of its summary.

    result: the folder that `analyze`, `study` or `generate` wrote, or the record in it

    Raises LinkwiseError for what has or is no such record, and for a damaged one.
    """
    path = _record_at(result)
    try:
        record = parse_json(path.read_text(encoding="utf-8"))
        require(isinstance(record, dict), "", "an object", record)
        if path.name == "study.json":
            tables = {"tests": path.with_name("tests.parquet"), "columns": path.with_name(SUMMARY)}
            record |= {name: _rows(table) for name, table in tables.items()}
        list(citations(record))
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        raise LinkwiseError(f"{path}: is damaged: {one_line(repr(error), 200)}") from error
    return path, record


def _rows(table: Path) -> list[dict[str, Any]]:
    """Return the rows of a study's table; none where it was not asked for."""
    return extra("pyarrow.parquet").read_table(table).to_pylist() if is_file(table) else []


def _record_at(result: Path) -> Path:
    """Return the path of a result's record; raises LinkwiseError where there is none."""
    remedy = "give a folder that analyze, study or generate wrote, or the record in it"
    places = [result] if result.name in RECORDS else []
    for place in (*places, *(result / name for name in RECORDS)):
        if is_file(place):
            return place
    lacks = f"{'is' if is_file(result) else 'holds'} none of {', '.join(RECORDS)}"
    if is_file(result / IDENTIFIED) or (is_file(result) and result.name == IDENTIFIED):
        lacks = "identify wrote this, and cite knows the methods of analyses, studies and packages alone"
    raise LinkwiseError(f"{result}: {lacks if result.exists() else 'no such file or folder'}; {remedy}")


def citations(record: Mapping[str, Any]) -> Iterator[Citation]:
    """Yield what a result owes to others, by its record: of an analysis, a study or a package."""
    yield _because(SOFTWARE, "the program")
    yield _because(PARTIAL_LAGRANGIAN, "torques by link and by cause: the method")
    methods = record.get("methods") or {}
    derivatives = methods.get("derivatives", [_inside(record, "processing", "derivative")])
    if "savitzky-golay" in derivatives:
        yield _because(POLYNOMIALS, "derivatives of the motion")
    used = [
        word
        for word, of_analysis, of_study in (
            ("inverse kinematics", "markers", "markers"),
            ("paths of muscles", "left_by_muscles", "muscles"),
        )
        if record.get(of_analysis) or methods.get(of_study)
    ]
    if used:
        yield _because(OPENSIM, f"{' and '.join(used)} by OpenSim")
    if _inside(record, "residuals", "of") and _inside(record, "residuals", "largest_net_external_force_N"):
        yield _because(RESIDUALS, "limits that residuals are held against")
    for uncertain in _uncertain(record):
        if uncertain.get("presets"):
            yield _because(SEGMENTS, "how uncertain segments of a person are")
        if uncertain.get("motion"):
            yield _because(DIFFERENCES, "deviations by noise of the motion")
        if uncertain.get("motion") and any(map(OF_PRODUCT.match, _columns(record))):
            yield _because(PRODUCTS, "deviations of shares and powers by noise of the motion")
    tests = record.get("tests") or []
    if any(test["threshold"] == test["threshold"] for test in tests):  # a test of means has none: NaN
        yield _because(CURVES, "tests of whole curves")
    if tests:
        yield _because(EFFECTS, "effect sizes")
    corrections = {test["correction"] for test in tests}
    for name, one in (("holm", HOLM), ("fdr-bh", FALSE_DISCOVERIES)):
        if name in corrections:
            yield _because(one, f"p corrected for several columns, {name}")


def _columns(record: Mapping[str, Any]) -> Iterator[str]:
    """Yield the names of an analysis's or a study's columns."""
    yield from (row.get("name") or row["column"] for row in record.get("columns") or [])


def _uncertain(record: Mapping[str, Any]) -> Iterator[Mapping[str, Any]]:
    """Yield all that was assumed uncertain, of a study once for each group of trials."""
    told = record.get("uncertain") or {}
    yield from told.get("assumed", [told])


def _inside(record: Mapping[str, Any], key: str, entry: str) -> Any:
    return (record.get(key) or {}).get(entry)


def _because(citation: Citation, why: str) -> Citation:
    return replace(citation, why=why)
