"""Small studies for tests: arms that swing, by subject and condition."""

from collections.abc import Generator, Sequence
from pathlib import Path

import numpy as np
from linkwise.study.trial import TrialOutcome, TrialTask, run_trial

from helpers.motion_logs import JOINTS, write_csv

HEAD = """schema = 1
name = "arms"
factors = ["condition"]
"""
TRIALS = """
[[trial]]
name = "{subject}-{condition}-{trial}"
log = "data/{subject}/{condition}_{trial}.csv"
robot = "planar3"
"""
NAMES = [f"S{s}-{c}-{k}" for s in (1, 2) for c in ("fast", "slow") for k in (1, 2)]
"""Names of trials of two subjects."""
QUICK = 'pages = false\ncolumns = ["tau/*"]\n'
CYCLES = '\n[cycles]\nstart = "stands>0.5"\n'
CHOICES = "\n[analysis]\nignore_extra = true\n"


class Here:
    """An engine of this process, which tells what it was given."""

    def __init__(self) -> None:
        self.given: list[str] = []

    def outcomes(self, tasks: Sequence[TrialTask]) -> Generator[TrialOutcome]:
        for task in tasks:
            self.given.append(task.trial.name)
            yield run_trial(task)


def write_logs(folder: Path, subjects: int = 2, trials: int = 2) -> list[Path]:
    """Logs of slow and fast swings, each of whole turns and a column that begins them."""
    logs = []
    for subject in range(1, subjects + 1):
        place = folder / f"data/S{subject}"
        place.mkdir(parents=True, exist_ok=True)
        for condition, size in (("slow", 0.4), ("fast", 1.0)):
            for trial in range(1, trials + 1):
                draw = np.random.default_rng(100 * subject + trial)
                time = np.arange(0, 3.0, 0.01)
                phase = 2 * np.pi * (1 + 0.05 * subject) * time - 0.5
                shift = 0.2 * subject + 0.05 * draw.normal(size=3)
                q = size * np.sin(phase[:, None] + shift) * [1.0, 0.7, 0.4]
                table = np.column_stack([time, q, np.sin(phase) > 0])
                logs.append(write_csv(place / f"{condition}_{trial}.csv", table, (*JOINTS, "stands")))
    return logs


def write_study(folder: Path, *parts: str, subjects: int = 2, trials: int = 2) -> Path:
    """A study's file of these parts, and its logs."""
    write_logs(folder, subjects, trials)
    path = folder / "study.toml"
    path.write_text("".join(parts), encoding="utf-8")
    return path
