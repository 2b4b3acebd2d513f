"""Tables, tests and figures of trials together, held against pandas, SciPy and spm1d."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from helpers.studies import CHOICES, HEAD, QUICK, Here, write_study
from linkwise.study import run_study
from linkwise.study.band_figure import figure_files
from linkwise.study.comparisons import Compared, compared
from linkwise.study.plan import Comparison, PaperFigure
from linkwise.study.spread import spread, values_of
from linkwise.study.summary import TrialSummary
from scipy import stats

STATISTICS = ["mean", "std", "min", "max", "rms"]
TRIALS = """
[[compare]]
factor = "condition"
between = ["slow", "fast"]
columns = ["tau/*"]
paired = false

[[compare]]
factor = "day"
between = ["2", "1"]
columns = ["q/joint1"]

[[trial]]
name = "{subject}-{condition}-{day}"
subject = "{subject}, {condition}"
log = "data/{subject}/{condition}_{day}.csv"
robot = "planar3"
"""


@pytest.fixture(scope="module")
def means(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A study without cycles, of others who were slow than were fast, one less."""
    folder: Path = tmp_path_factory.mktemp("means")
    head = HEAD.replace('["condition"]', '["condition", "day"]')
    file = write_study(folder, head, QUICK.replace("tau", "*"), CHOICES, TRIALS, subjects=4)
    for log in (folder / "data/S4").glob("slow_*"):
        log.unlink()
    found = run_study(file, folder / "out", Here())
    assert (len(found.done), found.broken, found.warnings) == (14, (), ())
    return folder / "out"


def tidy(means: Path) -> Any:
    """Every sample's every column, (rows of trial, factors, column, value)."""
    samples = pd.read_parquet(means / "trials")
    about = ["trial", "subject", "condition", "day"]
    return samples.astype(dict.fromkeys(about, str)).melt([*about, "time"], var_name="column")


def test_a_trials_row_sums_up_its_samples(means: Path) -> None:
    expected = (
        tidy(means)
        .groupby(["trial", "subject", "condition", "day", "column"])
        .value.agg(["mean", lambda x: x.std(ddof=0), "min", "max", lambda x: np.sqrt((x**2).mean())])
    )
    found = pd.read_parquet(means / "summary.parquet").set_index(list(expected.index.names))
    found = found.loc[expected.index]
    np.testing.assert_allclose(found[STATISTICS], expected, rtol=1e-9, atol=1e-12)
    units = found.groupby("column").unit.unique().map("".join).to_dict()
    assert (units["q/joint1"], units["tau/joint1"]) == ("rad", "N·m")


def test_a_groups_rows_are_of_its_subjects(means: Path) -> None:
    trials = pd.read_parquet(means / "summary.parquet")
    every = trials.melt(["trial", "subject", "condition", "day", "column", "unit"], STATISTICS, "statistic")
    expected = every.groupby(["condition", "day", "column", "statistic"]).value.agg(
        ["mean", "std", "min", "max", "count"]
    )
    found = pd.read_parquet(means / "groups.parquet").set_index(list(expected.index.names))
    assert len(found) == len(expected)
    found = found.loc[expected.index]
    for name in ("mean", "std", "min", "max"):
        np.testing.assert_allclose(found[name], expected[name], rtol=1e-9, atol=1e-12)
    assert (found.subjects == expected["count"]).all()
    assert sorted(set(found.subjects)) == [3, 4]


def test_means_are_compared_by_subject(means: Path) -> None:
    """Unpaired subjects are compared by Welch's test, and the first level less the second."""
    every = pd.read_parquet(means / "summary.parquet")
    tests = pd.read_parquet(means / "tests.parquet").set_index("column")
    assert sorted(tests.index) == ["q/joint1", "tau/joint1", "tau/joint2", "tau/joint3"]
    for column, found in tests.iterrows():
        by_subject = every[every.column == column].groupby([found.factor, "subject"])["mean"].mean()
        first, second = (by_subject[level] for level in (found["first"], found["second"]))
        if found.factor == "day":
            expected = stats.ttest_rel(first, second[first.index])
        else:
            expected = stats.ttest_ind(first, second, equal_var=False)
        assert (found.t, found.p) == pytest.approx((expected.statistic, expected.pvalue), rel=1e-9)
        assert (found.first_subjects, found.second_subjects) == (len(first), len(second))
        is_there = expected.pvalue < 0.05
        assert (found.start, found.end) == (
            (0, 100) if is_there else pytest.approx((np.nan,) * 2, nan_ok=True)
        )
    assert set(tests.loc["tau/joint1", ["first", "second"]]) == {"slow", "fast"}
    assert tests.loc["tau/joint1", "first_subjects"] == 3


