"""Files of a study that cover all its trials."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from linkwise.errors import LinkwiseError
from linkwise.progress import Progress
from linkwise.study.band_figure import band_figures
from linkwise.study.comparisons import Cluster, Compared, compared
from linkwise.study.folder import GROUPS, MEAN_CURVES, STUDY_PAGE, SUMMARIES, TESTS
from linkwise.study.page import study_page
from linkwise.study.plan import StudyPlan
from linkwise.study.summary import summaries
from linkwise.study.tables import curve_rows, group_rows, parquet, summary_rows
from linkwise.study.trial import TrialOutcome


def study_files(
    plan: StudyPlan, folders: Mapping[str, Path], broken: Sequence[TrialOutcome], progress: Progress
) -> tuple[dict[str, bytes], tuple[str, ...]]:
    """Return contents by name, and what could not be made.

    Tables, tests and figures cover the trials that exist.
    """
    trials = summaries(plan, folders)
    if not trials:
        return {}, ()
    progress("together", 0, 3)
    files = {
        SUMMARIES: parquet(summary_rows(trials)),
        GROUPS: parquet(group_rows(trials)),
    }
    if plan.cycles is not None:
        files[MEAN_CURVES] = parquet(curve_rows(trials, plan.cycles.points))
    progress("together", 1, 3)
    tests: list[Compared] = []
    told: list[str] = []
    for comparison in plan.comparisons:
        try:
            made, lacking = compared(comparison, trials)
        except LinkwiseError as error:
            made, lacking = [], (str(error),)
        tests += made
        told += lacking
    if tests:
        files[TESTS] = parquet(_rows(tests))
    progress("together", 2, 3)
    try:
        files |= dict(band_figures(plan.figures, trials, tests))
    except LinkwiseError as error:
        told.append(str(error))
    files[STUDY_PAGE] = study_page(plan, trials, folders, tests, broken).encode()
    progress("together", 3, 3)
    return files, tuple(told)


def _rows(tests: Sequence[Compared]) -> list[dict[str, object]]:
    """Return a row for each part of a cycle that differs, and one for a column without such a part."""
    rows: list[dict[str, object]] = []
    for test in tests:
        a, b = test.comparison.between
        about = {
            "factor": test.comparison.factor,
            "first": a,
            "second": b,
            "column": test.column,
            "unit": test.unit,
            "first_subjects": len(test.sides[0].each),
            "second_subjects": len(test.sides[1].each),
            "alpha": test.comparison.alpha,
            "t": float(test.statistic[np.abs(test.statistic).argmax()]),
            "threshold": test.threshold,
        }
        parts = test.clusters or (Cluster(np.nan, np.nan, test.p),)
        rows += [about | {"start": part.start, "end": part.end, "p": part.p} for part in parts]
    return rows
