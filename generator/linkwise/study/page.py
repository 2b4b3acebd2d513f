"""`study.html`: bands of a study's groups, its tests, and links to each trial's own page."""

from collections.abc import Container, Mapping, Sequence
from pathlib import Path
from urllib.parse import quote

import numpy as np

from linkwise.analysis.show.page_curves import encoded, packed, plotly_parts
from linkwise.arrays import Array
from linkwise.escape import printable, script_data
from linkwise.plotstyle import COLOURS, ON_DARK
from linkwise.render import render
from linkwise.study.comparisons import Compared
from linkwise.study.corrections import CORRECTIONS
from linkwise.study.deviation_columns import RANDOM, WHOLE, is_deviation
from linkwise.study.folder import TRIALS
from linkwise.study.ledger import PAGE, TrialRecord
from linkwise.study.plan import StudyPlan
from linkwise.study.spread import columns_of_trials, values_of
from linkwise.study.summary import TrialSummary
from linkwise.study.t_tests import Cluster
from linkwise.study.trial import TrialOutcome

NUMBERS = 3_000_000
"""Most numbers on a page, in float32; columns at the end are left out, and the page says so."""
FIRST = ("tau/", "q/")
"""Beginnings of the names of columns that are shown first."""
TEMPLATE = "study/study.html.j2"


def study_page(
    plan: StudyPlan,
    trials: Sequence[TrialSummary],
    folders: Mapping[str, Path],
    tests: Sequence[Compared],
    broken: Sequence[TrialOutcome],
    notes: Sequence[str],
) -> str:
    """Return the page as HTML; its links are relative to the study's folder.

    notes: lines that a reader of the page must know
    """
    columns, left_out = _columns(trials)
    curves = {name for one in trials for name in one.curves}
    beside = [one for name in columns for one in _beside(curves, name)]
    places = {name: at for at, name in enumerate((*columns, *beside))}
    labels = {trial.name: dict(trial.labels) for trial in plan.trials}
    data = {
        "name": printable(plan.name),
        "factors": list(plan.factors),
        "points": 1 if plan.cycles is None else plan.cycles.points,
        "columns": [
            {
                "name": printable(name),
                "unit": unit,
                "isCurve": name in curves,
                "sd": places.get(f"{WHOLE}{name}", -1),
                "random": places.get(f"{RANDOM}{name}", -1),
            }
            for name, unit in columns.items()
        ],
        "width": len(places),
        "values": encoded(_values(trials, list(places)), "<f4"),
        "trials": [_trial(trial, folders[trial.name]) for trial in trials],
        "broken": [
            {"name": printable(one.name), "labels": labels[one.name], "reason": printable(one.reason)}
            for one in broken
        ],
        "tests": [_test(test) for test in tests],
        "leftOut": left_out,
        "notes": list(map(printable, notes)),
        "told": _told(plan, folders),
        "colours": list(COLOURS),
        "coloursDark": list(ON_DARK),
    }
    return render(TEMPLATE, {"title": plan.name, "data": packed(script_data(data)), **plotly_parts()})


def _columns(trials: Sequence[TrialSummary]) -> tuple[dict[str, str], str]:
    """Return columns by name with their units, torques first, and a note on those left out.

    Deviations stand beside their columns, and take places of these.
    """
    known = {name: unit for name, unit in columns_of_trials(trials).items() if not is_deviation(name)}
    points = max((len(curve) for trial in trials for curve in trial.curves.values()), default=1)
    most = max(1, NUMBERS // (points * len(trials)))
    order = sorted(
        known, key=lambda name: next((k for k, start in enumerate(FIRST) if name.startswith(start)), 2)
    )
    curves = {name for one in trials for name in one.curves}
    wide = np.cumsum([1 + len(_beside(curves, name)) for name in order])
    kept = {name: known[name] for name in order[: max(1, int(np.searchsorted(wide, most, side="right")))]}
    if len(kept) == len(known):
        return kept, ""
    return kept, f"{len(kept)} of {len(known)} quantities are on this page; curves.parquet has all of them."


def _beside(curves: Container[str], name: str) -> list[str]:
    """Return the deviation of a column's curve and its random part, as far as curves have them."""
    return [whole for beside in (WHOLE, RANDOM) if (whole := f"{beside}{name}") in curves]


def _values(trials: Sequence[TrialSummary], names: Sequence[str]) -> Array:
    """Return values (trials, columns, points), NaN where a trial has no such column."""
    by_name = {name: values_of(trials, name) for name in names}
    points = max((len(curve) for some in by_name.values() for curve in some.values()), default=1)
    out = np.full((len(trials), len(names), points), np.nan)
    for at, trial in enumerate(trials):
        for column, name in enumerate(names):
            out[at, column] = by_name[name].get(trial.name, np.nan)
    return out


def _trial(trial: TrialSummary, folder: Path) -> dict[str, object]:
    record = TrialRecord.read(folder)
    return {
        "name": printable(trial.name),
        "labels": {factor: printable(level) for factor, level in trial.labels.items()},
        "page": f"{TRIALS}/{quote(folder.name)}/{PAGE}" if (folder / PAGE).is_file() else "",
        "samples": 0 if record is None else record.samples,
        "cycles": trial.cycles,
        "warnings": 0 if record is None else len(record.warnings),
    }


def _told(plan: StudyPlan, folders: Mapping[str, Path]) -> list[str]:
    """Return lines on how results are normalised, and how cycles of both sides go together."""
    told = []
    if plan.normalise not in ("", "none"):
        told.append(f"{NORMALISED[plan.normalise]}; tables and pages of single trials have N·m, N, W and J.")
    if plan.cycles is not None and plan.cycles.sides:
        records = [record for folder in folders.values() if (record := TrialRecord.read(folder)) is not None]
        turned = sorted({printable(name) for record in records for name in record.turned})
        told.append(
            "Cycles of the left are mirrored: ipsi is the side of the cycle, contra the other, and"
            f" {', '.join(turned) or 'no coordinate'} changed sign."
        )
    return told


NORMALISED = {
    "mass": "Torques, forces, powers and works are by kg of each subject",
    "weight*height": (
        "Torques are in % of body weight times height, forces in % of body weight, powers and works by kg"
    ),
}


def _test(test: Compared) -> dict[str, object]:
    counts = [len(side.each) for side in test.sides]
    return {
        "column": printable(test.column),
        "factor": test.comparison.factor,
        "between": list(map(printable, test.comparison.between)),
        "subjects": counts[:1] if test.comparison.paired else counts,
        "isPaired": test.comparison.paired,
        "alpha": test.comparison.alpha,
        "level": test.level,
        "p": test.adjusted,
        "correction": CORRECTIONS[test.comparison.correct],
        "family": test.family,
        "isCurve": len(test.statistic) > 1,
        "clusters": [_part(test, part) for part in test.clusters],
        "brief": [_part(test, part) for part in test.brief],
        "effect": _effect(test, None),
    }


def _part(test: Compared, part: Cluster) -> dict[str, object]:
    return {"start": part.start, "end": part.end, "p": part.p, "effect": _effect(test, part)}


def _effect(test: Compared, part: Cluster | None) -> list[float | None]:
    """Return Hedges' g with its interval, and where in the cycle in %; None where there is no number."""
    at, effect = test.effect(part)
    numbers = (effect.effect, effect.effect_low, effect.effect_high, at)
    return [number if np.isfinite(number) else None for number in numbers]
