"""The folder of a study: where its files are, and which study it belongs to."""

import os
import re
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from tempfile import gettempdir

from linkwise.errors import LinkwiseError
from linkwise.escape import file_name, file_names
from linkwise.output import sweep
from linkwise.output.workplace import locked
from linkwise.study.study_mark import StudyMark
from linkwise.study.study_paths import removed, require_own
from linkwise.study.study_plan import StudyPlan
from linkwise.study.trial_ledger import MARK, is_trial

TRIALS, LOCK = "trials", ".lock"
ADDRESS = re.compile(r"\w{2,}:/")
"""Address of a store, as `Path` shortens it; a single letter is a drive of Windows."""


def trial_folders(out: Path, plan: StudyPlan) -> dict[str, Path]:
    """Return the folder of each trial, by its name."""
    names = [trial.name for trial in plan.trials]
    folders = file_names(map(_folder_name, names))
    return {name: out / TRIALS / folder for name, folder in zip(names, folders, strict=True)}


def _folder_name(name: str) -> str:
    """Return a trial's folder name, without a leading . or _, which readers of a folder's tables skip."""
    folder = file_name(name)
    return f"trial{folder}" if folder[:1] in ("", ".", "_") else folder


@contextmanager
def held_study(out: Path) -> Iterator[None]:
    """Keep other processes away from a study's folder; raise LinkwiseError where one is at work there.

    It also raises LinkwiseError where the lock is not a regular file: opening a pipe would wait. Leftovers of
    killed processes, of this study and of its copies of files, are removed before and after.
    """
    try:
        out.mkdir(parents=True, exist_ok=True)
        if os.path.lexists(out / LOCK):
            require_own(out / LOCK)
        file = (out / LOCK).open("a")
    except OSError as error:
        raise LinkwiseError(f"{out}: {error.strerror or error}") from error
    with file:
        if not locked(file.fileno(), otherwise=True):
            raise LinkwiseError(f"{out}: another linkwise is at work there; wait, or give another --out")
        _sweep(out)
        try:
            yield
        finally:
            _sweep(out)


def _sweep(out: Path) -> None:
    for place in (out, out / TRIALS, Path(gettempdir())):
        sweep(place)


def refuse_unless_study(out: Path, plan: StudyPlan) -> None:
    """Raise LinkwiseError for a folder that is neither empty nor of this study."""
    if ADDRESS.match(str(out)):
        raise LinkwiseError(f"--out {out}: give a folder; results are written to disks only")
    if out.exists() and not out.is_dir():
        raise LinkwiseError(f"{out} is not a folder; give another --out")
    there = {entry.name for entry in out.iterdir()} if out.is_dir() else set[str]()
    mark = StudyMark.read(out)
    if mark is None and there - {LOCK}:
        raise LinkwiseError(f"{out}: exists and is not a former study (by its {MARK}); give another --out")
    if mark is not None and mark.study != plan.name:
        raise LinkwiseError(
            f"{out}: is of the study {mark.study!r}, whose trials would go for those of {plan.name!r}; give"
            " another --out"
        )


def sweep_trials(out: Path, folders: Mapping[str, Path]) -> None:
    """Remove the folders of trials that no longer belong to the study."""
    kept = set(folders.values())
    for folder in (out / TRIALS).glob("*"):
        if folder not in kept and is_trial(folder):
            removed(folder)
