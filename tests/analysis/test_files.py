"""Files that `linkwise analyze` and `linkwise motion` write, of which nothing half-written stays."""

import csv
import json
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest
from helpers.motion_logs import PLANAR3, smooth, write_csv
from linkwise import progress
from linkwise.analysis import analyze
from linkwise.analysis import run as run_module
from linkwise.analysis.settings import Lowpass, Processing
from linkwise.cli.app import app
from linkwise.errors import LinkwiseError
from typer.testing import CliRunner

ROBOT = ("--robot", str(PLANAR3))


@pytest.fixture
def call():
    def run(*arguments):
        result = CliRunner().invoke(app, [str(argument) for argument in arguments])
        if isinstance(result.exception, LinkwiseError):
            raise result.exception
        assert result.exit_code == 0, result.output
        return result

    return run


@pytest.fixture
def log(tmp_path):
    return write_csv(tmp_path / "log.csv", smooth(120, 3))


def test_parquet_holds_the_analysis(call, log, tmp_path):
    call("analyze", log, *ROBOT, "--out", tmp_path / "out", "--no-page", "--cutoff", 9)
    table = pq.read_table(tmp_path / "out" / "analysis.parquet")
    expected = analyze(log, PLANAR3, processing=Processing(lowpass=Lowpass(9.0)))
    assert table.column_names == [column.name for column in expected.columns]
    np.testing.assert_array_equal(np.array([c.to_numpy() for c in table.columns]), expected.values)
    assert not any(field.nullable for field in table.schema)
    meta = table.schema.field("tau_qd/joint1/link3/joint2").metadata
    assert meta[b"unit"].decode() == "N·m"
    assert (meta[b"joint"], meta[b"link"], meta[b"cause"]) == (b"0", b"2", b"1")
    note = json.loads(table.schema.metadata[b"linkwise"])
    assert note["processing"]["lowpass"] == {"cutoff": 9.0, "order": 2, "padding": "odd"}
    record = json.loads((tmp_path / "out" / "analysis.json").read_text(encoding="utf-8"))
    assert record.pop("files") == ["analysis.json", "analysis.parquet"]
    assert record == json.loads(json.dumps(expected.record()))
    assert sorted(file.name for file in tmp_path.iterdir()) == ["log.csv", "out"]


def test_columns_stand_by_joint_link_and_cause(log):
    result = analyze(log, PLANAR3)
    places: dict[str, list[tuple[int, ...]]] = {}
    for c in result.columns[1:]:
        places.setdefault(c.quantity, []).append(
            (c.joint, *(at for at in (c.link, c.cause) if at is not None))
        )
    assert {"tau_qdd", "tau_qd", "tau_gravity", "tau_link"} <= set(places)
    for quantity, found in places.items():
        assert found == sorted(found), quantity


def test_power_terms_are_written_where_asked_for_and_leave_the_page_alone(call, log, tmp_path):
    call("analyze", log, *ROBOT, "--out", tmp_path / "plain")
    call("analyze", log, *ROBOT, "--out", tmp_path / "more", "--power-terms")
    plain, more = (pq.read_schema(tmp_path / name / "analysis.parquet").names for name in ("plain", "more"))
    assert more[: len(plain)] == plain
    assert {name.partition("/")[0] for name in more[len(plain) :]} == {
        "power_qdd",
        "power_qd",
        "power_gravity",
    }
    pages = [(tmp_path / name / "report.html").read_bytes() for name in ("plain", "more")]
    assert pages[0] == pages[1]


def test_csv_reads_back_exactly(call, log, tmp_path):
    call("analyze", log, *ROBOT, "--out", tmp_path / "out", "--no-page", "--format", "csv")
    with (tmp_path / "out" / "analysis.csv").open(encoding="utf-8", newline="") as handle:
        header, *rows = csv.reader(handle)
    expected = analyze(log, PLANAR3)
    assert header == [column.name for column in expected.columns]
    np.testing.assert_array_equal(np.array(rows, float).T, expected.values)


