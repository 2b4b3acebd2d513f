"""Deviations of a study's curves, held against simulated truths, and bodies that all err by one part."""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.studies import CHOICES, CYCLES, HEAD, TRIALS, Here, write_study
from linkwise import LinkwiseError
from linkwise.analysis.result_rows import Column
from linkwise.study import run_study
from linkwise.study.band_figure import figure_columns
from linkwise.study.comparisons import compared_columns
from linkwise.study.deviations import deviations, trial_deviations
from linkwise.study.integrals import integral_columns
from linkwise.study.plan import Comparison, Cycles, PaperFigure, StudyPlan
from linkwise.study.spread import Spread, spread
from linkwise.study.summary import TrialSummary

pd = pytest.importorskip("pandas")
PART = 0.1
"""Deviation of the mass of all links together, of which every torque of planar3 has the same part."""
BODIES = f'schema = 1\n[body_mass]\nsd = "{100 * PART:g} %"\n'
WITH = CHOICES + 'uncertain = "bodies.toml"\n'
KEPT = 'pages = false\ncolumns = ["tau/**", "sd/**"]\n'
COMPARE = '\n[[compare]]\nfactor = "condition"\nbetween = ["slow", "fast"]\ncolumns = ["**tau/joint1"]\n'
FIGURE = '\n[[figure]]\ncolumns = ["tau/*"]\nby = "condition"\nname = "torques"\n'


