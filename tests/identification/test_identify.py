"""A log of motion and torques says some things of a robot's links, and what it does not say is told in
time."""

import json
import re
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from conftest import DATA, PANDA
from helpers.answers import random_states, relative_error
from helpers.motion_logs import write_csv
from helpers.urdf_text import joint, link, robot
from linkwise import (
    Fitting,
    LinkwiseError,
    Options,
    generate,
    identify,
    read_robot,
    read_system,
    write_package,
)
from linkwise.analysis import Lowpass, Processing, Reading
from linkwise.analysis.load_robot import load_robot
from linkwise.analysis.opened_robot import OpenedRobot
from linkwise.cli.app import app
from linkwise.identification.base_parameters import base_parameters
from linkwise.identification.identified_files import page
from linkwise.identification.identified_robot import identified_robot
from linkwise.identification.uncertain_robot import doubt
from linkwise.identification.urdf_file import urdf_text
from linkwise.oracle.newton_euler import NewtonEuler
from linkwise.package.load import import_package
from linkwise.package.manifest import Manifest
from linkwise_runtime.certainty.pseudo_inertia import pseudo_inertia
from linkwise_runtime.rule.joint_tree import Bodies
from linkwise_runtime.rule.regressors import inertial_parameters
from typer.testing import CliRunner

JOINTS = ("joint1", "joint2", "joint3")
TORQUES = tuple(f"tau/{joint}" for joint in JOINTS)


def swings(joints: int, seconds: float, rate: float, seed: int = 1) -> tuple[Any, Any, Any, Any]:
    """Time, and q, qd and qdd of sums of five sines a joint, from 0.1 to 0.5 Hz."""
    generator = np.random.default_rng(seed)
    t = np.arange(round(seconds * rate)) / rate
    w = 0.2 * np.pi * np.arange(1, 6)
    size, phase = generator.uniform(0.1, 0.5, (joints, 5)), generator.uniform(0, 2 * np.pi, (joints, 5))
    at = w * t[:, None, None] + phase
    return (
        t,
        (size * np.sin(at)).sum(-1),
        (size * w * np.cos(at)).sum(-1),
        (-size * w**2 * np.sin(at)).sum(-1),
    )


def own_parameters(robot: OpenedRobot) -> Any:
    """Parameters of the links as the robot has them."""
    assert robot.tree is not None
    chosen = robot.tree.links
    values = ([b.mass for b in chosen], [b.com for b in chosen], [b.inertia for b in chosen])
    return inertial_parameters(Bodies(*map(np.array, values)))


def other_bodies(pi: Any, seed: int = 2) -> Any:
    """Bodies that can exist, some 30 % off: masses and places of four points each."""
    generator = np.random.default_rng(seed)
    j = pseudo_inertia(pi)
    shift = np.eye(4) + 0.1 * generator.standard_normal((len(pi), 4, 4)) * [[1], [1], [1], [0]]
    moved = shift @ j @ shift.transpose(0, 2, 1) * generator.uniform(0.8, 1.3, (len(pi), 1, 1))
    second, inertia = moved[:, :3, :3], np.trace(moved[:, :3, :3], axis1=1, axis2=2)[:, None, None]
    about = inertia * np.eye(3) - second
    rows = [about[:, a, b] for a, b in ((0, 0), (0, 1), (1, 1), (0, 2), (1, 2), (2, 2))]
    return np.column_stack([moved[:, 3, 3], moved[:, :3, 3], *rows])


@pytest.fixture(scope="module")
def planar3(directory_of: Callable[[str], Path]) -> OpenedRobot:
    return load_robot(directory_of("planar3"), "numpy")


@pytest.fixture(scope="module")
def panda(directory_of: Callable[[str], Path]) -> OpenedRobot:
    return load_robot(directory_of(str(PANDA)), "numpy")


