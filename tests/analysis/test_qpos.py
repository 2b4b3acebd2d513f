"""Logs of a simulator's qpos: analysed and identified as that simulator has the motion and its torques."""

from pathlib import Path
from typing import Any, NamedTuple

import h5py
import numpy as np
import pytest
from helpers.studies import Here
from helpers.urdf_text import joint, link, robot
from linkwise import (
    Coordinate,
    LinkEnergy,
    LinkwiseError,
    Options,
    Processing,
    Reading,
    analyze,
    energy_system,
    generate,
    identify,
    read_system,
    write_package,
)
from linkwise.analysis.load_robot import load_robot
from linkwise.analysis.logs import open_log
from linkwise.cli.app import app
from linkwise.package.load import import_package
from linkwise.study import run_study
from typer.testing import CliRunner

pytestmark = pytest.mark.filterwarnings("ignore:.*degrees of a pitch of 90")

INERTIAL = '<inertial pos="0.1 0.02 -0.05" mass="{}" fullinertia="0.03 0.04 0.05 0.002 -0.003 0.004"/>'
MJCF = f"""<mujoco><compiler angle="radian"/><option integrator="RK4" timestep="0.001"/><worldbody>
<body name="trunk" pos="0.1 0.2 0.9"><freejoint name="free"/>{INERTIAL.format(9)}
<body name="thigh" pos="0 0.1 -0.1" euler="0.2 0.1 0.3"><joint name="hip" type="ball" pos="0 0 0.05"/>
{INERTIAL.format(1)}<body name="shank" pos="0 0 -0.4"><joint name="knee" axis="0 1 0"/>
{INERTIAL.format(0.5)}</body></body></body></worldbody></mujoco>"""
URDF = robot(
    *(link(name, f"{1.0 + at}") for at, name in enumerate(("trunk", "a", "b", "c"))),
    # Pinocchio has siblings by the names of their joints.
    joint("zz", "trunk", "a"),
    joint("wheel", "trunk", "b", type="continuous"),
    joint("slide", "b", "c", type="prismatic"),
)


class Moved(NamedTuple):
    """A package, and a motion as a simulator has it: (S, nq) and (S, nv), on the file's axes."""

    folder: Path
    order: str
    time: Any
    qpos: Any
    qvel: Any
    force: Any

    @property
    def module(self) -> Any:
        return import_package(self.folder / "package").load("numpy")

    def log(self, name: str = "log.npz", **arrays: Any) -> Path:
        np.savez(self.folder / name, time=self.time, **arrays)
        return self.folder / name


def packed(folder: Path, name: str, text: str, **options: Any) -> Path:
    (folder / name).write_text(text)
    write_package(generate(read_system(folder / name, Options(**options)), ["numpy"]), folder / "package")
    return folder


def pushes(model: Any, data: Any) -> None:
    """Return what drives the walker: it is carried upright, spins about the vertical, and everything
    swings."""
    t, (w, x, y, z) = data.time, data.qpos[3:7]
    up = np.array([2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)])
    swing = np.sin(t * np.array([5.0, 3.0, 4.0, 6.0, 7.0, 2.0, 5.0, 8.0, 3.0, 6.0]) + np.arange(10))
    data.qfrc_applied[:] = swing * [3, 3, 3, 9, 9, 2, 0.6, 0.6, 0.6, 0.6] - 0.3 * data.qvel
    data.qfrc_applied[2] += 9.81 * model.body_mass.sum()
    data.qfrc_applied[3:5] += 40.0 * np.array([-up[1], up[0]]) - 4.0 * data.qvel[3:5]
    data.qfrc_applied[5] -= 2.0 * (data.qvel[5] - 7.0)


@pytest.fixture(scope="module")
def walker(tmp_path_factory: pytest.TempPathFactory) -> Moved:
    """A simulation of MuJoCo's, in which the base turns several times."""
    mujoco = pytest.importorskip("mujoco")
    folder = packed(tmp_path_factory.mktemp("walker"), "walker.xml", MJCF)
    model = mujoco.MjModel.from_xml_string(MJCF)
    data, rows = mujoco.MjData(model), []
    data.qvel[5] = 7.0
    mujoco.set_mjcb_control(pushes)
    try:
        for step in range(2800):
            if step >= 300 and step % 2 == 0:  # once the first jerk is over
                mujoco.mj_forward(model, data)
                mujoco.mj_inverse(model, data)
                rows.append([data.time, *data.qpos, *data.qvel, *data.qfrc_inverse])
            mujoco.mj_step(model, data)
    finally:
        mujoco.set_mjcb_control(None)
    time, qpos, qvel, force = np.split(np.array(rows), [1, 1 + model.nq, 1 + model.nq + model.nv], axis=1)
    return Moved(folder, "mujoco", time[:, 0], qpos, qvel, force)


