"""Columns matched to joints, units, time and gaps."""

import re
from pathlib import Path

import numpy as np
import pytest
from helpers.motion_logs import JOINTS, smooth, write_csv, write_mot
from linkwise.analysis.column_matching import select
from linkwise.analysis.disk_rows import collected, let_go
from linkwise.analysis.even_time import resampled
from linkwise.analysis.logs import open_log
from linkwise.analysis.samples import read_samples
from linkwise.analysis.settings import Reading
from linkwise.errors import LinkwiseError
from linkwise.progress import silent

ANGLES = ("rad", "rad", "rad")


def read(path, reading=None, units=ANGLES, buffer=None):
    return read_samples(open_log(path), JOINTS, units, reading or Reading(), silent, buffer)


def test_samples_are_the_log(tmp_path):
    table = smooth(40, 3)
    path = write_csv(tmp_path / "a.csv", table)
    for buffer in (None, tmp_path):
        samples = read(path, buffer=buffer)
        np.testing.assert_array_equal(samples.time, table[:, 0])
        np.testing.assert_array_equal(samples.q, table[:, 1:])
        assert samples.rate == pytest.approx(100, rel=1e-12)
    assert [file.name for file in tmp_path.iterdir()] == ["a.csv"]


def test_degrees_turn_angles_only(tmp_path):
    table = np.round(smooth(9, 3) * [1, 50, 50, 50], 8)
    path = write_mot(tmp_path / "a.mot", table, JOINTS)
    q = read(path, units=("m", "rad", "rad")).q
    np.testing.assert_array_equal(q[:, 0], table[:, 1])
    np.testing.assert_allclose(q[:, 1:], np.radians(table[:, 2:]), rtol=1e-15)
    with pytest.raises(LinkwiseError, match="--units rad contradicts the file, whose angles are in degrees"):
        read(path, Reading(units="rad"))


@pytest.mark.parametrize(
    ("scale", "units", "warning"),
    [
        (60, "rad", "reaches 54 rad, 8.6 turns: if that is degrees, pass --units deg"),
        (7.5, "rad", "reaches 6.75 rad, 1.1 turns: if that is degrees, pass --units deg"),
        (1, "deg", "if that is radians, pass --units rad"),
        (1, None, None),
        (60, "deg", None),
    ],
)
def test_unlikely_units_are_warned_of(tmp_path, scale, units, warning):
    path = write_csv(tmp_path / "a.csv", smooth(400, 3) * [1, scale, scale, scale])
    warnings = read(path, Reading(units=units)).warnings
    assert [warning in text for text in warnings] == ([True] if warning else [])


def test_angles_that_are_wrapped_at_a_turn_are_warned_of(tmp_path):
    table = smooth(400, 3)
    table[:, 1] = np.mod(3.0 * table[:, 0] + np.pi, 2.0 * np.pi) - np.pi
    (warning,) = read(write_csv(tmp_path / "a.csv", table), Reading(units="rad"), ("rad",) * 3).warnings
    assert warning == "joint 'joint1' leaps by a turn twice: unwrap its angles, as numpy.unwrap does"


def test_angles_past_their_joints_limits_and_columns_in_degrees_want_their_unit_told(tmp_path):
    path = write_csv(tmp_path / "a.csv", smooth(400, 3) * [1, 5, 1, 1])
    limited = {"joint_units": ANGLES, "progress": silent, "reach": (1.2, np.inf, 0.1)}
    with pytest.raises(LinkwiseError, match=r"'joint1' reaches 2.5 rad, the limits of its joint 1.2: say"):
        read_samples(open_log(path), JOINTS, reading=Reading(), **limited)
    assert not read_samples(open_log(path), JOINTS, reading=Reading(units="rad"), **limited).warnings
    named = write_csv(tmp_path / "b.csv", smooth(400, 3), ["joint1 [deg]", "degrade", "joint3"])
    mapping = {"joint1 [deg]": "joint1", "degrade": "joint2"}
    with pytest.raises(LinkwiseError, match=r"column 'joint1 \[deg\]' speaks of degrees: say"):
        read(named, Reading(mapping=mapping))
    assert not read(named, Reading(mapping=mapping, units="rad")).warnings


def test_lengths_in_mm_are_warned_of(tmp_path):
    path = write_csv(tmp_path / "a.csv", smooth(400, 3) * [1, 900, 1, 1])
    (warning,) = read(path, units=("m", "rad", "rad")).warnings
    assert warning == "column 'joint1' reaches 450 m: if that is mm, divide it by 1000"


