"""STUDY.toml, read and checked before any work begins."""

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import make_dataclass, replace
from pathlib import Path
from typing import Any

from linkwise_runtime.chosen_names import nearest_first

from linkwise.analysis.choices import AnalysisChoices
from linkwise.bounded_file import toml_data
from linkwise.errors import LinkwiseError, within
from linkwise.escape import listed
from linkwise.input_file import require_file
from linkwise.option import chosen, written
from linkwise.package.decode import filled, known_keys, toml_value
from linkwise.robot import Options
from linkwise.robot.readers.toml.table import tables
from linkwise.study.cycles import written_cycles
from linkwise.study.deviations import SD_COLUMNS
from linkwise.study.paths import is_address, require_there, resolved
from linkwise.study.patterns import expanded
from linkwise.study.plan import OF_FILES, SUBJECT, Comparison, Cycles, PaperFigure, StudyPlan, Trial
from linkwise.study.summary import STATISTICS

COLUMNS = (
    *(
        "trial",
        "cycle",
        "percent",
        "start",
        "end",
        "time",
        "column",
        "unit",
        "statistic",
        "subjects",
        "trials",
    ),
    *(f"{over}{name}" for over in ("", "trials_") for name in (*STATISTICS, *SD_COLUMNS)),
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

OWN = ("name", "subject", "log", "robot")
"""Keys of a trial besides factors and choices."""
AnalysisKeys = make_dataclass(
    "AnalysisKeys",
    [(one.key, one.kind, one.default) for one in written(AnalysisChoices) if one.option.is_key],
)
"""Choices of an analysis as a study's file writes them."""


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
    return replace(plan, trials=tuple(_with_nets(trial, plan.nets) for trial in plan.trials))


def _with_nets(trial: Trial, nets: tuple[str, ...]) -> Trial:
    """Return the trial with net torques by cause among what it computes, where the study asks for some."""
    outputs = trial.choices.outputs
    columns = (*(outputs.columns or ("all",)), *nets) if nets else outputs.columns
    return replace(trial, choices=replace(trial.choices, outputs=replace(outputs, columns=columns)))


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
            for path in trial.choices.files:
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


def trials_of(
    data: dict[str, Any], factors: Sequence[str], usual: Mapping[str, Any], folder: Path
) -> Iterator[Trial]:
    """Yield the trials of a study's file; raise LinkwiseError that names an invalid one.

    usual: the choices for all trials, by key
    """
    for number, entry in enumerate(tables(data, "trial"), 1):
        place = f"trial {entry.get('name', number)!r}"
        known = tuple(dict.fromkeys((*OWN, *factors, *usual)))
        with within(place):
            entries = [
                {key: value for key, value in one.items() if key in known or key in entry}
                for one in expanded(entry, folder)
            ]
            several = [
                _trial(place, known_keys("the entry", one, known), factors, usual, folder) for one in entries
            ]
        for trial, keys in several:
            with within(f"trial {trial.name!r}"):
                yield replace(trial, choices=chosen(AnalysisChoices, keys))


def _trial(
    place: str,
    entry: Mapping[str, Any],
    factors: Sequence[str],
    usual: Mapping[str, Any],
    folder: Path,
) -> tuple[Trial, dict[str, Any]]:
    """Return a trial without its choices, and these as they are written."""
    log, robot = given_text(entry, "log"), given_text(entry, "robot")
    labels = [
        (factor, _label(entry, factor, place)) for factor in factors if factor in entry or factor != SUBJECT
    ]
    name = given_text(entry, "name", Path(log).stem)
    if SUBJECT not in entry:
        labels = [(SUBJECT, name), *labels]
    own = {key: value for key, value in entry.items() if key in usual}
    keys = vars(filled(AnalysisKeys, place, own, usual))
    files = {key: _resolved(keys[key], folder) for key in OF_FILES}
    return Trial(name, tuple(labels), resolved(log, folder), _robot(robot, folder)), keys | files


def _resolved(given: tuple[str, ...] | str | None, folder: Path) -> tuple[str, ...] | str | None:
    """Return the paths of a choice from the study's folder on: several, one, or none."""
    if given is None or isinstance(given, str):
        return given and resolved(given, folder)
    return tuple(resolved(path, folder) for path in given)


def _robot(given: str, folder: Path) -> str:
    """Return a built-in robot's name, or the path of a file or package from the study's folder on."""
    there = resolved(given, folder)
    return (
        given if not is_address(given) and not Path(there).exists() and Path(given).name == given else there
    )


def _label(entry: Mapping[str, Any], factor: str, place: str) -> str:
    if factor not in entry:
        raise LinkwiseError(f"needs {factor!r}, one of the study's factors")
    value = entry[factor]
    if isinstance(value, bool) or not isinstance(value, (str, int)):
        raise LinkwiseError(f"{factor!r} is {value!r}; give a text")
    if not (label := str(value).strip()):
        raise LinkwiseError(f"{factor!r} is empty; give a text")
    return label


def given_text(data: Mapping[str, Any], key: str, default: str | None = None) -> str:
    """Return a text of a table; raise LinkwiseError for an empty one, and for none without a default."""
    if key not in data and default is None:
        raise LinkwiseError(f"needs {key!r}")
    value: str = toml_value(str, repr(key), data.get(key, default))
    if not value.strip():
        raise LinkwiseError(f"{key!r} is {value!r}; give a text")
    return value
