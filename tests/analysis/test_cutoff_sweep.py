"""A sweep of cutoffs: sizes are those of analyses at these, and of sines as a Butterworth leaves them."""

import csv
import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet as pq
import pytest
from helpers.command_line import run_linkwise
from helpers.motion_logs import LEG, PLANAR3, smooth, write_csv
from linkwise import Contact, Contacts, LinkwiseError, Load, generate, read_system, write_package
from linkwise.analysis import Analysis, Lowpass, Payload, Processing, analyze
from linkwise.analysis.choices import AnalysisChoices
from linkwise.analysis.cutoff_sweep import SWEPT
from linkwise.analysis.load_robot import load_robot
from linkwise.analysis.show.page import page_data

RATE = 100.0
SLOW, FAST = 1.0, 5.0
"""Frequencies of two sines in Hz, of which both have whole periods in a second."""


def gain(frequency: float, cutoff: float, order: int = 2) -> float:
    """Gain of a Butterworth run both ways, as the bilinear transform makes it."""
    ratio = np.tan(np.pi * frequency / RATE) / np.tan(np.pi * cutoff / RATE)
    return float(1.0 / (1.0 + ratio ** (2 * order)))


def second(frequency: float) -> float:
    """Size of the five-point second derivative of a sine of this frequency."""
    turn = 2 * np.pi * frequency / RATE
    return float(RATE**2 * (30.0 - 32.0 * np.cos(turn) + 2.0 * np.cos(2 * turn)) / 12.0)


def test_an_acceleration_share_grows_as_the_filter_lets_a_fast_sine_through(tmp_path: Path) -> None:
    time, amplitudes = np.arange(2001) / RATE, (0.5, 0.02)
    moved = sum(a * np.sin(2 * np.pi * f * time) for a, f in zip(amplitudes, (SLOW, FAST), strict=True))
    log = write_csv(tmp_path / "log.csv", np.column_stack([time, 0 * time, 0 * time, moved]))
    how = Processing(lowpass=Lowpass(6.0), start=5.0, stop=14.99)
    sweep = analyze(log, PLANAR3, processing=how, cutoff_sweep=(2.0, 20.0, 4)).cutoff_sweep
    assert sweep is not None
    np.testing.assert_allclose(sweep.cutoffs, [2.0, 2 * 10 ** (1 / 3), 6.0, 2 * 10 ** (2 / 3), 20.0])
    parts = np.array(
        [
            [a * second(f) * gain(f, cutoff) for a, f in zip(amplitudes, (SLOW, FAST), strict=True)]
            for cutoff in sweep.cutoffs
        ]
    )
    wanted = np.sqrt((parts**2).sum(axis=1) / 2)
    assert wanted[-1] > 1.3 * wanted[0]
    row = [column.name for column in sweep.columns].index("tau_qdd/joint3/link3/joint3")
    rms, peak, at = sweep["tau_qdd/joint3/link3/joint3"]
    np.testing.assert_allclose(rms / rms[0], wanted / wanted[0], rtol=1e-6)
    np.testing.assert_allclose(sweep.change[row], (wanted[-1] - wanted[0]) / wanted[2], rtol=1e-6)
    instants = time[500:1500]
    for cutoff in range(5):
        curve = parts[cutoff] @ np.sin(2 * np.pi * np.outer((SLOW, FAST), instants))
        largest = np.abs(curve).max()
        np.testing.assert_allclose(abs(peak[cutoff]) / rms[cutoff], largest / wanted[cutoff], rtol=1e-6)
        there = curve[np.isclose(instants, at[cutoff])]
        np.testing.assert_allclose(np.abs(there), largest, rtol=1e-6)
        assert np.sign(peak[cutoff]) == -np.sign(there)


def held_against(sweep: Any, cutoff: float, result: Analysis) -> None:
    """Hold the sizes at a cutoff against the columns of an analysis with that cutoff."""
    at = int(np.flatnonzero(sweep.cutoffs == cutoff)[0])
    assert [c.name for c in sweep.columns] == [c.name for c in result.columns if c.quantity in SWEPT]
    for row, column in enumerate(sweep.columns):
        values = result[column.name]
        np.testing.assert_allclose(sweep.rms[row, at], np.sqrt(np.mean(values**2)), rtol=1e-12)
        largest = int(np.abs(values).argmax())
        assert abs(sweep.peak[row, at]) == abs(values[largest]), column.name
        assert sweep.peak[row, at] == values[result.time == sweep.peak_time[row, at]]


