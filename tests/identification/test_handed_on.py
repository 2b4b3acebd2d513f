"""Covariance that an identification hands on, against many identifications of logs with other noise."""

import json
from pathlib import Path

import numpy as np
import pytest
from helpers.command_line import run_linkwise
from helpers.motion_logs import write_csv
from helpers.urdf_text import chain, joint
from linkwise import Fitting, LinkwiseError, generate, identify, read_system, write_package
from linkwise.analysis import Processing, analyze
from linkwise.analysis.load_robot import load_robot
from linkwise_runtime.certainty.uncertain_bodies import UncertainBodies

from identification.test_identify import swings

JOINTS = ("ab", "bc", "cd")
COLUMNS = (*JOINTS, *(f"tau/{joint}" for joint in JOINTS))
ARM = chain(joint("ab", "a", "b"), joint("bc", "b", "c", type="prismatic"), joint("cd", "c", "d"))
BEFORE = 'schema = 1\n[all]\nmass = "10 %"\ncentre = "10 mm"\nradii = "8 %"\n'
SAME = UncertainBodies(np.full(3, 0.1), np.full((3, 3), 0.01), np.full(3, 0.08))
"""The file as it is to be read."""
NOISE = np.array([0.05, 0.15, 0.015])
MOTION = [np.array(a) for a in ([0.3, -0.2, 0.5], [1.0, 0.5, -2.0], [2.0, -1.0, 3.0])]
LOGS = 300


