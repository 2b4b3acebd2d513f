"""`robot.from_qpos`: motion and torques of MuJoCo and Pinocchio, held against these."""

import re
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from linkwise import LinkwiseError, Options, analyze, generate, read_system, write_package
from linkwise.package.load import import_package

INERTIAL = '<inertial pos="0.1 0.02 -0.05" mass="{}" fullinertia="0.03 0.04 0.05 0.002 -0.003 0.004"/>'
MJCF = f"""<mujoco><compiler angle="radian"/><worldbody>
<body name="trunk" pos="0.1 0.2 0.9" quat="0.8 0.6 0 0">
<freejoint name="free"/>{INERTIAL.format(6)}
<body name="thigh" pos="0 0.1 -0.1" euler="0.2 0.1 0.3"><joint name="hip" type="ball" pos="0 0 0.05"/>
{INERTIAL.format(2)}<body name="shank" pos="0 0 -0.4"><joint name="knee" axis="0 1 0" ref="0.3"/>
{INERTIAL.format(1)}</body></body>
<body name="arm" pos="0 -0.1 0.3"><joint name="lift" type="slide" axis="0 0 1"/>
<joint name="turn" axis="1 0 0"/>
{INERTIAL.format(1.5)}</body></body></worldbody></mujoco>"""
BODIES = "thigh", "shank", "arm"


def link(name: str, mass: float) -> str:
    return (
        f'<link name="{name}"><inertial><origin xyz="0.1 0.02 -0.05" rpy="0.1 0.2 0.3"/>'
        f'<mass value="{mass}"/>'
        '<inertia ixx="0.03" iyy="0.04" izz="0.05" ixy="0.002" ixz="-0.003" iyz="0.004"/></inertial></link>'
    )


def joint(name: str, kind: str, parent: str, child: str) -> str:
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
        '<origin xyz="0.1 0.2 0.3" rpy="0.4 -0.2 0.3"/><axis xyz="0 0 1"/>'
        '<limit lower="-9" upper="9" effort="9" velocity="9"/></joint>'
    )


URDF = (
    '<robot name="walker">'
    + "".join(link(name, 1.0 + at) for at, name in enumerate(["trunk", "a", "b", "c", "d", "e"]))
    # Pinocchio has siblings by the names of their joints, and fixed ones among them.
    + joint("zz", "revolute", "trunk", "a")
    + joint("fixed_b", "fixed", "trunk", "b")
    + joint("wheel", "continuous", "b", "c")
    + joint("slide", "prismatic", "a", "d")
    + joint("plane", "planar", "trunk", "e")
    + "</robot>"
)


@pytest.fixture(scope="module")
def walker(tmp_path_factory: pytest.TempPathFactory) -> tuple[Any, Path]:
    """A trunk that floats, a hip that turns in space, and MuJoCo's file of it."""
    pytest.importorskip("mujoco")
    folder = tmp_path_factory.mktemp("qpos")
    return made(folder, "walker.xml", MJCF), folder / "walker.xml"


def made(folder: Path, name: str, text: str, **options: Any) -> Any:
    (folder / name).write_text(text)
    directory = folder / f"package_{Path(name).stem}"
    write_package(generate(read_system(folder / name, Options(**options)), ["numpy"]), directory)
    return import_package(directory).load("numpy")


def states(model: Any, integrated: Any, nv: int, count: int = 40) -> tuple[Any, Any, Any]:
    """A walk of positions through all attitudes, in small steps, and velocities and accelerations."""
    draw = np.random.default_rng(0)
    steps = 0.15 * draw.normal(size=(count, nv)) + 0.1 * draw.normal(size=nv)
    q = [integrated(model, None, steps[0])]
    for step in steps[1:]:
        q.append(integrated(model, q[-1], step))
    return np.array(q), *draw.normal(size=(2, count, nv))