@pytest.fixture(scope="module")
def rover(tmp_path_factory: pytest.TempPathFactory) -> Moved:
    """A motion in Pinocchio's numbers, through turns and pitches beyond a right angle."""
    pin: Any = pytest.importorskip("pinocchio")
    folder = packed(tmp_path_factory.mktemp("rover"), "rover.urdf", URDF, base="floating")
    model = pin.buildModelFromXML(URDF, pin.JointModelFreeFlyer())
    data, small, rows = model.createData(), 1e-4, []

    def at(t: float) -> Any:
        turned = pin.rpy.rpyToMatrix(0.4 * np.sin(3 * t), 0.9 * np.sin(2 * t), 4.0 * t + np.sin(t))
        q = pin.neutral(model)
        q[:7] = pin.SE3ToXYZQUAT(pin.SE3(turned, np.sin([t, 1.3 * t, 2.0 * t + 0.4])))
        step = np.array([*np.zeros(6), 5.0 * t + np.sin(2 * t), 0.3 * np.sin(4 * t), 0.8 * np.sin(3 * t)])
        return pin.integrate(model, q, step)

    for t in np.arange(0.0, 4.0, 0.004):
        before, q, after = (at(t + side * small) for side in (-1, 0, 1))
        v = pin.difference(model, before, after) / (2 * small)
        a = (pin.difference(model, q, after) - pin.difference(model, before, q)) / small**2
        rows.append([t, *q, *v, *pin.rnea(model, data, q, v, a)])
    time, qpos, qvel, force = np.split(np.array(rows), [1, 1 + model.nq, 1 + model.nq + model.nv], axis=1)
    return Moved(folder, "pinocchio", time[:, 0], qpos, qvel, force)


@pytest.fixture(params=["walker", "rover"])
def moved(request: pytest.FixtureRequest) -> Moved:
    found: Moved = request.getfixturevalue(request.param)
    return found


def test_torques_of_a_log_of_qpos_are_those_of_the_simulator(moved: Moved) -> None:
    log, how = moved.log(qpos=moved.qpos), (Reading(qpos=moved.order), Processing(edges="trim"))
    found = analyze(log, moved.folder / "package", *how)
    force, qvel = moved.force[2:-2], moved.qvel[2:-2]
    assert np.ptp(found.q[:, 3]) > 2 * 2 * np.pi
    assert not [told for told in found.warnings if "--units" in told]
    peak = np.abs(force).max()
    own = {joint: at for at, joint in enumerate(found.robot.joints)}
    # Of joints of one coordinate either has the same torque, and of all together the same power.
    single = {"mujoco": {"knee": 9}, "pinocchio": {"wheel": 6, "slide": 7, "zz": 8}}[moved.order]
    for joint_name, at in single.items():
        np.testing.assert_allclose(found.torque[:, own[joint_name]], force[:, at], atol=1e-6 * peak)
    power, expected = ((a * b).sum(1) for a, b in ((found.torque, found.qd), (force, qvel)))
    np.testing.assert_allclose(power, expected, atol=1e-5 * np.abs(expected).max())


def test_a_log_of_qpos_is_as_one_of_what_from_qpos_makes(moved: Moved) -> None:
    q, tau = moved.module.from_qpos(moved.qpos, tau=moved.force, order=moved.order)
    made = moved.log("made.npz", q=q, tau=tau)
    taken = moved.log(qpos=moved.qpos, qvel=moved.qvel, tau=moved.force)
    package, reading = moved.folder / "package", Reading(qpos=moved.order)
    found, expected = analyze(taken, package, reading), analyze(made, package, Reading(units="rad"))
    np.testing.assert_array_equal(found.values, expected.values)
    assert found.ignored[-moved.qvel.shape[1]] == "qvel[0]"
    fitted = identify(taken, package, reading)
    np.testing.assert_array_equal(fitted.log.torque, tau)
    np.testing.assert_array_equal(fitted.fit.beta, identify(made, package, Reading(units="rad")).fit.beta)
    assert (fitted.errors(fitted.unseen)["fit"] < 1e-5 * fitted.unseen.sizes()).all()


def test_angles_go_on_from_block_to_block(moved: Moved) -> None:
    """Over attitudes of which half are pitched beyond a right angle."""
    turn = np.linspace(0.0, 30.0, 1200)
    qpos = np.array(np.broadcast_to(moved.qpos[0], (len(turn), moved.qpos.shape[1])))
    real = 3 if moved.order == "mujoco" else 6
    other = 5 if moved.order == "mujoco" else 4
    qpos[:, 3:7] = 0.0
    qpos[:, real], qpos[:, other] = np.cos(turn / 2), np.sin(turn / 2)
    if moved.order == "pinocchio":
        qpos[:, 7:9] = np.stack([np.cos(turn), np.sin(turn)], 1)
    np.savez(moved.folder / "turns.npz", time=turn, qpos=qpos, tau=np.ones((len(turn), moved.force.shape[1])))
    robot = load_robot(moved.folder / "package")
    log = open_log(
        moved.folder / "turns.npz", Reading(qpos=moved.order), robot.joints, robot.file_joints, robot.qpos
    )
    pieces, whole = (
        np.concatenate([block for block, _ in log.read(range(len(log.columns)), rows)]) for rows in (7, 5000)
    )
    np.testing.assert_allclose(pieces, whole, atol=1e-9)
    pitch = next(at for at, name in enumerate(log.columns) if name.endswith("_pitch"))
    np.testing.assert_allclose(whole[:, pitch], turn, atol=1e-6)
    if moved.order == "pinocchio":
        np.testing.assert_allclose(whole[:, log.columns.index("wheel")], turn, atol=1e-9)


