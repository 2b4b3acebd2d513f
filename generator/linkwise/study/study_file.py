"""STUDY.toml, read and checked before any work begins."""

from collections import Counter
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from linkwise_runtime.chosen_names import nearest_first

from linkwise.errors import LinkwiseError, within
from linkwise.escape import listed
from linkwise.input_file import require_file
from linkwise.package.decode import filled, known_keys, toml_value
from linkwise.robot import Options
from linkwise.robot.readers.toml_table import tables, toml_data
from linkwise.study.cycles import written_cycles
from linkwise.study.running_moments import STATISTICS
from linkwise.study.study_paths import require_there, resolved
from linkwise.study.study_plan import SUBJECT, Comparison, Cycles, PaperFigure, StudyPlan
from linkwise.study.trial_entries import OWN, AnalysisKeys, given_text, trials_of

COLUMNS = (
    *("trial", "cycle", "percent", "time", "column", "unit", "statistic", "subjects", "trials"),
    *(f"{over}{name}" for over in ("", "trials_") for name in STATISTICS),
)
"""Names of columns of tables, besides the factors."""
TOP = [
    "schema",
    "name",
    "factors",
    "analysis",
    "robot",
    "cycles",
    "columns",
    "pages",
    "compare",
    "figure",
    "trial",
]


def read_study(path: Path, trust_python: bool = False) -> StudyPlan:
    """Read a study; raise LinkwiseError, in one line with the file, for an invalid one.

    trust_python: whether robots that are Python files are run, once they are needed
    """
    with within(str(path)):
        require_file(path)
        data = known_keys("the file", toml_data(path), TOP)
        factors = _factors(data.get("factors", []))
        usual = vars(filled(AnalysisKeys, "[analysis]", data.get("analysis", {})))
        folder = path.parent.absolute()  # workers may run in other folders
        trials = tuple(trials_of(data, factors, usual, folder))
        plan = StudyPlan(
            given_text(data, "name", path.stem),
            path,
            factors,
            trials,
            _options(data.get("robot", {}), folder),
            _cycles(data, folder),
            toml_value(tuple[str, ...], "'columns'", data.get("columns", ["**"])),
            tuple(filled(Comparison, "[[compare]]", item) for item in tables(data, "compare")),
            tuple(filled(PaperFigure, "[[figure]]", item) for item in tables(data, "figure")),
            pages=toml_value(bool, "'pages'", data.get("pages", True)),
            trust_python=trust_python,
        )
        _check(plan)
    return plan


def _factors(given: Any) -> tuple[str, ...]:
    if not isinstance(given, list) or not all(
        isinstance(name, str) and name.isidentifier() for name in given
    ):
        raise LinkwiseError(
            f"'factors' is {given!r}; give names such as \"condition\", letters, digits and _"
        )
    taken = {name for name in (*OWN, *vars(AnalysisKeys()), *COLUMNS) if name != SUBJECT}
    lower = [name.lower() for name in given]  # DuckDB ignores the case of columns
    for name in given:
        is_another = name.lower() == SUBJECT and name != SUBJECT
        if name.lower() in taken or is_another or lower.count(name.lower()) > 1:
            raise LinkwiseError(f"factor {name!r} has a name that is taken; call it otherwise")
    return (SUBJECT, *(name for name in given if name != SUBJECT))


def _options(data: Any, folder: Path) -> Options:
    options = filled(Options, "[robot]", data)
    if options.parameters != "numeric":
        raise LinkwiseError("[robot]: 'parameters' are numbers in a study; leave it out")
    if options.constraints is None:
        return options
    return replace(options, constraints=resolved(options.constraints, folder))


def _cycles(data: Mapping[str, Any], folder: Path) -> Cycles | None:
    if "cycles" not in data:
        return None
    cycles = filled(Cycles, "[cycles]", data["cycles"])
    if not cycles.table:
        return cycles
    table = resolved(cycles.table, folder)
    require_there(table)
    return replace(cycles, table=table)


def _check(plan: StudyPlan) -> None:
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
            for path in (*trial.choices.loads, *trial.choices.contact_loads):
                require_there(path)
    if plan.cycles is not None and plan.cycles.table:
        _check_table(plan, plan.cycles.table)
    for comparison in plan.comparisons:
        levels = _levels(plan, comparison.factor)
        if odd := [level for level in comparison.between if level not in levels]:
            there = listed(map(repr, sorted(levels)))
            raise LinkwiseError(f"no trial has the {comparison.factor} {odd[0]!r}; there are {there}")
    for figure in plan.figures:
        if figure.by:
            _levels(plan, figure.by)


def _check_table(plan: StudyPlan, table: str) -> None:
    names = [trial.name for trial in plan.trials]
    for name in written_cycles(table):
        if name not in names:
            near = listed(map(repr, nearest_first(name, names)))
            raise LinkwiseError(f"{table}: no trial is called {name!r}; nearest are {near}")


def _levels(plan: StudyPlan, factor: str) -> set[str]:
    if factor not in plan.factors:
        raise LinkwiseError(f"{factor!r} is not a factor; there are {listed(map(repr, plan.factors))}")
    return {trial.label(factor) for trial in plan.trials}
