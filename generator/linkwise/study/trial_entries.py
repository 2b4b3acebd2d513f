"""Trials of a study's file: each with its labels, files and the choices for it alone."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import make_dataclass, replace
from pathlib import Path
from typing import Any

from linkwise.analysis.analysis_choices import AnalysisChoices
from linkwise.errors import LinkwiseError, within
from linkwise.option import chosen, written
from linkwise.package.decode import filled, known_keys, toml_value
from linkwise.robot.readers.toml_table import tables
from linkwise.study.study_paths import is_address, resolved
from linkwise.study.study_plan import OF_FILES, SUBJECT, Trial
from linkwise.study.trial_patterns import expanded

OWN = ("name", "subject", "log", "robot")
"""Keys of a trial besides factors and choices."""
AnalysisKeys = make_dataclass(
    "AnalysisKeys",
    [(one.key, one.kind, one.default) for one in written(AnalysisChoices) if one.option.is_key],
)
"""Choices of an analysis as a study's file writes them."""


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
    files = {key: tuple(resolved(path, folder) for path in keys[key]) for key in OF_FILES}
    return Trial(name, tuple(labels), resolved(log, folder), _robot(robot, folder)), keys | files


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
