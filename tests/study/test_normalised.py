"""Results by who they are of: per kg, in % of body weight and height, and told where they are not."""

import json
from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow.parquet as pq
import pytest
from helpers.studies import CHOICES, CYCLES, HEAD, Here, write_logs
from linkwise import LinkwiseError
from linkwise.study import run_study

ARM = """schema = 1
name = "arm"
gravity = [0, -9.81, 0]
joint = [
  {{ name = "joint1", parent = "base", child = "upper", axis = [0, 0, 1] }},
  {{ name = "joint2", parent = "upper", child = "fore", xyz = [0.4, 0, 0], axis = [0, 0, 1] }},
  {{ name = "joint3", type = "prismatic", parent = "fore", child = "hand", xyz = [0.3, 0, 0] }},
]
link = [
  {{ name = "upper", mass = {0}, com = [0.2, 0, 0], inertia = {{ xx = 0.1, yy = 0.1, zz = 0.1 }} }},
  {{ name = "fore", mass = {1}, com = [0.1, 0, 0], inertia = {{ xx = 0.1, yy = 0.1, zz = 0.1 }} }},
  {{ name = "hand", mass = {2}, com = [0.1, 0, 0], inertia = {{ xx = 0.1, yy = 0.1, zz = 0.1 }} }},
]
"""
MASSES = {"S1": 7.0, "S2": 12.0, "S3": 19.5}
KEPT = 'pages = false\ncolumns = ["tau/*", "power/*", "q/joint1"]\n'
TRIALS = """
[[compare]]
factor = "condition"
between = ["slow", "fast"]
columns = ["tau/*", "integral/power/*"]

[[figure]]
name = "torques"
columns = ["tau/joint1", "integral/power/joint1"]
by = "condition"

[[trial]]
name = "{subject}-{condition}-{trial}"
log = "data/{subject}/{condition}_{trial}.csv"
robot = "{subject}.toml"
payload = ["bag:hand=5"]
"""


def study_of(folder: Path, *lines: str) -> Path:
    """A study of three subjects, each of a mass of its own, who carry the same bag."""
    write_logs(folder, 3)
    for subject, mass in MASSES.items():
        text = ARM.format(0.5 * mass, 0.3 * mass, 0.2 * mass)
        (folder / f"{subject}.toml").write_text(text, encoding="utf-8")
    file = folder / "study.toml"
    file.write_text("".join((HEAD, KEPT, *lines, CHOICES, CYCLES, TRIALS)), encoding="utf-8")
    return file


def of_trials(out: Path, column: str) -> pd.Series:
    """Mean curve of each trial, by condition, subject, trial and percent."""
    table = pd.read_parquet(out / "trials")
    return table.groupby(["condition", "subject", "trial", "percent"], observed=True)[column].mean()


def of_groups(curves: pd.Series) -> pd.DataFrame:
    """Mean and deviation over subjects, by condition and percent."""
    subjects = curves.groupby(["condition", "subject", "percent"], observed=True).mean()
    return subjects.groupby(["condition", "percent"], observed=True).agg(["mean", "std"]).sort_index()


HEIGHTS = {"S1": 1.5, "S2": 1.8, "S3": 2.0}
TOLD = {"S1": 6.5, "S2": 12.0, "S3": 19.5}
"""Masses of the table of subjects: one is not that of the model, one is left to the model."""
WAYS = {
    "mass": (MASSES, ("N·m/kg", lambda m, h: 1 / m), ("N/kg", lambda m, h: 1 / m)),
    "weight*height": (
        TOLD,
        ("% BW·height", lambda m, h: 100 / (9.80665 * m * h)),
        ("% BW", lambda m, h: 100 / (9.80665 * m)),
    ),
}


