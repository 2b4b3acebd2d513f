"""Induced accelerations in an analysis: columns that sum up, of joints, points and the centre of mass."""

import json
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from helpers.answers import relative_error
from helpers.motion_logs import smooth, write_csv
from helpers.urdf_text import joint, link, robot
from linkwise import Load, Payload, generate, read_system, write_package
from linkwise.analysis import Processing, analyze
from linkwise.cli.analyze import app
from linkwise.errors import LinkwiseError
from linkwise.package.load import import_package
from typer.testing import CliRunner

ARM = robot(
    *map(link, "abcd"),
    '<link name="tool"/>',
    joint("ab", "a", "b"),
    joint("bc", "b", "c", type="prismatic"),
    joint("cd", "c", "d").replace("</joint>", '<dynamics damping="0.4" friction="0.2"/></joint>'),
    joint("fixed", "d", "tool", type="fixed"),
)
JOINTS = ("ab", "bc", "cd")
POINT, FORCE = "tool,0.1,0,0.2", (3.0, -2.0, 5.0)
ALL = ("joints", POINT, "centre-of-mass")


@pytest.fixture(scope="module")
def arm(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("induced")
    (folder / "arm.urdf").write_text(ARM)
    write_package(generate(read_system(folder / "arm.urdf"), ["numpy", "torch"]), folder / "arm")
    write_csv(folder / "log.csv", smooth(40, 3), list(JOINTS))
    return folder


@pytest.mark.parametrize("convention", ["closing", "gradient"])
def test_columns_hold_what_the_package_says_and_sum_to_the_acceleration(arm: Path, convention: str) -> None:
    load = Load("pull", "tool", force=FORCE)
    processing = Processing(convention=convention)  # type: ignore[arg-type]
    found = analyze(arm / "log.csv", arm / "arm", processing=processing, loads=[load], induced=ALL)
    module = import_package(arm / "arm")
    model, motion = module.load("numpy"), (found.q, found.qd)
    pull = [module.AppliedLoad("tool", FORCE)]
    for name, where in (
        ("joints", {}),
        (POINT, {"frame": "tool", "point": [0.1, 0, 0.2]}),
        ("centre-of-mass", {"frame": "centre of mass"}),
    ):
        shares = model.induced_accelerations(*motion, qdd=found.qdd, loads=pull, passive=True, **where)
        rows = {"joints": JOINTS, "centre-of-mass": "xyz"}.get(name, ("angular_x", *"??xyz"))
        for r, row in enumerate(rows):
            if row == "?":
                continue
            place = f"{name}/{row}"
            own = found[f"acc/{place}"]
            assert relative_error(own, shares.total[:, r]) <= 1e-10
            parts = [c.name for c in found.columns if f"/{place}/" in c.name]
            assert relative_error(sum(found[part] for part in parts), own) <= 1e-10
            for part, value in (
                ("acc_tau/{}/bc", shares.actuators[:, r, 1]),
                ("acc_qd/{}/d/ab", shares.velocity[:, r, 2, 0]),
                ("acc_gravity/{}/c", shares.gravity[:, r, 1]),
                ("acc_damping/{}/cd", shares.passive[:, r, 1, 2]),
                ("acc_friction/{}/cd", shares.passive[:, r, 2, 2]),
                ("acc_load/{}/pull", shares.loads[:, r, 0]),
                ("acc_kinematic/{}/ab", shares.kinematic[:, r, 0]),
            ):
                assert np.abs(found[part.format(place)] - value).max() <= 1e-10 * np.abs(own).max(), part
    assert found.closure.induced_relative is not None
    assert found.closure.induced_relative <= 1e-12


def test_payloads_accelerate_as_links_and_weigh_in_the_centre_of_mass(arm: Path) -> None:
    heavy = Payload("d", 2.0, (0.1, 0.2, 0.3))
    found = analyze(arm / "log.csv", arm / "arm", payloads=[heavy], induced=["joints", "centre-of-mass"])
    assert found.closure.induced_relative is not None
    assert found.closure.induced_relative <= 1e-12
    assert np.abs(found["acc_gravity/joints/ab/payload d"]).max() > 0.0
    # Newton's law of the whole: what the ground holds is the weight and m a of the centre of mass.
    carried = analyze(arm / "log.csv", arm / "arm", payloads=[heavy], induced=["d,0.1,0.2,0.3"])
    alone = analyze(arm / "log.csv", arm / "arm", induced=["centre-of-mass"])
    own = 4.5  # three moving links of 1.5 kg
    mean = (own * alone["acc/centre-of-mass/y"] + 2.0 * carried["acc/d,0.1,0.2,0.3/y"]) / (own + 2.0)
    assert relative_error(found["acc/centre-of-mass/y"], mean) <= 1e-9


def test_losses_stand_in_the_order_of_the_joints(tmp_path: Path) -> None:
    names, damped = "abcdefghij", ("bc", "ij")
    inner = '<dynamics damping="0.4"/>'
    joints = [one + two for one, two in pairwise(names)]
    text = robot(*map(link, names), *(joint(j, *j, inner=inner if j in damped else "") for j in joints))
    (tmp_path / "arm.urdf").write_text(text)
    write_package(generate(read_system(tmp_path / "arm.urdf"), ["numpy"]), tmp_path / "arm")
    log = write_csv(tmp_path / "log.csv", smooth(40, 9), joints)
    found = analyze(log, tmp_path / "arm", induced=["joints"])
    losses = [column.name for column in found.columns if column.name.startswith("acc_damping/joints/ab/")]
    assert losses == [f"acc_damping/joints/ab/{j}" for j in damped]


def test_the_command_writes_them_with_units_meaning_and_residual(
    arm: Path,
) -> None:
    out = arm / "result"
    told = ["analyze", str(arm / "log.csv"), "--robot", str(arm / "arm"), "--out", str(out), "--no-page"]
    done = CliRunner().invoke(app, [*told[1:], "--induced", "tool", "--induced", "joints"])
    assert done.exit_code == 0, done.output
    assert "; shares sum to accelerations within " in " ".join(done.output.split())
    record = json.loads((out / "analysis.json").read_text())
    assert record["induced"] == ["tool", "joints"]
    assert record["closure"]["induced_relative"] <= 1e-12
    columns = {column["name"]: column for column in record["columns"]}
    assert columns["acc_tau/tool/angular_x/cd"]["unit"] == "rad/s²"
    assert columns["acc_tau/joints/bc/cd"]["unit"] == "m/s²"
    assert columns["acc_tau/tool/x/cd"]["meaning"] == "acceleration by what the cause's joint gives alone"


@pytest.mark.parametrize(
    ("asked", "message"),
    [
        (
            ["hand"],
            "^--induced hand: not joints, not centre-of-mass, and of frames 'hand': test has no such body",
        ),
        (["tool,0,0"], "^--induced tool,0,0: give FRAME,X,Y,Z, such as hand,0,0,0.1, in m$"),
        (["tool,0,0,nan"], "^--induced tool,0,0,nan: give FRAME,X,Y,Z"),
        (["tool", "tool"], "^--induced tool is given twice; leave one of them out$"),
    ],
)
def test_a_point_that_is_not_there_is_named(arm: Path, asked: list[str], message: str) -> None:
    with pytest.raises(LinkwiseError, match=message):
        analyze(arm / "log.csv", arm / "arm", induced=asked)


def test_a_figure_shows_components_that_anything_accelerates(arm: Path) -> None:
    found = analyze(arm / "log.csv", arm / "arm", induced=["joints", "tool"])
    for name, labels in (("induced", JOINTS), ("induced:tool", "xyz")):
        panels = found.figure(name).axes
        assert [panel.get_ylabel().split(" ")[0] for panel in panels] == list(labels)
        curves = panels[0].get_lines()
        assert [curve.get_label() for curve in curves][:2] == ["all together", "torque of ab"]
        parts = sum(curve.get_ydata() for curve in curves[1:-1])  # the last one is the axis
        assert relative_error(parts, curves[0].get_ydata()) <= 1e-10
    with pytest.raises(LinkwiseError, match=r"^--figure induced:hand: add --induced hand, whose shares it"):
        found.figure("induced:hand")
