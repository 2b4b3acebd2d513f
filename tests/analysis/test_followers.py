"""Columns of joints that follow others or are held: left out unasked, and told of where they disagree."""

from pathlib import Path

import numpy as np
import pytest
from helpers.motion_logs import smooth, write_csv, write_mot
from helpers.osim_text import LINES, chain, constraints, coupler
from helpers.urdf_text import joint, link, mimic, robot
from linkwise import Options, analyze, kept_package
from numpy.typing import NDArray

TABLE = smooth(60, 1)
TIME, Q = TABLE.T
HAND = robot(
    *map(link, ("base", "hand", "left", "right", "nail")),
    joint("wrist", "base", "hand"),
    joint("finger", "hand", "left", type="prismatic", inner=mimic("wrist", 0.02, 0.01)),
    joint("thumb", "hand", "right"),
    joint("tip", "right", "nail", inner=mimic("thumb", -2.0)),
)


@pytest.fixture(autouse=True)
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("LINKWISE_CACHE", str(tmp_path / "cache"))


def said_of(columns: list[NDArray[np.float64]], folder: Path, apart: dict[int, float]) -> list[str]:
    """Warnings of a log of the hand, in which a sample of some columns is moved."""
    table = np.column_stack([TIME, *columns])
    for column, by in apart.items():
        table[7, 1 + column] += by
    (folder / "hand.urdf").write_text(HAND)
    hand = kept_package(folder / "hand.urdf", "numpy", Options(lock={"thumb": 0.5}))
    found = analyze(write_csv(folder / "a.csv", table, ("wrist", "finger", "thumb", "tip")), hand)
    assert found.ignored == ("finger", "thumb", "tip")
    return list(found.warnings)


def test_columns_of_followers_and_of_held_joints_are_held_against_what_the_robot_has_them_do(
    tmp_path: Path,
) -> None:
    still = np.full_like(Q, 0.5)
    columns = [Q, 0.01 + 0.02 * Q, still, -2 * still]
    assert said_of(columns, tmp_path, {}) == []
    assert said_of(columns, tmp_path, {1: 9e-4, 2: 9e-3, 3: -9e-3}) == [], "within play and rounding"
    assert said_of(columns, tmp_path, {1: -0.003, 2: 0.2, 3: 0.03}) == [
        "column 'finger' is left out, and is up to 0.003 m from what 'finger' does by following 'wrist'",
        "column 'thumb' is left out, and is up to 0.2 rad from where the robot holds 'thumb'",
        "column 'tip' is left out, and is up to 0.03 rad from where the robot holds 'tip'",
    ]
    gap = [*columns[:3], np.where(TIME[5] == TIME, np.nan, columns[3])]
    assert said_of(gap, tmp_path, {3: 0.04})[0].startswith("column 'tip' is left out, and is up to 0.04 rad")


def test_so_are_those_of_opensims_couplers_in_logs_in_degrees(tmp_path: Path) -> None:
    held = {"joint2_angle": "<locked>true</locked><default_value>0.4</default_value>"}
    coupled = constraints(coupler("joint1_angle", "joint0_angle", LINES))
    model = tmp_path / "model.osim"
    model.write_text(chain(["PinJoint"] * 4, coupled, held))
    follows = np.interp(Q, [-1.0, 0.3, 1.0], [0.2, -0.1, 0.4])
    for off in (0.0, 2.0):
        columns = [Q, follows, 0.4 + 0 * Q, 0.3 * Q]
        table = np.column_stack([TIME, *np.degrees(columns)])
        table[:, 2:4] += off
        names = [f"/jointset/joint{k}/joint{k}_angle/value" for k in range(4)]
        found = analyze(write_mot(tmp_path / "a.sto", table, names), kept_package(model, "numpy"))
        ends = (
            "what 'joint1_angle' does by following 'joint0_angle'",
            "where the robot holds 'joint2_angle'",
        )
        assert list(found.warnings) == [
            f"column {name!r} is left out, and is up to 0.0349 rad from {end}"
            for name, end in zip(names[1:3], ends, strict=True)
            if off
        ]
