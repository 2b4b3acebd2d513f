"""`study.json`: what a study was asked, and what came of it."""

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Literal

from linkwise.study.study_plan import StudyPlan
from linkwise.study.trial_ledger import MARK
from linkwise.study.trial_work import TrialOutcome


@dataclass(frozen=True)
class StudyMark:
    """The content of the file."""

    study: str
    """Its name."""
    state: Literal["begun", "done"]
    factors: list[str]
    trials: dict[str, dict[str, str]]
    """Level of each factor, by the trial's name."""
    broken: dict[str, str]
    """Reasons, by the trial's name."""
    key: str
    """Hash of all that `files` are made of; empty while they are not made."""
    files: list[str]
    """Names of what is in the folder beside trials."""

    @classmethod
    def begun(cls, plan: StudyPlan, files: Sequence[str]) -> "StudyMark":
        """That of a study at work, whose folder has files of a former run."""
        return cls(plan.name, "begun", list(plan.factors), _trials(plan), {}, "", list(files))

    @classmethod
    def done(
        cls, plan: StudyPlan, broken: Sequence[TrialOutcome], key: str, files: Sequence[str]
    ) -> "StudyMark":
        """That of a study whose trials are done or broken."""
        reasons = {one.name: one.reason for one in broken}
        return cls(plan.name, "done", list(plan.factors), _trials(plan), reasons, key, list(files))

    @classmethod
    def read(cls, out: Path) -> "StudyMark | None":
        """That of a study's folder; None where there is none that can be read."""
        try:
            return cls(**json.loads((out / MARK).read_text(encoding="utf-8")))
        except (OSError, ValueError, TypeError):
            return None

    def files_in(self, out: Path) -> tuple[Path, ...]:
        """Paths of its files, and of its own."""
        return tuple(out / Path(name).name for name in (*self.files, MARK))

    def text(self) -> bytes:
        """As JSON."""
        return f"{json.dumps(asdict(self), indent=1, ensure_ascii=False)}\n".encode()


def _trials(plan: StudyPlan) -> dict[str, dict[str, str]]:
    return {trial.name: dict(trial.labels) for trial in plan.trials}