def test_joints_may_be_named_in_the_order_of_the_qpos(walker: Moved) -> None:
    swapped = np.concatenate([walker.qpos[:, 11:], walker.qpos[:, :11]], axis=1)
    named = walker.folder / "named.h5"
    with h5py.File(named, "w") as file:
        file["sim/time"], file["sim/qpos"] = walker.time, swapped
        file["sim/qpos"].attrs["joint_names"] = ["knee", "free", "hip"]
    package, reading = walker.folder / "package", Reading(qpos="mujoco")
    expected = analyze(walker.log(qpos=walker.qpos), package, reading)
    np.testing.assert_array_equal(analyze(named, package, reading).q, expected.q)


def test_the_commands_and_a_study_take_a_qpos(walker: Moved, tmp_path: Path) -> None:
    log, package = walker.log(position=walker.qpos, tau=walker.force), str(walker.folder / "package")
    asked = (str(log), "--robot", package, "--qpos", "mujoco", "--out")
    for command in (
        ["analyze", *asked, str(tmp_path / "analysis"), "--no-page"],
        ["identify", *asked, str(tmp_path / "fit")],
    ):
        done = CliRunner().invoke(app, command)
        assert done.exit_code == 0, done.output
    (tmp_path / "study.toml").write_text(
        'schema = 1\nname = "walks"\npages = false\ncolumns = ["tau/*"]\n[analysis]\nqpos = "mujoco"\n'
        f'[[trial]]\nname = "one"\nlog = "{log}"\nrobot = "{package}"\n'
    )
    study = run_study(tmp_path / "study.toml", tmp_path / "out", Here())
    assert (len(study.done), study.broken) == (1, ())
    table, trial = tmp_path / "analysis/analysis.parquet", tmp_path / "out/trials/one/samples.parquet"
    names = [f"tau/{joint}" for joint in load_robot(Path(package)).joints]
    parquet: Any = pytest.importorskip("pyarrow.parquet")
    tables = [parquet.read_table(path).select(names).to_pandas() for path in (table, trial)]
    np.testing.assert_array_equal(*tables)


def test_what_is_no_qpos_is_refused(walker: Moved) -> None:
    package, qpos = walker.folder / "package", walker.qpos
    long, gap = qpos.copy(), qpos.copy()
    long[800, 7:11] *= 1.3
    gap[900, 4] = np.nan
    names = {"qpos": qpos, "joint_names": ["free", "hip", "ankle"]}
    for arrays, told in (
        ({"qpos": long}, r"wrong\.npz: qpos has a quaternion of length 1\.3 for hip at sample 801, and it"),
        ({"qpos": gap}, r"wrong\.npz: row 901, column 'qpos\[4\]': nan is not a sample; fill the gap"),
        (
            {"qpos": qpos[:, :11]},
            r"array 'qpos' is \(1250, 11\), and in mujoco's order its last axis must be 12: free 0\.\.6, hip",
        ),
        ({"angles_of": qpos}, "--qpos mujoco: there is no array of positions; call it 'qpos'"),
        (names, "--qpos mujoco: joints has 'ankle', which does not move by itself here"),
    ):
        with pytest.raises(LinkwiseError, match=told):
            analyze(walker.log("wrong.npz", **arrays), package, Reading(qpos="mujoco"))
    with pytest.raises(LinkwiseError, match=r"^--units deg: a --qpos is in rad and m; leave --units out$"):
        Reading(units="deg", qpos="mujoco")
    csv = walker.folder / "log.csv"
    csv.write_text("time,knee\n")
    with pytest.raises(LinkwiseError, match=r"log\.csv: --qpos goes with files of arrays, \.npz, \.h5"):
        analyze(csv, package, Reading(qpos="mujoco"))


def test_a_robot_of_energies_has_no_qpos(walker: Moved, tmp_path: Path) -> None:
    theta = Coordinate("theta")
    bob = LinkEnergy("bob", theta.qd**2, theta.q**2)
    write_package(generate(energy_system("one", [theta], [bob]), ["numpy"]), tmp_path / "package")
    with pytest.raises(LinkwiseError, match=r"--qpos mujoco: the robot is of energies written by hand"):
        analyze(walker.log(qpos=walker.qpos), tmp_path / "package", Reading(qpos="mujoco"))
