"""Check of the columns that a study asks for, against those of a trial before any begins."""

from collections.abc import Collection

from linkwise.analysis.result_rows import Column
from linkwise.errors import LinkwiseError, within
from linkwise.output import passing_folder
from linkwise.study.band_figure import figure_columns
from linkwise.study.comparisons import compared_columns
from linkwise.study.study_plan import StudyPlan
from linkwise.study.trial_files import trial_here
from linkwise.study.trial_table import kept_columns
from linkwise.study.trial_work import prepared_trial


def check_columns(plan: StudyPlan, before: Collection[str]) -> None:
    """Raise LinkwiseError for columns that the first trial whose log can be read does not have.

    before: names of trials that are done. If there are none, and no trial can begin, the study is at fault,
    and the error of the first trial is raised.
    """
    with within(str(plan.file)):
        columns = _columns(plan, before)
        names = [column.name for column in columns]
        if names:
            kept_columns(columns, plan.columns)
            for comparison in plan.comparisons:
                compared_columns(comparison, names)
            for figure in plan.figures:
                figure_columns(figure, names)


def _columns(plan: StudyPlan, before: Collection[str]) -> tuple[Column, ...]:
    """Return the columns of the first trial that can be prepared; faults of others are reported later."""
    reasons: list[LinkwiseError] = []
    for trial in plan.trials:
        if trial.name in before:
            continue
        try:
            with within(f"trial {trial.name!r}"), trial_here(trial) as here, passing_folder() as buffer:
                return prepared_trial(plan, here, buffer).columns
        except LinkwiseError as reason:
            reasons.append(reason)
    if reasons and not before:
        raise reasons[0]
    return ()
