"""Cycles of a trial: in order, wherever blocks of samples end, and without what lies between them."""

import json
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from helpers.motion_logs import JOINTS, LEG, write_csv
from helpers.studies import Here
from linkwise import LinkwiseError
from linkwise.study import run_study
from linkwise.study.cycles import CycleSink, without_flicker, written_cycles

TIME = np.arange(0, 60, 0.01)
ROWS = np.stack([TIME, np.sin(TIME), TIME**2])


@pytest.mark.parametrize("size", [37, 500, 6000])
def test_cycles_are_the_same_wherever_blocks_end(size: int) -> None:
    spans = [(0.0, 1.3), (1.3, 2.0), (1.5, 2.5), (20.004, 31.006), (55.0, TIME[-1])]
    found: dict[int, tuple[np.ndarray, np.ndarray]] = {}
    sink = CycleSink(spans, 11, lambda number, *rows: found.update({number: rows}))
    most = 0
    for at in range(0, len(TIME), size):
        sink(ROWS[:, at : at + size])
        most = max(most, sum(block.shape[1] for block in sink._kept))
    sink.finish()
    for number, (start, end) in enumerate(spans):
        at = np.linspace(start, end, 11)
        points, samples = found[number]
        np.testing.assert_allclose(points, [at, np.sin(at), at**2], atol=1e-8)
        inside = [at for at in TIME if start < at < end]
        np.testing.assert_allclose(samples[0], [start, *inside, end], rtol=0, atol=1e-12)
        np.testing.assert_allclose(samples[1], np.sin(samples[0]), atol=1e-8)
    assert most <= 1200 + 2 * size, "the longest cycle, and not what lies between"


BAD = {
    "no header": ("a,b\n", "name its columns trial, start and end"),
    "a word": ("trial,start,end\na,x,2\n", "row 2: start and end are numbers"),
    "backwards": ("trial,start,end\na,0,1\na,2,1\n", "row 3: the cycle from 2 to 1 s does not go forwards"),
    "no number": ("trial,start,end\na,nan,2\n", "row 2: the cycle from nan to 2 s does not go forwards"),
    "a column twice": ("trial,start,end,start\na,1,2,0\n", "columns 2 and 4 are both named 'start'"),
    "latin": ("trial,start,end\n\xe4,1,2\n", "not a table of text in UTF-8"),
}


@pytest.mark.parametrize("case", BAD)
def test_a_table_that_is_none_is_told_with_its_row(case: str, tmp_path: Path) -> None:
    text, message = BAD[case]
    table = tmp_path / "cycles.csv"
    table.write_text(text, encoding="latin-1")
    with pytest.raises(LinkwiseError, match=message):
        written_cycles(str(table))


WAYS = {
    "a column": ('start = "stands>0.5"', [(0.5, 1.5), (1.5, 2.5)]),
    "as long as it lasts": ('during = "stands"', [(0.5, 0.79), (1.5, 1.79), (2.5, 2.79)]),
    "a load": ('start = "push>20"', [(0.244, 1.244), (1.244, 2.244)]),
    "a table": ('table = "cycles.csv"', [(0.305, 0.9), (1.0, 2.0), (2.0, 2.99)]),
    "a length": ('table = "cycles.csv"\nshortest = 0.7', [(1.0, 2.0), (2.0, 2.99)]),
}


@pytest.mark.parametrize("way", WAYS)
def test_cycles_begin_by_a_column_a_load_or_a_table(way: str, tmp_path: Path) -> None:
    text, spans = WAYS[way]
    time = np.round(np.arange(0, 3, 0.01), 2)
    stands, pushed = (((time - begin) % 1 < 0.295) & (time >= begin) for begin in (0.5, 0.25))
    q = np.sin(time)[:, None] * [1, 0.5, 0.2]
    write_csv(tmp_path / "a.csv", np.column_stack([time, q, stands]), (*JOINTS, "stands"))
    forces = np.column_stack([time, 50.0 * pushed, 0 * time, 0 * time])
    write_csv(tmp_path / "forces.csv", forces, [f"push:link3/force_{axis}" for axis in "xyz"])
    (tmp_path / "cycles.csv").write_text("trial,start,end\nb,0,1\na,1,2\na,0.305,0.9\na,2,2.99\n")
    entry = 'log = "a.csv"\nrobot = "planar3"\nloads = ["forces.csv"]\n'
    file = tmp_path / "study.toml"
    trials = "".join(f'[[trial]]\nname = "{name}"\n{entry}' for name in "ab")
    choices = "[analysis]\nignore_extra = true\n"
    file.write_text(f"schema = 1\npages = false\n{choices}[cycles]\n{text}\n{trials}")
    assert run_study(file, tmp_path / "out", Here()).broken == ()
    table = pd.read_parquet(tmp_path / "out/trials/a/samples.parquet")
    ends = table.groupby("cycle").time.agg(["min", "max"]).to_numpy()
    np.testing.assert_allclose(ends, spans, atol=1e-9)


