"""Work and other integrals over cycles, held against Pinocchio's energies and tables of `analyze`."""

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pinocchio
import polars as pl
import pytest
from helpers.command_line import run_linkwise
from helpers.motion_logs import JOINTS, write_csv
from helpers.studies import CHOICES, CYCLES, HEAD, TRIALS, Here, write_study
from helpers.urdf_text import chain, joint
from linkwise import LinkwiseError
from linkwise.study import run_study
from linkwise.study.integrals import integral_unit
from scipy import stats
from scipy.interpolate import CubicSpline

ARM = chain(
    joint("ab", "a", "b", inner='<dynamics damping="0.4" friction="0.2"/>'),
    joint("bc", "b", "c", type="prismatic"),
    joint("cd", "c", "d"),
)
RATE = np.array([3.1, 4.4, 5.3])
SPANS = [(0.2503, 0.8007), (0.9, 1.3), (1.2999, 2.7402)]
"""Cycles of unlike length that begin and end between samples, and at some."""
COMPARE = '\n[[compare]]\nfactor = "condition"\nbetween = ["slow", "fast"]\n'
COMPARE += 'columns = ["integral*/power/joint1", "tau/joint1"]\n'
FIGURE = '\n[[figure]]\nname = "work"\ncolumns = ["integral/power/*"]\nby = "condition"\n'


def arms_study(folder: Path, rate: float) -> Any:
    """Integrals over SPANS of an arm that swings, one row a cycle."""
    time = np.arange(0, 3 + 0.5 / rate, 1 / rate)
    write_csv(folder / "log.csv", np.column_stack([time, np.sin(RATE * time[:, None])]), ("ab", "bc", "cd"))
    (folder / "arm.urdf").write_text(ARM)
    rows = [f"log,{start},{end}" for start, end in SPANS]
    (folder / "cycles.csv").write_text("\n".join(["trial,start,end", *rows]) + "\n")
    asked = '[analysis]\ninduced_power = true\n[cycles]\ntable = "cycles.csv"\n'
    trial = '[[trial]]\nlog = "log.csv"\nrobot = "arm.urdf"\n'
    file = folder / "study.toml"
    file.write_text(f"schema = 1\npages = false\n{asked}{trial}")
    assert run_study(file, folder / "out", Here()).broken == ()
    return pd.read_parquet(folder / "out/trials/log/_cycles.parquet")


def energy_at(time: float) -> float:
    """The energy of the arm by Pinocchio, where its motion is known."""
    model = pinocchio.buildModelFromXML(ARM)
    data = model.createData()
    q, qd = np.sin(RATE * time), RATE * np.cos(RATE * time)
    kinetic = pinocchio.computeKineticEnergy(model, data, q, qd)
    return float(kinetic + pinocchio.computePotentialEnergy(model, data, q))


def test_the_work_of_all_sources_in_a_cycle_is_the_change_of_energy(tmp_path: Path) -> None:
    """The error of the trapezoidal rule falls with the square of the step."""
    gains = np.array([energy_at(end) - energy_at(start) for start, end in SPANS])
    errors = []
    for rate in (100.0, 1000.0):
        folder = tmp_path / f"{rate:g}"
        folder.mkdir()
        table = arms_study(folder, rate)
        np.testing.assert_allclose(table[["start", "end"]], SPANS, rtol=1e-12)
        sources = table.filter(regex="^integral/gain_")
        assert any("damping" in name for name in sources)
        errors.append(np.abs(sources.sum(axis=1) - gains).max())
        whole = table.filter(regex="^integral/gain/").sum(axis=1)
        np.testing.assert_allclose(sources.sum(axis=1), whole, rtol=0, atol=1e-10)
    assert errors[1] < 1e-5 * np.abs(gains).max()
    assert 80 < errors[0] / errors[1] < 120


