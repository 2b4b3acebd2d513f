"""A study interrupted at 100 random instants, by its terminal or alone, and continued: of `make crash`.

Each time it ends within SECONDS, says one line and leaves no process, and what was done stays as it was. When
all trials are there, they are those of a study that nobody interrupted.
"""

import os
import random
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

import pandas as pd
from studies import CHOICES, HEAD, QUICK, TRIALS, write_study
from test_study_killed import begun, records

COUNT = 100
SECONDS = 5.0
DONE, INTERRUPTED = 0, 130
LATE = -signal.SIGINT
"""What Python makes of one that comes while it tidies up, after its program's last word."""


def whole(file: Path, out: Path) -> float:
    """Let a study come to its end; returns how long it took."""
    start = time.monotonic()
    study = begun(file, out)
    _, told = study.communicate(timeout=300)
    assert study.returncode == 0, told
    return time.monotonic() - start


def trials(out: Path) -> pd.DataFrame:
    table = pd.read_parquet(out / "trials")
    return table.sort_values(["trial", "time"]).reset_index(drop=True)


def left_of(group: int) -> bool:
    """Whether a process of a group is still there, some seconds later."""
    end = time.monotonic() + SECONDS
    while time.monotonic() < end:
        try:
            os.killpg(group, 0)
        except ProcessLookupError:
            return False
        time.sleep(0.01)
    return True


def wrong(study: subprocess.Popen[str], out: Path, alone: bool) -> tuple[float, str]:
    """Interrupt it; the seconds until it ended, and what was not as promised, empty if nothing."""
    before = {path: path.stat().st_mtime_ns for path in records(out)}
    start = time.monotonic()
    (os.kill if alone else os.killpg)(study.pid, signal.SIGINT)
    try:
        said, told = study.communicate(timeout=60)
    except subprocess.TimeoutExpired:
        os.killpg(study.pid, signal.SIGKILL)
        return 60.0, "it did not end"
    took = time.monotonic() - start
    if study.returncode not in (DONE, INTERRUPTED, LATE) or (study.returncode == LATE and not said):
        return took, f"status {study.returncode}: {told}"
    if study.returncode == INTERRUPTED and told != "linkwise: interrupted\n":
        return took, f"it said {told!r}"
    if took > SECONDS:
        return took, f"it took {took:.1f} s"
    if left_of(study.pid):
        return took, "it left a process"
    if any(not path.exists() or path.stat().st_mtime_ns != when for path, when in before.items()):
        return took, "what was done is gone, or was done once more"
    return took, "it left a draft" if list(out.rglob(".linkwise-*")) else ""


def main() -> int:
    generator, ends, longest, failures = random.Random(0), Counter[str](), 0.0, 0
    with tempfile.TemporaryDirectory() as folder:
        file = write_study(Path(folder), HEAD, QUICK, CHOICES, TRIALS, subjects=3)
        undisturbed, out = Path(folder) / "undisturbed", Path(folder) / "out"
        most = whole(file, undisturbed)
        for number in range(COUNT):
            alone, delay = number % 3 == 0, generator.uniform(0.0, most)
            study = begun(file, out)
            time.sleep(delay)
            took, complaint = wrong(study, out, alone)
            longest, ended = max(longest, took), study.returncode in (DONE, LATE)
            ends["ended before"] += ended
            ends["in the midst"] += not ended and bool(records(out))
            if complaint:
                failures += 1
                print(f"FAIL  interrupt {number}, after {delay:.2f} s: {complaint}", flush=True)
            if ended:
                pd.testing.assert_frame_equal(trials(out), trials(undisturbed))
                out = out.with_name(f"out{number}")
        whole(file, out)
        pd.testing.assert_frame_equal(trials(out), trials(undisturbed))
    told = ", ".join(f"{count} {how}" for how, count in ends.items())
    print(f"{COUNT - failures:4} of {COUNT} interrupts as promised ({told}), the longest end {longest:.1f} s")
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