def test_a_minute_of_panda_is_identified_to_the_noise_of_its_torques(
    panda: OpenedRobot, tmp_path: Path
) -> None:
    """200 Hz x 60 s, joints of other bodies than the package's, with friction; encoders of 1e-5 rad."""
    t, q, qd, qdd = swings(7, 60, 200)
    generator = np.random.default_rng(3)
    noise = generator.uniform(0.02, 0.2, 7)
    friction = generator.uniform(0.2, 1.0, (7, 2))
    pi = other_bodies(own_parameters(panda))
    torque = np.einsum("sijp,jp->si", panda.model.regressor(q, qd, qdd), pi)
    torque += friction[:, 0] * qd + friction[:, 1] * np.sign(qd)
    torque += noise * generator.standard_normal(torque.shape)
    q = q + 1e-5 * generator.standard_normal(q.shape)
    names = [*panda.joints, *(f"tau/{joint}" for joint in panda.joints)]
    log = write_csv(tmp_path / "log.csv", np.column_stack([t, q, torque]), names)
    start = time.process_time()
    found = identify(log, panda, processing=Processing(lowpass=Lowpass(10.0)))
    assert time.process_time() - start <= 20
    assert found.warnings == ()
    assert found.base.count == 43
    errors = found.errors(found.unseen)
    for what in ("fit", "bodies"):
        assert (errors[what] <= 1.1 * noise).all(), what
    assert (errors["package"] >= 3 * noise).all()
    off = (found.fit.beta - found.base.combinations @ pi.reshape(-1)) / found.fit.beta_errors
    assert np.sqrt(np.mean(off**2)) <= 1.5
    assert (np.abs(found.fit.friction - friction) <= 5 * found.fit.friction_errors).all()
    assert found.fit.noise == pytest.approx(noise, rel=0.1)
    assert (np.linalg.eigvalsh(pseudo_inertia(found.physical.pi)) > 0).all()


def test_noise_and_errors_are_those_of_least_squares(tmp_path: Path) -> None:
    """One joint, 26 samples and five unknowns; differences are exact, as the motion is of degree four."""
    write_package(generate(read_system("planar1"), ["numpy"]), tmp_path / "arm")
    arm, t = load_robot(tmp_path / "arm"), np.arange(26) / 10
    motion = np.polynomial.Polynomial([0.2, 2.0, -4.0, 2.4, -0.42])
    q, qd, qdd = (motion.deriv(m)(t) for m in range(3))
    torque = arm.model.inverse_dynamics(*(a[:, None] for a in (q, qd, qdd)))[:, 0] + 0.3 * qd
    torque += 0.05 * np.random.default_rng(8).standard_normal(len(t))
    log = write_csv(tmp_path / "log.csv", np.column_stack([t, q, torque]), ("joint1", "tau/joint1"))
    found = identify(log, arm, fitting=Fitting(unseen=0.0))
    assert found.base.texts() == ["mcx(link1)", "mcy(link1)", "Izz(link1)"]
    rows = np.column_stack([9.80665 * np.cos(q), -9.80665 * np.sin(q), qdd, qd, np.sign(qd)])
    x, (left,), rank, _ = np.linalg.lstsq(rows, torque, rcond=None)
    sigma = np.sqrt(left / (len(t) - rank))
    errors = sigma * np.sqrt(np.linalg.inv(rows.T @ rows).diagonal())
    assert [*found.fit.beta, *found.fit.friction[0]] == pytest.approx(x, rel=1e-6, abs=1e-9)
    assert found.fit.noise == pytest.approx([sigma], rel=1e-6)
    assert [*found.fit.beta_errors, *found.fit.friction_errors[0]] == pytest.approx(errors, rel=1e-6)
    seen = found.errors(found.seen)["fit"]
    assert seen == pytest.approx([np.sqrt(left / len(t))], rel=1e-6)


def test_base_parameters_of_a_planar_arm_are_the_textbooks(planar3: OpenedRobot) -> None:
    base = base_parameters(planar3.model)
    assert base.texts() == [
        "mcx(link1) + 0.25 m(link2) + 0.25 m(link3)",
        "mcy(link1)",
        "Izz(link1) + 0.0625 m(link2) + 0.0625 m(link3)",
        "mcx(link2) + 0.25 m(link3)",
        "mcy(link2)",
        "Izz(link2) + 0.0625 m(link3)",
        "mcx(link3)",
        "mcy(link3)",
        "Izz(link3)",
    ]
    assert base.units[:3] == ("kg m", "kg m", "kg m^2")


