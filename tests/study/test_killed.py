"""Studies that are ended in the midst of their work, by others or by their own trials."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Generator, Sequence
from pathlib import Path

import pytest
from helpers.search_path import before
from helpers.studies import CHOICES, HEAD, QUICK, TRIALS, Here, write_study
from linkwise import LinkwiseError
from linkwise.study import ProcessPool, run_study
from linkwise.study.folder import held_study
from linkwise.study.trial import TrialOutcome, TrialTask

pd = pytest.importorskip("pandas")


def begun(file: Path, out: Path, **environment: str) -> subprocess.Popen[str]:
    """The command at work, with all its processes in a group of their own."""
    command = [sys.executable, "-m", "linkwise", "study", str(file), "--out", str(out), "--workers", "2"]
    return subprocess.Popen(
        command,
        start_new_session=True,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env=os.environ | environment,
    )


def records(out: Path) -> list[Path]:
    return sorted((out / "trials").glob("*/_record.json"))


def wait_for(many: int, study: subprocess.Popen[str], out: Path) -> None:
    """Until so many trials are done."""
    while study.poll() is None and len(records(out)) < many:
        time.sleep(0.01)


def test_a_study_killed_at_any_instant_goes_on_where_it_was(tmp_path: Path) -> None:
    file = write_study(tmp_path, HEAD, QUICK, CHOICES, TRIALS, subjects=3)
    out = tmp_path / "out"
    for many, wait in ((0, 1.5), (1, 0.1)):
        study = begun(file, out)
        wait_for(many, study, out)
        time.sleep(wait)
        study.kill()
        study.communicate(timeout=20)  # its processes hold these pipes, and end with it
    before = {path: path.stat().st_mtime_ns for path in records(out)}
    assert len(before) >= 1
    found = run_study(file, out, Here())
    assert len(found.done) == 12
    assert found.fresh == 12 - len(before)
    assert all(path.stat().st_mtime_ns == when for path, when in before.items())
    counts = pd.read_parquet(tmp_path / "out/trials").groupby("trial", observed=True).size()
    assert sorted(counts.index) == [
        f"S{s}-{c}-{k}" for s in (1, 2, 3) for c in ("fast", "slow") for k in (1, 2)
    ]
    assert set(counts) == {300}


@pytest.mark.parametrize(("many", "later"), [(0, 0.0), (0, 0.7), (1, 0.0), (3, 0.05)])
def test_an_interrupt_is_told_in_a_line_and_leaves_what_is_done(
    tmp_path: Path, many: int, later: float
) -> None:
    """While processes begin, in the midst of trials and between them."""
    file, out = write_study(tmp_path, HEAD, QUICK, CHOICES, TRIALS, subjects=3), tmp_path / "out"
    study = begun(file, out)
    while not (out / "study.json").exists():
        time.sleep(0.01)
    wait_for(many, study, out)
    time.sleep(later)
    os.killpg(study.pid, signal.SIGINT)
    _, told = study.communicate(timeout=10)
    assert (study.returncode, told.splitlines()[-1]) == (130, "linkwise: interrupted")
    assert "Traceback" not in told
    assert not list(out.rglob(".linkwise-*"))
    assert many <= len(records(out)) < 12


@pytest.mark.parametrize("many", [0, 1])
def test_more_interrupts_while_it_ends_change_nothing(tmp_path: Path, many: int) -> None:
    file, out = write_study(tmp_path, HEAD, QUICK, CHOICES, TRIALS, subjects=3), tmp_path / "out"
    study = begun(file, out)
    while not (out / "study.json").exists():
        time.sleep(0.01)
    wait_for(many, study, out)
    while study.poll() is None:
        os.killpg(study.pid, signal.SIGINT)
        time.sleep(0.02)
    _, told = study.communicate(timeout=10)
    assert told == "linkwise: interrupted\n"
    assert study.returncode in (130, -signal.SIGINT)  # by one that comes after Python's own end has begun
    assert not list(out.rglob(".linkwise-*"))


def test_a_study_leaves_the_callers_environment_as_it_was(tmp_path: Path) -> None:
    file, before = write_study(tmp_path, HEAD, QUICK, CHOICES, TRIALS, subjects=1, trials=1), dict(os.environ)
    assert run_study(file, tmp_path / "out", ProcessPool(2)).done == ("S1-fast-1", "S1-slow-1")
    assert dict(os.environ) == before


def test_a_script_may_run_a_study_as_it_stands(tmp_path: Path) -> None:
    file = write_study(tmp_path, HEAD, QUICK, CHOICES, TRIALS, subjects=1)
    script = tmp_path / "script.py"
    script.write_text(
        "import linkwise\n"
        f"found = linkwise.run_study({str(file)!r}, {str(tmp_path / 'out')!r}, linkwise.ProcessPool(2))\n"
        "print(found.fresh, found.broken)\n"
    )
    done = subprocess.run([sys.executable, script], capture_output=True, text=True, check=True)
    assert done.stdout == "4 ()\n", done.stderr


def test_one_study_at_a_time_is_at_work_in_a_folder(tmp_path: Path) -> None:
    file, engine = write_study(tmp_path, HEAD, QUICK, CHOICES, TRIALS), Here()
    with (
        held_study(tmp_path / "out"),
        pytest.raises(LinkwiseError, match="another linkwise is at work there"),
    ):
        run_study(file, tmp_path / "out", engine)
    assert engine.given == []
    assert run_study(file, tmp_path / "out", engine).fresh == 8


KILLER = """
import multiprocessing, os, pathlib, signal