@pytest.mark.parametrize("way", WAYS)
def test_all_that_trials_say_together_is_normalised_by_each_subject(way: str, tmp_path: Path) -> None:
    masses, torque, force = WAYS[way]
    rows = ["subject,mass,height", *(f"{s},{'' if s == 'S2' else TOLD[s]},{HEIGHTS[s]}" for s in MASSES)]
    (tmp_path / "who.csv").write_text("\n".join(rows), encoding="utf-8")
    table = 'subjects = "who.csv"\n' if way != "mass" else ""
    file, out = study_of(tmp_path, f'normalise = "{way}"\n', table), tmp_path / "out"
    found = run_study(file, out, Here())
    assert (found.broken, found.warnings) == ((), ())
    schema = pq.read_schema(out / "trials/S1-slow-1/samples.parquet")
    assert schema.field("tau/joint1").metadata == {b"unit": "N·m".encode()}
    curves = (
        pd.read_parquet(out / "curves.parquet").set_index(["column", "condition", "percent"]).sort_index()
    )
    for column, (unit, factor) in {
        "tau/joint1": torque,
        "tau/joint3": force,
        "power/joint1": ("W/kg", lambda m, h: 1 / m),
        "q/joint1": ("rad", lambda m, h: 1.0),
    }.items():
        each = of_trials(out, column)
        factors = {subject: factor(masses[subject], HEIGHTS[subject]) for subject in masses}
        by = each.index.get_level_values("subject").astype(str).map(factors)
        expected, there = of_groups(each * by), curves.loc[column]
        assert set(there.unit) == {unit}
        for statistic in ("mean", "std"):
            np.testing.assert_allclose(there[statistic], expected[statistic], rtol=1e-9, atol=1e-12)
    tests = pd.read_parquet(out / "tests.parquet").set_index("column")
    assert set(tests.unit[["tau/joint1", "tau/joint2"]]) == {torque[0]}
    assert set(tests.unit[["integral/power/joint1"]]) == {"J/kg"}
    for name in ("summary", "groups"):
        units = pd.read_parquet(out / f"{name}.parquet").groupby("column").unit.unique().map("".join)
        assert units["tau/joint1"] == torque[0]
        assert units["integral_positive/power/joint3"] == "J/kg"
    mark = json.loads((out / "study.json").read_text())
    assert mark["normalised"]["by"] == way
    assert {t: one["mass"] for t, one in mark["normalised"]["trials"].items() if t.endswith("slow-1")} == {
        f"{s}-slow-1": pytest.approx(mass) for s, mass in masses.items()
    }


def test_the_same_trials_are_normalised_otherwise_without_being_done_again(tmp_path: Path) -> None:
    file, out = study_of(tmp_path), tmp_path / "out"
    run_study(file, out, Here())
    plain = pd.read_parquet(out / "summary.parquet")
    file.write_text(file.read_text().replace(KEPT, KEPT + 'normalise = "mass"\n'))
    again = Here()
    run_study(file, out, again)
    assert again.given == []
    found = pd.read_parquet(out / "summary.parquet")
    ratio = (plain["max"] / found["max"])[plain.column == "tau/joint1"]
    np.testing.assert_allclose(ratio, plain.subject.map(MASSES)[ratio.index], rtol=1e-12)


def test_subjects_of_different_mass_are_not_averaged_without_a_word(tmp_path: Path) -> None:
    file, out = study_of(tmp_path), tmp_path / "out"
    for _ in range(2):  # told each time, also where nothing is left to do
        (line,) = run_study(file, out, Here()).warnings
        assert line.startswith("subjects have 7 to 19.5 kg, and torques of all are averaged in N·m; give")
    assert json.loads((out / "study.json").read_text())["notes"] == [line]
    assert set(pd.read_parquet(out / "curves.parquet").query("column == 'tau/joint1'").unit) == {"N·m"}
    file.write_text(file.read_text().replace(KEPT, KEPT + 'normalise = "none"\n'))
    assert run_study(file, out, Here()).warnings == ()


def test_a_subject_that_the_table_does_not_have_is_told(tmp_path: Path) -> None:
    """A misspelt name would have one subject by the mass of its model among those by their own."""
    (tmp_path / "who.csv").write_text("subject,mass\nS1,6.5\ns2,11\nS3,\n", encoding="utf-8")
    file = study_of(tmp_path, 'normalise = "mass"\nsubjects = "who.csv"\n')
    (line,) = run_study(file, tmp_path / "out", Here()).warnings
    assert line == (
        "'subjects' lacks 'S2', normalised by the mass of the robot of each trial; it has 's2', of whom there"
        " is no trial"
    )
    assert json.loads((tmp_path / "out/study.json").read_text())["notes"] == [line]


BAD = {
    "no height": (
        'normalise = "weight*height"\n',
        "",
        "there is no height of 'S1'; give the study 'subjects'",
    ),
    "centimetres": (
        'normalise = "weight*height"\nsubjects = "who.csv"\n',
        "subject,height\nS1,175\n",
        "row 2: height is '175'; give m, 0.2 to 3",
    ),
    "twice": ('subjects = "who.csv"\n', "subject,mass\nS1,70\nS1,71\n", "row 3: subject 'S1' is there twice"),
    "no columns": ('subjects = "who.csv"\n', "who,mass\nS1,70\n", "name its columns subject, mass in kg and"),
    "no way": ('normalise = "kg"\n', "", "'normalise' is 'kg'; give "),
    "no sizes": ('subjects = "who.csv"\n', "subject\nS1\n", "name its columns subject, mass in kg and"),
    "no file": ('subjects = "gone.csv"\n', "", "gone.csv: no such file"),
}


@pytest.mark.parametrize("case", BAD)
def test_what_cannot_be_normalised_is_told_before_any_work(case: str, tmp_path: Path) -> None:
    lines, table, message = BAD[case]
    file, engine = study_of(tmp_path, lines), Here()
    (tmp_path / "who.csv").write_text(table, encoding="utf-8")
    with pytest.raises(LinkwiseError) as caught:
        run_study(file, tmp_path / "out", engine)
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)
    assert (engine.given, (tmp_path / "out").exists()) == ([], False)