def test_resampling_that_makes_fast_motion_slow_is_warned_of(tmp_path):
    path = write_csv(tmp_path / "a.csv", smooth(400, 3, rate=1000))
    (warning,) = read(path, Reading(resample=100)).warnings
    assert warning.startswith("--resample 100 of 1000 samples a second: what moves faster than 50 Hz comes")
    assert not read(path, Reading(resample=1000)).warnings


def test_two_columns_of_one_joint_are_named(tmp_path):
    path = write_csv(tmp_path / "a.csv", smooth(30, 4), (*JOINTS, "/jointset/a/joint2/value"))
    with pytest.raises(LinkwiseError, match=r"columns 'joint2' and '/jointset/a/joint2/value' are both of"):
        read(path)
    mapping = (("joint1", "joint3"), ("joint2", "joint3"))
    with pytest.raises(LinkwiseError, match=r"--map joint2=joint3: column 'joint1' is that joint already"):
        read(path, Reading(mapping=mapping))
    with pytest.raises(LinkwiseError, match=r"mapping \['joint1'\]: give pairs of a column and a joint"):
        Reading(mapping=["joint1"])


def test_speeds_of_old_states_are_left_out(tmp_path):
    path = write_csv(tmp_path / "a.csv", smooth(30, 6), (*JOINTS, *(f"{name}_u" for name in JOINTS)))
    assert read(path).ignored == ("joint1_u", "joint2_u", "joint3_u")


def test_angles_of_many_turns_want_their_unit_told(tmp_path):
    path = write_csv(tmp_path / "a.csv", smooth(400, 3) * [1, 60, 60, 60])
    with pytest.raises(LinkwiseError, match=r"a.csv: column 'joint.' reaches 54 rad, 8.6 turns: say what"):
        read(path)


@pytest.mark.parametrize(
    ("columns", "reading", "message"),
    [
        (
            ("time", "joint1", "joint2"),
            {},
            "no column for joint 'joint3' .found none.; hold what the log leaves out with --lock joint3=V",
        ),
        (("time", *JOINTS, "emg"), {}, "no joint for column 'emg'; .* --ignore-extra"),
        (("stamp", *JOINTS), {}, "no column 'time' .* --time COLUMN"),
        (("time", *JOINTS), {"mapping": (("a", "joint1"),)}, "the log has no column 'a'"),
        (("time", *JOINTS), {"mapping": (("joint1", "x"),)}, "the robot has no joint 'x'"),
        (("time", *JOINTS[1:]), {"mapping": (("time", "joint1"),)}, "'time' is asked to be"),
        (("time", *JOINTS), {"time": "t"}, "--time t: no such column"),
    ],
)
def test_columns_that_do_not_fit(columns, reading, message):
    with pytest.raises(LinkwiseError, match=message):
        select(columns, JOINTS, Reading(**reading))


def test_columns_by_map_time_and_leave():
    reading = Reading(time="clock", mapping=(("q3", "joint3"),), ignore_extra=True)
    found = select(("joint2", "q3", "emg", "clock", "joint1"), JOINTS, reading)
    assert (found.time, found.joints, found.ignored) == (3, (4, 0, 1), ("emg",))


STATES = ("time", *(f"/jointset/j/{joint}/{kind}" for joint in JOINTS for kind in ("value", "speed")))


def test_opensim_states_are_matched_by_the_coordinate():
    found = select(STATES, JOINTS, Reading())
    assert (found.joints, found.ignored) == ((1, 3, 5), STATES[2::2])
    with pytest.raises(LinkwiseError, match="no joint for column '/forceset/soleus/activation'; leave"):
        select((*STATES, "/forceset/soleus/activation"), JOINTS, Reading())
    twice = (
        r"'joint1' \(found '/jointset/j/joint1/value', '/jointset/other/joint1/value'\); name it with --map"
    )
    with pytest.raises(LinkwiseError, match=twice):
        select((*STATES, "/jointset/other/joint1/value"), JOINTS, Reading())


def test_a_path_of_opensim_is_its_coordinate_wherever_it_comes_from():
    paths = ("time", "/jointset/j/joint1", "j/joint2/value", "angle")
    reading = Reading(mapping=(("angle", "/jointset/j/joint3/value"),))
    assert select(paths, JOINTS, reading).joints == (1, 2, 3)
    with pytest.raises(LinkwiseError, match="no column for joint 'joint1'"):
        select(("time", "/jointset/j/joint1/speed", *JOINTS[1:]), JOINTS, Reading())


