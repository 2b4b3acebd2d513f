"""Input of a trial: the files that it depends on, copies of those at addresses, and a hash of it all.

The hash, its key, covers files by content, the trial's choices, and linkwise itself.
"""

import hashlib
import json
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import NamedTuple

from linkwise.analysis.loads.external import data_files
from linkwise.errors import LinkwiseError
from linkwise.generator_fingerprint import fingerprint
from linkwise.package.manifest import FILE
from linkwise.robot import robot_files
from linkwise.robot.read import is_built_in, most_bytes
from linkwise.study.paths import beside, copied_here, is_address, opened_here, version_of
from linkwise.study.plan import OF_FILES, StudyPlan, Trial

CHUNK = 1 << 20


def trial_files(plan: StudyPlan, trial: Trial) -> Iterator[str]:
    """Yield all files that a trial's numbers depend on."""
    yield from _inside(trial.log)
    for path in trial.choices.files:
        yield path
        yield from _data_of(path)
    if Path(trial.robot).is_dir():
        yield str(Path(trial.robot) / FILE)
    elif is_address(trial.robot):
        yield trial.robot
    else:
        yield from (str(path) for path in robot_files(trial.robot, plan.options) if path.is_file())
    if plan.cycles is not None and plan.cycles.table:
        yield plan.cycles.table


@contextmanager
def trial_here(trial: Trial) -> Iterator[Trial]:
    """Give the trial with its log and loads on this machine; copies keep their names until the block ends."""
    with ExitStack() as copies:

        def here(path: str) -> str:
            copy = copies.enter_context(opened_here(path))
            if is_address(path):
                for data in _data_of(path):
                    copied_here(data, copy.parent / data.removeprefix(beside(path, "")))
            return str(copy)

        choices = replace(
            trial.choices,
            loads=tuple(map(here, trial.choices.loads)),
            contact_loads=tuple(map(here, trial.choices.contact_loads)),
            muscle_actuators=tuple(map(here, trial.choices.muscle_actuators)),
            uncertain=trial.choices.uncertain and here(trial.choices.uncertain),
            ik_tasks=trial.choices.ik_tasks and here(trial.choices.ik_tasks),
            muscles=trial.choices.muscles and here(trial.choices.muscles),
        )
        yield replace(trial, log=here(trial.log), choices=choices)


def _inside(path: str) -> Iterator[str]:
    """Yield the file itself; of a folder, such as a bag, all files in it."""
    if not is_address(path) and Path(path).is_dir():
        yield from sorted(str(file) for file in Path(path).rglob("*") if file.is_file())
    else:
        yield path


def _data_of(path: str) -> list[str]:
    """Return the files of numbers that an OpenSim file of loads names.

    It is empty if the file cannot be read, which the analysis reports.
    """
    if not path.lower().endswith(".xml"):
        return []
    with opened_here(path) as copy:
        try:
            found = data_files(copy)
        except LinkwiseError:
            return []
        if not is_address(path):
            return list(map(str, found))
        inside = [data.relative_to(copy.parent) for data in found if data.is_relative_to(copy.parent)]
    return [beside(path, data.as_posix()) for data in inside if ".." not in data.parts]


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
        trial.side,
        trial.recording,
        trial.robot if is_built_in(trial.robot) else "",  # a built-in robot has no file to hash
        {**asdict(trial.choices), **{key: _count(getattr(trial.choices, key)) for key in OF_FILES}},
        plan.options.request(),
        None if plan.cycles is None else {**asdict(plan.cycles), "table": bool(plan.cycles.table)},
        plan.columns,
        plan.pages,
        # A file's suffix says how it is read; the rest of its name does not matter.
        [(Path(path).suffix.lower(), seen.sha256) for path, seen in files.items()],
        fingerprint(),
    ]
    return TrialKey(hashlib.sha256(json.dumps(told, default=str).encode()).hexdigest(), files)


def _count(paths: tuple[str, ...] | str | None) -> int:
    """Return the number of the files that a choice names."""
    return len(paths) if isinstance(paths, tuple) else int(paths is not None)


def _hash(path: str, trial: Trial) -> str:
    digest = hashlib.sha256()
    most = most_bytes(path) if path == trial.robot else None
    with opened_here(path, most) as file, file.open("rb") as content:
        while chunk := content.read(CHUNK):
            digest.update(chunk)
    return digest.hexdigest()