@pytest.mark.filterwarnings("ignore:.*degrees of a pitch of 90")
def test_a_motion_of_mujoco_is_the_same_here(walker: tuple[Any, Path]) -> None:
    import mujoco

    robot, path = walker
    model = mujoco.MjModel.from_xml_path(str(path))

    def integrated(model: Any, q: Any, step: Any) -> Any:
        q = model.qpos0.copy() if q is None else q.copy()
        mujoco.mj_integratePos(model, q, step, 1.0)
        return q

    qpos, qvel, qacc = states(model, integrated, model.nv)
    data, forces, poses, energies = mujoco.MjData(model), [], [], []
    model.opt.enableflags |= mujoco.mjtEnableBit.mjENBL_ENERGY
    for data.qpos[:], data.qvel[:], data.qacc[:] in zip(qpos, qvel, qacc, strict=True):
        wanted = data.qacc.copy()
        mujoco.mj_forward(model, data)
        data.qacc[:] = wanted
        mujoco.mj_inverse(model, data)
        forces.append(data.qfrc_inverse.copy())
        poses.append([np.append(data.body(name).xpos, data.body(name).xmat) for name in BODIES])
        energies.append(data.energy[1])
    q, qd, qdd, tau = robot.from_qpos(qpos, qvel, qacc, forces)
    at = [list(robot.kinematics.frames).index(name) for name in BODIES]
    found = robot.kinematics.poses(q)[:, at]
    own = np.concatenate([found[..., :3, 3], found[..., :3, :3].reshape(len(q), 3, 9)], -1)
    np.testing.assert_allclose(own, poses, atol=1e-12)
    np.testing.assert_allclose(robot.energy(q, qd).kinetic.sum(-1), energies, rtol=1e-10)
    expected = robot.inverse_dynamics(q, qd, qdd)
    np.testing.assert_allclose(tau, expected, atol=1e-9 * np.abs(expected).max())
    np.testing.assert_allclose((tau * qd).sum(-1), (np.array(forces) * qvel).sum(-1), atol=1e-9)
    assert np.abs(np.diff(q, axis=0)).max() < 1.5


@pytest.mark.filterwarnings("ignore:.*degrees of a pitch of 90")
@pytest.mark.parametrize("is_named", [False, True])
def test_a_motion_of_pinocchio_is_the_same_here(is_named: bool, tmp_path: Path) -> None:
    pin: Any = pytest.importorskip("pinocchio")
    robot = made(tmp_path, "walker.urdf", URDF, base="floating")
    model = pin.buildModelFromXML(URDF, pin.JointModelFreeFlyer())
    assert (model.nq, model.nv) == (15, robot.n)

    def integrated(model: Any, q: Any, step: Any) -> Any:
        return pin.integrate(model, pin.neutral(model) if q is None else q, step)

    qpos, qvel, qacc = states(model, integrated, model.nv)
    data, forces, poses, energies = model.createData(), [], [], []
    for one in zip(qpos, qvel, qacc, strict=True):
        forces.append(pin.rnea(model, data, *one).copy())
        pin.framesForwardKinematics(model, data, one[0])
        poses.append([data.oMf[model.getFrameId(name)].homogeneous for name in ("c", "d", "e")])
        energies.append(pin.computeKineticEnergy(model, data, *one[:2]))
    names = list(model.names)[1:] if is_named else None
    q, qd, qdd, tau = robot.from_qpos(qpos, qvel, qacc, forces, order="pinocchio", joints=names)
    found = robot.kinematics.poses(q)
    at = [list(robot.kinematics.frames).index(name) for name in ("c", "d", "e")]
    np.testing.assert_allclose(found[:, at], poses, atol=1e-12)
    np.testing.assert_allclose(robot.energy(q, qd).kinetic.sum(-1), energies, rtol=1e-10)
    expected = robot.inverse_dynamics(q, qd, qdd)
    np.testing.assert_allclose(tau, expected, atol=1e-9 * np.abs(expected).max())
    np.testing.assert_allclose((tau * qd).sum(-1), (np.array(forces) * qvel).sum(-1), atol=1e-9)


def test_velocities_are_the_slopes_of_positions(walker: tuple[Any, Path]) -> None:
    import mujoco

    robot, path = walker
    model = mujoco.MjModel.from_xml_path(str(path))
    qpos, qvel, qacc, step = model.qpos0.copy(), *np.random.default_rng(1).normal(size=(2, model.nv)), 1e-4
    sides = []
    for sign in (-1.0, 0.0, 1.0):
        moved = qpos.copy()
        mujoco.mj_integratePos(model, moved, qvel + sign * step * qacc / 2.0, sign * step)
        sides.append([moved, qvel + sign * step * qacc])
    (before, v0), (here, v), (after, v1) = sides
    q = robot.from_qpos([before, here, after])
    _, qd, qdd = robot.from_qpos(here, v, qacc)
    speeds = [robot.from_qpos(*side)[1] for side in ((before, v0), (after, v1))]
    np.testing.assert_allclose((q[2] - q[0]) / (2 * step), qd, atol=1e-6)
    np.testing.assert_allclose((speeds[1] - speeds[0]) / (2 * step), qdd, atol=1e-5)