def test_sizes_are_those_of_analyses_at_these_cutoffs(tmp_path: Path) -> None:
    table = smooth(400, 3)
    table[:, 1:] += 0.003 * np.random.default_rng(0).standard_normal((400, 3))
    log, time = write_csv(tmp_path / "log.csv", table), np.arange(500) / 100
    push = Load("push", "link3", np.column_stack([np.sin(40 * time), time, 0 * time]), time=time)
    given: dict[str, Any] = {"payloads": [Payload("link2", 0.4, (0.1, 0.0, 0.0))], "loads": [push]}
    given |= {"reactions": ["joint1"], "induced": ["joints"]}
    how = Processing("savitzky-golay", 9, 3, Lowpass(7.0, 3, "even"), "trim", "gradient", 0.5, 3.0)
    found = analyze(log, PLANAR3, processing=how, cutoff_sweep=(4.0, 12.0, 2), **given)
    assert found.cutoff_sweep is not None
    np.testing.assert_array_equal(found.cutoff_sweep.cutoffs, [4.0, 7.0, 12.0])
    for cutoff in (4.0, 7.0, 12.0):
        other = replace(how, lowpass=Lowpass(cutoff, 3, "even"))
        held_against(found.cutoff_sweep, cutoff, analyze(log, PLANAR3, processing=other, **given))


def test_loads_of_files_and_contacts_stay_at_their_own_cutoff(tmp_path: Path) -> None:
    names = ("pelvis_tx", "pelvis_ty", "pelvis_tilt", "hip_flexion_r", "knee_angle_r", "ankle_angle_r")
    write_package(generate(read_system(LEG), ["numpy"]), tmp_path / "leg")
    log = write_csv(tmp_path / "log.csv", smooth(120, 6) * [1, 0.3, 0.3, 0.3, 0.3, 0.3, 0.3], names)
    time = np.arange(121) / 100
    heads = [f"shank/force_{axis}" for axis in "xyz"]
    rough = 40 * np.random.default_rng(1).standard_normal((121, 3))
    write_csv(tmp_path / "push.csv", np.column_stack([time, rough]), heads)
    plate = Load("foot", "foot", np.stack([0 * time, 500 * (time > 0.4), 0 * time], 1), time=time)
    held = Contacts((Contact("foot", "held", (0.1, -0.06, 0.0), name="sole"),), loads=(plate,))
    given: dict[str, Any] = {"loads": [tmp_path / "push.csv"], "loads_cutoff": 9.0, "contacts": held}
    how = Processing(lowpass=Lowpass(6.0))
    sweep = analyze(log, tmp_path / "leg", processing=how, cutoff_sweep=(5.0, 15.0, 2), **given).cutoff_sweep
    other = analyze(log, tmp_path / "leg", processing=Processing(lowpass=Lowpass(15.0)), **given)
    held_against(sweep, 15.0, other)


def test_the_command_writes_table_record_figure_page_and_lines(tmp_path: Path) -> None:
    log = write_csv(tmp_path / "log.csv", smooth(300, 3))
    (tmp_path / "bodies.toml").write_text('schema = 1\n[all]\nmass = "10 %"\n')
    words = ["analyze", log, "--robot", PLANAR3, "--cutoff", 6, "--cutoff-sweep", "4,12,3"]
    words += ["--uncertain", "bodies.toml", "--trace", "joint1", "--figure", "cutoff", "--no-page"]
    done = run_linkwise(*words, "--out", "a", folder=tmp_path)
    assert not done.returncode, done.stderr
    found = analyze(log, PLANAR3, processing=Processing(lowpass=Lowpass(6.0)), cutoff_sweep=(4, 12, 3))
    sweep = found.cutoff_sweep
    assert sweep is not None
    assert sweep.sentence in done.stdout
    told = [line.partition(":")[0].strip() for line in done.stdout.splitlines() if line.startswith("  tau")]
    assert told[0] == sweep.columns[sweep.listed[0]].name
    assert len(told) == 5
    table = pq.read_table(tmp_path / "a" / "cutoff-sweep.parquet").to_pydict()
    order = np.argsort(-np.abs(sweep.change), kind="stable")
    assert table["column"] == [sweep.columns[row].name for row in order for _ in range(4)]
    for name, values in {"rms": sweep.rms, "peak": sweep.peak, "peak_time": sweep.peak_time}.items():
        np.testing.assert_array_equal(table[name], values[order].ravel())
    assert table["cutoff"][:4] == sweep.cutoffs.tolist()
    record = json.loads((tmp_path / "a" / "analysis.json").read_text())
    assert record["cutoff_sweep"] == sweep.record()
    assert {"cutoff.png", "cutoff-sweep.parquet"} <= set(record["files"])
    page = json.loads(page_data(found))["cutoff"]
    assert (page["sentence"], page["cutoffs"]) == (sweep.sentence, ["4 Hz", "6 Hz", "12 Hz"])
    assert len(page["shares"]) == len(sweep.listed)
    done = run_linkwise(*words, "--out", "b", "--format", "csv", folder=tmp_path)
    rows = list(
        csv.DictReader((tmp_path / "b" / "cutoff-sweep.csv").read_text(encoding="utf-8").splitlines())
    )
    assert [float(row["rms"]) for row in rows] == table["rms"]


