"""Cases of `linkwise example` do what their pages say, and the notebooks on them draw the gallery."""

import io
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from linkwise import Lowpass, Payload, Processing, analyze, kept_package
from linkwise.example_cases import example_case, write_case
from tools import notebooks, pages

pytestmark = pytest.mark.ship
NAMES = ["arm-log", "leg", "throw", "walk"]
CASES = pages.ROOT / "examples/cases"


@pytest.mark.parametrize("name", NAMES)
def test_every_command_of_a_case_runs_as_its_page_says(name: str, tmp_path: Path) -> None:
    write_case(example_case(name), tmp_path / name)
    pages.run_page(tmp_path / name / "README.md", tmp_path / name)
    shown = re.findall(
        r"`(\w+/[\w-]+\.(?:png|html|parquet|urdf))`", (tmp_path / name / "README.md").read_text()
    )
    assert shown
    assert not [path for path in shown if not (tmp_path / name / path).is_file()]


@pytest.mark.parametrize("name", ["arm-log", "leg", "throw"])
def test_what_was_made_is_what_its_script_makes(name: str, tmp_path: Path) -> None:
    pytest.importorskip("mujoco")
    subprocess.run([sys.executable, CASES / name / "make.py", tmp_path], check=True)
    made = sorted(tmp_path.glob("*.csv"))
    assert [file.name for file in made] == sorted(file.name for file in (CASES / name).glob("*.csv"))
    for file in made:
        ours, kept = (
            np.loadtxt(path, delimiter=",", skiprows=1) for path in (file, CASES / name / file.name)
        )
        np.testing.assert_allclose(ours, kept, rtol=0, atol=0.011)  # a unit of the last digit of arm-log.csv


SUMS = ("sums",)
MOTORS = {
    "throw": lambda case: analyze(
        case / "throw.csv",
        kept_package(case / "arm.urdf"),
        processing=Processing(lowpass=Lowpass(40.0), start=0.1, stop=0.348),
        payloads=[Payload("hand", 0.145, (0, 0, -0.1), name="ball")],
        columns=SUMS,
    ),
    "leg": lambda case: analyze(
        case / "step.csv",
        kept_package(case / "leg.toml"),
        processing=Processing(lowpass=Lowpass(40.0)),
        loads=[case / "ground.csv"],
        columns=SUMS,
    ),
}


@pytest.mark.parametrize("name", MOTORS)
def test_torques_are_those_that_motors_gave_in_the_simulation(name: str) -> None:
    result = MOTORS[name](CASES / name)
    joints = (CASES / name / "torques.csv").read_text().partition("\n")[0].split(",")[1:]
    time, *given = np.loadtxt(CASES / name / "torques.csv", delimiter=",", skiprows=1).T
    for joint, gave in zip(joints, given, strict=True):
        apart = result[f"tau/{joint}"] - np.interp(result.time, time, gave)
        assert np.sqrt(np.mean(apart**2)) < 0.02 * abs(gave).max(), joint


def test_moments_of_the_walk_are_those_that_opensim_found() -> None:
    walk = CASES / "walk"
    result = analyze(
        walk / "subject01_walk_IK.mot",
        kept_package(walk / "subject01.osim"),
        loads=[walk / "subject01_walk_grf.xml"],
        processing=Processing(lowpass=Lowpass(6.0, order=3)),
        columns=SUMS,
    )
    lines = (walk / "subject01_walk_ID.sto").read_text().split("endheader\n")[1]
    names = lines.partition("\n")[0].split()
    table = np.loadtxt(io.StringIO(lines), skiprows=1)
    for at, name in enumerate(names[1:], 1):
        joint = re.sub("_(moment|force)$", "", name)
        apart = (result[f"tau/{joint}"] - table[:, at])[3:-3]  # OpenSim ends a spline, linkwise a difference
        assert np.sqrt(np.mean(apart**2)) < 1e-3 * abs(table[:, at]).max(), joint


@pytest.mark.parametrize("notebook", notebooks.NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_runs_from_top_to_bottom_and_draws_what_the_gallery_shows(
    notebook: Path, tmp_path: Path
) -> None:
    image = pytest.importorskip("matplotlib.image")
    drawn = notebooks.executed(notebook, tmp_path)
    gallery = (pages.ROOT / "docs/gallery.md").read_text()
    assert drawn
    for name, content in drawn.items():
        assert f"pictures/{name}.png" in gallery
        now, kept = image.imread(io.BytesIO(content)), image.imread(notebooks.PICTURES / f"{name}.png")
        assert now.shape == kept.shape, name
        assert abs(now - kept).mean() < 0.01, name


def test_there_are_five_notebooks_and_each_says_where_to_go_on() -> None:
    assert [one.stem for one in notebooks.NOTEBOOKS] == ["arm-log", "leg", "teaching", "throw", "walk"]
    for notebook in notebooks.NOTEBOOKS:
        text = notebook.read_text(encoding="utf-8")
        assert "## Where to go on" in text
        assert '"outputs": []' in text
        for page in re.findall(r"`(docs/[\w/-]+\.md)`", text):
            assert (pages.ROOT / page).is_file(), page
        if notebook.stem in NAMES:
            assert f'"!linkwise example {notebook.stem}"' in text