SUBJECTS = {"slow": "CAADBE", "fast": "BDACF", "mean": "ABCDEF"}
"""Subjects in the order of their trials: A was slow twice, and two were in one condition only."""


def trials_of(points: int) -> list[TrialSummary]:
    """Trials of curves, or of means where there is one point; levels of the other factor have like names."""
    noise, bump = np.random.default_rng(5), np.sin(np.linspace(0, np.pi, points)) ** 2 if points > 1 else 1.0
    made = []
    for number, level in enumerate(SUBJECTS):
        for at, subject in enumerate(SUBJECTS[level]):
            own = np.random.default_rng(ord(subject)).normal() / 2
            rough = noise.normal(size=(1, 7)) @ np.array(
                [np.cos(k * np.linspace(0, 3, points)) for k in range(7)]
            )
            curve = own + 0.2 * (1 + number) * rough[0] - 2.5 * number * bump
            labels = {"subject": subject, "pace": level, "like": "fast" if at % 2 else "slow"}
            statistics = {"tau": np.array([curve.mean(), 0, 0, 0, 0])}
            curves = {"tau": curve} if points > 1 else {}
            made.append(TrialSummary(f"{level}{at}", labels, {"tau": "N·m"}, statistics, curves, 1))
    return made


def sides(trials: Sequence[TrialSummary], paired: bool) -> list[Any]:
    """Mean curves or means of subjects, slow and fast, by pandas."""
    rows = [
        (one.labels["pace"], one.labels["subject"], *(one.curves.get("tau", one.statistics["tau"][:1])))
        for one in trials
    ]
    table = pd.DataFrame(rows).groupby([0, 1]).mean()
    first, second = (table.loc[level] if level in table.index else table[:0] for level in ("slow", "fast"))
    if paired:
        both = sorted(set(first.index) & set(second.index))
        first, second = first.loc[both], second.loc[both]
    return [first.to_numpy(), second.to_numpy()]


@pytest.mark.parametrize("paired", [True, False])
@pytest.mark.parametrize("alpha", [0.05, 0.3])
def test_curves_are_compared_subject_by_subject(paired: bool, alpha: float) -> None:
    spm = pytest.importorskip("spm1d").stats
    trials = trials_of(31)
    ((found,), told) = compared([Comparison("pace", ("slow", "fast"), ("tau",), paired, alpha)], trials)
    first, second = sides(trials, paired)
    assert (told, [len(side.each) for side in found.sides]) == ((), [len(first), len(second)])
    t = stats.ttest_rel(first, second) if paired else stats.ttest_ind(first, second, equal_var=False)
    np.testing.assert_allclose(found.statistic, t.statistic, rtol=1e-9)
    field = spm.ttest_paired(first, second) if paired else spm.ttest2(first, second, equal_var=False)
    inferred = field.inference(alpha, two_tailed=True)
    assert found.threshold == pytest.approx(inferred.zstar, rel=1e-9)
    least = np.finfo(float).eps  # spm1d's own p may come to 0, which none is
    clusters = [
        [*np.multiply(c.endpoints, 100 / 30), max(c.P, least)] for c in inferred.clusters if alpha > c.P
    ]
    assert clusters
    np.testing.assert_allclose([[c.start, c.end, c.p] for c in found.clusters], clusters, rtol=1e-9)


@pytest.mark.parametrize("paired", [True, False])
def test_means_differ_where_p_is_below_alpha(paired: bool) -> None:
    trials = trials_of(1)
    first, second = sides(trials, paired)
    t = stats.ttest_rel(first, second) if paired else stats.ttest_ind(first, second, equal_var=False)
    for share, is_found in ((0.99, False), (1.01, True)):
        comparison = Comparison("pace", ("slow", "fast"), ("tau",), paired, share * t.pvalue[0])
        ((found,), _) = compared([comparison], trials)
        assert [*found.statistic, found.p] == pytest.approx([*t.statistic, *t.pvalue], rel=1e-9)
        assert [(c.start, c.end, c.p) for c in found.clusters] == [(0, 100, found.p)] * is_found


@pytest.mark.parametrize("paired", [True, False])
def test_means_that_do_not_vary_are_told_in_own_words(paired: bool) -> None:
    """SciPy warns of lost digits, which here would be an error."""
    same = [
        replace(one, statistics={"tau": np.full_like(one.statistics["tau"], one.labels["pace"] == "slow")})
        for one in trials_of(1)
    ]
    made, (reason,) = compared([Comparison("pace", ("slow", "fast"), ("tau",), paired)], same)
    assert made == []
    assert reason.endswith("subjects do not vary, so that there is nothing to test")