def test_without_the_shoulders_torque_its_link_is_not_told(planar3: OpenedRobot, tmp_path: Path) -> None:
    table = np.loadtxt(planar_log(planar3, tmp_path, noise=0.01), delimiter=",", skiprows=1)
    log = write_csv(tmp_path / "two.csv", np.delete(table, 4, axis=1), (*JOINTS, *TORQUES[1:]))
    found = identify(log, planar3, fitting=Fitting(unmeasured=("joint1",)))
    whole = base_parameters(planar3.model)
    assert found.base.hidden == tuple(whole.texts()[:3])
    assert found.base.texts() == whole.texts()[3:]
    assert (found.joints, found.unmeasured) == (("joint2", "joint3"), ("joint1",))
    assert found.fit.noise == pytest.approx([0.01] * 2, rel=0.1)
    off = found.fit.beta - found.base.combinations @ found.own.reshape(-1)
    assert (np.abs(off) <= 5 * found.fit.beta_errors).all()
    # What no torque tells of a link stays as the package has it.
    assert found.physical.pi[0] == pytest.approx(found.own[0], rel=1e-3, abs=1e-6)


def test_a_robot_on_a_floating_base_is_identified_without_the_grounds_forces(tmp_path: Path) -> None:
    write_package(
        generate(read_system(DATA / "crane.urdf", Options(base="floating")), ["numpy"]), tmp_path / "crane"
    )
    robot = load_robot(tmp_path / "crane")
    base, joints = robot.joints[:6], robot.joints[6:]
    t, q, qd, qdd = swings(9, 30, 100)
    generator = np.random.default_rng(4)
    pi, noise = other_bodies(own_parameters(robot)), np.array([0.01, 0.02, 0.03])
    every = np.einsum("sijp,jp->si", robot.model.regressor(q, qd, qdd), pi)
    torque = every[:, 6:] + noise * generator.standard_normal((len(t), 3))
    names = [*robot.joints, *(f"{joint}_effort" for joint in joints)]
    log = write_csv(tmp_path / "log.csv", np.column_stack([t, q, torque]), names)
    found = identify(log, robot, fitting=Fitting(unmeasured=base))
    # All that joints do not tell of is one body: the base.
    assert len(found.base.hidden) == 10
    assert all("(ground)" in text.split()[0] for text in found.base.hidden)
    assert found.base.count + 10 == base_parameters(robot.model).count
    assert (found.errors(found.unseen)["fit"] <= 1.1 * noise).all()
    assert (found.errors(found.unseen)["bodies"] <= 1.1 * noise).all()
    off = (found.fit.beta - found.base.combinations @ pi.reshape(-1)) / found.fit.beta_errors
    assert np.sqrt(np.mean(off**2)) <= 1.5
    assert found.fit.noise == pytest.approx(noise, rel=0.1)
    # A base that floats rubs nowhere: where its torques are known it has no friction to be fitted.
    every[:, 6:] += 0.2 * qd[:, 6:]
    every += 0.02 * generator.standard_normal(every.shape)
    names = [*robot.joints, *(f"tau/{joint}" for joint in robot.joints)]
    log = write_csv(tmp_path / "log.csv", np.column_stack([t, q, every]), names)
    found = identify(log, robot)
    assert found.floating == base == tuple(f"base_{x}" for x in ("x", "y", "z", "yaw", "pitch", "roll"))
    assert not found.fit.friction[:6].any()
    assert found.fit.friction[6:, 0] == pytest.approx([0.2] * 3, rel=0.1)
    # Friction there is none of is none, and not what the solver leaves.
    slight = found.physical.friction[6:, 1] / found.fit.friction_errors[6:, 1]
    assert ((slight == 0) | (slight >= 0.01)).all()
    made, _ = identified_robot(found, Manifest.read(tmp_path / "crane"), None)
    assert made["crane.urdf"].count(b"<dynamics") == 3
    assert "Without friction, as what floats has no bearings: base_x, " in page(found, ())