@pytest.fixture(scope="module")
def arm(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder of an arm, whose file's axes are not those of its joints."""
    folder = tmp_path_factory.mktemp("handed")
    (folder / "arm.urdf").write_text(ARM)
    (folder / "before.toml").write_text(BEFORE)
    write_package(generate(read_system(folder / "arm.urdf"), ["numpy"]), folder / "arm")
    return folder


def noisy_log(folder: Path, seed: int = 1) -> Path:
    """Five seconds of the arm, its own bodies, with noise and friction."""
    t, q, qd, qdd = swings(3, 5, 100)
    torque = load_robot(folder / "arm").model.inverse_dynamics(q, qd, qdd)
    noise = NOISE * np.random.default_rng(seed).standard_normal(torque.shape)
    torque += 0.3 * qd + 0.1 * np.sign(qd) + noise
    return write_csv(folder / "log.csv", np.column_stack([t, q, torque]), COLUMNS)


@pytest.mark.parametrize("before", [None, "before.toml"])
def test_deviations_are_those_of_many_identifications(arm: Path, before: str | None) -> None:
    """With bodies drawn before, errors of what torques do not tell count; without, what noise does alone."""
    pin = pytest.importorskip("pinocchio")
    from numeric.drawn_bodies import Oracle

    robot = load_robot(arm / "arm")
    oracle = Oracle(pin.buildModelFromUrdf(str(arm / "arm.urdf")), robot.tree)
    drawn = oracle.drawn(SAME, 3)
    t, *motion = swings(3, 5, 100)
    rows = np.stack([oracle.rows(*sample) for sample in zip(*motion, strict=True)])
    rubs = 0.3 * motion[1] + 0.1 * np.sign(motion[1])
    asked, true = robot.model.regressor(*MOTION), oracle.rows(*MOTION)
    errors, told, summed = [], [], []
    for seed in range(LOGS):
        pi = drawn[seed if before else 0]
        noise = NOISE * np.random.default_rng(100 + seed).standard_normal(rubs.shape)
        torque = np.einsum("tijp,jp->ti", rows, pi) + rubs + noise
        log = write_csv(arm / "many.csv", np.column_stack([t, motion[0], torque]), COLUMNS)
        found = identify(
            log, robot, fitting=Fitting(unseen=0.0), uncertain=None if before is None else arm / before
        )
        errors.append((asked * found.physical.pi).sum(-1) - (true * pi).sum(-1))
        if seed < 10:
            deviations = robot.model.uncertainty(*MOTION, found.uncertain_bodies)
            told.append(deviations.torque**2)
            summed.append(deviations.joint_torque**2)
    assert found.leaning == ("ab/b", "ab/c", "ab/d", "bc/c", "bc/d")
    there = np.triu(np.ones((3, 3), bool))
    shares, sums = np.std(errors, axis=0), np.sum(errors, axis=2).std(0)
    np.testing.assert_allclose(np.sqrt(np.mean(told, 0))[there], shares[there], rtol=0.1)
    np.testing.assert_allclose(np.sqrt(np.mean(summed, 0)), sums, rtol=0.1)
    if before:
        assert sums[1] < 0.1 * shares[1, 1:].min()


@pytest.mark.parametrize("own", [True, False])
def test_analyze_takes_what_identify_writes(arm: Path, own: bool) -> None:
    log = noisy_log(arm)
    robot, out = ("arm.urdf", "by_file") if own else ("arm", "by_package")
    done = run_linkwise(
        *("identify", "log.csv", "--robot", robot, "--out", out, "--backend", "numpy"),
        *("--uncertain", "before.toml"),
        folder=arm,
    )
    assert done.returncode in (0, None), done.stderr
    told = (
        "bodies are as torques of log.csv tell, within their noise; what these do not tell, such as how "
        "masses are spread over links, is as uncertain as before.toml said of the bodies before"
    )
    assert f"uncertain.toml: {told}" in done.stdout
    assert "torques by link that lean on what these do not tell: ab/b, ab/c, ab/d, bc/c, bc/d" in done.stdout
    record = json.loads((arm / out / "identified.json").read_text())
    assert record["uncertain"] == told
    assert record["leaning_torques"] == ["ab/b", "ab/c", "ab/d", "bc/c", "bc/d"]
    assert record["bodies_from_fit_in_standard_errors"] < 0.1
    [written] = (arm / out).glob("*.urdf")
    flags = (
        "--robot",
        f"{out}/{written.name}",
        "--out",
        f"{out}/result",
        "--ignore-extra",
        "--backend",
        "numpy",
    )
    done = run_linkwise("analyze", "log.csv", *flags, "--uncertain", f"{out}/uncertain.toml", folder=arm)
    assert done.returncode in (0, None), done.stderr
    assert f"uncertain.toml: {told}" in done.stdout
    record = json.loads((arm / out / "result/analysis.json").read_text())["uncertain"]
    assert record["note"] == told
    assert record["covariance_of_parameters"]
    found = identify(log, arm / "arm", processing=Processing(edges="trim"), uncertain=arm / "before.toml")
    write_package(generate(read_system(written), ["numpy"]), arm / out / "again")
    after = arm / out / "again"
    result = analyze(
        write_csv(arm / "positions.csv", np.loadtxt(log, delimiter=",", skiprows=1)[:, :4], JOINTS),
        after,
        uncertain=arm / out / "uncertain.toml",
    )
    motion = result.q, result.qd, result.qdd
    expected = load_robot(after).model.uncertainty(*motion, found.uncertain_bodies)
    np.testing.assert_allclose(result.dense("sd/tau_link"), expected.torque, rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(result.dense("sd/tau"), expected.joint_torque, rtol=1e-6, atol=1e-9)


COVARIANCE = '[covariance]\nlinks = ["b"]\n'


@pytest.mark.parametrize(
    ("text", "told"),
    [
        (COVARIANCE, "[covariance] needs factor or matrix, the one or the other"),
        (f"{COVARIANCE}factor = [[1.0]]", "[covariance]: factor needs 10 rows of equally many numbers"),
        (f"{COVARIANCE}matrix = {[[1.0] * 9] * 10}", "[covariance]: matrix needs 10 rows of 10 numbers"),
        (f"{COVARIANCE}factor = {[['x']] * 10}", "[covariance]: factor holds what is no number"),
        (f"{COVARIANCE}factor = {[[1.0]] * 10}\nnote = 3", "[covariance]: note is not a line of text"),
        (f"{COVARIANCE}parts = 3", "[covariance] has the unknown key 'parts'"),
        ('[covariance]\nlinks = ["e"]\nfactor = [[1.0]]', "[covariance]: test has no link 'e'"),
        (f"{COVARIANCE}matrix = {(-np.eye(10)).tolist()}", "parameters of 'b' have the variance -1"),
        (
            f"{COVARIANCE}factor = {[[1.0]] * 10}\nparameters = {[[2.0] * 10]}",
            "[covariance] is of other bodies than the robot's: 'b' has 1.5, not 2, for parameter 1 of ten",
        ),
    ],
)
def test_a_bad_covariance_ends_in_one_line(arm: Path, text: str, told: str) -> None:
    (arm / "bad.toml").write_text(f"schema = 1\n{text}\n")
    with pytest.raises(LinkwiseError) as info:
        analyze(noisy_log(arm), arm / "arm", uncertain=arm / "bad.toml")
    assert "bad.toml: " in str(info.value)
    assert told in str(info.value)
    assert "\n" not in str(info.value)


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ('[all]\nlength = "1 mm"', "'length' counts as certain where links are identified; leave it out"),
        ('[joint.ab]\nlength = "1 mm"', "'joint' counts as certain where links are identified; leave it out"),
        ('[all]\nmass = "-1 %"', "[all]: mass is -1 %"),
    ],
)
def test_what_identify_cannot_take_of_bodies_before_is_refused(arm: Path, text: str, told: str) -> None:
    (arm / "bad.toml").write_text(f"schema = 1\n{text}\n")
    with pytest.raises(LinkwiseError) as info:
        identify(noisy_log(arm), arm / "arm", uncertain=arm / "bad.toml")
    assert told in str(info.value)
    assert "\n" not in str(info.value)