def test_each_joint_that_is_wanted_stands_beside_the_nearest_columns_of_the_log():
    joints = ("hip_flexion_r", "knee_angle_r", "ankle_angle_r")
    columns = ("time", "emg", "AnkleAngleR", "knee_angle_left", "/jointset/hip/hip_flex_r/value", "knee_r")
    with pytest.raises(LinkwiseError) as told:
        select(columns, joints, Reading())
    assert str(told.value) == (
        "no column for joint 'hip_flexion_r' (found '/jointset/hip/hip_flex_r/value', 'AnkleAngleR'), "
        "'knee_angle_r' (found 'knee_angle_left', 'AnkleAngleR'), "
        "'ankle_angle_r' (found 'AnkleAngleR', 'knee_angle_left'); name it with --map COLUMN=hip_flexion_r, "
        "or hold what the log leaves out with --lock hip_flexion_r=VALUE --lock knee_angle_r=VALUE "
        "--lock ankle_angle_r=VALUE, in rad or m"
    )


@pytest.mark.parametrize(
    ("row", "time", "message"),
    [
        (5, 0.04, r"row 7, time column: time repeats 0.04 s; sort"),
        (5, 0.01, r"row 7, time column: time runs back to 0.01 s"),
        (5, 0.053, r"row \d+, time column: a step of .* --resample"),
        (slice(5, None), None, r"rows 6 to 7, time column: a gap of 1.01 s where steps are 0.01 s"),
    ],
)
def test_time_must_be_even(tmp_path, row, time, message):
    table = smooth(10, 3)
    table[row, 0] = table[row, 0] + 1 if time is None else time
    with pytest.raises(LinkwiseError, match=message):
        read(write_csv(tmp_path / "a.csv", table))


def test_nan_is_named(tmp_path):
    table = smooth(10, 3)
    table[4, 2] = np.nan
    with pytest.raises(LinkwiseError, match=r"a.csv: row 6, column 'joint2': nan is not a sample"):
        read(write_csv(tmp_path / "a.csv", table))


def test_rounded_time_is_even_enough(tmp_path):
    table = smooth(200, 3, rate=60)
    table[:, 0] = np.round(table[:, 0], 6)
    assert read(write_csv(tmp_path / "a.csv", table)).rate == pytest.approx(60, rel=1e-6)


def test_resampling_follows_the_signal_and_not_the_window(tmp_path):
    rng = np.random.default_rng(1)
    time = np.cumsum(0.01 * rng.uniform(0.7, 1.3, 3000))
    table = np.column_stack([time, np.sin(5 * time), np.cos(3 * time)])
    whole = np.concatenate([*resampled(table, 100.0)])
    np.testing.assert_allclose(whole[:, 1], np.sin(5 * whole[:, 0]), atol=1e-7)
    np.testing.assert_allclose(np.diff(whole[:, 0]), 0.01, rtol=1e-9)
    parts = np.concatenate([*resampled(table, 100.0, rows=97)])
    np.testing.assert_allclose(parts, whole, atol=1e-12)
    path = write_csv(tmp_path / "a.csv", table, ("joint1", "joint2"))
    samples = read_samples(open_log(path), JOINTS[:2], ANGLES[:2], Reading(resample=50), silent)
    np.testing.assert_allclose(samples.q, whole[::2, 1:][: len(samples.q)], atol=1e-12)


def test_too_short(tmp_path):
    with pytest.raises(LinkwiseError, match="1 samples; a movement needs 5"):
        read(write_csv(tmp_path / "a.csv", smooth(1, 3)))


def test_a_rate_beyond_reason_is_refused(tmp_path):
    path = write_csv(tmp_path / "a.csv", smooth(73, 3, rate=60))
    message = r"--resample 1e\+12 Hz is more than 100 times the log's own mean rate of 60 Hz"
    with pytest.raises(LinkwiseError, match=message):
        read(path, Reading(resample=1e12), buffer=tmp_path)
    assert [file.name for file in tmp_path.iterdir()] == ["a.csv"]


@pytest.mark.parametrize("rate", [0.0, -1.0, float("inf"), float("nan")])
def test_what_is_no_rate_is_refused(rate):
    with pytest.raises(LinkwiseError, match=r"--resample .*: give a rate in Hz above 0"):
        Reading(resample=rate)


def test_a_rate_below_one_is_one():
    assert Reading(resample=0.25).resample == 0.25


def test_resampling_reports_progress():
    seen = []
    blocks = [*resampled(smooth(50, 1), 200.0, rows=40, progress=lambda *step: seen.append(step))]
    assert [len(block) for block in blocks] == [40, 40, 19]
    assert seen == [("resampling", 40, 99), ("resampling", 80, 99), ("resampling", 99, 99)]


