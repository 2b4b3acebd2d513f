"""Payloads in an analysis: links of their own, against the whole robot with their inertia appended."""

import json

import numpy as np
import pytest
from conftest import DATA
from helpers.command_line import run_linkwise
from helpers.motion_logs import smooth, write_csv
from helpers.urdf_text import joint, link, robot
from linkwise import Payload, generate, read_system, write_package
from linkwise.analysis import Processing, analyze
from linkwise.analysis.choices import carried
from linkwise.analysis.load_robot import load_robot
from linkwise.analysis.payload import with_payloads
from linkwise.analysis.request import Outputs, Request
from linkwise.analysis.run import analyze_to
from linkwise.analysis.show.page import page_data
from linkwise.errors import LinkwiseError
from linkwise.progress import silent

ARM = robot(
    *map(link, "abcd"),
    '<link name="tool"/>',
    joint("ab", "a", "b"),
    joint("bc", "b", "c", type="prismatic"),
    joint("cd", "c", "d"),
    joint("fixed", "d", "tool", type="fixed"),
)
POINT = (0.1, 0.05, -0.2)
PAYLOADS = (Payload("tool", 2.5, POINT), Payload("c", 1.2, (0.0, 0.3, 0.1), "bag"), Payload("c", 0.4))


@pytest.fixture(scope="module")
def arm(tmp_path_factory):
    folder = tmp_path_factory.mktemp("payloads")
    (folder / "arm.urdf").write_text(ARM)
    write_package(generate(read_system(folder / "arm.urdf"), ["numpy", "torch"]), folder / "arm")
    write_csv(folder / "log.csv", smooth(60, 3), ["ab", "bc", "cd"])
    return folder


@pytest.mark.parametrize("backend", ["numpy", "torch"])
def test_a_payload_loads_the_joints_as_its_inertia_on_the_body_does(arm, backend):
    pin = pytest.importorskip("pinocchio")
    result = analyze(arm / "log.csv", load_robot(arm / "arm", backend), payloads=PAYLOADS)
    model = pin.buildModelFromUrdf(str(arm / "arm.urdf"))
    data = model.createData()
    own = [pin.rnea(model, data, *motion) for motion in zip(result.q, result.qd, result.qdd, strict=True)]
    every = np.array(own)
    for payload in PAYLOADS:
        loaded = model.copy()
        frame = loaded.frames[loaded.getFrameId(payload.body, pin.BODY)]
        mass = pin.Inertia(payload.mass, np.array(payload.point), np.zeros((3, 3)))
        loaded.appendBodyToJoint(frame.parentJoint, mass, frame.placement)
        motions = zip(result.q, result.qd, result.qdd, strict=True)
        share = np.array([pin.rnea(loaded, loaded.createData(), *motion) for motion in motions]) - own
        at = result.robot.links.index(payload.title)
        np.testing.assert_allclose(result.partial_torque[:, :, at], share, rtol=0, atol=1e-11)
        every = every + share
    np.testing.assert_allclose(result.torque, every, rtol=0, atol=1e-10)


def test_it_has_every_column_that_a_link_has(arm):
    result = analyze(arm / "log.csv", arm / "arm", payloads=PAYLOADS)
    assert result.robot.links == ("b", "c", "d", "payload tool", "bag", "payload c")
    names = {column.name for column in result.columns}

    def of(link):
        parts = (name.split("/") for name in names)
        return {tuple("*" if part == link else part for part in name) for name in parts if link in name}

    assert of("payload tool") == of("d")
    assert of("bag") == of("c")
    assert result.closure.terms_relative < 1e-13
    assert result.closure.recursion_relative < 1e-12
    assert result.closure.energy_relative < 1e-12
    assert result.work.given.shape == (3, 6)


def test_the_convention_of_velocities_holds_for_payloads(arm):
    closing, gradient = (
        analyze(arm / "log.csv", arm / "arm", None, Processing(convention=way), payloads=PAYLOADS)
        for way in ("closing", "gradient")
    )
    twice = 2 * closing.velocity.sum(axis=3)
    np.testing.assert_allclose(gradient.velocity.sum(axis=3), twice, rtol=0, atol=1e-12)