opened = pathlib.Path.open

def once():
    try:
        os.mkdir(os.path.join(os.path.dirname(__file__), "once"))
    except FileExistsError:
        return False
    return True

def deadly(self, mode="r", *rest, **more):
    if self.name == "fast_1.csv" and mode == "rb" and {who} multiprocessing.parent_process():
        os.kill(os.getpid(), signal.{deadly})
    return opened(self, mode, *rest, **more)

pathlib.Path.open = deadly
"""


def killing(folder: Path, who: str, deadly: str) -> dict[str, str]:
    """Surroundings in which processes are ended so: workers, "once() and" one of them, or "not" workers."""
    (folder / "sitecustomize.py").write_text(KILLER.format(who=who, deadly=deadly))
    return {"PYTHONPATH": before(folder)}


@pytest.mark.parametrize("deadly", ["SIGKILL", "SIGTERM"])
def test_a_process_that_dies_takes_its_trial_alone(tmp_path: Path, deadly: str) -> None:
    """A worker is ended whenever it opens one of the logs, as the system does where memory ends."""
    file = write_study(tmp_path, HEAD, QUICK, CHOICES, TRIALS, subjects=1, trials=1)
    out = tmp_path / "out"
    study = begun(file, out, **killing(tmp_path, "", deadly))
    said, told = study.communicate(timeout=60)
    assert study.returncode == 1, told
    assert "broken: S1-fast-1: its process died twice" in told
    assert said.startswith("1 trials done, 0 of them before, 1 broken")
    assert not list(out.rglob(".linkwise-*"))


@pytest.mark.parametrize("deadly", ["SIGKILL", "SIGTERM"])
def test_a_trial_whose_process_dies_is_tried_once_more(tmp_path: Path, deadly: str) -> None:
    file = write_study(tmp_path, HEAD, QUICK, CHOICES, TRIALS, subjects=1, trials=1)
    out = tmp_path / "out"
    study = begun(file, out, **killing(tmp_path, "once() and", deadly))
    said, told = study.communicate(timeout=60)
    assert study.returncode == 0, told
    assert (tmp_path / "once").exists()
    assert said.startswith("2 trials done, 0 of them before, 0 broken")
    assert not list(out.rglob(".linkwise-*"))


def test_a_trial_whose_process_died_is_tried_after_all_others(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """There may be enough memory by then, where it was for want of it."""
    file = write_study(tmp_path, HEAD, QUICK, CHOICES, TRIALS, subjects=1)
    for name, value in killing(tmp_path, "once() and", "SIGKILL").items():
        monkeypatch.setenv(name, value)
    ended = list[str]()

    class OneProcess:
        """An engine of one process, which keeps the order in which trials end."""

        def outcomes(self, tasks: Sequence[TrialTask]) -> Generator[TrialOutcome]:
            for outcome in ProcessPool(1).outcomes(tasks):
                ended.append(outcome.name)
                yield outcome

    assert run_study(file, tmp_path / "out", OneProcess()).broken == ()
    assert ended == ["S1-fast-2", "S1-slow-1", "S1-slow-2", "S1-fast-1"]


def test_what_a_killed_study_left_among_passing_files_goes_with_the_next(tmp_path: Path) -> None:
    """The study is killed while it looks at the first log, whose samples are then in a folder that passes."""
    file = write_study(tmp_path, HEAD, QUICK, CHOICES, TRIALS, subjects=1, trials=1)
    (passing := tmp_path / "passing").mkdir()
    study = begun(file, tmp_path / "out", TMPDIR=str(passing), **killing(tmp_path, "not", "SIGKILL"))
    study.communicate(timeout=60)
    assert study.returncode == -signal.SIGKILL
    assert list(passing.iterdir())
    study = begun(file, tmp_path / "out", TMPDIR=str(passing))
    _, told = study.communicate(timeout=60)
    assert study.returncode == 0, told
    assert not list(passing.iterdir())
