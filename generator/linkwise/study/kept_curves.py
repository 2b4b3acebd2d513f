"""Columns whose mean curve over the cycle a trial keeps: those of tables, comparisons and figures."""

from collections.abc import Sequence
from pathlib import Path

from linkwise.analysis.column_patterns import matching
from linkwise.study.deviation_columns import RANDOM, WHOLE
from linkwise.study.integrals import PARTS
from linkwise.study.ledger import CURVES, SUMMARY
from linkwise.study.plan import StudyPlan
from linkwise.study.summary import trial_arrays


def kept_curves(plan: StudyPlan, names: Sequence[str]) -> list[int]:
    """Return the numbers of the columns whose curve is kept, with the deviations of these; time is one."""
    figures = (pattern for figure in plan.figures for pattern in (*figure.patterns, *figure.wholes))
    tests = (pattern for comparison in plan.comparisons for pattern in comparison.columns)
    found = {"time"}
    for pattern in dict.fromkeys((*plan.columns, *figures, *tests)):
        found |= matching(names, pattern)
    found |= {f"{beside}{name}" for name in found for beside in (WHOLE, RANDOM)}
    return [at for at, name in enumerate(names) if name in found]


def lacks_curves(plan: StudyPlan, folder: Path) -> bool:
    """Return whether a trial that is done has not kept all curves that the plan asks for now."""
    if plan.cycles is None or not (folder / CURVES).is_file():
        return False
    with trial_arrays(folder / SUMMARY) as summary, trial_arrays(folder / CURVES) as curves:
        every, there = summary["names"].tolist(), set(curves["names"].tolist())
    of_samples = [name for name in every if name.partition("/")[0] not in PARTS]
    return any(of_samples[at] not in there for at in kept_curves(plan, of_samples))
