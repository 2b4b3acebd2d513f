"""Files of a study that cover all its trials."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

from linkwise.errors import LinkwiseError
from linkwise.escape import listed
from linkwise.progress import Progress
from linkwise.study.band_figure import figure_files
from linkwise.study.comparisons import compared, left_out_lines
from linkwise.study.folder import GROUPS, MEAN_CURVES, STUDY_PAGE, SUMMARIES, TESTS
from linkwise.study.normalised import normalised, of_several_masses, of_their_robots, told_of_bodies
from linkwise.study.page import study_page
from linkwise.study.plan import StudyPlan
from linkwise.study.plan_checks import check_names
from linkwise.study.spread import columns_of_trials
from linkwise.study.summary import summaries
from linkwise.study.tables import curve_rows, group_rows, parquet, summary_rows
from linkwise.study.tested_rows import rows_of_tests
from linkwise.study.trial import TrialOutcome

SHOWN = 6
"""Names of broken trials that are listed."""


class Together(NamedTuple):
    """Combined results of the trials of a study."""

    files: dict[str, bytes]
    """Contents by name."""
    notes: tuple[str, ...]
    """Lines that a reader of the files must know: what could not be made, who is left out of a test."""
    normalised: dict[str, object]
    """Way in which results are normalised, empty where they are not."""
    is_whole: bool = True
    """False where a test or a figure could not be made."""


def together(
    plan: StudyPlan, folders: Mapping[str, Path], broken: Sequence[TrialOutcome], progress: Progress
) -> Together:
    """Return tables, tests and figures of the trials that exist, and what is to be told of them."""
    own = summaries(plan, folders)
    if not own:
        return Together({}, (), {})
    trials = normalised(plan, own)
    progress("together", 0, 3)
    files = {
        SUMMARIES: parquet(summary_rows(trials)),
        GROUPS: parquet(group_rows(trials)),
    }
    if plan.cycles is not None:
        files[MEAN_CURVES] = parquet(curve_rows(trials, plan.cycles.points))
    progress("together", 1, 3)
    tests, untested = compared(plan.comparisons, trials)
    lacking = [*untested]
    if tests:
        files[TESTS] = parquet(rows_of_tests(tests))
    progress("together", 2, 3)
    used: list[str] = []
    for number, figure in enumerate(plan.figures, 1):
        try:
            check_names(plan, figure, columns_of_trials(trials))
            made = dict(figure_files(figure, trials, tests, number, used))
        except LinkwiseError as error:
            lacking.append(
                f"figure {number}{f', {figure.name},' if figure.name else ''} is not drawn: {error}"
            )
            continue
        files |= made
        used.append(Path(next(iter(made))).stem)
    notes = (
        *lacking,
        *_of_broken(plan, broken),
        *of_several_masses(plan, own),
        *of_their_robots(plan, own),
        *left_out_lines(tests),
    )
    files[STUDY_PAGE] = study_page(plan, trials, folders, tests, broken, notes).encode()
    progress("together", 3, 3)
    return Together(files, notes, told_of_bodies(plan, own), not lacking)


def _of_broken(plan: StudyPlan, broken: Sequence[TrialOutcome]) -> tuple[str, ...]:
    """Return a line on trials without results, as means, tests and figures are of the others alone."""
    if not broken:
        return ()
    names = listed([one.name for one in broken], SHOWN)
    return (f"{len(broken)} of {len(plan.trials)} trials are broken, and part of nothing here: {names}",)