def test_bodies_can_exist_where_least_squares_has_none(planar3: OpenedRobot, tmp_path: Path) -> None:
    """Noise as large as what the last link asks for: its inertia comes out negative without the condition."""
    for seed in range(20):
        log = planar_log(planar3, tmp_path, noise=2.0, seed=seed)
        found = identify(log, planar3, fitting=Fitting(friction=False))
        if found.fit.beta[-1] < 0:
            break
    assert found.fit.beta[-1] < 0
    assert (np.linalg.eigvalsh(pseudo_inertia(found.physical.pi)) > 0).all()
    assert found.errors(found.seen)["bodies"] == pytest.approx(found.errors(found.seen)["fit"], rel=0.05)
    # What is handed on is of the fit, and a line says how far the bodies are from it.
    inverse = np.linalg.inv(found.fit.triangle[:-1, :-1])
    off = found.base.combinations @ found.physical.pi.reshape(-1) - found.fit.beta
    distance = np.sqrt(off @ np.linalg.solve(inverse @ inverse.T, off))
    assert found.unbound_distance == pytest.approx(distance, rel=1e-6)
    assert distance > 1
    assert f"bodies that can exist are {distance:.2g} standard errors from the fit" in doubt(found)


def planar_log(
    robot: OpenedRobot,
    folder: Path,
    seconds: float = 10,
    noise: float = 0.0,
    seed: int = 1,
    factor: float = 1.0,
    rate: float = 100,
    slow: float = 1.0,
    swing: Sequence[float] = (1, 1, 1),
) -> Path:
    t, *motion = swings(3, seconds, rate, seed)
    q, qd, qdd = (a * swing / slow**order for order, a in enumerate(motion))
    torque = robot.model.inverse_dynamics(q, qd, qdd)
    torque = factor * (torque + noise * np.random.default_rng(seed).standard_normal(torque.shape))
    return write_csv(folder / "log.csv", np.column_stack([t * slow, q, torque]), (*JOINTS, *TORQUES))


@pytest.mark.parametrize("robot", ["crane", "planar3", "skew"])
def test_the_urdf_file_makes_the_same_torques(robot: str, tmp_path: Path) -> None:
    """Slides, a part without mass, joints that follow another; gravity along another axis, and askew."""
    path = {"crane": DATA / "crane.urdf", "skew": DATA / "skew.toml"}.get(robot, robot)
    write_package(generate(read_system(path), ["numpy"], "robot"), tmp_path / "robot")
    manifest = Manifest.read(tmp_path / "robot")
    assert manifest.tree is not None
    gravity = np.array(manifest.tree.gravity)
    x, y, z = (gravity * 9.81 / np.linalg.norm(gravity)).tolist()
    tree = replace(manifest.tree, gravity=(x, y, z))
    loaded = load_robot(tmp_path / "robot")
    pi = dict(
        zip(
            loaded.robot_links if hasattr(loaded, "robot_links") else loaded.links,
            own_parameters(loaded),
            strict=True,
        )
    )
    text = urdf_text(
        replace(manifest, name="again", tree=tree), pi, {manifest.joints[0].name: np.array([0.5, 0.25])}
    )
    (tmp_path / "again.urdf").write_text(text)
    assert '<dynamics damping="0.5" friction="0.25"/>' in text
    write_package(generate(read_system(tmp_path / "again.urdf"), ["numpy"], "again"), tmp_path / "again")
    again = import_package(tmp_path / "again").load("numpy")
    assert again.joint_names == loaded.joints
    states = random_states(again.n, 20)
    expected = NewtonEuler(manifest, tree).partial_torque(*states)
    order = [again.link_names.index(link) for link in loaded.links]
    assert relative_error(again.partial_torque(*states)[:, :, order], expected) <= 1e-12