@pytest.mark.parametrize("way", ["start", "during"])
def test_cycles_by_a_plate_begin_where_its_own_samples_cross_the_threshold(way: str, tmp_path: Path) -> None:
    """The motion has 50 Hz, the plate 1000 Hz, and it ends before the motion: less of that is analysed."""
    time, own = np.arange(0, 4, 0.02), np.arange(0, 3.2, 0.001)
    write_csv(tmp_path / "a.csv", np.column_stack([time, np.sin(time)[:, None] * [1, 0.5, 0.2]]))
    turns = 2 * np.pi * 1.3
    forces = np.column_stack([own, 60 * np.sin(turns * own), 80 * np.sin(turns * own), 0 * own])
    forces[np.sin(turns * own) < 0, 1:] = 0
    write_csv(tmp_path / "forces.csv", forces, [f"push:link3/force_{axis}" for axis in "xyz"])
    file, out = tmp_path / "study.toml", tmp_path / "out"
    trial = '[[trial]]\nlog = "a.csv"\nrobot = "planar3"\nloads = ["forces.csv"]\nto_time = 3.1\n'
    file.write_text(f'schema = 1\npages = false\n[cycles]\n{way} = "push>40"\n{trial}')
    assert run_study(file, out, Here()).broken == ()
    found = pd.read_parquet(out / "trials/a/_cycles.parquet")[["start", "end"]]
    up = (np.arange(5) + np.arcsin(0.4) / (2 * np.pi)) / 1.3
    down = (np.arange(5) + 0.5 - np.arcsin(0.4) / (2 * np.pi)) / 1.3
    ends = np.stack([up[:-1], up[1:]], 1) if way == "start" else np.stack([up, down], 1)
    expected = ends[ends[:, 1] < 3.1]
    assert len(expected) == (3 if way == "start" else 4)
    np.testing.assert_allclose(found, expected, rtol=0, atol=2e-6)  # a thousandth of the plate's own step
    (told,) = json.loads((out / "study.json").read_text())["cycles"]["begin_and_end"]
    said = "force of push above 40 N; between the load's own samples, of 1000 Hz, by straight lines"
    assert told == {"by": said, "trials": ["a"]}
    file.write_text(file.read_text().replace("to_time = 3.1\n", ""))
    message = r"it ends at 3.199 s, .*; analyse less of the motion, by \[analysis\] from_time and "
    with pytest.raises(LinkwiseError, match=message):
        run_study(file, out, Here())


def test_cycles_by_a_filtered_load_begin_where_its_force_as_measured_crosses_the_threshold(
    tmp_path: Path,
) -> None:
    """A filter spreads the steep edges, and swings below zero beside them by more than the threshold.

    Noise above the threshold for less than half of its period counts neither alone nor beside an edge.
    """
    time, own = np.arange(0, 1.5, 0.01), np.round(np.arange(0, 1.5, 0.001), 3)
    write_csv(tmp_path / "a.csv", np.column_stack([time, np.sin(time)[:, None] * [1, 0.5, 0.2]]))
    stands = ((own > 0.2) & (own < 0.5)) | ((own > 0.8) & (own < 1.1))
    noise = 30.0 * np.isin(own, [0.1, 0.502, 0.65, 0.796])
    forces = np.column_stack([own, 800.0 * stands + noise, 0 * own, 0 * own])
    write_csv(tmp_path / "forces.csv", forces, [f"push:link3/force_{axis}" for axis in "xyz"])
    choices = "[analysis]\nloads_cutoff = 20\n"
    trial = '[[trial]]\nlog = "a.csv"\nrobot = "planar3"\nloads = ["forces.csv"]\n'
    file = tmp_path / "study.toml"
    file.write_text(f'schema = 1\npages = false\n{choices}[cycles]\nduring = "push>20"\n{trial}')
    assert run_study(file, tmp_path / "out", Here()).broken == ()
    found = pd.read_parquet(tmp_path / "out/trials/a/_cycles.parquet")[["start", "end"]]
    np.testing.assert_allclose(found, [(0.2, 0.5), (0.8, 1.1)], rtol=0, atol=0.001)


def test_flicker_is_left_out_and_then_gaps_are_filled() -> None:
    up, down = np.array([0.1, 0.3, 0.305, 0.41, 0.9]), np.array([0.05, 0.102, 0.304, 0.4, 0.6, 0.95])
    found = without_flicker(up, down, 0.025)
    np.testing.assert_array_equal(np.concatenate(found), [0.305, 0.9, 0.05, 0.6, 0.95])
    np.testing.assert_array_equal(np.concatenate(without_flicker(up, down, 0.0)), [*up, *down])


@pytest.mark.parametrize(
    ("asked", "start", "message"),
    [
        ("from_time = 7", "stands", "[analysis] from_time 7: 0 samples are there, and 2 are needed"),
        ("from_time = 2\nto_time = 1", "stands", "[analysis] from_time 2 is not before [analysis] to_time 1"),
        ("", "right>20", "trial 'a': [cycles] right: no load, contact or column 'right'"),
    ],
)
def test_messages_name_keys_of_the_study_and_no_flags(
    asked: str, start: str, message: str, tmp_path: Path
) -> None:
    file = _stepping(tmp_path, asked, start)
    with pytest.raises(LinkwiseError) as raised:
        run_study(file, tmp_path / "out", Here())
    assert message in str(raised.value)
    assert "--" not in str(raised.value)


