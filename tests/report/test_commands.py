"""The report commands as a user calls them."""

import json
import re
import subprocess
from collections.abc import Callable
from functools import partial
from pathlib import Path

import pytest
from helpers.command_line import run_linkwise

Report = Callable[..., subprocess.CompletedProcess[str]]


@pytest.fixture
def report(tmp_path: Path) -> Report:
    return partial(run_linkwise, "report", folder=tmp_path)


@pytest.mark.parametrize(
    ("arguments", "complaint"),
    [
        (("reduction", "--dof", "5..3"), "--dof '5..3' is not a range"),
        (("reduction", "--dof", "-1..3"), "--dof '-1..3' is not a range"),
        (("reduction", "--dof", "1" * 5000), "--dof '111111111111…11111111111' is not a range"),
        (("reduction", "--dof", "0..3"), "1 ≤ FIRST ≤ LAST"),
        (("reduction", "--robot", "puma560", "--dof", "1..7"), "--dof reaches 7, but 6 links move"),
        (("reduction", "--dof", "1..12", "--tip", "link9"), "--dof reaches 12, but 9 links move"),
        (("reduction", "--dof", "1..9", "--tip", "link5"), "--dof reaches 9, but 5 links move"),
        (("reduction", "--dof", "1..1000000"), "reaches 1000000, but the planar arm has at most 1000 joints"),
        (
            ("reduction", "--budget", "0"),
            "'--budget': Input should be greater than or equal to 1. See python -m linkwise report",
        ),
        (
            ("terms", "planar3", "--budget", "-4"),
            "'--budget': Input should be greater than or equal to 1. See python -m linkwise report",
        ),
        (("terms", "planar3", "--order", "3"), "--order is 3; choose 2 for acceleration"),
        (("terms", "planar3", "--order", "-1"), "--order is -1; choose"),
        (("reduction", "--budget", "10"), "raise --budget"),
        (("reduction", "--seconds", "nowhere.json"), "nowhere.json: cannot be read"),
        (("terms", "puma560", "--budget", "100"), "raise --budget"),
        (("terms", "planar3", "--joint", "7"), "--joint '7' is not there; choose 1..3"),
        (("terms", "planar3", "--lock", "joint1"), "--lock 'joint1' is not of the form JOINT=VALUE"),
    ],
)
def test_a_users_mistake_is_one_line_and_leaves_no_file(
    arguments: tuple[str, ...], complaint: str, report: Report, tmp_path: Path
) -> None:
    run = report(*arguments, "--out", str(tmp_path / "out"))
    assert run.returncode == 2
    assert run.stdout == ""
    assert run.stderr.count("\n") == 1
    assert complaint in run.stderr
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("arguments", "work"),
    [(("reduction",), "report_reduction.study"), (("terms", "planar2"), "report_terms.terms_report")],
)
def test_an_unwritable_directory_is_refused_before_the_work(
    arguments: tuple[str, ...], work: str, report: Report, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def begun(*_: object) -> None:
        raise AssertionError("the work has begun")

    monkeypatch.setattr(f"linkwise.cli.{work}", begun)
    (tmp_path / "file").write_text("")
    run = report(*arguments, "--out", str(tmp_path / "file" / "out"))
    assert run.returncode == 2
    assert run.stderr.count("\n") == 1
    assert "nothing was written" in run.stderr


def test_reports_are_tables_pages_data_and_pictures(report: Report, tmp_path: Path) -> None:
    assert report("reduction", "--robot", "planar3", "--out", "out", "--dof", "1..3").returncode == 0
    assert report("terms", "planar2", "--joint", "all", "--out", "out").returncode == 0
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == sorted(
        [f"{name}.{kind}" for name in ("reduction", "terms") for kind in ("csv", "json", "md", "png", "svg")]
        + ["savings.png", "savings.svg"]
    )


def test_a_held_joint_leaves_the_range_that_was_asked_for(report: Report) -> None:
    run = report("reduction", "--dof", "1..10", "--lock", "joint1=0", "--json")
    assert run.returncode == 0, run.stderr
    assert [point["dof"] for point in json.loads(run.stdout)["points"]] == list(range(1, 11))


def test_where_no_range_is_asked_for_all_links_are_counted(report: Report) -> None:
    for asked, links in ((("--robot", "planar3"), 3), (("--tip", "link5"), 5)):
        run = report("reduction", *asked, "--json")
        assert run.returncode == 0, run.stderr
        assert [point["dof"] for point in json.loads(run.stdout)["points"]] == list(range(1, links + 1))


def test_a_page_shows_the_pictures_that_lie_beside_it_and_no_others(report: Report, tmp_path: Path) -> None:
    printed = report("reduction", "--robot", "planar3", "--dof", "1..3").stdout
    assert "](" not in printed
    assert "--measure" in printed
    asked = ("reduction", "--robot", "planar3", "--dof", "1..3", "--out", str(tmp_path))
    assert report(*asked).returncode == 0
    shown = re.findall(r"\]\((.*?)\)", (tmp_path / "reduction.md").read_text())
    assert shown == ["reduction.svg", "savings.svg"]
    assert all((tmp_path / name).is_file() for name in shown)


def test_any_bucket_of_any_torque_can_be_asked_for(report: Report) -> None:
    asked = ("--joint", "joint2", "--link", "3", "--coordinate", "3", "--order", "1", "--json")
    run = report("terms", "planar3", *asked)
    (torque,) = json.loads(run.stdout)["torques"]
    assert (torque["joint"], torque["link"]) == (2, 3)
    assert torque["kept"] == torque["velocity"][2] == 3


def test_measured_seconds_stay_in_files_of_their_own_and_draw_again(report: Report, tmp_path: Path) -> None:
    first, again = tmp_path / "first", tmp_path / "again"
    asked = ("reduction", "--robot", "planar2", "--dof", "1..2")
    assert report(*asked, "--measure", "--out", str(first)).returncode == 0
    found = json.loads((first / "measured.json").read_text())
    timings, derivations = found["timings"], found["derivations"]
    assert [(t["dof"], t["method"]) for t in timings] == [
        (n, method) for n in (1, 2) for method in ("closed form", "autograd")
    ]
    assert all(t["extract"] > 0.0 and 0.0 < t["whole"] < 1e6 for t in timings)
    assert [d["dof"] for d in derivations] == [1, 2]
    assert all(0.0 < d[way] < 20.0 for d in derivations for way in ("whole", "link", "rule"))
    assert "](savings-measured.svg)" in (first / "measured.md").read_text()
    assert (first / "savings-measured.svg").read_bytes() != (first / "savings.svg").read_bytes()
    stored = str(first / "measured.json")
    printed = report(*asked, "--seconds", stored)
    assert "# Measured time of planar2" in printed.stdout
    assert "](" not in printed.stdout
    as_json = report(*asked, "--seconds", stored, "--json")
    assert json.loads(as_json.stdout)["measured"]["timings"] == timings
    assert report(*asked, "--seconds", stored, "--out", str(again)).returncode == 0
    for path in first.iterdir():
        assert path.read_bytes() == (again / path.name).read_bytes(), path.name
