"""Cycles of both legs: mirrored where they are of the left, apart or pooled."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from helpers.motion_logs import write_csv
from helpers.studies import Here
from linkwise import LinkwiseError
from linkwise.study import run_study
from linkwise.study.sides import neutral, swapped

BIPED = """schema = 1
name = "biped"
gravity = [0, -9.81, 0]
joint = [
  { name = "tx", type = "prismatic", parent = "base", child = "a", axis = [1, 0, 0] },
  { name = "ty", type = "prismatic", parent = "a", child = "b", axis = [0, 1, 0] },
  { name = "tz", type = "prismatic", parent = "b", child = "c", axis = [0, 0, 1] },
  { name = "tilt", parent = "c", child = "d", axis = [0, 0, 1] },
  { name = "list", parent = "d", child = "e", axis = [1, 0, 0] },
  { name = "turn", parent = "e", child = "pelvis", axis = [0, 1, 0] },
  { name = "flex_r", parent = "pelvis", child = "f_r", xyz = [0, -0.1, 0.1], axis = [0, 0, 1] },
  { name = "spread_r", parent = "f_r", child = "g_r", axis = [1, 0, 0] },
  { name = "twist_r", parent = "g_r", child = "thigh_r", axis = [0, 1, 0] },
  { name = "knee_r", parent = "thigh_r", child = "shank_r", xyz = [0, -0.4, 0.02], axis = [0, 0, 1] },
  { name = "flex_l", parent = "pelvis", child = "f_l", xyz = [0, -0.1, -0.1], axis = [0, 0, 1] },
  { name = "spread_l", parent = "f_l", child = "g_l", axis = [-1, 0, 0] },
  { name = "twist_l", parent = "g_l", child = "thigh_l", axis = [0, 1, 0] },
  { name = "knee_l", parent = "thigh_l", child = "shank_l", xyz = [0, -0.4, -0.02], axis = [0, 0, 1] },
]
link = [
  { name = "a" }, { name = "b" }, { name = "c" }, { name = "d" }, { name = "e" },
  { name = "f_r" }, { name = "g_r" }, { name = "f_l" }, { name = "g_l" },
  { name = "pelvis", mass = 20, com = [0.02, 0.2, 0], inertia = { xx = 0.6, yy = 0.5, zz = 0.3, xy = 0.02 } },
  { name = "thigh_r", mass = 4, com = [0, -0.2, 0.01], inertia = { xx = 1, yy = 1, zz = 1, yz = 0.1 } },
  { name = "shank_r", mass = 2, com = [0, -0.2, 0], inertia = { xx = 0.4, yy = 0.3, zz = 0.5, xz = 0.1 } },
  { name = "thigh_l", mass = 4, com = [0, -0.2, -0.01], inertia = { xx = 1, yy = 1, zz = 1, yz = -0.1 } },
  { name = "shank_l", mass = 2, com = [0, -0.2, 0], inertia = { xx = 0.4, yy = 0.3, zz = 0.5, xz = -0.1 } },
]
"""
MIDDLE = ["tx", "ty", "tz", "tilt", "list", "turn"]
LEG = ["flex", "spread", "twist", "knee"]
JOINTS = [*MIDDLE, *(f"{name}_{side}" for side in "rl" for name in LEG)]
TURNED = {"tz", "list", "turn", "twist_r", "twist_l"}
"""Coordinates that a mirror in the plane of x and y turns round, by the axes above; `spread` is none."""
STUDY = """schema = 1
name = "walks"
pages = false
columns = ["**"]
[analysis]
ignore_extra = true
power_terms = true
[cycles]
"""
TRIALS = "".join(
    f'[[trial]]\nname = "{name}"\nlog = "{name}.csv"\nrobot = "biped.toml"\nloads = ["{name}-plates.csv"]\n'
    'subject = "ann"\n'
    for name in ("as-is", "mirrored")
)
BY_PLATES = 'start = { right = "right>20", left = "left>20" }\n'


def write_walks(folder: Path) -> None:
    """A recording of a symmetric biped, and the same in a mirror: sides exchanged, signs turned."""
    (folder / "biped.toml").write_text(BIPED, encoding="utf-8")
    time = np.arange(0, 3.0, 0.01)
    draw = np.random.default_rng(3)
    phase = 2 * np.pi * time[:, None] * draw.integers(1, 3, 14) * 0.8 + draw.uniform(0, 6, 14)
    q = dict(zip(JOINTS, (0.4 * np.sin(phase) + 0.1).T, strict=True))
    force = np.maximum(0, 400 * np.sin(2 * np.pi * 0.8 * time + np.outer([0.3, 2.9], np.ones_like(time))))
    plates = {
        f"{side}:shank_{side[0]}": np.stack([0.1 * one, one, 0.2 * one, 0 * one, -0.4 + 0 * one, z + 0 * one])
        for side, one, z in (("right", force[0], 0.15), ("left", force[1], -0.12))
    }
    flip = np.array([1, 1, -1, 1, 1, -1])[:, None]
    both = {
        "as-is": (q, plates),
        "mirrored": (
            {exchanged(name): (-1 if name in TURNED else 1) * values for name, values in q.items()},
            {exchanged(name): flip * values for name, values in plates.items()},
        ),
    }
    for name, (motion, loads) in both.items():
        write_csv(folder / f"{name}.csv", np.column_stack([time, *(motion[j] for j in JOINTS)]), JOINTS)
        heads = [f"{load}/{what}_{axis}" for load in loads for what in ("force", "point") for axis in "xyz"]
        table = np.column_stack([time, *(row for load in loads.values() for row in load)])
        write_csv(folder / f"{name}-plates.csv", table, heads)


def exchanged(name: str) -> str:
    if ":" in name:
        return "left:shank_l" if name.startswith("right") else "right:shank_r"
    return f"{name[:-1]}{'l' if name[-1] == 'r' else 'r'}" if name[-2:] in ("_r", "_l") else name


@pytest.fixture(scope="module")
def walks(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("walks")
    write_walks(folder)
    (folder / "study.toml").write_text(STUDY + BY_PLATES + TRIALS, encoding="utf-8")
    found = run_study(folder / "study.toml", folder / "out", Here())
    assert (found.broken, found.warnings) == ((), ())
    return folder / "out"


def samples(out: Path, trial: str) -> Any:
    return pd.read_parquet(out / f"trials/{trial}/samples.parquet").drop(columns=["trial", "side"])


@pytest.mark.parametrize(("side", "other"), [("right", "left"), ("left", "right")])
def test_a_mirrored_walk_has_on_its_left_what_the_walk_has_on_its_right(
    walks: Path, side: str, other: str
) -> None:
    """Every share of every torque and power: a symmetric robot in a mirror bears mirrored torques."""
    one, mirrored = samples(walks, f"as-is-{side}"), samples(walks, f"mirrored-{other}")
    assert len(one.columns) > 700
    assert {"tau/knee_ipsi", "tau_load/flex_contra/contra", "tau_qd/tilt/thigh_contra/twist_contra"} <= set(
        one
    )
    assert set(one) == set(mirrored)
    for name in one.columns[1:]:
        scale = np.abs(one[name]).max()
        np.testing.assert_allclose(mirrored[name], one[name], rtol=0, atol=1e-9 * scale + 1e-12, err_msg=name)
    assert np.abs(one["tau/twist_ipsi"]).max() > 0.5
    assert np.abs(one["tau/list"]).max() > 0.5


def test_a_cycle_of_the_right_is_as_it_was_recorded(walks: Path) -> None:
    table = samples(walks, "as-is-right")
    whole = np.loadtxt(walks.parent / "as-is.csv", delimiter=",", skiprows=1)
    for name, column in (("q/twist_ipsi", "twist_r"), ("q/twist_contra", "twist_l"), ("q/list", "list")):
        at = np.interp(table.time, whole[:, 0], whole[:, 1 + JOINTS.index(column)])
        np.testing.assert_allclose(table[name], at, atol=1e-3)  # lines between samples


def test_sides_are_a_factor_and_what_was_turned_is_told(walks: Path) -> None:
    mark = json.loads((walks / "study.json").read_text())
    assert mark["factors"] == ["subject", "side"]
    assert set(mark["cycles"]["change_sign_on_the_left"]) == TURNED
    assert (mark["cycles"]["sides"], mark["cycles"]["sign_by"]) == ("apart", "the robot's geometry")
    curves = pd.read_parquet(walks / "curves.parquet")
    assert set(curves.side) == {"right", "left"}


def test_pooled_cycles_of_both_sides_are_of_one_subject(walks: Path) -> None:
    folder = walks.parent
    pooled = folder / "pooled.toml"
    pooled.write_text(STUDY + BY_PLATES + 'sides = "pooled"\n' + TRIALS, encoding="utf-8")
    assert run_study(pooled, folder / "pooled", Here()).broken == ()
    curves = pd.read_parquet(folder / "pooled/curves.parquet").set_index(["column", "percent"])
    assert "side" not in curves
    names = [f"{trial}-{side}" for trial in ("as-is", "mirrored") for side in ("right", "left")]
    for column in ("tau/knee_ipsi", "tau/twist_contra", "q/turn"):
        each = [samples(walks, name).groupby("percent")[column].mean() for name in names]
        np.testing.assert_allclose(curves.loc[column]["mean"], np.mean(each, axis=0), rtol=1e-9, atol=1e-12)
    assert set(curves.trials) == {4}


def test_net_torques_by_cause_are_asked_for_by_the_names_that_tell_a_side(walks: Path) -> None:
    """Tables, tests and figures name `ipsi`, and trials compute the right and the left of it."""
    folder = walks.parent
    named = (
        STUDY.replace('["**"]', '["tau_by/knee_ipsi/flex_*", "tau_qd*/knee_ipsi/*/flex_*"]') + BY_PLATES,
        '[[figure]]\ncolumns = ["causes:knee_ipsi"]\nby = "side"\nformats = ["svg"]\n',
        '[[compare]]\nfactor = "side"\nbetween = ["right", "left"]\ncolumns = ["tau_by/knee_ipsi/*"]\n',
    )
    (folder / "nets.toml").write_text("".join((*named, TRIALS)), encoding="utf-8")
    assert run_study(folder / "nets.toml", folder / "nets", Here()).broken == ()
    for side in ("right", "left"):
        table = samples(folder / "nets", f"as-is-{side}")
        parts = (f"{order}/knee_ipsi/shank_ipsi/flex_ipsi" for order in ("tau_qdd", "tau_qd"))
        whole = sum(table[part] for part in parts)
        np.testing.assert_allclose(table["tau_by/knee_ipsi/flex_ipsi"], whole, atol=1e-9)
        assert np.ptp(whole) > 0.5
    assert (folder / "nets/causes-knee_ipsi.svg").exists()


def test_what_is_turned_may_be_said_and_cycles_come_from_a_table(walks: Path) -> None:
    folder = walks.parent
    rows = "as-is,right,0.5,1.5", "as-is,left,1,2", "mirrored,right,1,2", "mirrored,left,0.5,1.5"
    (folder / "steps.csv").write_text("\n".join(("trial,side,start,end", *rows)), encoding="utf-8")
    told = 'table = "steps.csv"\nsides = "apart"\nturned = ["list"]\n'
    (folder / "told.toml").write_text(STUDY + told + TRIALS, encoding="utf-8")
    assert run_study(folder / "told.toml", folder / "told", Here()).broken == ()
    one, mirrored = samples(folder / "told", "as-is-right"), samples(folder / "told", "mirrored-left")
    for name, sign in (("q/list", 1), ("q/turn", -1), ("q/twist_ipsi", -1), ("q/knee_ipsi", 1)):
        np.testing.assert_allclose(mirrored[name], sign * one[name], atol=1e-9)
    assert (one.time.min(), one.time.max()) == (0.5, 1.5)
    mark = json.loads((folder / "told/study.json").read_text())
    assert mark["cycles"]["change_sign_on_the_left"] == ["list"]


BAD = {
    "one text": ('start = "right>20"\nsides = "apart"\n', "as { right = …, left = … }"),
    "one side": ('start = { right = "right>20" }\n', "as { right = …, left = … }"),
    "turned alone": ('start = "right>20"\nturned = ["list"]\n', "'turned' goes with 'sides'"),
    "no joint": (BY_PLATES + 'turned = ["lits"]\n', "'turned' has 'lits', which is not a joint"),
    "no side in a table": (
        'table = "a.csv"\nsides = "apart"\n',
        "a.csv: name its columns trial, start, end and",
    ),
    "another side": (
        'table = "b.csv"\nsides = "apart"\n',
        "b.csv, row 2: side is 'Right'; give right or left",
    ),
}


@pytest.mark.parametrize("case", BAD)
def test_sides_that_cannot_be_are_told_before_any_work(case: str, tmp_path: Path) -> None:
    write_walks(tmp_path)
    (tmp_path / "a.csv").write_text("trial,start,end\nas-is,0,1\n")
    (tmp_path / "b.csv").write_text("trial,side,start,end\nas-is,Right,0,1\n")
    lines, message = BAD[case]
    (tmp_path / "study.toml").write_text(STUDY + lines + TRIALS, encoding="utf-8")
    refuse(tmp_path, message)


ROBOTS = {
    "a joint without its other": ("knee_l", "knie_l", "joint 'knee_r' has no 'knee_l' on the other"),
    "names that tell no side": ("_", "", "no joint's name tells one: r, l, R, L, right or left"),
    "legs in one place": (", 0.1]", ", 0]", "joints of both are in one place; name the coordinates"),
    "an axis askew": (
        'child = "e", axis = [1, 0, 0]',
        'child = "e", axis = [1, 0, 1]',
        "'list' have no mirror",
    ),
}


@pytest.mark.parametrize("case", ROBOTS)
def test_a_robot_whose_sides_are_not_told_is_refused(case: str, tmp_path: Path) -> None:
    write_walks(tmp_path)
    right, wrong, message = ROBOTS[case]
    text = BIPED.replace(right, wrong)
    if case == "legs in one place":
        text = (
            text.replace(", -0.1]", ", 0]")
            .replace("0.02]", "0]")
            .replace("-0.02]", "0]")
            .replace("-0]", "0]")
        )
    (tmp_path / "biped.toml").write_text(text, encoding="utf-8")
    for name in ("as-is", "mirrored"):
        log = tmp_path / f"{name}.csv"
        head, _, rest = log.read_text().partition("\n")
        log.write_text(f"{head.replace(right, wrong)}\n{rest}")
        plates = tmp_path / f"{name}-plates.csv"
        head, _, rest = plates.read_text().partition("\n")
        bodies = head.replace("shank_", "shank") if right == "_" else head
        plates.write_text(f"{bodies}\n{rest}")
    (tmp_path / "study.toml").write_text(STUDY + BY_PLATES + TRIALS, encoding="utf-8")
    refuse(tmp_path, message)


def test_directions_that_are_not_mirrored_are_refused(tmp_path: Path) -> None:
    write_walks(tmp_path)
    asked = STUDY.replace("power_terms", 'reaction = ["knee_r"]\npower_terms') + BY_PLATES + TRIALS
    (tmp_path / "study.toml").write_text(asked, encoding="utf-8")
    refuse(tmp_path, "'reaction/knee_r/")


def refuse(folder: Path, message: str) -> None:
    engine = Here()
    with pytest.raises(LinkwiseError) as caught:
        run_study(folder / "study.toml", folder / "out", engine)
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)
    assert (engine.given, (folder / "out").exists()) == ([], False)


@pytest.mark.parametrize(
    ("name", "other", "ipsi"),
    [
        ("knee_angle_r", "knee_angle_l", "knee_angle_ipsi"),
        ("R_Knee", "L_Knee", "ipsi_Knee"),
        ("RightKnee", "LeftKnee", "ipsiKnee"),
        ("rKnee", "lKnee", "ipsiKnee"),
        ("kneeR", "kneeL", "kneeIpsi"),
        ("right foot", "left foot", "ipsi foot"),
        ("torque:knee_r", "torque:knee_l", "torque:knee_ipsi"),
        (
            "tau_qdd/hip_r/shank_l/knee_r",
            "tau_qdd/hip_l/shank_r/knee_l",
            "tau_qdd/hip_ipsi/shank_contra/knee_ipsi",
        ),
        ("pelvis_list", "pelvis_list", "pelvis_list"),
        ("lumbar", "lumbar", "lumbar"),
        ("RLEG_KNEE", "RLEG_KNEE", "RLEG_KNEE"),
    ],
)
def test_sides_are_told_by_words_of_names(name: str, other: str, ipsi: str) -> None:
    assert (swapped(name), swapped(other)) == (other, name)
    assert neutral(name, "right") == neutral(other, "left") == ipsi


def test_net_torques_by_cause_are_of_the_side_whose_cycle_it_is(walks: Path) -> None:
    """Figures of causes, too, name joints by the side whose cycle it is."""
    kept = '"tau_by/knee_ipsi/*", "tau_qdd/knee_ipsi/**", "tau_qd/knee_ipsi/**"'
    text = (STUDY + BY_PLATES + TRIALS).replace('"**"', kept)
    figure = '[[figure]]\ncolumns = ["causes:knee_ipsi"]\nby = "side"\n'
    study = walks.parent / "causes.toml"
    study.write_text(text + figure, encoding="utf-8")
    found = run_study(study, walks.parent / "causes", Here())
    assert (found.broken, found.warnings) == ((), ())
    assert (walks.parent / "causes/causes-knee_ipsi.svg").is_file()
    for side in ("left", "right"):
        table = samples(walks.parent / "causes", f"as-is-{side}")
        for cause in ("flex_ipsi", "turn"):
            parts = table.filter(regex=f"^tau_qdd?/knee_ipsi/[^/]+/{cause}$").sum(axis=1)
            np.testing.assert_allclose(table[f"tau_by/knee_ipsi/{cause}"], parts, rtol=0, atol=1e-9)
        assert np.abs(table["tau_by/knee_ipsi/flex_ipsi"]).max() > 0.5
    study.write_text(text + figure.replace("knee_ipsi", "knee_l"), encoding="utf-8")
    with pytest.raises(
        LinkwiseError, match=r"has 'causes:knee_l', and the robot has no .* nearest are 'knee_"
    ):
        run_study(study, walks.parent / "causes", Here())
