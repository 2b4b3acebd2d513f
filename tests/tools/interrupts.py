"""A study interrupted at 100 random instants, by its terminal or alone, and continued: of `make crash`.

Every other time by one who is impatient, and interrupts it again and again until it has ended.

Each time it ends within SECONDS, says one line and leaves no process, and what was done stays as it was. When
all trials are there, they are those of a study that nobody interrupted.
"""

import os
import random
import re
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterator
from functools import partial
from itertools import chain
from pathlib import Path

import pandas as pd

sys.path.insert(0, str(Path(__file__).parents[1]))

from helpers.studies import CHOICES, HEAD, QUICK, TRIALS, write_study
from study.test_killed import begun, records

COUNT = 100
SECONDS = 5.0
START = 0.5
"""Seconds in which Python itself begins, before linkwise can have a say."""
TOLD = "linkwise: interrupted\n"
PROGRESS = re.compile(r"^(trials|together): \d+%\n", re.MULTILINE)
"""Lines that a study writes where it takes long, as on a machine with other work."""
ENDED = (130, -signal.SIGINT)
"""Exit statuses: of linkwise, and of Python where it executes text, or after the program's last word."""


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
    """Return whether a process of a group is still there, some seconds later."""
    end = time.monotonic() + SECONDS
    while time.monotonic() < end:
        try:
            os.killpg(group, 0)
        except ProcessLookupError:
            return False
        time.sleep(0.01)
    return True


def interrupt(study: subprocess.Popen[str], alone: bool, pauses: Iterator[float]) -> None:
    """Interrupt it, and once more after each pause for as long as it is there."""
    end = time.monotonic() + SECONDS
    for pause in chain([0.0], pauses):
        time.sleep(pause)
        if study.poll() is not None or time.monotonic() > end:
            break
        (os.kill if alone else os.killpg)(study.pid, signal.SIGINT)


def struck(
    study: subprocess.Popen[str], out: Path, alone: bool, pauses: Iterator[float]
) -> tuple[bool, float, str]:
    """Interrupt it: whether it had done all, the seconds until it ended, and what was not as promised."""
    before = {path: path.stat().st_mtime_ns for path in records(out)}
    start = time.monotonic()
    interrupt(study, alone, pauses)
    try:
        said, told = study.communicate(timeout=60)
    except subprocess.TimeoutExpired:
        os.killpg(study.pid, signal.SIGKILL)
        return False, 60.0, "it did not end"
    took, status, complaint = time.monotonic() - start, study.returncode, ""
    told = PROGRESS.sub("", told)
    done = bool(said) and not told
    if status not in (0, *ENDED)[not done :] or not (done or told == TOLD):
        complaint = f"status {status}, and it said {told!r}"
    elif took > SECONDS:
        complaint = f"it took {took:.1f} s"
    elif left_of(study.pid):
        complaint = "it left a process"
    elif any(not path.exists() or path.stat().st_mtime_ns != when for path, when in before.items()):
        complaint = "what was done is gone, or was done once more"
    elif list(out.rglob(".linkwise-*")):
        complaint = "it left a draft"
    return done, took, complaint


def main() -> int:
    # Who begins this in the background has it ignore interrupts, and so would the studies.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    generator, ends, longest, failures = random.Random(0), Counter[str](), 0.0, 0
    with tempfile.TemporaryDirectory() as folder:
        file = write_study(Path(folder), HEAD, QUICK, CHOICES, TRIALS, subjects=3)
        undisturbed, out = Path(folder) / "undisturbed", Path(folder) / "out"
        most = whole(file, undisturbed)
        for number in range(COUNT):
            alone, delay = number % 3 == 0, generator.uniform(START, most)
            study = begun(file, out)
            time.sleep(delay)
            pauses = iter(partial(generator.uniform, 0.0, 0.2), None) if number % 2 else iter(())
            done, took, complaint = struck(study, out, alone, pauses)
            longest = max(longest, took)
            ends["when all was done"] += done
            ends["between trials"] += not done and bool(records(out))
            if complaint:
                failures += 1
                print(f"FAIL  interrupt {number}, after {delay:.2f} s: {complaint}", flush=True)
            if done:
                pd.testing.assert_frame_equal(trials(out), trials(undisturbed))
                out = out.with_name(f"out{number}")
        whole(file, out)
        pd.testing.assert_frame_equal(trials(out), trials(undisturbed))
    told = ", ".join(f"{count} {how}" for how, count in ends.items())
    print(f"{COUNT - failures:4} of {COUNT} interrupts as promised ({told}), the longest end {longest:.1f} s")
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