def test_the_command_writes_a_page_a_record_and_a_robot(
    planar3: OpenedRobot, directory_of: Callable[[str], Path], tmp_path: Path
) -> None:
    log, package = planar_log(planar3, tmp_path, noise=0.01), str(directory_of("planar3"))
    command = [
        "identify",
        str(log),
        "--robot",
        package,
        "--out",
        str(tmp_path / "out"),
        "--backend",
        "numpy",
    ]
    done = CliRunner().invoke(app, command)
    assert done.exit_code == 0, done.output
    assert "9 combinations of 30 parameters, condition number" in done.output
    assert sorted(file.name for file in (tmp_path / "out").iterdir()) == [
        "identified.json",
        "identified.md",
        "planar3.urdf",
        "uncertain.toml",
    ]
    record = json.loads((tmp_path / "out/identified.json").read_text())
    first = record["base_parameters"][0]
    assert abs(first["value"] - first["package"]) <= 5 * first["standard_error"]
    assert record["choices"]["fitting"]["unseen"] == 0.2
    page = (tmp_path / "out/identified.md").read_text()
    assert "| mcx(link1) + 0.25 m(link2) + 0.25 m(link3) |" in page
    lost = "a URDF file has no gravity, and is read with 9.81 m/s^2 along -z where the package has 9.80665"
    assert f"warning: {lost}" in done.stderr
    assert [text.split(":")[0] for text in record["warnings"]] == [lost]
    assert record["gravity"] == [0.0, -9.80665, 0.0]
    assert "A URDF file has no gravity" in page
    assert f"<!-- Gravity is lost: {lost}: " in (tmp_path / "out/planar3.urdf").read_text()
    read_system(tmp_path / "out/planar3.urdf")


BAD: dict[str, tuple[Callable[[OpenedRobot, Path], dict[str, Any]], str]] = {
    "a joint that stands still": (
        lambda robot, folder: {"log": planar_log(robot, folder, swing=(1, 1e-3, 1))},
        "too little excitation: joint 'joint2' moves by 0.0018 rad in all; record a motion of every joint, "
        "or generate the robot with --lock joint2=",
    ),
    "a motion so slow that only weights count": (
        lambda robot, folder: {"log": planar_log(robot, folder, noise=0.01, slow=300.0)},
        "too little excitation: the log does not tell",
    ),
    "no torque": (
        lambda robot, folder: {
            "log": write_csv(folder / "log.csv", np.zeros((30, 4)) + np.arange(30)[:, None])
        },
        "no torque column for joint 'joint1', 'joint2', 'joint3' (found none); call it 'tau/joint1' or "
        "'joint1_moment', or name it with --torque COLUMN=joint1; where nothing measures it, as of a "
        "floating base, say so with --unmeasured joint1",
    ),
    "no such joint to leave out": (
        lambda robot, folder: {
            "log": planar_log(robot, folder),
            "fitting": Fitting(unmeasured=("elbow",)),
        },
        "--unmeasured elbow: there is no such joint; there are 'joint1', 'joint2', 'joint3'",
    ),
    "two columns told for a joint": (
        lambda robot, folder: {
            "log": planar_log(robot, folder),
            "fitting": Fitting((("tau/joint1", "joint1"), ("tau/joint2", "joint1"))),
        },
        "--torque tau/joint2=joint1: column 'tau/joint1' is that joint's already; keep one",
    ),
    "a torque of a joint that has none": (
        lambda robot, folder: {
            "log": planar_log(robot, folder),
            "fitting": Fitting((("tau/joint1", "joint2"),), unmeasured=("joint2",)),
        },
        "--torque tau/joint1=joint2 and --unmeasured joint2 contradict each other; leave one out",
    ),
    "no joint with a torque": (
        lambda robot, folder: {
            "log": planar_log(robot, folder),
            "fitting": Fitting(unmeasured=JOINTS),
        },
        "--unmeasured names every joint; at least one torque must be there",
    ),
    "torques of zeros": (
        lambda robot, folder: {"log": planar_log(robot, folder, factor=0.0)},
        "every torque is 0 throughout, which tells nothing; see the columns",
    ),
    "torques without bounds": (
        lambda robot, folder: {"log": planar_log(robot, folder, factor=1e200)},
        ", which no robot's does; see its column and its unit",
    ),
    "two torques of a joint": (
        lambda robot, folder: {
            "log": altered(
                planar_log(robot, folder), lambda t: t[:, [0, 1, 2, 3, 4, 5, 6, 4]], "joint1_moment"
            )
        },
        "column 'joint1_moment' is a second torque of joint1, beside 'tau/joint1'; name the one to take with "
        "--torque COLUMN=joint1, and leave the other out with --ignore-extra",
    ),
    "no file": (lambda robot, folder: {"log": folder / "away.csv"}, "away.csv: no such file"),
    "a torque of no joint": (
        lambda robot, folder: {
            "log": planar_log(robot, folder),
            "fitting": Fitting((("tau/joint1", "elbow"),)),
        },
        "--torque tau/joint1=elbow: there is no such joint; there are 'joint1', 'joint2', 'joint3'",
    ),
    "few samples": (
        lambda robot, folder: {"log": planar_log(robot, folder, rate=1)},
        "samples are too few for 15 unknowns; give a longer log, or lower --unseen",
    ),
    "too short for the filter": (
        lambda robot, folder: {
            "log": planar_log(robot, folder, seconds=1),
            "processing": Processing(lowpass=Lowpass(2.0)),
        },
        "100 samples are too few for --cutoff 2, which blurs 150 at either end; give a longer log, or "
        "raise it",
    ),
    "what the filter blurs": (
        lambda robot, folder: {
            "log": planar_log(robot, folder, seconds=4),
            "processing": Processing(lowpass=Lowpass(3.0), stop=0.5),
        },
        "--from and --to leave what --cutoff 3 blurs, up to",
    ),
    "energies": (
        lambda robot, folder: {"log": planar_log(robot, folder), "robot": energies(folder)},
        "cart_pendulum is made of energies; only rigid links have parameters to identify",
    ),
    "all unseen": (
        lambda robot, folder: {"fitting": Fitting(unseen=1.0)},
        "--unseen 1: give a share of the log from 0 to 0.9",
    ),
}