@pytest.mark.parametrize(("rate", "digits"), [(60, 3), (60, 4), (240, 3)])
def test_time_rounded_to_its_last_digit_is_even(tmp_path, rate, digits):
    table = smooth(300, 3, rate=rate)
    table[:, 0] = np.round(table[:, 0], digits)
    assert read(write_csv(tmp_path / "a.csv", table)).rate == pytest.approx(rate, rel=1e-4)


def test_jitter_is_not_rounding(tmp_path):
    table = smooth(300, 3, rate=60)
    table[:, 0] = np.round(table[:, 0], 3)
    table[100:, 0] += 0.001
    table[200:, 0] += 0.001
    with pytest.raises(LinkwiseError, match=r"time column: a step of .* --resample"):
        read(write_csv(tmp_path / "a.csv", table))


@pytest.mark.parametrize(("unit", "factor"), [("ms", 1000), ("µs", 10**6), ("ns", 10**9)])
def test_time_in_other_units_is_warned_of(tmp_path, unit, factor):
    table = smooth(30, 3) * [factor, 1, 1, 1]
    (warning,) = read(write_csv(tmp_path / "a.csv", table)).warnings
    assert warning.endswith(f" samples a second are few: if time is in {unit}, divide it by {factor}")
    assert read(write_csv(tmp_path / "b.csv", smooth(30, 3, rate=10))).warnings == ()


def test_a_header_without_a_unit_is_refused_unless_it_is_told(tmp_path):
    path = write_mot(tmp_path / "a.mot", smooth(30, 3), JOINTS)
    said = path.read_text(encoding="utf-8")
    path.write_text(said.replace("inDegrees=yes\n", ""), encoding="utf-8")
    with pytest.raises(LinkwiseError, match=r"a.mot: the header has no inDegrees: say .* --units deg or rad"):
        read(path)
    assert read(path, Reading(units="rad")).warnings == ()
    path.write_text(said.replace("inDegrees=yes", "inDegrees=maybe"), encoding="utf-8")
    with pytest.raises(LinkwiseError, match=r"a.mot: inDegrees='maybe' in the header is neither yes nor no"):
        read(path)


def test_a_last_row_that_may_be_cut_is_warned_of(tmp_path):
    path = write_csv(tmp_path / "a.csv", np.round(smooth(30, 3) + 1.1, 2) + 0.001)
    text = path.read_text(encoding="utf-8").rstrip("\n")
    path.write_text(text, encoding="utf-8")
    assert read(path).warnings == ()
    path.write_text(text[:-2], encoding="utf-8")
    (warning,) = read(path).warnings
    assert "the last row has no line end" in warning
    assert "may be cut off" in warning


@pytest.mark.parametrize(
    ("time", "message"),
    [
        ("{}e307", r"time column: it comes to 9e\+307 s; give seconds"),
        ("{}e-323", r"time column: steps of .*e-324 s; give seconds"),
    ],
)
def test_times_that_no_clock_shows(tmp_path, time, message):
    path = tmp_path / "a.csv"
    rows = "".join(f"{time.format(at)},1\n" for at in range(10))
    path.write_text(f"time,joint1\n{rows}", encoding="utf-8")
    with pytest.raises(LinkwiseError, match=message):
        read_samples(open_log(path), ("joint1",), ("rad",), Reading(), silent)


def test_splines_that_overflow_are_told(tmp_path):
    table = smooth(40, 1)
    table[20, 1] = 1e308
    path = write_csv(tmp_path / "a.csv", table, ("joint1",))
    message = (
        r"--resample overflows between 0 s and 0\.39 s: the log's values are too large there, up to 1e\+308"
    )
    with pytest.raises(LinkwiseError, match=message):
        read_samples(open_log(path), ("joint1",), ("rad",), Reading(resample=50.0), silent)


def test_rows_that_are_let_go_are_in_their_file_and_not_in_memory(tmp_path: Path) -> None:
    def held() -> int:
        """KiB of files' pages that this process has."""
        return int(re.search(r"RssFile:\s+(\d+)", Path("/proc/self/status").read_text())[1])

    rows = collected((np.full((1 << 16, 8), float(k)) for k in range(16)), 8, tmp_path)
    rows[5] = 7.5
    assert rows[-1, -1] == 15.0
    total, before = rows.sum(), held()
    let_go(rows)
    assert before - held() > 60_000
    assert (rows.sum(), rows[5, 3]) == (total, 7.5)
