"""One trial of a study, from its log to its folder: the work of every engine's workers."""

import math
import time
from contextlib import ExitStack
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from linkwise.analysis.contacts.standing import with_contacts
from linkwise.analysis.disk_rows import EverySample
from linkwise.analysis.job import Job
from linkwise.analysis.payload import with_payloads
from linkwise.analysis.phases import Phase
from linkwise.analysis.preparation import prepared
from linkwise.analysis.show.page import report
from linkwise.arrays import Array
from linkwise.errors import LinkwiseError
from linkwise.escape import short
from linkwise.output import whole_directory
from linkwise.progress import silent
from linkwise.study.cycles import TrialCycles
from linkwise.study.inputs import trial_here, trial_key
from linkwise.study.integrals import CycleIntegrals
from linkwise.study.ledger import (
    PAGE,
    RECORD,
    SUMMARY,
    TABLE,
    TrialRecord,
    outputs_in,
    refuse_unless_trial,
    require_seen,
)
from linkwise.study.normalised import own_mass
from linkwise.study.plan import StudyPlan, Trial
from linkwise.study.robots import opened_robot
from linkwise.study.sides import SidedColumns
from linkwise.study.summary import RunningMoments
from linkwise.study.tables import CYCLE, PERCENT, TrialTable, kept_columns
from linkwise.study.told_keys import by_keys


@dataclass(frozen=True)
class TrialTask:
    """A trial to be run, and the folder for its results."""

    plan: StudyPlan
    """Plan of this trial alone."""
    folder: Path

    @property
    def trial(self) -> Trial:
        """Trial to be run."""
        return self.plan.trials[0]


@dataclass(frozen=True)
class TrialOutcome:
    """Outcome of a trial: its samples, or why there are none."""

    name: str
    samples: int = 0
    reason: str = ""


def run_trial(task: TrialTask) -> TrialOutcome:
    """Run a trial and return its outcome; its folder appears whole, or not at all if it fails."""
    try:
        require_seen(task.folder)
        with by_keys(), whole_directory(task.folder, refuse_unless_trial) as draft:
            record = _worked(task, draft)
            (draft / RECORD).write_text(record.text(), encoding="utf-8")
    except LinkwiseError as error:
        return TrialOutcome(task.trial.name, reason=str(error))
    except MemoryError:
        return TrialOutcome(task.trial.name, reason="there is not enough memory; cut the log")
    except Exception as error:  # a fault of linkwise; it stops no other trial
        fault = f"a fault of linkwise, please report it: {type(error).__name__}: {short(str(error), 300)}"
        return TrialOutcome(task.trial.name, reason=fault)
    return TrialOutcome(task.trial.name, record.samples)


def _worked(task: TrialTask, draft: Path) -> TrialRecord:
    plan, began = task.plan, time.monotonic()
    with ExitStack() as files:
        trial = files.enter_context(trial_here(task.trial))
        key = trial_key(plan, task.trial, {}, trial)
        job = prepared_trial(plan, trial, draft)
        seen, rows = SidedColumns.of(job, plan.cycles, trial.side), len(job.decomposer.rows)
        columns = seen.columns
        tree = job.decomposer.robot.package.manifest.tree
        mass = math.nan if tree is None else own_mass(tree.links)
        kept = kept_columns(columns, plan.columns)
        labels = {"trial": trial.name, **dict(trial.labels)}
        every = EverySample(rows, *((job.count, draft) if plan.pages else (0, None)))
        files.enter_context(every)
        moments = RunningMoments(len(columns))
        places = () if plan.cycles is None else (CYCLE, PERCENT)
        table = files.enter_context(TrialTable(draft / TABLE, labels, [columns[at] for at in kept], places))
        integrals = files.enter_context(CycleIntegrals(plan, columns, labels, draft))
        names = [column.name for column in columns]
        cycles = TrialCycles(plan, job, names, lambda rows, *places: table(rows[kept], *places), integrals)

        if plan.cycles is not None and not plan.cycles.table:
            # The cycle may be on at single samples: no time, no work.
            job = replace(job, phases=job.phases[:-1])

        def sink(whole: Array) -> None:
            block = seen.rows(job.table_rows(whole))
            moments(block)
            if plan.pages:
                every(whole)
            if plan.cycles is None:
                table(block[kept])
            else:
                cycles.sink(block)

        done = job.run(sink, silent)
        cycles.finish(draft)
        analysis = job.analysis(done, every.values)
    every_column = (*columns, *integrals.columns)
    np.savez(
        draft / SUMMARY,
        statistics=np.concatenate([moments.table, integrals.statistics], axis=1),
        names=[c.name for c in every_column],
        units=[c.unit for c in every_column],
        words=np.array([(name, *words) for name, words in seen.words.items()]).reshape(-1, 4),
        mass=mass,
    )
    if plan.pages:
        (draft / PAGE).write_bytes(report(analysis).encode())
    seconds = time.monotonic() - began
    warnings = (*analysis.warnings, *analysis.load_warnings)
    return TrialRecord(
        trial.name,
        key.key,
        key.files,
        done.total,
        cycles.count,
        job.samples.rate,
        seconds,
        warnings,
        outputs_in(draft),
        analysis.uncertain,
        cycles.ends,
        seen.turned,
    )


def prepared_trial(plan: StudyPlan, trial: Trial, buffer: Path) -> Job:
    """Read and filter a trial whose files are on this machine; raise LinkwiseError for an invalid one.

    buffer: a directory that keeps the samples
    """
    loaded = opened_robot(trial.robot, plan)
    robot = with_payloads(loaded, trial.choices.payloads(loaded))
    asked = trial.choices.request(robot, trial.robot)
    robot = with_contacts(robot, asked.contacts)
    outputs = replace(asked.outputs, page=plan.pages)
    if plan.cycles is not None and (what := plan.cycles.what(trial.side)):
        outputs = replace(outputs, phases=(*outputs.phases, Phase.of(f"cycle={what}")))
    return prepared(Path(trial.log), robot, replace(asked, outputs=outputs), silent, buffer)
