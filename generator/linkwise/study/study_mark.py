"""`study.json`: the request of a study, and its outcome."""

import json
import os
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Literal

from linkwise.errors import LinkwiseError
from linkwise.input_file import is_file
from linkwise.package.decode import decode, parse_json, require
from linkwise.package.manifest import is_inside
from linkwise.study.band_figure import FORMATS
from linkwise.study.study_paths import read_back, require_own
from linkwise.study.study_plan import StudyPlan
from linkwise.study.trial_ledger import MARK
from linkwise.study.trial_work import TrialOutcome

STUDY_PAGE = "study.html"
SUMMARIES, GROUPS, MEAN_CURVES, TESTS = (
    "summary.parquet",
    "groups.parquet",
    "curves.parquet",
    "tests.parquet",
)
"""Names of files in the folder besides trials and figures."""


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

    @classmethod
    def begun(cls, plan: StudyPlan, files: Sequence[str]) -> "StudyMark":
        """Return the mark of a study at work, whose folder has files of a former run."""
        return cls(plan.name, "begun", plan.factors, _trials(plan), {}, "", tuple(files))

    @classmethod
    def done(
        cls, plan: StudyPlan, broken: Sequence[TrialOutcome], key: str, files: Sequence[str]
    ) -> "StudyMark":
        """Return the mark of a study whose trials are done or broken."""
        reasons = {one.name: one.reason for one in broken}
        return cls(plan.name, "done", plan.factors, _trials(plan), reasons, key, tuple(files))

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
            mark = decode(cls, parse_json(read_back(path)), "")
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