def test_the_command_says_what_a_missing_torque_leaves_open(
    planar3: OpenedRobot, directory_of: Callable[[str], Path], tmp_path: Path
) -> None:
    log, out = planar_log(planar3, tmp_path, noise=0.01), tmp_path / "out"
    package = str(directory_of("planar3"))
    command = ["identify", str(log), "--robot", package, "--out", str(out), "--backend", "numpy"]
    done = CliRunner().invoke(app, [*command, "--unmeasured", "joint1"])
    assert "'tau/joint1' is a torque of joint1, which is --unmeasured; leave such columns out with" in str(
        done.exception
    )
    done = CliRunner().invoke(app, [*command, "--unmeasured", "joint1", "--ignore-extra"])
    assert done.exit_code == 0, done.output
    hidden = "mcx(link1) + 0.25 m(link2) + 0.25 m(link3), mcy(link1), Izz(link1) + 0.0625 m(link2)"
    assert f"no torque of joint1; not told without: {hidden}" in done.output
    record = json.loads((out / "identified.json").read_text())
    assert (record["unmeasured_joints"], len(record["hidden"])) == (["joint1"], 3)
    assert list(record["joints"]) == ["joint2", "joint3"]
    page = (out / "identified.md").read_text()
    assert "Not measured, and left out of the fit: joint1." in page
    assert f"which those measured do not tell by themselves: {hidden}" in page
    assert (out / "planar3.urdf").read_text().count("<dynamics") == 2


def energies(folder: Path) -> Path:
    write_package(generate(read_system(DATA / "cart_pendulum.py"), ["numpy"]), folder / "cart_pendulum")
    return folder / "cart_pendulum"


@pytest.mark.parametrize("case", BAD)
def test_what_cannot_be_identified_is_said_in_a_line(case: str, planar3: OpenedRobot, tmp_path: Path) -> None:
    made, message = BAD[case]
    with pytest.raises(LinkwiseError) as raised:
        identify(**({"robot": planar3} | made(planar3, tmp_path)))
    assert message in str(raised.value)
    assert "\n" not in str(raised.value)
    assert str(raised.value).count(".csv") <= 1


