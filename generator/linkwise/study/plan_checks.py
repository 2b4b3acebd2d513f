"""Checks of a study as a whole: names, files, levels, and who is compared with whom."""

from collections import Counter
from collections.abc import Collection, Sequence

from linkwise_runtime.chosen_names import nearest_first

from linkwise.errors import LinkwiseError, within
from linkwise.escape import listed
from linkwise.study.band_figure import figure_columns
from linkwise.study.cycles import written_cycles
from linkwise.study.normalised import check_bodies
from linkwise.study.paths import require_there
from linkwise.study.plan import SUBJECT, Comparison, PaperFigure, StudyPlan

NEAR = 4
"""Names that a message shows in place of one that nothing is called."""


def check_plan(plan: StudyPlan) -> None:
    """Raise LinkwiseError for trials of one name, missing files, and levels that no trial has."""
    if not plan.trials:
        raise LinkwiseError("there is no trial; add [[trial]] with a log and a robot")
    counts = Counter(trial.name for trial in plan.trials)
    if twice := [name for name, count in counts.items() if count > 1]:
        raise LinkwiseError(
            f"two trials are called {twice[0]!r}; name each, with fields of its pattern: {{field}}"
        )
    for trial in plan.trials:
        with within(f"trial {trial.name!r}"):
            require_there(trial.log, or_folder=True)
            for path in trial.choices.files:
                require_there(path)
    if plan.cycles is not None and plan.cycles.table:
        _check_table(plan, plan.cycles.table)
    for comparison in plan.comparisons:
        levels = _levels(plan, comparison.factor)
        if odd := [level for level in comparison.between if level not in levels]:
            there = listed(map(repr, sorted(levels)))
            raise LinkwiseError(f"no trial has the {comparison.factor} {odd[0]!r}; there are {there}")
        if not comparison.paired:
            _check_apart(plan, comparison)
    _check_families(plan.comparisons)
    check_bodies(plan)
    for figure in plan.figures:
        if figure.by:
            figure.in_order(sorted(_levels(plan, figure.by)))


def check_names(plan: StudyPlan, figure: PaperFigure, columns: Collection[str]) -> None:
    """Raise LinkwiseError for a key of a figure's `names` that is none of its columns, joints and levels."""
    factor = [figure.by, *sorted(_levels(plan, figure.by))] if figure.by else []
    shown = [*figure_columns(figure, columns), *figure.wholes, *figure.joints, *factor]
    if odd := [key for key in figure.names if key not in shown]:
        near = listed(map(repr, nearest_first(odd[0], shown)[:NEAR]))
        raise LinkwiseError(
            f"[[figure]]: 'names' has {odd[0]!r}, which nothing in it is called; nearest are {near}"
        )


def _check_apart(plan: StudyPlan, comparison: Comparison) -> None:
    """Raise LinkwiseError for subjects at both levels of a comparison that takes them for others."""
    first, second = (
        {trial.label(SUBJECT) for trial in plan.trials if trial.label(comparison.factor) == level}
        for level in comparison.between
    )
    if both := sorted(first & second):
        levels = " and ".join(map(repr, comparison.between))
        raise LinkwiseError(
            f"[[compare]] {comparison.factor}: 'paired' is false, and {levels} have subjects in common,"
            f" {listed(map(repr, both))}, whose values go together; leave 'paired' out"
        )


def _check_families(comparisons: Sequence[Comparison]) -> None:
    """Raise LinkwiseError for comparisons of one family that are not corrected alike."""
    first: dict[str, Comparison] = {}
    for one in comparisons:
        other = first.setdefault(one.family, one)
        if one.family and (one.correct, one.alpha) != (other.correct, other.alpha):
            raise LinkwiseError(
                f"[[compare]]: the family {one.family!r} has 'correct' {other.correct!r} at 'alpha'"
                f" {other.alpha:g}, and {one.correct!r} at {one.alpha:g}; give all its comparisons the same"
            )
        if one.family and one.correct == "none":
            raise LinkwiseError(
                f"[[compare]]: the family {one.family!r} is not corrected; add 'correct', such as \"holm\""
            )


def _check_table(plan: StudyPlan, table: str) -> None:
    names = list(dict.fromkeys(trial.recording for trial in plan.trials))
    for name, _ in written_cycles(table, is_sided=bool(plan.cycles and plan.cycles.sides)):
        if name not in names:
            near = listed(map(repr, nearest_first(name, names)))
            raise LinkwiseError(f"{table}: no trial is called {name!r}; nearest are {near}")


def _levels(plan: StudyPlan, factor: str) -> set[str]:
    if factor not in plan.factors:
        raise LinkwiseError(f"{factor!r} is not a factor; there are {listed(map(repr, plan.factors))}")
    return {trial.label(factor) for trial in plan.trials}