def test_files_and_page_list_them(arm, tmp_path):
    loaded = load_robot(arm / "arm")
    loaded = with_payloads(loaded, carried(["tool=2.5,0.1,0.05,-0.2", "bag:c=1.2"], loaded))
    wanted = Outputs("csv", ("shares", "power", "paper"), page=True)
    log, out = arm / "log.csv", tmp_path / "out"
    result, _ = analyze_to(out, log, loaded, Request(outputs=wanted), silent)
    record = json.loads((out / "analysis.json").read_text())
    assert record["payloads"] == [
        {"name": "payload tool", "body": "tool", "mass": 2.5, "point": list(POINT)},
        {"name": "bag", "body": "c", "mass": 1.2, "point": [0.0, 0.0, 0.0]},
    ]
    assert "tau/ab/payload tool" in (out / "analysis.csv").read_text().splitlines()[0].split(",")
    data = json.loads(page_data(result))
    assert data["links"][3:] == ["payload tool", "bag"]
    assert data["bodies"]["links"][-2:] == [3, 4]
    assert data["bodies"]["coordinates"][-2:] == [-1, -1]


def test_a_kept_package_without_numpy_is_told_by_the_robot_that_was_named(tmp_path):
    log = write_csv(tmp_path / "log.csv", smooth(20, 3))
    asked = "--backend", "autograd", "--payload", "link3=1", "--trace", "all"
    done = run_linkwise("analyze", log, "--robot", "planar3", *asked, "--out", "out", folder=tmp_path)
    told = "planar3: no back end takes a payload's mass; leave --backend out, or give numpy"
    assert (done.returncode, done.stderr) == (2, f"linkwise: error: {told}\n")


def test_robots_that_take_no_payload_say_why(arm, tmp_path):
    write_package(generate(read_system(arm / "arm.urdf"), ["autograd"]), tmp_path / "arm")
    with pytest.raises(LinkwiseError, match="no back end takes a payload's mass; generate the robot again"):
        with_payloads(load_robot(tmp_path / "arm"), PAYLOADS)
    write_package(generate(read_system(str(DATA / "cart_pendulum.py")), ["numpy"]), tmp_path / "cart")
    with pytest.raises(LinkwiseError, match=r"payload on 'tool': the links of .* are energies, which do not"):
        with_payloads(load_robot(tmp_path / "cart"), PAYLOADS)


def test_what_cannot_carry_a_payload_is_named(arm):
    loaded = load_robot(arm / "arm")
    refused = {
        "tol=1": r"payload on 'tol': test has no such body; its bodies are tool, a, b, c, d",
        "a=1": r"payload on 'a': that stands on the ground; joints do not carry it",
        "tool=0": r"payload on 'tool': mass 0; give kg above 0",
        "tool=nan": r"payload on 'tool': mass nan; give kg above 0",
        "tool=1,0,0,inf": r"payload on 'tool': give its place as three numbers x, y, z, in m",
        "tool=1,2": r"--payload tool=1,2: write it as BODY=MASS,x,y,z, in kg and m",
        "tool": r"--payload tool: write it as BODY=MASS,x,y,z, in kg and m",
        "b:tool=1": r"payload 'b': another has that name; tell them apart as NAME:BODY",
    }
    for text, message in refused.items():
        with pytest.raises(LinkwiseError) as refusal:
            with_payloads(loaded, carried([text], loaded))
        assert str(refusal.value) == message
    with pytest.raises(LinkwiseError, match="'payload tool': another has that name"):
        with_payloads(loaded, carried(["tool=1", "tool=2"], loaded))


def test_a_payload_follows_no_joint_so_that_no_flow_is_called_fed_by_it(arm):
    told = analyze(arm / "log.csv", arm / "arm", payloads=PAYLOADS, induced_power=True).warnings
    assert not [line for line in told if "flow" in line]