def altered(log: Path, change: Callable[[Any], Any], *more: str) -> Path:
    """The log with its numbers changed, and further columns."""
    table = np.loadtxt(log, delimiter=",", skiprows=1)
    return write_csv(log, change(table), (*JOINTS, *TORQUES, *more))


def test_noise_of_positions_is_told_from_a_poor_motion(planar3: OpenedRobot, tmp_path: Path) -> None:
    def shaken(table: Any) -> Any:
        table[:, 1:4] += 1e-4 * np.random.default_rng(5).standard_normal((len(table), 3))
        return table

    log = altered(planar_log(planar3, tmp_path, seconds=20, noise=0.01, rate=200), shaken)
    read = identify(log, planar3)
    assert read.log.noise == pytest.approx([1e-4] * 3, rel=0.1)
    (warning,) = read.warnings
    assert re.fullmatch(
        r"the positions of 'joint\d' and 2 more are noisy: 0.0001 rad of noise, differentiated, is 1[23] of "
        r"the 1\d rad/s\^2 of acceleration \(root mean squares\); pass --cutoff, in Hz, .*",
        warning,
    )
    smooth = identify(log, planar3, processing=Processing(lowpass=Lowpass(5.0)))
    assert smooth.warnings == ()
    # Of 4,000 samples, 120 at either end are not the filter's alone; of the rest a fifth is not seen.
    assert (smooth.seen.rows, smooth.unseen.rows) == (3008, 752)
    (warning,) = identify(log, planar3, processing=Processing(lowpass=Lowpass(80.0))).warnings
    assert "lower --cutoff 80 towards the motion's own frequencies" in warning


def reversed_torques(*joints: int) -> Callable[[Any], Any]:
    return lambda table: table * [-1 if column - 4 in joints else 1 for column in range(7)]


CONTRADICTIONS: dict[str, tuple[Callable[[Any], Any], str]] = {
    "all signs": (
        reversed_torques(0, 1, 2),
        "the torques are opposite to what the robot, as it is, needs (correlation -1.00): if the log counts "
        "them so, pass --torque-factor -1",
    ),
    "one sign": (
        reversed_torques(1),
        "the torque of 'joint2' is opposite to what the robot, as it is, needs (correlation -1.00): see its "
        "column, and turn its sign if it is so",
    ),
    "noise": (
        lambda t: np.column_stack([t[:, :6], np.random.default_rng(6).standard_normal(len(t))]),
        "no parameters explain the torque of 'joint3' (",
    ),
    "zeros": (
        lambda t: t * [1, 1, 1, 1, 1, 1, 0],
        "the torque of 'joint3' is 0 throughout, and is fitted as such; where nothing measured it, pass "
        "--unmeasured joint3",
    ),
}


@pytest.mark.parametrize("case", CONTRADICTIONS)
def test_torques_that_contradict_the_robot_are_asked_about(
    case: str, planar3: OpenedRobot, tmp_path: Path
) -> None:
    change, message = CONTRADICTIONS[case]
    log = altered(planar_log(planar3, tmp_path, seconds=20, noise=0.01), change)
    (warning,) = identify(log, planar3).warnings
    assert message in warning
    assert "\n" not in warning


def test_torques_of_no_body_that_can_exist_are_asked_about(planar3: OpenedRobot, tmp_path: Path) -> None:
    """Weights of the robot, and an inertia below zero."""
    pi = own_parameters(planar3)
    pi[2, -1] = -0.1
    t, q, qd, qdd = swings(3, 20, 100)
    torque = np.einsum("sijp,jp->si", planar3.model.regressor(q, qd, qdd), pi)
    torque += 0.01 * np.random.default_rng(7).standard_normal(torque.shape)
    log = write_csv(tmp_path / "log.csv", np.column_stack([t, q, torque]), (*JOINTS, *TORQUES))
    found = identify(log, planar3)
    assert found.errors(found.unseen)["fit"] == pytest.approx([0.01] * 3, rel=0.1)
    (warning,) = found.warnings
    assert "no bodies that can exist explain these torques as the base parameters do: of 'joint" in warning
    assert "see the signs, units and order of the torques" in warning


