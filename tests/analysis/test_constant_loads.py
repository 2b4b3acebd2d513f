"""Loads at the command line: constant ones by --load, what is noticed in files of others, and pictures."""

import json
from pathlib import Path

import numpy as np
import pytest
from helpers.command_line import run_linkwise
from helpers.motion_logs import smooth, write_csv
from linkwise import Load, generate, read_system, write_package
from linkwise.analysis import analyze

FORCE = [f"{load}/force_{axis}" for load in ("hand:link3", "link2") for axis in "xyz"]


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("constant")
    write_package(generate(read_system("planar3"), ["numpy"]), folder / "planar3")
    write_csv(folder / "log.csv", smooth(60, 3))
    return folder


def loaded(place: Path, *arguments: str):
    asked = ("analyze", "log.csv", "--robot", "planar3", "--out", "out", "--no-page", *arguments)
    return run_linkwise(*asked, folder=place)


@pytest.mark.parametrize(
    ("text", "load"),
    [
        ("link3=1,-20,0", Load("link3", "link3", (1, -20, 0))),
        ("hand:link3=1,-2e1,0@0.25,0,0.1", Load("hand", "link3", (1, -20, 0), point=(0.25, 0, 0.1))),
        ("link2=0,0,0,0,0,3", Load("link2", "link2", moment=(0, 0, 3))),
        ("link2=4,5,6,1,2,3@0,0.1,0", Load("link2", "link2", (4, 5, 6), (1, 2, 3), (0, 0.1, 0))),
    ],
)
def test_a_constant_load_is_that_of_python(place: Path, text: str, load: Load) -> None:
    done = loaded(place, "--load", text, "--format", "csv")
    assert done.returncode == 0, done.stderr
    expected = analyze(place / "log.csv", place / "planar3", loads=[load])
    with (place / "out/analysis.csv").open() as file:
        header = file.readline().rstrip().split(",")
        table = np.loadtxt(file, delimiter=",")
    for joint in ("joint1", "joint2"):
        name = f"tau_load/{joint}/{load.name}"
        np.testing.assert_array_equal(table[:, header.index(name)], expected[name])
    (entry,) = json.loads((place / "out/analysis.json").read_text())["loads"]
    assert entry == {"name": load.name, "body": load.body, "file": "", "cutoff": None}


WAY = "write it as BODY=FX,FY,FZ, or with moments behind them and with the point as BODY=FX,FY,FZ,MX"


@pytest.mark.parametrize(
    ("texts", "message"),
    [
        (("link3=1,2",), f"--load link3=1,2: {WAY}"),
        (("link3=1,2,3,4",), f"--load link3=1,2,3,4: {WAY}"),
        (("link3=1,2,3@",), f"--load link3=1,2,3@: {WAY}"),
        (("link3",), f"--load link3: {WAY}"),
        (("=1,2,3",), f"--load =1,2,3: {WAY}"),
        (("link3=1,2,nan",), "load 'link3': a value is not finite; fill the gap"),
        (("lnk3=1,2,3",), "load 'lnk3' on 'lnk3': planar3 has no such body; its bodies are link3, "),
        (("link3=1,2,3", "link3=0,0,1"), "load 'link3': another has that name; tell them apart as NAME:BODY"),
    ],
)
def test_a_load_that_cannot_be_is_one_line(place: Path, texts: tuple[str, ...], message: str) -> None:
    done = loaded(place, *(word for text in texts for word in ("--load", text)), "--out", "none")
    assert done.returncode == 2
    assert done.stderr.startswith(f"linkwise: error: {message}")
    assert done.stderr.count("\n") == 1
    assert not (place / "none").exists()


def test_what_is_noticed_in_a_file_of_loads_is_told_once(place: Path) -> None:
    """Milliseconds taken for seconds, and a last row that is cut off."""
    time = np.arange(0, 4000, 1000.0)
    write_csv(place / "plate.csv", np.column_stack([time, np.full((4, 6), 12.345)]), FORCE)
    text = (place / "plate.csv").read_text()
    (place / "plate.csv").write_text(text.removesuffix("345\n"))
    done = loaded(place, "--loads", "plate.csv")
    assert done.returncode == 0, done.stderr
    slow = "plate.csv: 0.001 samples a second are few: if time is in ms, divide it by 1000"
    cut = "plate.csv: the last row has no line end, and its last number '12.' is shorter than those before: "
    first, second = (line for line in done.stderr.splitlines() if line.startswith("warning: "))
    assert first.startswith(f"warning: {cut}")
    assert second == f"warning: {slow}"
    told = json.loads((place / "out/analysis.json").read_text())["warnings"]
    assert [first, second] == [f"warning: {warning}" for warning in told]


def test_a_force_at_a_place_of_the_world_is_one_at_its_origin_with_its_moment(place: Path) -> None:
    point, force = np.array([0.3, 0.2, -0.1]), np.array([4.0, -5.0, 6.0])
    there = Load("there", "link3", force, point=point, point_in="world")
    moved = Load("moved", "link3", force, np.cross(point, force), point_in="world")
    there, moved = (analyze(place / "log.csv", place / "planar3", loads=[one]) for one in (there, moved))
    np.testing.assert_allclose(there.load_torque, moved.load_torque, rtol=0, atol=1e-12)
    assert np.abs(there.load_torque).max() > 1


def test_pictures_tell_a_load_from_the_link_that_bears_it(place: Path) -> None:
    result = analyze(place / "log.csv", place / "planar3", loads=[Load("link3", "link3", (0, -20, 0))])
    assert "loads link3" in result.provenance
    bars = result.figure("power").axes[1]
    names = ["net", "link1", "link2", "link3", "load link3"]
    assert [text.get_text() for text in bars.get_legend().get_texts()] == names
    net = result.work.net.sum(axis=1) + result.load_work.net.sum(axis=1)
    np.testing.assert_allclose(bars.lines[0].get_xdata(), net, rtol=1e-12)
    np.testing.assert_allclose(net, result.joint_work.net, rtol=1e-9)
    assert np.abs(result.load_work.net).max() > 1
    shares = result.figure("shares").legends[0].get_texts()
    assert [text.get_text() for text in shares[:2]] == ["gravity", "load link3"]
    paper = result.figure("paper").axes[-1].get_legend()
    assert [text.get_text() for text in paper.get_texts()] == names[1:]
