"""`run_study`: from a study's file to a folder of trials and their combined results.

The columns that the study asks for are checked against those of a trial before any begins.
"""

import json
from collections.abc import Collection, Generator, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass, replace
from hashlib import sha256
from pathlib import Path
from typing import Protocol

from linkwise.analysis.markers import SUFFIXES
from linkwise.analysis.result_rows import Column
from linkwise.errors import LinkwiseError, within
from linkwise.generator_fingerprint import fingerprint
from linkwise.output import passing_folder, require_writable, write_files
from linkwise.progress import Progress, silent
from linkwise.study.band_figure import figure_columns
from linkwise.study.comparisons import compared_columns
from linkwise.study.deviations import assumptions
from linkwise.study.file import read_study
from linkwise.study.folder import StudyMark, held_study, refuse_unless_study, sweep_trials, trial_folders
from linkwise.study.inputs import trial_here
from linkwise.study.integrals import integral_columns
from linkwise.study.kept_curves import lacks_curves
from linkwise.study.ledger import MARK, TrialRecord, cut_by, done_before, is_trial
from linkwise.study.paths import removed
from linkwise.study.plan import StudyPlan
from linkwise.study.process_pool import ProcessPool
from linkwise.study.results import together
from linkwise.study.robots import check_robots
from linkwise.study.sides import SidedColumns
from linkwise.study.tables import kept_columns
from linkwise.study.told_keys import by_keys
from linkwise.study.trial import TrialOutcome, TrialTask, prepared_trial


class Engine(Protocol):
    """Interface of an engine that runs trials, in any order."""

    def outcomes(self, tasks: Sequence[TrialTask]) -> Generator[TrialOutcome]:
        """Yield the outcomes of all tasks as they come; if closed before the end, drop the rest."""


@dataclass(frozen=True)
class StudyOutcome:
    """Outcome of a study."""

    plan: StudyPlan
    done: tuple[str, ...]
    """Names of the trials that have results."""
    fresh: int
    """Number of trials that were run now."""
    samples: int
    broken: tuple[TrialOutcome, ...]
    warnings: tuple[str, ...]
    files: tuple[Path, ...]


def run_study(
    file: str | Path,
    out: str | Path,
    engine: Engine | None = None,
    progress: Progress = silent,
    trust_python: bool = False,
) -> StudyOutcome:
    """Run the trials of a study that are not done yet, and write the combined results of all.

    file: its TOML; out: its folder; engine: a `ProcessPool` with all cores if not given
    trust_python: run robots that are Python files of this machine, which are refused otherwise
    Raises LinkwiseError, before any trial begins, for an invalid file, robot or folder.
    """
    plan, out = read_study(Path(file), trust_python), Path(out)
    refuse_unless_study(out, plan)
    require_writable(out)
    out = out.absolute()  # workers may run in other folders
    warnings = check_robots(plan, progress)
    folders = trial_folders(out, plan)
    done = done_before(plan, folders)
    before = {name: record for name, record in done.items() if not lacks_curves(plan, folders[name])}
    check_columns(plan, before)
    with held_study(out):
        return _done(plan, out, before, engine or ProcessPool(), progress, warnings)


def _done(
    plan: StudyPlan,
    out: Path,
    before: Mapping[str, TrialRecord],
    engine: Engine,
    progress: Progress,
    warnings: tuple[str, ...],
) -> StudyOutcome:
    folders, former = trial_folders(out, plan), StudyMark.read(out)
    if len(before) < len(plan.trials):
        write_files(out, {MARK: StudyMark.begun(plan, former.files if former else ()).text()})
    sweep_trials(out, folders)
    tasks = [
        TrialTask(replace(plan, trials=(trial,)), folders[trial.name])
        for trial in plan.trials
        if trial.name not in before
    ]
    outcomes: list[TrialOutcome] = []
    progress("trials", len(before), len(plan.trials))
    with closing(engine.outcomes(tasks)) as coming:
        for outcome in coming:
            outcomes.append(outcome)
            if outcome.reason and is_trial(folders[outcome.name]):
                removed(folders[outcome.name])  # its results are of other inputs
            progress("trials", len(before) + len(outcomes), len(plan.trials))
    broken = tuple(sorted((one for one in outcomes if one.reason), key=lambda one: one.name))
    failed = {one.name for one in broken}
    done = tuple(trial.name for trial in plan.trials if trial.name not in failed)
    records = [record for name in done if (record := TrialRecord.read(folders[name])) is not None]
    key = _key(plan, records, broken)
    there = former.files_in(out) if former else ()
    if (
        former
        and former.key == key
        and len(outcomes) == len(broken)
        and all(file.is_file() for file in there)
    ):
        if outcomes:
            write_files(out, {MARK: former.text()})
        return StudyOutcome(plan, done, 0, 0, broken, (*warnings, *former.notes), there)
    made = together(plan, {name: folders[name] for name in done}, broken, progress)
    # What is missing, such as a library, may be there next time: it is tried again each time.
    entries = {
        "uncertain": assumptions(records),
        "notes": made.notes,
        "normalised": made.normalised,
        "cycles": cut_by(plan, records),
        "methods": methods_of(plan),
    }
    mark = StudyMark.done(plan, broken, key if made.is_whole else "", list(made.files), entries)
    files = write_files(out, {**made.files, MARK: mark.text()})
    for file in set(there) - set(files):
        file.unlink(missing_ok=True)
    samples, told = sum(one.samples for one in outcomes), (*warnings, *made.notes)
    return StudyOutcome(plan, done, len(outcomes) - len(broken), samples, broken, told, files)


def methods_of(plan: StudyPlan) -> dict[str, object]:
    """Return how trials were analysed, as far as others are to be named for it."""
    choices = [trial.choices for trial in plan.trials]
    return {
        "derivatives": sorted({one.processing.derivative for one in choices}),
        "markers": any(Path(trial.log).suffix.lower() in SUFFIXES for trial in plan.trials),
        "muscles": any(one.muscles is not None for one in choices),
    }


def _key(plan: StudyPlan, records: Sequence[TrialRecord], broken: Sequence[TrialOutcome]) -> str:
    """Return the hash of all that tables, tests, figures and the page depend on."""
    keys = [record.key for record in records]
    return sha256(json.dumps([repr(plan), keys, repr(broken), fingerprint()]).encode()).hexdigest()


def check_columns(plan: StudyPlan, before: Collection[str]) -> None:
    """Raise LinkwiseError for columns that the first trial whose log can be read does not have.

    before: names of trials that are done. If there are none, and no trial can begin, the study is at fault,
    and the error of the first trial is raised.
    """
    with within(str(plan.file)):
        columns = _columns(plan, before)
        if columns:
            kept_columns(columns, plan.columns)
            every = (*columns, *integral_columns(plan, columns))
            names = [column.name for column in every if column.name != "time"]
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
            with (
                within(f"trial {trial.name!r}"),
                by_keys(),
                trial_here(trial) as here,
                passing_folder() as buffer,
            ):
                return SidedColumns.of(prepared_trial(plan, here, buffer), plan.cycles, here.side).columns
        except LinkwiseError as reason:
            reasons.append(reason)
    if reasons and not before:
        raise reasons[0]
    return ()