def test_zeros_for_a_torque_do_not_outweigh_the_others(planar3: OpenedRobot, tmp_path: Path) -> None:
    log = altered(planar_log(planar3, tmp_path, seconds=20, noise=0.01), lambda t: t * [1, 1, 1, 1, 1, 1, 0])
    noise = identify(log, planar3).fit.noise
    assert noise[2] >= 0.5 * noise[:2].min()


def test_torques_of_another_unit_are_asked_about(planar3: OpenedRobot, tmp_path: Path) -> None:
    log = planar_log(planar3, tmp_path, noise=0.01, factor=1000.0)
    (warning,) = identify(log, planar3).warnings
    assert "if it is in another unit, pass --torque-factor, 0.001 for N mm" in warning
    assert identify(log, planar3, fitting=Fitting(factor=0.001)).warnings == ()


def test_degrees_and_other_names_are_taken_as_told(planar3: OpenedRobot, tmp_path: Path) -> None:
    table = np.loadtxt(planar_log(planar3, tmp_path, noise=0.01), delimiter=",", skiprows=1)
    table[:, 1:4] *= 180 / np.pi
    log = write_csv(tmp_path / "deg.csv", table, ("a", "b", "joint3", "joint1_moment", "joint2_effort", "u"))
    reading = Reading(units="deg", mapping=(("a", "joint1"), ("b", "joint2")))
    found = identify(log, planar3, reading, fitting=Fitting((("u", "joint3"),)))
    assert found.fit.noise == pytest.approx([0.01] * 3, rel=0.1)


def test_springs_and_armatures_of_the_file_are_known_and_kept(tmp_path: Path) -> None:
    text = robot(
        *map(link, "abc"),
        joint("ab", "a", "b", inner='<dynamics damping="0.5" friction="0.2"/>'),
        joint("bc", "b", "c"),
        """<gazebo reference="bc"><springStiffness>3</springStiffness><springReference>0.25</springReference>
        </gazebo><transmission xmlns:drake="http://drake.mit.edu"><joint name="ab"/><actuator>
        <drake:rotor_inertia value="0.125"/></actuator></transmission>""",
    )
    (tmp_path / "arm.urdf").write_text(text)
    write_package(generate(read_system(tmp_path / "arm.urdf"), ["numpy"]), tmp_path / "arm")
    arm = load_robot(tmp_path / "arm")
    t, q, qd, qdd = swings(2, 20, 100, 1)
    torque = arm.model.inverse_dynamics(q, qd, qdd) + arm.model.passive_torque(q, qd, qdd).total
    log = write_csv(tmp_path / "log.csv", np.column_stack([t, q, torque]), ("ab", "bc", "tau/ab", "tau/bc"))
    found = identify(log, arm)
    assert found.fit.friction == pytest.approx(np.array([[0.5, 0.2], [0.0, 0.0]]), abs=1e-3)
    # An armature that were not known would be an inertia of the link, and be found as one.
    assert found.fit.beta == pytest.approx(found.base.combinations @ found.own.reshape(-1), abs=1e-3)
    assert (found.errors(found.unseen)["bodies"] < 1e-2).all()
    alone = identify(log, arm, Reading(ignore_extra=True), fitting=Fitting(unmeasured=("ab",)))
    assert (alone.errors(alone.unseen)["bodies"] < 1e-2).all()
    manifest = Manifest.read(tmp_path / "arm")
    (tmp_path / "again.urdf").write_bytes(identified_robot(found, manifest, None)[0]["test.urdf"])
    kept = {axis.joint: axis for axis in read_robot(tmp_path / "again.urdf").passive}
    assert kept["ab"].armature == 0.125
    assert (kept["bc"].stiffness, kept["bc"].rest) == (3.0, 0.25)