def test_everything_and_json(call, log, tmp_path):
    out = tmp_path / "out"
    result = call(
        "analyze", log, *ROBOT, "--out", out, "--figure", "paper", "--figure", "paper:joint2", "--json"
    )
    assert json.loads(result.stdout)["closure"]["terms_relative"] < 1e-12
    assert sorted(file.name for file in out.iterdir()) == [
        "analysis.json",
        "analysis.parquet",
        "paper-joint2.png",
        "paper.png",
        "report.html",
    ]


def test_a_former_result_is_replaced_and_nothing_else(call, log, tmp_path):
    out = tmp_path / "out"
    call("analyze", log, *ROBOT, "--out", out, "--no-page")
    call("analyze", log, *ROBOT, "--out", out, "--no-page", "--format", "csv")
    assert sorted(file.name for file in out.iterdir()) == ["analysis.csv", "analysis.json"]
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "thesis.txt").touch()
    with pytest.raises(LinkwiseError, match="exists and is not a former result"):
        call("analyze", log, *ROBOT, "--out", tmp_path / "mine")
    assert [file.name for file in (tmp_path / "mine").iterdir()] == ["thesis.txt"]


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("--cutoff", "50"), "log.csv: --cutoff 50 Hz is not below half"),
        (("--figure", "pie"), "--figure pie: give one of paper, shares"),
        (("--figure", "paper:hip"), "with a joint of joint1"),
        (("--map", "joint1"), "--map joint1: write it as COLUMN=JOINT"),
        (("--backend", "abacus"), "no back end"),
        (("--window", "9"), "--window and --degree go with --derivative savitzky-golay"),
        (("--figure-format", "svg"), "--figure-format goes with --figure; add it"),
        (("--padding", "even"), "--filter-order and --padding go with --cutoff"),
    ],
)
def test_mistakes_leave_nothing(call, log, tmp_path, options, message):
    with pytest.raises(LinkwiseError, match=message):
        call("analyze", log, *ROBOT, "--out", tmp_path / "out", *options)
    assert [file.name for file in tmp_path.iterdir()] == ["log.csv"]


def test_a_fault_on_the_way_leaves_nothing(call, log, tmp_path, monkeypatch):
    def fail(_):
        raise LinkwiseError("page")

    monkeypatch.setattr(run_module, "report", fail)
    with pytest.raises(LinkwiseError, match="page"):
        call("analyze", log, *ROBOT, "--out", tmp_path / "out")
    assert [file.name for file in tmp_path.iterdir()] == ["log.csv"]


def test_a_full_disk_is_told(call, log, tmp_path, monkeypatch):
    def fill(*_, **__):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(pq.ParquetWriter, "write_batch", fill)
    with pytest.raises(LinkwiseError, match=r"nothing was written: .*No space left on device"):
        call("analyze", log, *ROBOT, "--out", tmp_path / "out")
    assert [file.name for file in tmp_path.iterdir()] == ["log.csv"]


def test_a_failed_exchange_keeps_the_former_result(call, log, tmp_path, monkeypatch):
    out = tmp_path / "out"
    call("analyze", log, *ROBOT, "--out", out, "--no-page")
    former = (out / "analysis.json").read_bytes()
    rename = Path.rename

    def fail(path, target):
        if target == out:
            raise OSError(5, "Input/output error")
        return rename(path, target)

    monkeypatch.setattr(Path, "rename", fail)
    with pytest.raises(LinkwiseError, match="nothing was written: Input/output error"):
        call("analyze", log, *ROBOT, "--out", out, "--no-page", "--format", "csv")
    assert sorted(file.name for file in tmp_path.iterdir()) == ["log.csv", "out"]
    assert (out / "analysis.json").read_bytes() == former
    assert (out / "analysis.parquet").is_file()


def test_a_link_to_a_former_result_is_not_replaced(call, log, tmp_path):
    call("analyze", log, *ROBOT, "--out", tmp_path / "out", "--no-page")
    (tmp_path / "link").symlink_to(tmp_path / "out")
    with pytest.raises(LinkwiseError, match="link is a symbolic link; give another --out"):
        call("analyze", log, *ROBOT, "--out", tmp_path / "link", "--no-page")