@pytest.mark.parametrize(("paired", "told"), [(True, "2 subjects in both"), (False, "2 subjects on a side")])
def test_too_few_subjects_are_told(paired: bool, told: str) -> None:
    few = [one for one in trials_of(1) if one.labels["pace"] != "slow" or one.labels["subject"] in "AD"]
    made, (reason,) = compared([Comparison("pace", ("slow", "fast"), ("tau",), paired)], few)
    assert (made, told in reason, "a test needs 3" in reason) == ([], True, True)


def test_whoever_has_more_trials_weighs_more_among_trials_and_not_among_subjects() -> None:
    slow = [one for one in trials_of(1) if one.labels["pace"] == "slow"]
    rows = spread(slow, values_of(slow, "tau")).rows
    trials, subjects = np.array([one.statistics["tau"][0] for one in slow]), sides(slow, False)[0][:, 0]
    assert (len(trials), len(subjects)) == (6, 5)
    for head, values in (("trials_", trials), ("", subjects)):
        found = [rows[f"{head}{name}"][0] for name in ("mean", "std", "min", "max")]
        assert found == pytest.approx([values.mean(), values.std(ddof=1), values.min(), values.max()])


def drawn(figure: PaperFigure, trials: Sequence[TrialSummary], tests: Sequence[Compared]) -> Any:
    """The axes of a figure's one panel."""
    with pytest.MonkeyPatch.context() as patch:
        found: list[Any] = []
        patch.setattr("linkwise.study.band_figure.saved", lambda drawing, kind: found.append(drawing) or b"")
        assert [name for name, _ in figure_files(figure, trials, tests)] == ["tau.svg", "tau.pdf"]
    return found[0].axes[0]


@pytest.mark.parametrize("band", ["deviation", "range"])
def test_a_figure_has_the_mean_curves_bands_and_differences_of_its_factor(band: Any) -> None:
    pytest.importorskip("spm1d")
    trials = trials_of(31)
    tests = [
        test
        for factor, alpha in (("pace", 0.3), ("like", 0.9))
        for test in compared([Comparison(factor, ("slow", "fast"), ("tau",), alpha=alpha)], trials)[0]
    ]
    assert all(test.clusters for test in tests)
    panel = drawn(PaperFigure(("tau",), "pace", band=band), trials, tests)
    each = dict(zip(("slow", "fast"), sides(trials, False), strict=True))
    lines = {line.get_label(): line for line in panel.get_lines()}
    assert list(lines) == ["slow", "fast", "mean"]
    for (level, curves), shade in zip(each.items(), panel.collections, strict=False):
        mean, spread = curves.mean(axis=0), curves.std(axis=0, ddof=1)
        low, high = (mean - spread, mean + spread) if band == "deviation" else (curves.min(0), curves.max(0))
        np.testing.assert_allclose(lines[level].get_ydata(), mean, rtol=1e-12)
        np.testing.assert_allclose(lines[level].get_xdata(), np.linspace(0, 100, 31))
        corners = shade.get_paths()[0].vertices
        for at, (x, a, b) in enumerate(zip(np.linspace(0, 100, 31), low, high, strict=True)):
            there = np.sort(corners[np.isclose(corners[:, 0], x), 1])
            np.testing.assert_allclose([there[0], there[-1]], [a, b], rtol=1e-9, err_msg=str(at))
    bars = [patch.get_bbox().intervalx for patch in panel.patches]
    np.testing.assert_allclose(bars, [[c.start, c.end] for c in tests[0].clusters])


def test_a_figure_of_means_has_a_dot_for_each_subject() -> None:
    trials = trials_of(1)
    panel = drawn(PaperFigure(("tau",), "pace"), trials, ())
    assert [text.get_text() for text in panel.get_xticklabels()] == list(SUBJECTS)
    every = [line for line in panel.get_lines() if line.get_marker() == "o"]
    for number, (values, dots) in enumerate(zip(sides(trials, False), every, strict=False)):
        np.testing.assert_allclose(sorted(dots.get_ydata()), sorted(values[:, 0]))
        assert set(dots.get_xdata()) == {number}
        ends = panel.containers[number][2][0].get_segments()[0][:, 1]
        spread = values.std(ddof=1)
        np.testing.assert_allclose(ends, [values.mean() - spread, values.mean() + spread])


def test_a_column_that_trials_lack_is_told() -> None:
    made, (reason,) = compared([Comparison("pace", ("slow", "fast"), ("tua",))], trials_of(1))
    assert made == []
    assert "'tua', which no column is called; nearest are 'tau'" in reason
