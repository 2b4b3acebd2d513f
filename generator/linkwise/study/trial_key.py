"""Hash of all that a trial's result depends on: its files by content, its choices, and linkwise itself."""

import hashlib
import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import NamedTuple

from linkwise.generator_fingerprint import fingerprint
from linkwise.robot.read import is_built_in, most_bytes
from linkwise.study.study_paths import opened_here, version_of
from linkwise.study.study_plan import OF_FILES, StudyPlan, Trial
from linkwise.study.trial_files import trial_files

CHUNK = 1 << 20


@dataclass(frozen=True)
class SeenFile:
    """A file as it was when it was hashed."""

    version: str
    sha256: str


class TrialKey(NamedTuple):
    """Hash of a trial, and the files that it covers, by path."""

    key: str
    files: dict[str, SeenFile]


def trial_key(
    plan: StudyPlan, trial: Trial, known: Mapping[str, SeenFile], here: Trial | None = None
) -> TrialKey:
    """Return the key of a trial; files whose version is known are not read again.

    here: the same trial with its files on this machine
    """
    files: dict[str, SeenFile] = {}
    for path, copy in zip(trial_files(plan, trial), trial_files(plan, here or trial), strict=True):
        version = version_of(path)
        seen = known.get(path)
        files[path] = (
            seen if seen is not None and seen.version == version else SeenFile(version, _hash(copy, trial))
        )
    told = [
        trial.name,
        trial.labels,
        trial.robot if is_built_in(trial.robot) else "",  # a built-in robot has no file to hash
        {**asdict(trial.choices), **{key: len(getattr(trial.choices, key)) for key in OF_FILES}},
        plan.options.request(),
        None if plan.cycles is None else {**asdict(plan.cycles), "table": bool(plan.cycles.table)},
        plan.columns,
        plan.pages,
        # A file's suffix says how it is read; the rest of its name does not matter.
        [(Path(path).suffix.lower(), seen.sha256) for path, seen in files.items()],
        fingerprint(),
    ]
    return TrialKey(hashlib.sha256(json.dumps(told, default=str).encode()).hexdigest(), files)


def _hash(path: str, trial: Trial) -> str:
    digest = hashlib.sha256()
    most = most_bytes(path) if path == trial.robot else None
    with opened_here(path, most) as file, file.open("rb") as content:
        while chunk := content.read(CHUNK):
            digest.update(chunk)
    return digest.hexdigest()
