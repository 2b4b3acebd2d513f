"""Trials that a study does again when something changes: those that are made of it, and no others."""

import shutil
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from helpers import urdf_text
from helpers.motion_logs import write_csv
from helpers.studies import CHOICES, HEAD, QUICK, Here
from linkwise import generate, read_system, write_package
from linkwise.study import run_study
from linkwise.study.file import read_study
from linkwise.study.folder import trial_folders
from linkwise.study.inputs import trial_files
from linkwise.study.kept_curves import lacks_curves
from linkwise.study.ledger import done_before

CYCLES = '\n[cycles]\ntable = "cycles.csv"\npoints = 21\n'
ONE = """
[[trial]]
name = "{name}"
subject = "S1"
condition = "slow"
log = "a.csv"
robot = "{robot}"
loads = ["forces.csv"]
"""


def write_arm(folder: Path, mass: str = "1") -> None:
    links = urdf_text.link("a"), urdf_text.link("b", mass)
    (folder / "arm.urdf").write_text(urdf_text.robot(*links, urdf_text.joint("joint1", "a", "b")))


@pytest.fixture(scope="module")
def done(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A study whose trials are of a robot's file and of its package, with a load, in cycles of a table."""
    folder: Path = tmp_path_factory.mktemp("again")
    time = np.arange(0, 1.0, 0.01)
    write_csv(folder / "a.csv", np.column_stack([time, np.sin(3 * time)]), ["joint1"])
    force = np.column_stack([time, 5.0 * time, 0 * time, 0 * time])
    write_csv(folder / "forces.csv", force, [f"b/force_{axis}" for axis in "xyz"])
    (folder / "cycles.csv").write_text("trial,start,end\na,0.1,0.5\na,0.5,0.9\nb,0.1,0.9\n")
    write_arm(folder)
    write_package(generate(read_system(folder / "arm.urdf"), ["numpy"]), folder / "arm")
    trials = ONE.format(name="a", robot="arm.urdf"), ONE.format(name="b", robot="arm")
    (folder / "study.toml").write_text("".join((HEAD, QUICK, CHOICES, "\n[robot]\n", CYCLES, *trials)))
    assert run_study(folder / "study.toml", folder / "out", Here()).done == ("a", "b")
    return folder


Change = Callable[[Path], object]


def edit(old: str, new: str, name: str = "study.toml") -> Change:
    """Write a file of the study's folder with another text in the place of one."""

    def changed(folder: Path) -> None:
        text = (folder / name).read_text()
        assert old in text
        (folder / name).write_text(text.replace(old, new, 1))

    return changed


CHANGES: dict[str, tuple[Change, str]] = {
    "columns": (edit('["tau/*"]', '["q/*", "tau/*"]'), "ab"),
    "a choice for all": (edit("ignore_extra = true", "cutoff = 20"), "ab"),
    "a choice for one": (edit('name = "b"', 'name = "b"\ncutoff = 20'), "b"),
    "the robot's options": (edit("[robot]\n", "[robot]\nfree_mimic = true\n"), "ab"),
    "points of cycles": (edit("points = 21", "points = 22"), "ab"),
    "lengths of cycles": (edit("points = 21", "points = 21\nlongest = 0.7"), "ab"),
    "no cycles": (edit(CYCLES, ""), "ab"),
    "cycles of a phase": (edit('table = "cycles.csv"', 'during = "joint1>0"'), "ab"),
    "the table of cycles": (edit("0.5,0.9", "0.5,0.8", "cycles.csv"), "ab"),
    "the log": (edit("0.01,", "0.011,", "a.csv"), "ab"),
    "a load's numbers": (edit("0.01,0.05", "0.01,0.06", "forces.csv"), "ab"),
    "no load": (edit('loads = ["forces.csv"]', ""), "a"),
    "the robot's file": (lambda folder: write_arm(folder, "2"), "a"),
    "the robot's package": (edit("{", "{ ", "arm/manifest.json"), "b"),
    "another robot": (edit('"arm.urdf"', '"arm"'), "a"),
    "a label": (edit('condition = "slow"', 'condition = "fast"'), "a"),
    "the subject": (edit('subject = "S1"', 'subject = "S2"'), "a"),
    "pages": (edit("pages = false", "pages = true"), "ab"),
}


def still_done(folder: Path) -> str:
    plan = read_study(folder / "study.toml")
    return "".join(done_before(plan, trial_folders(folder / "out", plan)))


@pytest.mark.parametrize("what", CHANGES)
def test_a_trial_is_done_again_for_whatever_it_is_made_of(done: Path, what: str) -> None:
    change, stale = CHANGES[what]
    assert still_done(done) == "ab"
    files = [path for path in done.iterdir() if path.is_file()]
    before = {path: path.read_bytes() for path in (*files, done / "arm/manifest.json")}
    change(done)
    try:
        assert still_done(done) == "ab".translate(dict.fromkeys(map(ord, stale)))
    finally:
        for path, content in before.items():
            path.write_bytes(content)


def test_a_trial_that_keeps_no_curves_lacks_none(tmp_path: Path) -> None:
    plan: Any = SimpleNamespace(cycles="on")
    assert not lacks_curves(plan, tmp_path)


@pytest.mark.parametrize(("column", "fresh"), [("tau/joint1", 0), ("q/joint1", 2)])
def test_trials_are_done_again_for_a_curve_that_they_have_not_kept(
    done: Path, tmp_path: Path, column: str, fresh: int
) -> None:
    folder = Path(shutil.copytree(done, tmp_path / "study"))
    with (folder / "study.toml").open("a") as file:
        file.write(f'\n[[figure]]\ncolumns = ["{column}"]\n')
    found = run_study(folder / "study.toml", folder / "out", Here())
    assert (found.fresh, found.broken, found.warnings) == (fresh, (), ())
    assert (folder / f"out/{column.replace('/', '-')}.svg").is_file()


def test_a_trial_of_another_built_in_robot_is_done_again(tmp_path: Path) -> None:
    time = np.arange(0, 1.0, 0.01)
    write_csv(tmp_path / "a.csv", np.column_stack([time, *np.sin([3 * time, time])]), ["joint1", "joint2"])
    trial = '\n[[trial]]\nname = "a"\ncondition = "slow"\nlog = "a.csv"\nrobot = "planar1"\n'
    file, out = tmp_path / "study.toml", tmp_path / "out"
    file.write_text("".join((HEAD, QUICK, CHOICES, trial)))
    assert [run_study(file, out, Here()).fresh for _ in range(2)] == [1, 0]
    edit("planar1", "planar2")(tmp_path)
    assert run_study(file, out, Here()).fresh == 1
    assert run_study(file, out, Here()).fresh == 0


def test_a_trial_is_done_again_by_another_linkwise(done: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("linkwise.study.inputs.fingerprint", lambda: "of another")
    assert still_done(done) == ""


def test_a_trial_is_made_of_every_file_that_it_names(done: Path, tmp_path: Path) -> None:
    """OpenSim's loads name the file of their numbers, too, and what ties the robot's joints."""
    loads = '<OpenSimDocument><ExternalLoads><objects><ExternalForce name="f"/></objects>'
    (tmp_path / "plate.xml").write_text(
        f"{loads}<datafile>plate.mot</datafile></ExternalLoads></OpenSimDocument>"
    )
    for name in ("a.csv", "forces.csv", "arm.urdf", "cycles.csv"):
        shutil.copy(done / name, tmp_path)
    (tmp_path / "cycles.csv").write_text("trial,start,end\na,0.1,0.5\n")
    ties = CHOICES, "\n[robot]\n", 'constraints = "ties.toml"\n', CYCLES
    trial = ONE.format(name="a", robot="arm.urdf") + 'contact_loads = ["plate.xml"]\n'
    (tmp_path / "study.toml").write_text("".join((HEAD, QUICK, *ties, trial)))
    (tmp_path / "ties.toml").touch()
    plan = read_study(tmp_path / "study.toml")
    assert sorted(trial_files(plan, plan.trials[0])) == [
        str(tmp_path / name)
        for name in ("a.csv", "arm.urdf", "cycles.csv", "forces.csv", "plate.mot", "plate.xml", "ties.toml")
    ]
