"""The folder of a study: where its files are, and `study.json`, the study's request and its outcome."""

import json
import os
import re
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path
from tempfile import gettempdir
from typing import Any, Literal

from linkwise.errors import LinkwiseError
from linkwise.escape import file_name, file_names
from linkwise.input_file import is_file
from linkwise.output import sweep
from linkwise.output.workplace import locked
from linkwise.package.decode import decode, parse_json, require
from linkwise.package.manifest import is_inside
from linkwise.plotstyle import FORMATS
from linkwise.study.ledger import MARK, is_trial
from linkwise.study.paths import read_back, removed, require_own
from linkwise.study.plan import StudyPlan
from linkwise.study.trial import TrialOutcome

TRIALS, LOCK = "trials", ".lock"
ADDRESS = re.compile(r"\w{2,}:/")
"""Address of a store, as `Path` shortens it; a single letter is a drive of Windows."""

STUDY_PAGE = "study.html"
SUMMARIES, GROUPS, MEAN_CURVES, TESTS = (
    "summary.parquet",
    "groups.parquet",
    "curves.parquet",
    "tests.parquet",
)
"""Names of files in the folder besides trials and figures."""


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


def is_of_study(name: str) -> bool:
    """Return whether a study gives this name to one of its files, or to a figure."""
    return name in (STUDY_PAGE, SUMMARIES, GROUPS, MEAN_CURVES, TESTS) or name.endswith(
        tuple(f".{kind}" for kind in FORMATS)
    )


@dataclass(frozen=True)
class StudyMark:
    """Content of `study.json`."""

    study: str
    """Name of the study."""
    state: Literal["begun", "done"]
    factors: tuple[str, ...]
    trials: Mapping[str, Mapping[str, str]]
    """Level of each factor, by the trial's name."""
    broken: Mapping[str, str]
    """Reasons of the trials that failed, by the trial's name."""
    key: str
    """Hash of everything that `files` depend on; empty while they are not made."""
    files: tuple[str, ...]
    """Names of the files in the folder, besides trials."""
    uncertain: Mapping[str, object]
    """Assumptions about what is uncertain; empty where nothing is."""
    notes: tuple[str, ...]
    """Lines that a reader of the files must know."""
    normalised: Mapping[str, object]
    """Way in which results are normalised; empty where they are not."""
    cycles: Mapping[str, object]
    """Way in which trials are cut into cycles; empty where they are not."""
    methods: Mapping[str, object]
    """Methods of the trials' analyses for which others are to be named."""

    @classmethod
    def begun(cls, plan: StudyPlan, files: Sequence[str]) -> "StudyMark":
        """Return the mark of a study at work, whose folder has files of a former run."""
        return cls(plan.name, "begun", plan.factors, _trials(plan), {}, "", tuple(files), {}, (), {}, {}, {})

    @classmethod
    def done(
        cls,
        plan: StudyPlan,
        broken: Sequence[TrialOutcome],
        key: str,
        files: Sequence[str],
        told: Mapping[str, Any],
    ) -> "StudyMark":
        """Return the mark of a study whose trials are done or broken; told are the rest of its entries."""
        reasons = {one.name: one.reason for one in broken}
        return cls(plan.name, "done", plan.factors, _trials(plan), reasons, key, tuple(files), **told)

    @classmethod
    def read(cls, out: Path) -> "StudyMark | None":
        """Return the mark of a study's folder, None where there is none.

        Raises LinkwiseError for a damaged mark, and where one of its files is not a regular file: those that
        are not made again are removed.
        """
        path = out / MARK
        if not is_file(path):
            return None
        try:
            data = parse_json(read_back(path))
            if isinstance(data, dict):
                # That of an earlier linkwise has no such entries.
                data = {"uncertain": {}, "notes": [], "normalised": {}, "cycles": {}, "methods": {}} | data
            mark = decode(cls, data, "")
            for name in mark.files:
                is_plain = is_inside(name) and "/" not in name
                require(is_plain and is_of_study(name), f"{name!r} among 'files'", "a name of a study's file")
                if os.path.lexists(out / name):
                    require_own(out / name)
        except LinkwiseError:
            raise
        except ValueError as error:
            raise LinkwiseError(f"{path} is damaged: {error}; give another --out") from error
        return mark

    def files_in(self, out: Path) -> tuple[Path, ...]:
        """Return the paths of its files, and of the mark itself."""
        return tuple(out / name for name in (*self.files, MARK))

    def text(self) -> bytes:
        """Return the mark as JSON."""
        return f"{json.dumps(asdict(self), indent=1, ensure_ascii=False)}\n".encode()


def _trials(plan: StudyPlan) -> dict[str, dict[str, str]]:
    return {trial.name: dict(trial.labels) for trial in plan.trials}
