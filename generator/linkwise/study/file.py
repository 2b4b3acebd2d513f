"""STUDY.toml, read and checked before any work begins."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import make_dataclass, replace
from pathlib import Path
from typing import Any

from linkwise.analysis.choices import AnalysisChoices
from linkwise.bounded_file import toml_data
from linkwise.errors import LinkwiseError, within
from linkwise.input_file import require_file
from linkwise.option import chosen, written
from linkwise.package.decode import filled, known_keys, toml_value
from linkwise.robot import Options
from linkwise.robot.readers.toml.table import tables
from linkwise.study.deviations import SD_COLUMNS
from linkwise.study.paths import is_address, require_there, resolved
from linkwise.study.patterns import expanded
from linkwise.study.plan import (
    OF_FILES,
    SIDE,
    SIDES,
    SUBJECT,
    Comparison,
    Cycles,
    Normalise,
    PaperFigure,
    StudyPlan,
    Trial,
)
from linkwise.study.plan_checks import check_plan
from linkwise.study.sides import of_either_side
from linkwise.study.subjects import SubjectSize, read_subjects
from linkwise.study.summary import STATISTICS
from linkwise.study.told_keys import by_keys

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
    "normalise",
    "subjects",
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
        folder = path.parent.absolute()  # workers may run in other folders
        cycles = _cycles(data, folder)
        factors = _factors(data.get("factors", []))
        usual = vars(filled(AnalysisKeys, "[analysis]", data.get("analysis", {})))
        trials = tuple(of_sides(trials_of(data, factors, usual, folder), cycles))
        plan = StudyPlan(
            given_text(data, "name", path.stem),
            path,
            _with_side(factors, cycles),
            trials,
            _options(data.get("robot", {}), folder),
            cycles,
            toml_value(tuple[str, ...], "'columns'", data.get("columns", ["**"])),
            tuple(filled(Comparison, "[[compare]]", item) for item in tables(data, "compare")),
            tuple(filled(PaperFigure, "[[figure]]", item) for item in tables(data, "figure")),
            normalise=toml_value(Normalise, "'normalise'", data.get("normalise", "")),
            bodies=_bodies(data, folder),
            pages=toml_value(bool, "'pages'", data.get("pages", True)),
            trust_python=trust_python,
        )
        check_plan(plan)
    return replace(plan, trials=tuple(_with_nets(trial, plan.nets) for trial in plan.trials))


def _with_nets(trial: Trial, nets: tuple[str, ...]) -> Trial:
    """Return the trial with net torques by cause among what it computes, where the study asks for some."""
    outputs = trial.choices.outputs
    if trial.side:
        nets = tuple(dict.fromkeys(map(of_either_side, nets)))
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
    given = data["cycles"]
    if isinstance(given, dict):
        by_side = {key: given[key] for key in ("start", "during") if isinstance(given.get(key), str)}
        usual = {"sides": "apart"} if given.keys() & {"start", "during"} and not by_side else {}
        given = usual | given | {key: {"": what} for key, what in by_side.items() if what}
    cycles = filled(Cycles, "[cycles]", given)
    if not cycles.table:
        return cycles
    table = resolved(cycles.table, folder)
    require_there(table)
    return replace(cycles, table=table)


def _with_side(factors: tuple[str, ...], cycles: Cycles | None) -> tuple[str, ...]:
    if cycles is None or cycles.sides != "apart":
        return factors
    if any(factor.lower() == SIDE for factor in factors):
        raise LinkwiseError(f"the factor {SIDE!r} is made by [cycles], whose sides are apart; leave it out")
    return (*factors, SIDE)


def of_sides(trials: Iterable[Trial], cycles: Cycles | None) -> Iterator[Trial]:
    """Yield the trials, or two of each where cycles are of two sides, in whose names the side stands."""
    for trial in trials:
        if cycles is None or not cycles.sides:
            yield replace(trial, recording=trial.name)
            continue
        for side in SIDES:
            labels = (*trial.labels, *([(SIDE, side)] if cycles.sides == "apart" else []))
            name = f"{trial.name}-{side}"
            yield replace(trial, name=name, labels=labels, side=side, recording=trial.name)


def _bodies(data: Mapping[str, Any], folder: Path) -> dict[str, SubjectSize]:
    if "subjects" not in data:
        return {}
    table = resolved(given_text(data, "subjects"), folder)
    require_there(table)
    return read_subjects(table)


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
            with within(f"trial {trial.name!r}"), by_keys():
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