def test_a_trial_without_a_cycle_is_told_how_often_one_begins(tmp_path: Path) -> None:
    (broken,) = run_study(_stepping(tmp_path, "to_time = 1.5", "stands"), tmp_path / "out", Here()).broken
    told = "no whole cycle by 'stands' between 0 and 1.5 s; it begins 1 and ends 2 times there"
    assert broken.reason == f"a.csv: {told}"


def _stepping(folder: Path, asked: str, start: str) -> Path:
    """Write a study of one log of 4 s that stands for 0.3 s of each, and return its file."""
    time = np.round(np.arange(0, 4, 0.01), 2)
    q = np.sin(time)[:, None] * [1, 0.5, 0.2]
    write_csv(folder / "a.csv", np.column_stack([time, q, time % 1 < 0.295]), (*JOINTS, "stands"))
    choices = f'[analysis]\nignore_extra = true\n{asked}\n[cycles]\nstart = "{start}"\n'
    trial = '[[trial]]\nlog = "a.csv"\nrobot = "planar3"\n'
    file = folder / "study.toml"
    file.write_text(f"schema = 1\npages = false\n{choices}{trial}")
    return file


def test_cycles_lie_in_the_range_of_time_that_is_analysed(tmp_path: Path) -> None:
    time = np.round(np.arange(0, 4, 0.01), 2)
    q = np.sin(time)[:, None] * [1, 0.5, 0.2]
    write_csv(tmp_path / "a.csv", np.column_stack([time, q, time % 1 < 0.295]), (*JOINTS, "stands"))
    asked = "[analysis]\nignore_extra = true\nfrom_time = 0.5\nto_time = 3.5\n"
    file = tmp_path / "study.toml"
    trial = '[[trial]]\nlog = "a.csv"\nrobot = "planar3"\n'
    for way in ('start = "stands"', 'table = "cycles.csv"'):
        (tmp_path / "cycles.csv").write_text("trial,start,end\na,0.4,1\na,1,2\na,2,3\na,3,3.6\n")
        file.write_text(f"schema = 1\npages = false\n{asked}[cycles]\n{way}\n{trial}")
        assert run_study(file, tmp_path / "out", Here()).broken == ()
        table = pd.read_parquet(tmp_path / "out/trials/a/samples.parquet")
        ends = table.groupby("cycle").time.agg(["min", "max"]).to_numpy()
        np.testing.assert_allclose(ends, [(1, 2), (2, 3)], atol=1e-9)


def test_a_cycle_may_begin_between_the_first_two_samples(tmp_path: Path) -> None:
    time = np.round(np.arange(0, 3, 0.01), 2)
    write_csv(tmp_path / "a.csv", np.column_stack([time, np.sin(time)[:, None] * [1, 0.5, 0.2]]))
    forces = np.column_stack([time, 50.0 * ((time % 1 >= 0.25) & (time % 1 < 0.55)), 0 * time, 0 * time])
    write_csv(tmp_path / "forces.csv", forces, [f"push:link3/force_{axis}" for axis in "xyz"])
    trial = '[[trial]]\nlog = "a.csv"\nrobot = "planar3"\nloads = ["forces.csv"]\nfrom_time = 0.24\n'
    file = tmp_path / "study.toml"
    file.write_text(f'schema = 1\npages = false\n[cycles]\nstart = "push>20"\n{trial}')
    assert run_study(file, tmp_path / "out", Here()).broken == ()
    found = pd.read_parquet(tmp_path / "out/trials/a/_cycles.parquet")[["start", "end"]]
    np.testing.assert_allclose(found, [(0.244, 1.244), (1.244, 2.244)], rtol=0, atol=1e-9)


def test_cycles_last_as_long_as_a_contact_is_on(tmp_path: Path) -> None:
    time = np.round(np.arange(0, 3, 0.01), 2)
    names = ["pelvis_tx", "pelvis_ty", "pelvis_tilt", "hip_flexion_r", "knee_angle_r", "ankle_angle_r"]
    log = np.column_stack([time, 0.1 * np.sin(time)[:, None] * np.ones(6), (time - 0.5) % 1 < 0.295])
    write_csv(tmp_path / "a.csv", log, (*names, "stands"))
    held = 'contact = ["sole:foot=held@0.1,-0.06,0"]\ncontact_while = ["sole=stands"]\n'
    trial = f'[cycles]\nduring = "sole"\n[[trial]]\nlog = "a.csv"\nrobot = "{LEG}"\n'
    file = tmp_path / "study.toml"
    file.write_text(f"schema = 1\npages = false\n[analysis]\nignore_extra = true\n{held}{trial}")
    assert run_study(file, tmp_path / "out", Here()).broken == ()
    table = pd.read_parquet(tmp_path / "out/trials/a/_cycles.parquet")
    np.testing.assert_allclose(table[["start", "end"]], [(0.5, 0.79), (1.5, 1.79), (2.5, 2.79)], atol=1e-9)