def test_angles_go_on_through_turns_and_beyond_a_right_angle(walker: tuple[Any, Path]) -> None:
    robot, _ = walker
    turn = np.linspace(0.0, 9.0, 200)
    for axis, name in ((3, "free_yaw"), (2, "free_pitch"), (1, "free_roll")):
        qpos = np.zeros((200, 14))
        qpos[:, 3], qpos[:, 3 + (4 - axis)], qpos[:, 7] = np.cos(turn / 2), 0.0, 1.0
        qpos[:, 3 + axis] = np.sin(turn / 2)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            q = robot.from_qpos(qpos)
        expected = np.zeros((200, 3))
        expected[:, 3 - axis] = turn
        np.testing.assert_allclose(q[:, 3:6], expected, atol=1e-7, err_msg=name)


def test_what_is_no_qpos_is_refused_with_the_reason(walker: tuple[Any, Path]) -> None:
    robot, _ = walker
    qpos = np.zeros((2, 14))
    qpos[:, [3, 7]] = 1.0
    told = (
        "q has shape (2, 14); its last axis must be 12, one for each joint (14 = 12 + 2, for in a qpos of "
        "mujoco's free, hip have a quaternion, four numbers for three angles: robot.from_qpos makes q of it)"
    )
    with pytest.raises(ValueError, match=f"^{re.escape(told)}$"):
        robot.inverse_dynamics(qpos, qpos, qpos)
    with pytest.raises(
        ValueError, match=r"must be 14: free 0\.\.6, hip 7\.\.10, knee 11, lift 12, turn 13; joi"
    ):
        robot.from_qpos(qpos[:, :13])
    long = qpos.copy()
    long[1, 7] = 1.2
    with pytest.raises(
        ValueError, match=r"^qpos has a quaternion of length 1\.2 for hip at sample 1, and it"
    ):
        robot.from_qpos(long)
    steep = qpos.copy()
    steep[:, 3] = steep[:, 5] = np.sqrt(0.5)
    with pytest.warns(UserWarning, match=r"^free comes within \S+ degrees of a pitch of 90 at sample 0: yaw"):
        robot.from_qpos(steep)
    with pytest.raises(ValueError, match=r"^free is pitched by 90 degrees at sample 0, where yaw and roll"):
        robot.from_qpos(steep, np.ones((2, 12)))
    with pytest.raises(ValueError, match=r"^qacc is given without qvel"):
        robot.from_qpos(qpos, qacc=np.ones((2, 12)))
    with pytest.raises(ValueError, match=r"^order is 'mujuco'; choose mujoco or pinocchio$"):
        robot.from_qpos(qpos, order="mujuco")
    with pytest.raises(ValueError, match=r"^joints has 'ankle', which does not move by itself here"):
        robot.from_qpos(qpos, joints=["free", "hip", "ankle", "lift", "turn"])
    with pytest.raises(ValueError, match=r"^joints lacks lift, turn; give each joint once"):
        robot.from_qpos(qpos, joints=["free", "hip", "knee"])
    with pytest.raises(ValueError, match=r"^joints has a joint twice; give each joint once"):
        robot.from_qpos(qpos, joints=["free", "hip", "knee", "lift", "turn", "hip"])


def test_a_joint_locked_in_part_has_no_quaternion(tmp_path: Path) -> None:
    robot = made(tmp_path, "held.urdf", URDF, base="floating", lock={"base_z": 0.5})
    with pytest.raises(
        ValueError, match=r"^of the floating joint base some coordinates are locked or follow"
    ):
        robot.from_qpos(np.zeros(16))


def test_a_log_of_qpos_is_refused_with_the_reason(tmp_path: Path) -> None:
    made(tmp_path, "walker.urdf", URDF, base="floating")
    np.savez(tmp_path / "log.npz", time=np.arange(200) / 100, qpos=np.zeros((200, 13)))
    told = (
        "array 'qpos' is (200, 13), and the robot has 12 joints: 13 = 12 + 1, for in a qpos of mujoco's base "
        "has a quaternion, four numbers for three angles; say whose it is, --qpos mujoco or --qpos pinocchio"
    )
    with pytest.raises(LinkwiseError, match=re.escape(told)):
        analyze(tmp_path / "log.npz", tmp_path / "package_walker")