@pytest.fixture(scope="module")
def arms(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A study in cycles of four subjects, whose work and impulses are asked for."""
    folder = tmp_path_factory.mktemp("arms")
    cycles = f'{CYCLES}integrals = ["power/*", "tau/*", "qd/joint2"]\n'
    kept = 'pages = false\ncolumns = ["tau/*"]\n'
    file = write_study(folder, HEAD, kept, CHOICES, cycles, COMPARE, FIGURE, TRIALS, subjects=4)
    found = run_study(file, folder / "out", Here())
    assert (len(found.done), found.broken, found.warnings) == (16, (), ())
    return folder


def test_integrals_are_of_the_table_of_the_analysis_cut_at_the_cycles_times(arms: Path) -> None:
    log = arms / "data/S3/fast_2.csv"
    words = ["analyze", log, "--robot", "planar3", "--ignore-extra", "--out", "whole", "--no-page"]
    done = run_linkwise(*map(str, words), folder=arms)
    assert done.returncode == 0, done.stderr
    whole = pl.read_parquet(arms / "whole/analysis.parquet")
    cycles = pd.read_parquet(arms / "out/trials/S3-fast-2/_cycles.parquet")
    assert list(cycles.columns[:6]) == ["trial", "subject", "condition", "cycle", "start", "end"]
    assert cycles.cycle.tolist() == [0, 1, 2]
    time = whole["time"].to_numpy()
    for column in ("power/joint1", "power/joint3", "tau/joint2", "qd/joint2"):
        for _, row in cycles.iterrows():
            some = (time >= row.start - 1e-9) & (time <= row.end + 1e-9)
            values = whole[column].to_numpy()[some]
            for part, of_part in (
                ("integral", values),
                ("integral_positive", np.maximum(values, 0)),
                ("integral_negative", np.minimum(values, 0)),
            ):
                expected = np.trapezoid(of_part, time[some])
                assert row[f"{part}/{column}"] == pytest.approx(expected, rel=1e-9, abs=1e-12)
    q = CubicSpline(time, whole["q/joint2"].to_numpy())
    turned = q(cycles.end) - q(cycles.start)
    np.testing.assert_allclose(cycles["integral/qd/joint2"], turned, atol=2e-4)


def test_trials_and_groups_sum_up_their_cycles(arms: Path) -> None:
    names = ["integral/power/joint1", "integral_positive/power/joint2", "integral_negative/tau/joint3"]
    every = pd.concat(map(pd.read_parquet, sorted((arms / "out/trials").glob("*/_cycles.parquet"))))
    about = ["trial", "subject", "condition"]
    each = every.astype(dict.fromkeys(about, str)).melt(about, names, "column").groupby([*about, "column"])
    expected = each.value.agg(["mean", lambda x: x.std(ddof=0), "min", "max"])
    summary = pd.read_parquet(arms / "out/summary.parquet")
    units = summary.groupby("column").unit.unique().map("".join)
    assert [units[name] for name in names] == ["J", "J", "N·m·s"]
    found = summary.set_index([*about, "column"]).loc[expected.index]
    np.testing.assert_allclose(found[["mean", "std", "min", "max"]], expected, rtol=1e-9, atol=1e-12)
    subjects = expected["mean"].groupby(["condition", "subject", "column"]).mean()
    over = subjects.groupby(["condition", "column"]).agg(["mean", "std", "min", "max"])
    groups = pd.read_parquet(arms / "out/groups.parquet").query("statistic == 'mean'")
    of_groups = groups.set_index(["condition", "column"]).loc[over.index]
    np.testing.assert_allclose(of_groups[["mean", "std", "min", "max"]], over, rtol=1e-9, atol=1e-12)
    curves = set(pd.read_parquet(arms / "out/curves.parquet").column)
    assert not any(name.startswith("integral") for name in curves)


def test_works_are_compared_by_subject_and_curves_as_ever(arms: Path) -> None:
    summary = pd.read_parquet(arms / "out/summary.parquet")
    tests = pd.read_parquet(arms / "out/tests.parquet")
    column = "integral_positive/power/joint1"
    means = summary[summary.column == column].groupby(["condition", "subject"])["mean"].mean()
    expected = stats.ttest_rel(means["slow"], means["fast"])
    (found,) = (row for _, row in tests.iterrows() if row.column == column)
    assert (found.t, found.p, found.unit) == (
        pytest.approx(expected.statistic, rel=1e-9),
        pytest.approx(expected.pvalue, rel=1e-9),
        "J",
    )
    assert tests[tests.column == "tau/joint1"].threshold.notna().all(), "of whole curves"
    assert (arms / "out/work.svg").is_file()


@pytest.mark.parametrize(
    ("unit", "expected"),
    [("W", "J"), ("N·m", "N·m·s"), ("N", "N·s"), ("rad/s", "rad"), ("m/s²", "m/s"), ("1", "s"), ("m", "m·s")],
)
def test_an_integral_has_the_unit_of_what_it_is_of_times_seconds(unit: str, expected: str) -> None:
    assert integral_unit(unit) == expected


def test_powers_that_tables_keep_are_integrated_if_nothing_is_asked_for(tmp_path: Path) -> None:
    kept = 'pages = false\ncolumns = ["tau/*", "power/joint1/*"]\n'
    file = write_study(tmp_path, HEAD, kept, CHOICES, CYCLES, TRIALS, subjects=1, trials=1)
    run_study(file, tmp_path / "out", Here())
    table = pd.read_parquet(tmp_path / "out/trials/S1-slow-1/_cycles.parquet")
    of_links = [f"integral/power/joint1/link{j}" for j in (1, 2, 3)]
    assert list(table.filter(regex="^integral/")) == of_links


def test_a_column_to_integrate_that_is_none_is_told_before_any_work(tmp_path: Path) -> None:
    cycles = f'{CYCLES}integrals = ["pwer/*"]\n'
    file = write_study(tmp_path, HEAD, CHOICES, cycles, TRIALS, subjects=1, trials=1)
    with pytest.raises(LinkwiseError, match=r"\[cycles\]: 'integrals' has 'pwer/\*', which no column is"):
        run_study(file, tmp_path / "out", Here())
    assert not (tmp_path / "out").exists()


def test_cycles_begin_by_events_of_a_single_sample(tmp_path: Path) -> None:
    time = np.round(np.arange(0, 3, 0.01), 2)
    strikes = np.isin(np.arange(300) % 100, [40])
    log = np.column_stack([time, np.sin(time)[:, None] * [1, 0.5, 0.2], strikes])
    write_csv(tmp_path / "a.csv", log, (*JOINTS, "strikes"))
    asked = '[analysis]\nignore_extra = true\ninduced_power = true\n[cycles]\nstart = "strikes"\n'
    file = tmp_path / "study.toml"
    file.write_text(f'schema = 1\npages = false\n{asked}[[trial]]\nlog = "a.csv"\nrobot = "planar3"\n')
    assert run_study(file, tmp_path / "out", Here()).broken == ()
    ends = pd.read_parquet(tmp_path / "out/trials/a/_cycles.parquet")[["start", "end"]]
    np.testing.assert_allclose(ends, [(0.4, 1.4), (1.4, 2.4)], rtol=1e-12)
