"""Ledger of the trials of a study that are done: a folder for each, with a record of what it depends on."""

import json
import platform
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

from linkwise.errors import LinkwiseError
from linkwise.input_file import is_file
from linkwise.package.decode import decode, parse_json
from linkwise.study.inputs import SeenFile, trial_key
from linkwise.study.paths import read_back
from linkwise.study.plan import StudyPlan, Trial

MARK = "study.json"
"""File in the folder of a study that marks it as one."""
RECORD, TABLE, CYCLES, CURVES, SUMMARY, PAGE = (
    "_record.json",
    "samples.parquet",
    "_cycles.parquet",
    "_curves.npz",
    "_summary.npz",
    "_report.html",
)
"""Files in a trial's folder; names with _ are skipped by readers of all tables of the folder above."""


@dataclass(frozen=True)
class TrialRecord:
    """Record of a trial that is done."""

    name: str
    key: str
    files: Mapping[str, SeenFile]
    samples: int
    cycles: int
    rate: float
    seconds: float
    warnings: tuple[str, ...]
    outputs: Mapping[str, int]
    """Bytes of the other files of its folder, by name."""
    uncertain: Mapping[str, object] | None
    """Assumptions about what is uncertain; none where nothing is."""
    cycles_by: str
    """Instants at which cycles begin and end, in words; empty without cycles."""
    turned: tuple[str, ...]
    """Coordinates that change sign in cycles of the left; none without sides."""

    def text(self) -> str:
        """Return the record as JSON."""
        return json.dumps(asdict(self), indent=1) + "\n"

    @classmethod
    def read(cls, folder: Path) -> "TrialRecord | None":
        """Return the record of a folder; None if there is none, or it cannot be read or has other types.

        Raises LinkwiseError for a record that is not a regular file, or far too large.
        """
        try:
            if not (folder / RECORD).exists():
                return None
            return decode(cls, parse_json(read_back(folder / RECORD)), "")
        except LinkwiseError:
            raise
        except (OSError, ValueError):
            return None


def done_before(plan: StudyPlan, folders: Mapping[str, Path]) -> dict[str, TrialRecord]:
    """Return the records of trials that are done with the same inputs; raise as `TrialRecord.read` does."""
    found = {}
    for trial in plan.trials:
        record = TrialRecord.read(folders[trial.name])
        folder = folders[trial.name]
        if (
            record is not None
            and outputs_in(folder) == record.outputs
            and record.key == _key(plan, trial, record)
        ):
            found[trial.name] = record
    return found


def cut_by(plan: StudyPlan, records: Sequence[TrialRecord]) -> dict[str, object]:
    """Return how trials are cut into cycles, as plain data; empty without cycles."""
    if plan.cycles is None:
        return {}
    ends = {by: [one.name for one in records if one.cycles_by == by] for by in {r.cycles_by for r in records}}
    told: dict[str, object] = {"begin_and_end": [{"by": by, "trials": ends[by]} for by in sorted(ends)]}
    if plan.cycles.sides:
        told |= {
            "sides": plan.cycles.sides,
            "change_sign_on_the_left": sorted({name for one in records for name in one.turned}),
            "sign_by": "the robot's geometry" if plan.cycles.turned is None else "the study's file",
        }
    return told


def outputs_in(folder: Path) -> dict[str, int]:
    """Return the bytes of the regular files of a trial's folder, by name, without its record."""
    return {
        path.name: path.stat().st_size for path in folder.iterdir() if path.name != RECORD and is_file(path)
    }


def is_trial(folder: Path) -> bool:
    """Return whether a folder holds files of a trial, and nothing else."""
    there = {path.name for path in folder.iterdir()} if folder.is_dir() else set[str]()
    return bool(there) and there <= {RECORD, TABLE, CYCLES, CURVES, SUMMARY, PAGE}


def _key(plan: StudyPlan, trial: Trial, record: TrialRecord) -> str:
    """Return the key as it is now; empty if an input cannot be read."""
    try:
        return trial_key(plan, trial, record.files).key
    except (LinkwiseError, OSError):
        return ""


def require_seen(folder: Path) -> None:
    """Raise LinkwiseError if this machine does not see the study that a trial's folder is to be in."""
    out = folder.parents[1]
    if not (out / MARK).is_file():
        raise LinkwiseError(
            f"machine {platform.node()} does not see {out}; give --out on a disk that all nodes share"
        )


def refuse_unless_trial(folder: Path) -> None:
    """Raise LinkwiseError for a folder in the place of a trial's that is not a trial."""
    is_empty = folder.is_dir() and not any(folder.iterdir())
    if not is_empty and not is_trial(folder):
        raise LinkwiseError(f"{folder}: exists and is not a trial of a study; move it away")