def test_a_former_result_with_files_of_ones_own_is_not_replaced(call, log, tmp_path):
    out = tmp_path / "out"
    call("analyze", log, *ROBOT, "--out", out, "--no-page")
    (out / "paper.png").write_text("mine")
    with pytest.raises(LinkwiseError, match=r"out holds 'paper.png', which linkwise did not write; move"):
        call("analyze", log, *ROBOT, "--out", out, "--no-page")
    assert (out / "paper.png").read_text() == "mine"


def test_the_log_is_not_replaced_by_its_analysis(call, log, tmp_path):
    call("analyze", log, *ROBOT, "--out", tmp_path / "out", "--no-page", "--format", "csv")
    written = tmp_path / "out/analysis.csv"
    with pytest.raises(
        LinkwiseError, match=r"--out .*out is to be replaced and holds the log .*analysis.csv"
    ):
        call("analyze", written, *ROBOT, "--out", tmp_path / "out")
    assert written.is_file()


@pytest.mark.parametrize("command", ["analyze", "motion", "report terms", "report reduction", "generate"])
def test_nothing_is_written_into_a_package(call, command, log, tmp_path):
    package = shutil.copytree(PLANAR3, tmp_path / "planar3", ignore=shutil.ignore_patterns("__pycache__"))
    (tmp_path / "link").symlink_to(package)
    before = sorted(package.rglob("*"))
    arguments = {"analyze": (log, *ROBOT), "report terms": ("planar3",), "generate": ("planar3",)}
    for out in ("planar3", "link", "planar3/forms/a/b"):
        with pytest.raises(LinkwiseError, match=r"is in the generated package .*planar3, which"):
            call(*command.split(), *arguments.get(command, ()), "--out", tmp_path / out)
    assert sorted(package.rglob("*")) == before


def test_motions_are_told_with_their_samples(call, tmp_path):
    told = call("motion", "--out", tmp_path).stdout.splitlines()
    assert told == [
        f"{tmp_path}/recorded.csv: 801 samples at 100 Hz",
        f"{tmp_path}/simulated.csv: 601 samples at 100 Hz",
    ]


def test_motions_are_written_and_analysed(call, tmp_path):
    written = json.loads(call("motion", "--out", tmp_path, "--json").stdout)
    assert [entry["samples"] for entry in written] == [801, 601]
    for entry in written:
        call("analyze", entry["file"], *ROBOT, "--out", tmp_path / "out", "--no-page")


def test_warnings_and_left_out_columns_are_told(call, tmp_path):
    table = np.column_stack([smooth(20, 3) * [1, 90, 90, 90], np.zeros(20)])
    log = write_csv(tmp_path / "a.csv", table, ("joint1", "joint2", "joint3", "emg"))
    asked = ("--no-page", "--ignore-extra", "--units", "rad")
    result = call("analyze", log, *ROBOT, "--out", tmp_path / "out", *asked)
    assert "if that is degrees, pass --units deg" in result.stderr
    assert "left out: emg" in result.stderr


def test_importing_the_commands_needs_no_extra():
    code = (
        "import sys, linkwise.cli.motion;"
        "print({'scipy', 'pyarrow', 'matplotlib', 'plotly'} & set(sys.modules))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "set()"


def test_a_missing_extra_is_named(monkeypatch, log, call, tmp_path):
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    with pytest.raises(LinkwiseError, match=r"pyarrow is needed .* pip install 'linkwise\[motion\]'"):
        call("analyze", log, *ROBOT, "--out", tmp_path / "out")


def test_progress_of_long_work_in_plain_lines(monkeypatch, capsys):
    monkeypatch.setattr(progress, "QUIET", 0.0)
    with progress.progress() as report:
        for done in range(0, 1001, 10):
            report("analysing", done, 1000)
    lines = capsys.readouterr().err.splitlines()
    assert lines == [f"analysing: {percent}%" for percent in range(0, 101, 10)]


def test_progress_bar_tells_the_rate(monkeypatch, capsys):
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
    monkeypatch.setenv("FORCE_COLOR", "1")
    monkeypatch.setenv("COLUMNS", "120")
    with progress.progress({"reading": "B"}) as report:
        for done in (100, 500, 1000):
            report("reading", done, 1000)
    text = capsys.readouterr().err
    assert "reading" in text
    assert "B/s" in text
    assert "left" in text
