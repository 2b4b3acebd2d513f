"""Endings of `linkwise analyze`: one line for an error, and nothing left behind."""

import signal
import subprocess
import sys
import time

import numpy as np
import pytest
from helpers.command_line import run_linkwise
from helpers.motion_logs import JOINTS, PLANAR3, smooth, write_csv, write_mot


def arguments(log, *options):
    return ["analyze", str(log), "--robot", str(PLANAR3), "--out", str(log.parent / "out"), *options]


def holed(path):
    table = smooth(20, 3)
    table[9, 2] = np.nan
    return write_csv(path.with_suffix(".csv"), table)


def gap(path):
    table = smooth(20, 3)
    table[9:, 0] += 1
    return write_csv(path.with_suffix(".csv"), table)


def short(path):
    write_csv(path.with_suffix(".csv"), smooth(20, 3))
    with path.with_suffix(".csv").open("a", encoding="utf-8") as file:
        file.write("0.2,1\n")
    return path.with_suffix(".csv")


def in_degrees(path):
    return write_mot(path.with_suffix(".mot"), smooth(20, 3), JOINTS)


@pytest.mark.parametrize(
    ("make", "options", "message"),
    [
        (holed, (), "row 11, column 'joint2': nan"),
        (gap, (), "a gap of"),
        (short, (), "2 cells where"),
        (in_degrees, ("--units", "rad"), "contradicts"),
    ],
)
def test_an_error_is_one_line(tmp_path, make, options, message):
    log = make(tmp_path / "a")
    done = run_linkwise(*arguments(log, *options), folder=tmp_path)
    assert done.returncode == 2
    (line,) = [line for line in done.stderr.splitlines() if not line.startswith("reading: ")]
    assert message in line
    assert [file.name for file in tmp_path.iterdir()] == [log.name]


def test_a_termination_leaves_nothing(tmp_path):
    log = write_csv(tmp_path / "a.csv", smooth(60_000, 3))
    command = [sys.executable, "-m", "linkwise", *arguments(log, "--resample", "9000")]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    while len(list(tmp_path.iterdir())) < 2:
        assert process.poll() is None
        time.sleep(0.02)
    process.send_signal(signal.SIGTERM)
    process.communicate()
    assert process.returncode == 128 + signal.SIGTERM
    assert [file.name for file in tmp_path.iterdir()] == ["a.csv"]