@pytest.fixture(scope="module")
def out(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A study whose bodies all err by one part."""
    folder: Path = tmp_path_factory.mktemp("deviations")
    file = write_study(folder, HEAD, KEPT, WITH, CYCLES, COMPARE, FIGURE, TRIALS, subjects=3)
    (folder / "bodies.toml").write_text(BODIES)
    found = run_study(file, folder / "out", Here())
    assert (len(found.done), found.broken, found.warnings) == (12, (), ())
    return folder / "out"


def curve_table(out: Path) -> Any:
    return pd.read_parquet(out / "curves.parquet").set_index(["condition", "column", "percent"]).sort_index()


def test_columns_tell_apart_what_errs_alike_and_the_spread_between_subjects(out: Path) -> None:
    table, samples = curve_table(out), pd.read_parquet(out / "trials")
    about = ["condition", "percent", "subject", "trial"]
    for joint in ("tau/joint1", "tau/joint3", "tau/joint1/link2"):
        trials = samples.groupby(about, observed=True)[joint].agg(["mean", lambda x: (x**2).mean()])
        subjects = trials.groupby(about[:3], observed=True).mean()
        told = subjects.groupby(about[:2], observed=True)
        spread_of, square = told["mean"].std(), PART**2 * told["<lambda_0>"].mean()
        for condition in ("slow", "fast"):
            found, between, systematic = table.loc[condition, joint], spread_of[condition], square[condition]
            scale = np.sqrt(systematic.max())
            for name, variance in {
                "std": between**2,
                "sd_systematic": systematic,
                "sd_within": systematic,
                "sd_mean": between**2 / 3 + systematic,
                "sd_new": between**2 * 4 / 3 + systematic,
            }.items():
                np.testing.assert_allclose(found[name], np.sqrt(variance), atol=2e-3 * scale, err_msg=name)
            assert (found.sd_random == 0).all()
            own = trials["mean"][condition].groupby("percent").std() ** 2
            expected = np.sqrt(own * (1 + 1 / 6) + systematic)
            np.testing.assert_allclose(found.trials_sd_new, expected, atol=2e-3 * scale)


def test_deviations_over_a_cycle_are_those_of_its_torques_and_never_negative(out: Path) -> None:
    """A spline through them would dip below zero where a torque changes its sign."""
    samples = pd.read_parquet(out / "trials")
    for name in ("tau/joint1", "tau/joint2/link3"):
        torque, deviation = samples[name].abs(), samples[f"sd/{name}"]
        assert deviation.min() >= 0
        np.testing.assert_allclose(deviation, PART * torque, atol=1e-4 * torque.max())


def test_deviations_are_neither_curves_nor_tested(out: Path) -> None:
    tests = pd.read_parquet(out / "tests.parquet")
    assert sorted(set(tests.column)) == ["tau/joint1"]
    columns = {column for _, column, _ in curve_table(out).index}
    assert "tau/joint1/link2" in columns
    assert not [name for name in columns if name.startswith("sd")]
    every = set(pd.read_parquet(out / "summary.parquet").column)
    assert "sd/tau/joint1" in every
    assert not [name for name in every if name.startswith("integral") and "/sd" in name]


def plan(**given: Any) -> StudyPlan:
    return StudyPlan("s", Path("s.toml"), ("subject",), (), pages=False, trust_python=False, **given)


NAMES = ("time", "power/hip", "sd/power/hip", "sd-motion/power/hip", "tau/hip", "sd/tau/hip")
UNITS = ("s", "W", "W", "W", "N·m", "N·m")
COLUMNS = [Column(name.partition("/")[0], name, unit) for name, unit in zip(NAMES, UNITS, strict=True)]
REFUSED = "'sd/tau/*', which fits standard deviations alone; they stand beside what they are of, so name that"


def test_deviations_of_power_are_not_integrated() -> None:
    names = [column.name for column in integral_columns(plan(cycles=Cycles(start={"": "a>1"})), COLUMNS)]
    assert names == [f"{part}/power/hip" for part in ("integral", "integral_positive", "integral_negative")]
    asked = plan(cycles=Cycles(start={"": "a>1"}, integrals=("**/hip",)))
    assert {column.name for column in integral_columns(asked, COLUMNS)} == {
        *names,
        *(name.replace("power", "tau") for name in names),
    }
    with pytest.raises(
        LinkwiseError, match="integrals' has 'sd/power/hip', which fits standard deviations alone"
    ):
        integral_columns(plan(cycles=Cycles(start={"": "a>1"}, integrals=("sd/power/hip",))), COLUMNS)


def test_deviations_by_name_are_refused_in_tests_and_figures() -> None:
    with pytest.raises(LinkwiseError) as compare:
        compared_columns(Comparison("f", ("a", "b"), ("tau/*", "sd/tau/*")), NAMES)
    assert str(compare.value) == f"[[compare]] has {REFUSED}"
    with pytest.raises(LinkwiseError) as figure:
        figure_columns(PaperFigure(("sd/tau/*",)), NAMES)
    assert str(figure.value) == f"[[figure]] has {REFUSED}"
    assert figure_columns(PaperFigure(("**/hip",)), NAMES) == ["power/hip", "tau/hip"]


FEW, MANY = (1, 2, 2, 3, 4), (2,) * 40
"""Trials of each subject, of CYCLES_EACH cycles."""
CYCLES_EACH = 3
STUDIES = 20_000
OWN, BY_BODIES, NOISE = (np.repeat(sd, STUDIES) for sd in ([2.0, 1.0, 0.5], [1.0, 0.5, 1.5], [0.5, 1.0, 0.2]))
"""Standard deviations of subjects' truths, by bodies, and by noise in each cycle: three cases of many.

Each point of a curve is a study of its own, whose errors of bodies are drawn once, truths for each subject,
and noise for each cycle.
"""


def simulated(sizes: Sequence[int], seed: int) -> tuple[list[TrialSummary], Any, Any]:
    """Trials, the error of their mean, and its error as the truth of one more subject."""
    draw, trials = np.random.default_rng(seed), list[TrialSummary]()
    body = draw.normal(size=OWN.size) * BY_BODIES
    for subject, count in enumerate(sizes):
        truth = draw.normal(size=OWN.size) * OWN
        for trial in range(count):
            noise = (draw.normal(size=(CYCLES_EACH, OWN.size)) * NOISE).mean(axis=0)
            curves = {
                "tau/hip": truth + body + noise,
                "sd/tau/hip": np.hypot(BY_BODIES, NOISE),
                "sd-motion/tau/hip": NOISE,
            }
            name = f"{subject}-{trial}"
            trials.append(TrialSummary(name, {"subject": str(subject)}, {}, {}, curves, CYCLES_EACH))
    mean = spread_of(trials).mean
    return trials, mean, mean - draw.normal(size=OWN.size) * OWN


def spread_of(trials: Sequence[TrialSummary]) -> Spread:
    return spread(trials, {one.name: one.curves["tau/hip"] for one in trials})


def by_case(values: Any) -> Any:
    """Means over the studies of each case."""
    return values.reshape(3, STUDIES).mean(axis=1)


def test_told_variances_are_those_of_simulated_studies_about_their_truth() -> None:
    trials, of_mean, of_new = simulated(FEW, seed=3)
    told = deviations(trials, "tau/hip", spread_of(trials))
    assert told is not None
    for errors, name in ((of_mean, "mean"), (of_new, "new")):
        found = by_case(getattr(told, name) ** 2)
        np.testing.assert_allclose(by_case(errors**2), found, rtol=0.04, err_msg=name)
    np.testing.assert_allclose(told.within, np.hypot(BY_BODIES, NOISE))
    np.testing.assert_allclose([told.systematic, told.random], [BY_BODIES, NOISE])


def test_noise_averages_out_over_the_trials_of_one_subject_and_bodies_do_not() -> None:
    own = [one for one in simulated(FEW, seed=4)[0] if one.labels["subject"] == "4"]
    assert len(own) == 4
    told = trial_deviations(own, "tau/hip", spread_of(own))
    assert told is not None
    expected = BY_BODIES**2 + NOISE**2 / CYCLES_EACH / 4
    np.testing.assert_allclose(by_case(told.mean**2), by_case(expected), rtol=0.01)
    alone = deviations(own, "tau/hip", spread_of(own))
    assert alone is not None
    assert np.isnan([alone.mean, alone.new]).all()


def test_bodies_and_spread_together_cover_the_truth_of_new_subjects() -> None:
    """A normal error leaves a band of 1.645 deviations in one case of ten."""
    trials, _, of_new = simulated(MANY, seed=5)
    told = deviations(trials, "tau/hip", spread_of(trials))
    assert told is not None
    np.testing.assert_allclose(by_case(np.abs(of_new) < 1.645 * told.new), 0.9, atol=0.01)


@pytest.mark.parametrize("with_bodies", [False, True])
def test_noise_of_motion_is_new_in_each_cycle_and_bodies_are_not(tmp_path: Path, with_bodies: bool) -> None:
    file = write_study(tmp_path, HEAD, KEPT, WITH, CYCLES, FIGURE, TRIALS, subjects=2)
    noise = '[motion]\nangle = "1 mrad"\n'
    (tmp_path / "bodies.toml").write_text((BODIES if with_bodies else "schema = 1\n") + noise)
    assert run_study(file, tmp_path / "out", Here()).broken == ()
    table = curve_table(tmp_path / "out").loc[("slow", "tau/joint1")]
    assert (table["sd_random"] > 0).all()
    assert ((table["sd_systematic"] > 1e-3 * table["sd_random"]).all()) == with_bodies
    np.testing.assert_allclose(
        table["sd_within"], np.hypot(table["sd_systematic"], table["sd_random"]), rtol=1e-12
    )


def test_a_group_with_a_trial_without_deviations_has_none(tmp_path: Path) -> None:
    one = TRIALS.replace("{condition}_{trial}", "slow_{trial}").replace("{condition}-{trial}", "slow-{trial}")
    slow, fast = (one.replace("slow", name) + f'condition = "{name}"\n' for name in ("slow", "fast"))
    file = write_study(
        tmp_path, HEAD, KEPT.replace('"sd/**"', '"q/*"'), CHOICES, CYCLES, slow, fast, FIGURE, subjects=2
    )
    text = file.read_text().replace('condition = "slow"\n', 'condition = "slow"\nuncertain = "bodies.toml"\n')
    file.write_text(text)
    (tmp_path / "bodies.toml").write_text(BODIES)
    found = run_study(file, tmp_path / "out", Here())
    assert (found.broken, found.warnings) == ((), ())
    table = curve_table(tmp_path / "out")
    assert table.loc["fast", "sd_new"].isna().all()
    assert table.loc[("slow", "tau/joint1"), "sd_new"].notna().all()
    assert table.loc[("slow", "q/joint1"), "sd_new"].isna().all()
    (assumed,) = json.loads((tmp_path / "out/study.json").read_text())["uncertain"]["assumed"]
    assert assumed["trials"] == [f"S{s}-slow-{k}" for s in (1, 2) for k in (1, 2)]
    mark = tmp_path / "out/study.json"
    former = json.loads(mark.read_text())
    del former["uncertain"]
    mark.write_text(json.dumps(former))
    assert run_study(file, tmp_path / "out", Here()).fresh == 0


def test_the_record_says_what_was_assumed(out: Path) -> None:
    told = json.loads((out / "study.json").read_text())["uncertain"]
    assert "the same in all trials of all subjects" in told["together"]
    (assumed,) = told["assumed"]
    assert len(assumed["trials"]) == 12
    assert (assumed["file"], assumed["body_mass"]) == ("bodies.toml", PART)
    assert assumed["certain"].startswith("motion, loads")


def test_a_study_without_deviations_has_no_columns_of_them_and_draws_none(tmp_path: Path) -> None:
    asked = FIGURE + 'hatched = "mean"\n'
    file = write_study(tmp_path, HEAD, KEPT.replace(', "sd/**"', ""), CHOICES, CYCLES, FIGURE, asked, TRIALS)
    found = run_study(file, tmp_path / "out", Here())
    (told,) = found.warnings
    assert told == (
        "figure 2, torques, is not drawn: [[figure]]: 'hatched' is 'mean', and no curve has deviations; give"
        " all trials the key 'uncertain', or leave it out"
    )
    assert not [name for name in curve_table(tmp_path / "out").columns if "sd_" in name]
    assert json.loads((tmp_path / "out/study.json").read_text())["uncertain"] == {}


def test_a_record_that_no_study_writes_is_damaged(tmp_path: Path) -> None:
    file = write_study(tmp_path, HEAD, "pages = false\n", CHOICES, TRIALS, trials=1)
    run_study(file, tmp_path / "out", Here())
    mark = tmp_path / "out/study.json"
    former = json.loads(mark.read_text())
    former["uncertain"] = {"a": [[[[[[[[[1]]]]]]]]]}
    mark.write_text(json.dumps(former))
    with pytest.raises(LinkwiseError, match=r"study\.json is damaged: uncertain\.a\[0\].* is not a number"):
        run_study(file, tmp_path / "out", Here())