def test_lines_of_the_figure_are_the_sizes(tmp_path: Path) -> None:
    log = write_csv(tmp_path / "log.csv", smooth(300, 3))
    found = analyze(log, PLANAR3, processing=Processing(lowpass=Lowpass(6.0)), cutoff_sweep=(4, 12, 3))
    assert found.cutoff_sweep is not None
    left, right = found.figure("cutoff").axes[:2]
    for panel, at in ((left, 0), (right, 1)):
        lines = {line.get_label(): line.get_ydata() for line in panel.get_lines()}
        for label, name in (
            ("joint torque", "tau/joint1"),
            ("acc. of joint2 through link3", "tau_qdd/joint1/link3/joint2"),
            ("gravity through link1", "tau_gravity/joint1/link1"),
        ):
            np.testing.assert_array_equal(lines[label], np.abs(found.cutoff_sweep[name][at]))


def test_the_figure_names_the_joints_that_it_leaves_out(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    log = write_csv(tmp_path / "log.csv", smooth(300, 3))
    found = analyze(log, PLANAR3, processing=Processing(lowpass=Lowpass(6.0)), cutoff_sweep=(4, 12, 3))
    assert "Not drawn" not in found.figure("cutoff").get_supxlabel()
    monkeypatch.setattr("linkwise.analysis.show.cutoff_figure.JOINTS", 1)
    figure = found.figure("cutoff")
    shown = figure.axes[0].get_title("left").partition(":")[0]
    others = [f"joint{k}" for k in (1, 2, 3) if f"joint{k}" != shown]
    words = " ".join(figure.get_supxlabel().split())
    assert f"Not drawn, as their shares change less: {', '.join(others)}." in words


def test_next_to_nothing_is_left_out_of_the_list_and_not_of_the_table(tmp_path: Path) -> None:
    table = smooth(300, 3) * [1, 1, 1, 1e-5]
    log = write_csv(tmp_path / "log.csv", table)
    found = analyze(log, PLANAR3, processing=Processing(lowpass=Lowpass(6.0)), cutoff_sweep=(4, 12, 2))
    sweep = found.cutoff_sweep
    assert sweep is not None
    listed = {sweep.columns[row].name for row in sweep.listed}
    assert "tau_qdd/joint1/link3/joint3" not in listed
    assert "tau_qdd/joint1/link3/joint2" in listed
    assert sweep["tau_qdd/joint1/link3/joint3"][0].all()


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("12,4", "--cutoff-sweep 12,4: 12 Hz is not below 4 Hz; give the lower first"),
        ("4,4", "--cutoff-sweep 4,4: 4 Hz is not below 4 Hz; give the lower first"),
        ("0,4", "--cutoff-sweep 0,4: give frequencies in Hz above 0"),
        ("4,inf", "--cutoff-sweep 4,inf: give frequencies in Hz above 0"),
        ("4,12,1", "--cutoff-sweep 4,12,1: give a whole number of cutoffs from 2 to 1000"),
        ("4,12,2.5", "--cutoff-sweep 4,12,2.5: give a whole number of cutoffs from 2 to 1000"),
        ("4", "--cutoff-sweep 4: write it as LOW,HIGH or LOW,HIGH,COUNT, in Hz"),
        ("4,12,3,5", "--cutoff-sweep 4,12,3,5: write it as LOW,HIGH or LOW,HIGH,COUNT, in Hz"),
        ("4,x", "--cutoff-sweep 4,x: write it as LOW,HIGH or LOW,HIGH,COUNT, in Hz"),
    ],
)
def test_what_is_no_range_is_refused(text: str, why: str) -> None:
    with pytest.raises(LinkwiseError) as told:
        AnalysisChoices(processing=Processing(lowpass=Lowpass(6.0)), cutoff_sweep=text)
    assert str(told.value) == why


def test_a_sweep_without_a_cutoff_or_above_half_the_rate_is_refused(tmp_path: Path) -> None:
    log, filtered = write_csv(tmp_path / "log.csv", smooth(300, 3)), Processing(lowpass=Lowpass(6.0))
    with pytest.raises(LinkwiseError, match="--cutoff-sweep goes with --cutoff"):
        AnalysisChoices(cutoff_sweep="4,12")
    with pytest.raises(LinkwiseError, match="--cutoff-sweep goes with --cutoff"):
        analyze(log, PLANAR3, cutoff_sweep=(4, 12))
    with pytest.raises(LinkwiseError, match=r"--cutoff-sweep 50 Hz is not below half the sampling rate"):
        analyze(log, PLANAR3, processing=filtered, cutoff_sweep=(4, 50))
    with pytest.raises(LinkwiseError, match="add --cutoff-sweep, whose sizes it draws"):
        analyze(log, load_robot(PLANAR3), processing=filtered).figure("cutoff")
