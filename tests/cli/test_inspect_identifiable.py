"""`linkwise inspect --identifiable`: what joint torques determine, as a table and as JSON."""

import json
import sys
from pathlib import Path
from typing import Any

import pytest
from conftest import DATA
from linkwise.cli.app import app
from typer.testing import CliRunner

pytest.importorskip("clarabel")

README = ["--at", "joint1=0.3,1,0", "--at", "joint2=0.5,0,0", "--at", "joint3=-0.2,2,5"]


def told(*arguments: str) -> Any:
    return CliRunner().invoke(app, ["inspect", *arguments], catch_exceptions=False)


def test_the_table_says_what_follows_and_how_far_the_rest_may_be_off() -> None:
    text = told("planar3", "--identifiable", *README).stdout
    rows = {tuple(line.split()[:2]): line.split()[2:] for line in text.splitlines() if line[:8] == "  joint1"}
    assert "1 of 6" in text
    assert "5 of 14" in text
    assert rows["joint1", "link2"] == ["1.918", "0.8787", "3.301", "*"]  # with a link 1 of any mass
    assert "  * an end goes further with links above 10 times the robot's mass and reach" in text
    assert "  joint3  link3      0.6807  follows from torques" in text
    assert "joint3 -0.2 rad, 2 rad/s, 5 rad/s^2" in text
    assert max(map(len, text.splitlines())) < 120


def test_limits_of_masses_and_what_is_measured_are_taken_and_json_has_every_mask() -> None:
    free, held, one = (
        json.loads(told("planar3", "--identifiable", "--json", *README, *more).stdout)
        for more in ((), ("--mass-limit", "0.1"), ("--mass-limit", "link2=0.55,0.65", "--measured", "joint1"))
    )
    tau = [{(row["joint"], row["link"]): row for row in data["tau"]} for data in (free, held, one)]
    ends = [(rows["joint1", "link2"]["least"], rows["joint1", "link2"]["greatest"]) for rows in tau]
    assert ends[0] == pytest.approx((0.8787, 3.3010), abs=1e-4)
    assert ends[1] == pytest.approx((1.6747, 2.1607), abs=1e-4)
    assert ends[0][0] < ends[2][0] < ends[2][1] < ends[0][1]
    assert held["mass_limits"] == [pytest.approx([0.54, 0.66])] * 3
    assert one["mass_limits"] == [[0.0, None], [0.55, 0.65], [0.0, None]]
    assert (one["measured"], free["measured"]) == (["joint1"], ["joint1", "joint2", "joint3"])
    assert free["follows"]["torque"] == [[False] * 3, [False] * 3, [False, False, True]]
    assert free["by_link"]["torque"] == [1, 6]
    assert free["summed_over_links"]["torque"] == [3, 3]
    assert all(row["proved"] for row in free["tau"])


@pytest.mark.parametrize(
    ("limits", "said"),
    [
        ([], "whatever their masses (--mass-limit)"),
        (["--mass-limit", "link2=0,0.65"], "within --mass-limit"),
    ],
)
def test_the_table_says_whether_masses_are_held(limits: list[str], said: str) -> None:
    assert f"the same joint torques, {said}," in told("planar3", "--identifiable", *README, *limits).stdout


def test_a_loop_is_looked_at_where_it_closes() -> None:
    data = json.loads(told(str(DATA / "fourbar.toml"), "--identifiable", "--json").stdout)
    assert data["joints"] == ["a"]
    assert [row["follows"] for row in data["tau"]] == [False] * 3
    assert all(row["least"] <= row["value"] <= row["greatest"] for row in data["tau"])


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["planar3", "--mass-limit", "0.1"], "--at, --measured and --mass-limit go with --identifiable"),
        (
            ["planar3", "--identifiable", "--mass-limit", "link9=0.1"],
            "--mass-limit is 'link9'; choose a link",
        ),
        (["planar3", "--identifiable", "--mass-limit", "much"], "--mass-limit much: give a number"),
        (
            ["planar3", "--identifiable", "--mass-limit", "link3=5,6"],
            "outside of its own; widen --mass-limit",
        ),
        (["planar3", "--identifiable", "--measured", "elbow"], "--measured is 'elbow'; choose a joint"),
        (["planar3", "--identifiable", "--at", "joint1"], "--at joint1: write it as JOINT=POSITION"),
        (["planar3", "--identifiable", "--at", "joint1=a"], "--at joint1=a: give 1 to 3 numbers"),
        (["planar3", "--identifiable", "--at", "hip=1"], "--at hip=1: the joint is 'hip'; choose a joint"),
        ([str(DATA / "cart_pendulum.py"), "--identifiable"], "links of cart_pendulum are energies"),
    ],
)
def test_what_cannot_be_is_one_line(
    arguments: list[str], message: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    from linkwise.__main__ import main

    monkeypatch.setattr(sys, "argv", ["linkwise", "inspect", *arguments])
    with pytest.raises(SystemExit) as ended:
        main()
    said = [line for line in capsys.readouterr().err.splitlines() if not line.startswith("note")]
    assert ended.value.code == 2
    assert len(said) == 1
    assert message in said[0]


def test_without_the_solver_the_extra_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    from linkwise.errors import LinkwiseError

    monkeypatch.setitem(sys.modules, "clarabel", None)
    with pytest.raises(LinkwiseError, match=r"pip install 'linkwise\[identify\]'"):
        told("planar3", "--identifiable")
    assert not Path("planar3").exists()
