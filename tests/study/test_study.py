"""Studies: every trial once, whatever happens, and what they say together."""

import base64
import gzip
import json
import os
import re
import shutil
import sys
from pathlib import Path

import numpy as np
import pytest
from helpers.command_line import run_linkwise
from helpers.studies import CHOICES, CYCLES, HEAD, NAMES, QUICK, TRIALS, Here, write_study
from linkwise import Options, analyze, kept_package
from linkwise.analysis import Payload, Processing, Reading
from linkwise.analysis.loads import Load
from linkwise.analysis.settings import Lowpass
from linkwise.errors import LinkwiseError
from linkwise.study import run_study
from linkwise.study.comparisons import compared
from linkwise.study.file import read_study
from linkwise.study.plan import Comparison
from linkwise.study.summary import TrialSummary
from scipy.interpolate import CubicSpline
from scipy.ndimage import gaussian_filter1d

pd = pytest.importorskip("pandas")


@pytest.fixture(scope="module")
def arms(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A study in cycles, of four subjects, done."""
    folder = tmp_path_factory.mktemp("arms")
    compare = '\n[[compare]]\nfactor = "condition"\nbetween = ["slow", "fast"]\ncolumns = ["tau/joint1"]\n'
    figure = '\n[[figure]]\ncolumns = ["tau/*"]\nby = "condition"\n'
    file = write_study(folder, HEAD, QUICK, CHOICES, CYCLES, compare, figure, TRIALS, subjects=4)
    found = run_study(file, folder / "out", Here())
    assert (len(found.done), found.broken, found.warnings) == (16, (), ())
    return folder


def test_a_trial_is_what_its_analysis_is_over_its_cycles(arms: Path) -> None:
    table = pd.read_parquet(arms / "out/trials/S2-fast-1/samples.parquet")
    whole = analyze(arms / "data/S2/fast_1.csv", kept_package("planar3"), Reading(ignore_extra=True))
    stands = np.loadtxt(arms / "data/S2/fast_1.csv", delimiter=",", skiprows=1)[:, 4]
    starts = whole.time[1:][np.diff(stands) > 0]
    assert table.groupby("cycle").size().tolist() == [101] * (len(starts) - 1)
    assert set(table.subject) == {"S2"}
    assert set(table.condition) == {"fast"}
    at = np.linspace(starts[1], starts[2], 101)
    expected = CubicSpline(whole.time, whole["tau/joint1"])(at)
    np.testing.assert_allclose(table[table.cycle == 1]["tau/joint1"], expected, rtol=1e-6, atol=1e-9)


def test_tables_are_read_in_one_line(arms: Path) -> None:
    pl, duckdb = pytest.importorskip("polars"), pytest.importorskip("duckdb")
    table = pd.read_parquet(arms / "out/trials")
    assert list(table.columns[:7]) == [
        "trial",
        "subject",
        "condition",
        "cycle",
        "percent",
        "time",
        "tau/joint1",
    ]
    every = arms / "out/trials/*/samples.parquet"
    assert len(table) == len(pl.read_parquet(every))
    assert duckdb.sql(f"from '{every}'").shape[0] == len(table)


def test_curves_of_groups_are_means_of_subjects_each_the_mean_of_its_trials(arms: Path) -> None:
    table = pd.read_parquet(arms / "out/trials")
    of_trials = table.groupby(["condition", "subject", "trial", "percent"], observed=True)[
        "tau/joint1"
    ].mean()
    of_subjects = of_trials.groupby(["condition", "subject", "percent"], observed=True).mean()
    expected = of_subjects.groupby(["condition", "percent"], observed=True).agg(["mean", "std", "min", "max"])
    curves = pd.read_parquet(arms / "out/curves.parquet")
    found = curves[curves.column == "tau/joint1"].set_index(["condition", "percent"]).sort_index()
    assert found.index.get_level_values("percent").max() == 100
    for statistic in ("mean", "std", "min", "max"):
        np.testing.assert_allclose(found[statistic], expected[statistic].sort_index(), rtol=1e-9, atol=1e-12)
    whosever = of_trials.groupby(["condition", "percent"], observed=True).agg(["mean", "std", "min", "max"])
    for statistic in ("mean", "std", "min", "max"):
        every = whosever[statistic].sort_index()
        np.testing.assert_allclose(found[f"trials_{statistic}"], every, rtol=1e-9, atol=1e-12)
    assert set(found.unit) == {"N·m"}
    assert set(found.subjects) == {4}
    assert set(found.trials) == {8}


def test_levels_are_compared_over_whole_curves(arms: Path) -> None:
    spm1d = pytest.importorskip("spm1d")
    curves = pd.read_parquet(arms / "out/trials").groupby(["condition", "subject", "percent"], observed=True)
    each = curves["tau/joint1"].mean().unstack("percent")
    field = spm1d.stats.ttest_paired(each.loc["slow"].to_numpy(), each.loc["fast"].to_numpy())
    expected = field.inference(0.05, two_tailed=True)
    tests = pd.read_parquet(arms / "out/tests.parquet")
    assert tests.threshold.iloc[0] == pytest.approx(expected.zstar, rel=1e-6)
    assert tests.t.to_list() == pytest.approx([field.z[np.abs(field.z).argmax()]] * len(tests), rel=1e-6)
    parts = np.array([cluster.endpoints for cluster in expected.clusters])
    np.testing.assert_allclose(tests[["start", "end"]], parts, rtol=1e-4)
    own = np.maximum([cluster.P for cluster in expected.clusters], np.finfo(float).eps)  # no p is 0
    np.testing.assert_allclose(tests.p, own, rtol=1e-4)
    assert tests.p_told.to_list() == ["< 0.001"] * 3


@pytest.mark.parametrize(("seed", "shift"), [(7, 0.3), (16, 0.6), (30, 0.8)])
def test_only_what_has_a_p_below_alpha_of_its_own_differs(seed: int, shift: float) -> None:
    """Rough curves pass the threshold of t for moments that chance makes more often than alpha says."""
    spm1d = pytest.importorskip("spm1d")
    noise = np.random.default_rng(seed)
    first, second = (gaussian_filter1d(noise.standard_normal((10, 101)), 1, axis=1) for _ in range(2))
    first += shift
    above = spm1d.stats.ttest_paired(first, second).inference(0.05, two_tailed=True).clusters
    surely = [(*cluster.endpoints, cluster.P) for cluster in above if cluster.P < 0.05]
    assert len(surely) < len(above)
    trials = [
        TrialSummary(
            f"{level}{at}", {"subject": f"S{at}", "pace": level}, {"tau": "N·m"}, {}, {"tau": curve}, 1
        )
        for level, curves in (("slow", first), ("fast", second))
        for at, curve in enumerate(curves)
    ]
    ((found,), told) = compared([Comparison("pace", ("slow", "fast"), ("tau",))], trials)
    assert told == ()
    shown = [(part.start, part.end, part.p) for part in found.clusters]
    np.testing.assert_allclose(np.reshape(shown, (-1, 3)), np.reshape(surely, (-1, 3)), rtol=1e-9)
    assert all(start < end and p < 0.05 for start, end, p in shown)


def test_figures_for_papers_hold_their_fonts(arms: Path) -> None:
    pdf, svg = (arms / f"out/figure1.{kind}" for kind in ("pdf", "svg"))
    content = pdf.read_bytes()
    assert b"/FontFile2" in content, "the font itself"
    assert b"/Type3" not in content
    assert b"<text" not in svg.read_bytes(), "letters are outlines"


def test_done_trials_stay_and_changed_ones_are_done_again(tmp_path: Path) -> None:
    file = write_study(tmp_path, HEAD, QUICK, CHOICES, TRIALS)
    first = Here()
    run_study(file, tmp_path / "out", first)
    assert sorted(first.given) == sorted(NAMES)
    log = tmp_path / "data/S1/slow_1.csv"
    os.utime(log)
    again = Here()
    assert run_study(file, tmp_path / "out", again).fresh == 0
    assert again.given == [], "touched, and the same"
    log.write_text(log.read_text().replace("\n0.0,-0.", "\n0.0,-0.0", 1))
    changed = Here()
    run_study(file, tmp_path / "out", changed)
    assert changed.given == ["S1-slow-1"]
    shutil.rmtree(tmp_path / "data/S2")
    fewer = Here()
    run_study(file, tmp_path / "out", fewer)
    assert fewer.given == []
    assert sorted(path.name for path in (tmp_path / "out/trials").iterdir()) == NAMES[:4]
    file.write_text(file.read_text().replace("ignore_extra = true", "ignore_extra = true\ncutoff = 6"))
    other = Here()
    run_study(file, tmp_path / "out", other)
    assert sorted(other.given) == NAMES[:4]


def test_what_all_say_is_made_again_where_the_plan_changes_and_no_trial_is(tmp_path: Path) -> None:
    ask = '\n[[compare]]\nfactor = "condition"\nbetween = ["slow", "fast"]\ncolumns = ["tau/joint1"]\n'
    file, out = (
        write_study(tmp_path, HEAD, QUICK, CHOICES, ask, TRIALS, subjects=3, trials=1),
        tmp_path / "out",
    )
    run_study(file, out, Here())
    assert set(pd.read_parquet(out / "tests.parquet").alpha) == {0.05}
    figure = '[[figure]]\nname = "torque"\ncolumns = ["tau/joint1"]\n'
    file.write_text("".join((HEAD, QUICK, CHOICES, ask, "alpha = 0.2\n", figure, TRIALS)))
    engine = Here()
    assert run_study(file, out, engine).fresh == 0
    assert engine.given == []
    assert set(pd.read_parquet(out / "tests.parquet").alpha) == {0.2}
    (out / "torque.svg").unlink()
    (out / "summary.parquet").unlink()
    run_study(file, out, Here())
    assert len(set(pd.read_parquet(out / "summary.parquet").trial)) == 6
    assert (out / "torque.svg").is_file()


def test_a_trial_has_all_that_is_chosen_of_its_analysis_and_robot(tmp_path: Path) -> None:
    chosen = 'cutoff = 6\npayload = ["link3=2,0.1,0,0"]\nload = ["link2=0,9,0"]\n'
    robot = "[robot]\nlock = {joint2 = 0.5}\n"
    own = TRIALS.replace("{condition}_{trial}", "slow_1").replace("-{condition}-{trial}", "")
    own += 'condition = "slow"\ncutoff = 9\nderivative = "savitzky-golay"\n'
    file = write_study(tmp_path, HEAD, QUICK, CHOICES, chosen, robot, own, subjects=1, trials=1)
    assert run_study(file, tmp_path / "out", Here()).done == ("S1",)
    whole = analyze(
        tmp_path / "data/S1/slow_1.csv",
        kept_package("planar3", options=Options(lock={"joint2": 0.5})),
        Reading(ignore_extra=True),
        Processing("savitzky-golay", lowpass=Lowpass(9)),
        payloads=[Payload("link3", 2.0, (0.1, 0, 0))],
        loads=[Load("link2", "link2", (0, 9, 0))],
    )
    table = pd.read_parquet(tmp_path / "out/trials/S1/samples.parquet")
    assert list(table.filter(like="tau/")) == ["tau/joint1", "tau/joint3"]
    for name in ("tau/joint1", "tau/joint3"):
        np.testing.assert_array_equal(table[name], whole[name])


def test_a_broken_trial_is_told_and_stops_no_other(tmp_path: Path) -> None:
    file = write_study(tmp_path, HEAD, QUICK, CHOICES, TRIALS, subjects=1)
    done = run_linkwise("study", file, "--out", "out", folder=tmp_path)
    assert done.returncode == 0, done.stderr
    (tmp_path / "data/S1/fast_2.csv").write_text("time,joint1\n0,1\n")
    done = run_linkwise("study", file, "--out", "out", folder=tmp_path)
    assert done.returncode == 1
    broken = next(line for line in done.stderr.splitlines() if line.startswith("broken: "))
    assert broken.startswith("broken: S1-fast-2: ")
    assert "no column for joint" in broken
    assert not (tmp_path / "out/trials/S1-fast-2").exists(), "what was there is of another log"
    record = json.loads((tmp_path / "out/study.json").read_text())
    assert "S1-fast-2" in record["broken"]
    assert record["notes"] == ["1 of 4 trials are broken, and part of nothing here: S1-fast-2"]
    assert sorted(set(pd.read_parquet(tmp_path / "out/summary.parquet").trial)) == [
        name for name in NAMES[:4] if name != "S1-fast-2"
    ]
    (tmp_path / "data/S1/fast_2.csv").write_text("time,joint1,joint2,joint3\n0,1,2,x\n")
    run_study(file, tmp_path / "out", Here())
    told = json.loads((tmp_path / "out/study.json").read_text())["broken"]["S1-fast-2"]
    assert "no column for joint" not in told, "it is broken in another way now"
    record = (tmp_path / "out/study.json").read_text()
    run_study(file, tmp_path / "out", Here())
    assert (tmp_path / "out/study.json").read_text() == record, "it was tried again, and nothing is new"


def test_every_trial_is_read_whatever_it_is_called(tmp_path: Path) -> None:
    names = ["..", ".", "_a", ".b", "A/b=c", "a%b #?", "b", "B"]
    trials = TRIALS.replace("{subject}-{condition}-{trial}", "NAME").replace("{subject}", "S1")
    trials = trials.replace("{condition}_{trial}", "slow_1") + 'condition = "slow"\n'
    file = write_study(tmp_path, HEAD, QUICK, CHOICES, *(trials.replace("NAME", name) for name in names))
    assert run_study(file, tmp_path / "out", Here()).done == tuple(names)
    assert set(pd.read_parquet(tmp_path / "out/trials").trial) == set(names)
    assert len(list((tmp_path / "out/trials").iterdir())) == len(names)
    file.write_text(file.read_text().replace('"B"', '"B-2"'))
    renamed = Here()
    run_study(file, tmp_path / "out", renamed)
    assert renamed.given == ["B-2"], "the folder of B has that name"


def test_a_key_that_is_written_is_what_it_says_whatever_the_pattern_finds(tmp_path: Path) -> None:
    file = write_study(tmp_path, HEAD, TRIALS, 'condition = "very {condition}"\n', subjects=1, trials=1)
    trials = read_study(file).trials
    assert [(one.name, one.label("condition")) for one in trials] == [
        ("S1-fast-1", "very fast"),
        ("S1-slow-1", "very slow"),
    ]


def test_damaged_trials_are_done_again_and_what_is_not_a_trial_stays(tmp_path: Path) -> None:
    file, trials = write_study(tmp_path, HEAD, QUICK, CHOICES, TRIALS), tmp_path / "out/trials"
    run_study(file, tmp_path / "out", Here())
    (trials / "S1-fast-1/samples.parquet").write_bytes(b"PAR1")
    (trials / "S1-fast-2/_record.json").write_text("")
    (trials / "S2-fast-1/_summary.npz").unlink()
    shutil.rmtree(trials / "S2-slow-1")
    (trials / "S2-slow-1").mkdir()
    (trials / "S2-slow-1/thesis.txt").write_text("mine")
    (trials / "notes").mkdir()
    (trials / "notes/thesis.txt").write_text("mine, too")
    again = Here()
    found = run_study(file, tmp_path / "out", again)
    assert sorted(again.given) == ["S1-fast-1", "S1-fast-2", "S2-fast-1", "S2-slow-1"]
    assert [(one.name, "move it away" in one.reason) for one in found.broken] == [("S2-slow-1", True)]
    assert (trials / "S2-slow-1/thesis.txt").read_text() == "mine"
    assert (trials / "notes/thesis.txt").read_text() == "mine, too", "no trial was ever called so"


def test_files_that_a_study_no_longer_asks_for_go(tmp_path: Path) -> None:
    figure = '\n[[figure]]\nname = "old"\ncolumns = ["tau/*"]\n'
    file = write_study(tmp_path, HEAD, QUICK, CHOICES, CYCLES, figure, TRIALS, subjects=1)
    run_study(file, tmp_path / "out", Here())
    assert {"old.svg", "curves.parquet"} <= {path.name for path in (tmp_path / "out").iterdir()}
    file.write_text("".join((HEAD, QUICK, CHOICES, TRIALS)))
    run_study(file, tmp_path / "out", Here())
    assert not {"old.svg", "old.pdf", "curves.parquet"} & {path.name for path in (tmp_path / "out").iterdir()}


def test_words_for_what_a_figure_does_not_show_are_told_with_the_nearest_that_it_does(tmp_path: Path) -> None:
    figure = '\n[[figure]]\nname = "torques"\ncolumns = ["tau/*"]\nby = "condition"\n'
    other = '\n[[figure]]\nname = "others"\ncolumns = ["tau/*"]\n'
    words = '"tau/joint3" = "ankle", condition = "pace", slow = "at ease"'
    file = write_study(
        tmp_path, HEAD, QUICK, CHOICES, figure, f"names = {{ {words} }}\n", other, TRIALS, subjects=1
    )
    assert not run_study(file, tmp_path / "out", Here()).warnings
    file.write_text(file.read_text().replace('"tau/joint3"', '"tau/joint4"'))
    (told,) = run_study(file, tmp_path / "out", Here()).warnings
    assert told.startswith(
        "figure 1, torques, is not drawn: [[figure]]: 'names' has 'tau/joint4', which nothing in it is"
        " called; nearest are 'tau/"
    )
    assert not (tmp_path / "out/torques.svg").exists()
    assert (tmp_path / "out/others.svg").exists()
    file.write_text(file.read_text().replace('by = "condition"', 'by = "condition"\norder = ["quick"]'))
    with pytest.raises(LinkwiseError, match="'order' has 'quick', which no trial is"):
        run_study(file, tmp_path / "out", Here())


def test_a_figure_that_is_not_drawn_is_told_by_the_record_and_the_page(tmp_path: Path) -> None:
    figure = '\n[[figure]]\ncolumns = ["tau/*"]\nhatched = "mean"\n'
    file = write_study(tmp_path, HEAD, QUICK, CHOICES, CYCLES, figure, TRIALS, subjects=1, trials=1)
    (told,) = run_study(file, tmp_path / "out", Here()).warnings
    assert told.startswith("figure 1 is not drawn: [[figure]]: 'hatched' is 'mean', and no curve has")
    assert json.loads((tmp_path / "out/study.json").read_text())["notes"] == [told]
    data = re.findall(r"H4sI[\w+/=]+", (tmp_path / "out/study.html").read_text())
    pages = [gzip.decompress(base64.b64decode(one)).decode() for one in data]
    assert any("figure 1 is not drawn" in page for page in pages)


@pytest.mark.parametrize(
    ("key", "told"),
    [
        ('columns = ["tau/*"]\nname = "../up"', "'name' is '../up'; give a name of a file, without / "),
        ('columns = ["tau/*"]\nname = ".up"', "'name' is '.up'; give a name of a file, without / "),
        ('columns = ["tau/*"]\nname = "a\\\\b"', r"'name' is 'a\\b'; give a name of a file, without / "),
        ('columns = ["time"]', "'time'"),
    ],
)
def test_a_figure_that_cannot_be_is_refused_before_any_trial(key: str, told: str, tmp_path: Path) -> None:
    file = write_study(tmp_path, HEAD, QUICK, CHOICES, f"\n[[figure]]\n{key}\n", TRIALS, subjects=1, trials=1)
    engine = Here()
    with pytest.raises(LinkwiseError, match=re.escape(told)):
        run_study(file, tmp_path / "out", engine)
    assert engine.given == []


def test_curves_that_do_not_vary_are_told_and_the_rest_is_made(tmp_path: Path) -> None:
    columns = 'columns = ["tau_load/**", "tau/*"]\n'
    compare = f'\n[[compare]]\nfactor = "condition"\nbetween = ["slow", "fast"]\n{columns}'
    choices = CHOICES + 'load = ["push:link3=0,0,0"]\n'
    file = write_study(tmp_path, HEAD, QUICK, choices, CYCLES, compare, TRIALS, subjects=3, trials=1)
    found = run_study(file, tmp_path / "out", Here())
    (told,) = found.warnings
    assert re.search(r"condition, (tau_load/\S+(, )?){3}: spm1d: Zero variance", told), told
    tests = pd.read_parquet(tmp_path / "out/tests.parquet")
    assert set(tests.column) == {"tau/joint1", "tau/joint2", "tau/joint3"}


def test_what_was_lacking_is_made_once_it_can_be(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    compare = '\n[[compare]]\nfactor = "condition"\nbetween = ["slow", "fast"]\ncolumns = ["tau/joint1"]\n'
    file = write_study(tmp_path, HEAD, QUICK, CHOICES, CYCLES, compare, TRIALS, subjects=3, trials=1)
    with monkeypatch.context() as patch:
        patch.setitem(sys.modules, "spm1d", None)
        for _ in range(2):
            assert "pip install 'linkwise[spm]'" in run_study(file, tmp_path / "out", Here()).warnings[0]
    assert not (tmp_path / "out/tests.parquet").exists()
    assert run_study(file, tmp_path / "out", Here()).warnings == ()
    assert (tmp_path / "out/tests.parquet").is_file()
