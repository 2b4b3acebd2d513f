"""Torques that joints take for springs, damping, friction and armature of their own, on every back end."""

import ctypes
import hashlib
import inspect
import json
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from conftest import PANDA, needs_compiler
from helpers.answers import random_states, relative_error
from helpers.compiled import compile_library, name_of
from helpers.urdf_text import joint, link, mimic, robot
from linkwise import generate, read_system, write_package
from linkwise.check.checks import check_package
from linkwise.check.sum_checks import passive_reference
from linkwise.oracle.states import States
from linkwise.package.load import import_package
from linkwise.package.manifest import Manifest

BACKENDS = ("numpy", "torch", "autograd", pytest.param("native", marks=needs_compiler))
DYNAMICS = '<dynamics damping="{}" friction="{}"/>'
SPRINGS = """<gazebo reference="{}"><springStiffness>{}</springStiffness>
<springReference>{}</springReference></gazebo>"""
HAND = robot(
    *map(link, "abcd"),
    joint("ab", "a", "b", inner=DYNAMICS.format(0.5, 0.2)),
    joint("bc", "b", "c", inner=DYNAMICS.format(0.7, 0.3)),
    joint("cd", "c", "d", inner=mimic("bc", -2.0, 0.3) + DYNAMICS.format(0.11, 0.13)),
    SPRINGS.format("bc", 4, 0.1),
    SPRINGS.format("cd", 3, -0.2),
    """<transmission xmlns:drake="http://drake.mit.edu"><joint name="cd"/><actuator>
    <drake:rotor_inertia value="1e-4"/><drake:gear_ratio value="50"/></actuator></transmission>""",
)


def by_hand(q: Any, qd: Any, qdd: Any) -> tuple[Any, ...]:
    """Virtual work of the joints of HAND, that of cd at -2 q + 0.3 on the second coordinate."""
    (_, q), (a, b), (_, c) = (np.moveaxis(x, -1, 0) for x in (q, qd, qdd))
    none = 0.0 * q
    shares = (
        (none, 4 * (q - 0.1) - 2 * 3 * ((0.3 - 2 * q) + 0.2)),
        (0.5 * a, 0.7 * b - 2 * 0.11 * (-2 * b)),
        (0.2 * np.sign(a), 0.3 * np.sign(b) - 2 * 0.13 * np.sign(-2 * b)),
        (none, -2 * 0.25 * (-2 * c)),
    )
    return tuple(np.stack(share, -1) for share in shares)


def written(folder: Path, backends: list[str] | None = None) -> Path:
    (folder / "hand.urdf").write_text(HAND)
    write_package(generate(read_system(folder / "hand.urdf"), backends, kernel="loops"), folder / "hand")
    return folder / "hand"


@pytest.fixture(scope="module")
def hand(tmp_path_factory: pytest.TempPathFactory) -> ModuleType:
    return import_package(written(tmp_path_factory.mktemp("hand")))


def test_an_error_is_held_against_all_that_a_share_is_summed_from(tmp_path: Path) -> None:
    passive = Manifest.read(written(tmp_path, ["numpy"])).passive
    motion = random_states(2, 20)
    shares, sizes = passive_reference(passive, States(*motion))
    for share, size, own in zip(shares, sizes, by_hand(*motion), strict=True):
        np.testing.assert_allclose(share, own, rtol=1e-12, atol=1e-14)
        assert (size >= abs(share) * (1 - 1e-12)).all()


def taken(model: Any, arrays: Any) -> Any:
    if not model.backend.takes_tensors:
        return arrays
    import torch

    return [torch.from_numpy(a) for a in arrays]


@pytest.mark.parametrize(("dtype", "most"), [("float64", 1e-15), ("float32", 1e-6)])
@pytest.mark.parametrize("batch", [(), (2, 3), (0,)])
@pytest.mark.parametrize("backend", BACKENDS)
def test_shares_are_what_the_joints_of_each_coordinate_take(
    backend: str, batch: tuple[int, ...], dtype: str, most: float, hand: ModuleType
) -> None:
    model = hand.load(backend)
    motion = np.random.default_rng(3).uniform(-2.0, 2.0, (3, *batch, 2)).astype(dtype)
    found = model.passive_torque(*taken(model, motion))
    out = taken(model, [np.empty((*batch, 2), dtype) for _ in found])
    assert model.passive_torque(*taken(model, motion), out=out)[0] is out[0]
    for value, written, expected in zip(found, out, by_hand(*motion.astype(float)), strict=True):
        assert str(value.dtype).endswith(dtype)
        np.testing.assert_allclose(np.asarray(value), expected, rtol=0, atol=20 * most)
        assert np.array_equal(np.asarray(value), np.asarray(written))
    assert np.array_equal(np.asarray(found.total), np.asarray(sum(found[1:], start=found[0])))


@pytest.mark.parametrize("backend", ["torch", "autograd", pytest.param("native", marks=needs_compiler)])
def test_gradients_flow_through_them(backend: str, hand: ModuleType) -> None:
    torch = pytest.importorskip("torch")
    motion = torch.from_numpy(np.random.default_rng(3).uniform(-2.0, 2.0, (3, 2))).requires_grad_()
    hand.load(backend).passive_torque(*motion).total.sum().backward()
    expected = [[0.0, 4 + 4 * 3], [0.5, 0.7 + 4 * 0.11], [0.0, 4 * 0.25]]
    np.testing.assert_allclose(motion.grad.numpy(), expected, rtol=1e-14)


ARM = """<mujoco><option gravity="0 0 -9.81"/><worldbody><body name="upper">
<joint name="a" axis="0 1 0" stiffness="3" springref="20" damping="0.4" armature="0.05"/>
<geom type="capsule" size=".04" fromto="0 0 0 .3 0 0"/><body name="fore" pos=".3 0 0">
<joint name="b" axis="0 1 .2" damping="0.2" armature="0.02"/>
<geom type="capsule" size=".03" fromto="0 0 0 .2 0 .1"/></body></body></worldbody></mujoco>"""


FOUR_BAR = """<mujoco><option gravity="0 0 -9.81" jacobian="dense"/><worldbody>
<body name="crank" pos="0 0 .5"><joint name="a" axis="0 1 0" damping=".1" armature=".002"/>
<geom type="capsule" fromto="0 0 0 .12 0 0" size=".02" mass=".4"/>
<body name="rod" pos=".12 0 0"><joint name="b" axis="0 1 0"/>
<geom type="capsule" fromto="0 0 0 .31 0 0" size=".015" mass=".9"/></body></body>
<body name="rocker" pos=".28 0 .5"><joint name="c" axis="0 1 0" stiffness="1" springref="17"/>
<geom type="capsule" fromto="0 0 0 0 0 .24" size=".02" mass=".7"/></body></worldbody>
<equality><connect name="pin" body1="rod" body2="rocker" anchor=".31 0 0"/></equality></mujoco>"""
Q, QD, TAU = np.array([[0.4, -0.7], [1.5, -2.0], [0.3, -0.1]])


@pytest.fixture(scope="module")
def arm(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("arm")
    (folder / "arm.xml").write_text(ARM)
    write_package(generate(read_system(folder / "arm.xml")), folder / "arm")
    return folder / "arm"


@pytest.fixture(scope="module")
def four_bar(tmp_path_factory: pytest.TempPathFactory) -> ModuleType:
    folder = tmp_path_factory.mktemp("four_bar")
    (folder / "four_bar.xml").write_text(FOUR_BAR)
    write_package(generate(read_system(folder / "four_bar.xml")), folder / "four_bar")
    return import_package(folder / "four_bar")


def in_mujoco(text: str, q: Any, qd: Any, tau: Any) -> tuple[Any, Any]:
    """MuJoCo's model and data of a state under torques of actuators."""
    mujoco = pytest.importorskip("mujoco")
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    data.qpos[:], data.qvel[:], data.qfrc_applied[:] = q, qd, tau
    mujoco.mj_forward(model, data)
    return model, data


def inertia(model: Any, data: Any) -> Any:
    """MuJoCo's mass matrix, which has armature."""
    mujoco, columns = pytest.importorskip("mujoco"), np.eye(model.nv)
    for column, unit in zip(columns, np.eye(model.nv), strict=True):
        mujoco.mj_mulM(model, data, column, unit)
    return columns


def test_calls_that_move_the_robot_count_what_joints_have_unless_told_otherwise(four_bar: ModuleType) -> None:
    robot = four_bar.load("numpy")
    found = {}
    for owner, prefix in ((robot, ""), (robot.constraints, "constraints.")):
        for name in dir(owner):
            call = getattr(owner, name, None)
            if not name.startswith("_") and callable(call):
                passive = inspect.signature(call).parameters.get("passive")
                found |= {f"{prefix}{name}": passive.default} if passive else {}
    assert found == dict.fromkeys(
        (
            *("forward_dynamics", "induced_accelerations", "induced_reactions", "simulate"),
            *("induced_power", "induced_flow", "reactions", "trace", "counterfactual"),
            *("partial_impedance", "cancel", "constraints.forward_dynamics"),
        ),
        True,
    )


@pytest.mark.parametrize("backend", BACKENDS)
def test_what_actuators_give_moves_joints_as_mujoco_moves_them(backend: str, arm: Path) -> None:
    robot = import_package(arm).load(backend)
    model, data = in_mujoco(ARM, Q, QD, TAU)
    q, qd, tau, qdd = taken(robot, [Q, QD, TAU, data.qacc.copy()])
    assert relative_error(robot.forward_dynamics(q, qd, tau), data.qacc) <= 1e-13
    shares = robot.induced_accelerations(q, qd, tau)
    assert relative_error(shares.total, data.qacc) <= 1e-13
    asked = robot.induced_accelerations(q, qd, qdd=qdd)
    assert relative_error(asked.actuators, np.asarray(shares.actuators)) <= 1e-12
    moved = robot.simulate(q, qd, [0.0, 1e-4, 2e-4], tau).qd
    rate = (4.0 * moved[1] - 3.0 * moved[0] - moved[2]) / 2e-4
    assert relative_error(rate, data.qacc) <= 1e-4
    # Controllers that follow a motion give the torques with which MuJoCo makes it; armature is of no link.
    armature = np.diag(model.dof_armature)
    target, (task,) = import_package(arm).Target(q, qd, qdd), taken(robot, [armature @ data.qacc])
    assert relative_error(robot.partial_impedance(stiffness=3.0)(q, qd, target), TAU) <= 1e-12
    assert relative_error(robot.cancel({(None,) * 4})(q, qd, task, qdd=qdd), TAU) <= 1e-12
    # What is split by links has none of it.
    assert relative_error(robot.mass_matrix(q), inertia(model, data) - armature) <= 1e-13
    links = TAU + data.qfrc_passive - armature @ data.qacc
    assert relative_error(robot.inverse_dynamics(q, qd, qdd), links) <= 1e-12
    alone = np.linalg.solve(inertia(model, data) - armature, TAU - data.qfrc_bias)
    assert relative_error(robot.forward_dynamics(q, qd, tau, passive=False), alone) <= 1e-13


@needs_compiler
@pytest.mark.parametrize(("dtype", "bound"), [("f8", 1e-13), ("f4", 1e-5)])
def test_c_moves_them_so_too(dtype: str, bound: float, arm: Path, tmp_path: Path) -> None:
    model, data = in_mujoco(ARM, Q, QD, TAU)
    compile_library(arm, tmp_path / "arm.so")
    library, suffix = ctypes.CDLL(str(tmp_path / "arm.so")), "f" if dtype == "f4" else ""

    def answer(function: str, *given: Any) -> Any:
        arrays = [*(np.array(a, dtype) for a in given), np.full(2, np.nan, dtype)]
        getattr(library, f"{name_of(arm)}_{function}{suffix}")(
            *(ctypes.c_void_p(a.ctypes.data) for a in arrays)
        )
        return arrays[-1]

    assert relative_error(answer("forward_dynamics", Q, QD, TAU), data.qacc) <= bound
    armature = np.diag(model.dof_armature)
    alone = np.linalg.solve(inertia(model, data) - armature, TAU - data.qfrc_bias)
    assert relative_error(answer("forward_dynamics_of_links", Q, QD, TAU), alone) <= bound
    own = armature @ data.qacc - data.qfrc_passive
    assert relative_error(answer("passive_torque", Q, QD, data.qacc), own) <= bound


@needs_compiler
def test_c_takes_friction_by_the_sense_of_motion_and_none_at_rest(hand: ModuleType, tmp_path: Path) -> None:
    directory = Path(str(hand.__file__)).parent
    compile_library(directory, tmp_path / "hand.so")
    library, q, qdd = ctypes.CDLL(str(tmp_path / "hand.so")), [0.4, -0.7], [0.3, -0.6]
    for qd in ([0.0, -0.3], [0.2, 0.0], [-0.0, 0.3], [-1e-30, 0.0]):
        for suffix, dtype, most in (("", "f8", 1e-14), ("f", "f4", 1e-5)):
            arrays = [*(np.array(a, dtype) for a in (q, qd, qdd)), np.full(2, np.nan, dtype)]
            pointers = [ctypes.c_void_p(a.ctypes.data) for a in arrays]
            getattr(library, f"{name_of(directory)}_passive_torque{suffix}")(*pointers)
            expected = sum(by_hand(*(a.astype(float) for a in arrays[:3])))
            np.testing.assert_allclose(arrays[3], expected, rtol=0, atol=most)


@pytest.mark.parametrize("backend", BACKENDS)
def test_loops_move_as_mujocos_matrices_say(backend: str, four_bar: ModuleType) -> None:
    loop = four_bar.load("numpy").constraints
    q = loop.closed(np.array([0.3, -0.3, 0.3]))
    qd, tau = loop.velocity(q, np.array([2.0])), np.array([1.0, -0.2, 0.3])
    model, data = in_mujoco(FOUR_BAR, q, qd, tau)
    ahead, behind = (
        in_mujoco(FOUR_BAR, q + s * qd, qd, tau)[1].efc_J[:9].reshape(3, 3) for s in (1e-5, -1e-5)
    )
    rows, drift = data.efc_J[:9].reshape(3, 3), (ahead - behind) @ qd / 2e-5
    whole = np.block([[inertia(model, data), -rows.T], [rows, np.zeros((3, 3))]])
    force = tau + data.qfrc_passive - data.qfrc_bias
    expected, pinned = np.split(np.linalg.lstsq(whole, np.r_[force, -drift], rcond=1e-9)[0], 2)
    robot = four_bar.load(backend)
    q, qd, tau = taken(robot, [q, qd, tau])
    found = robot.constraints.forward_dynamics(q, qd, tau)
    assert relative_error(found.qdd, expected) <= 1e-7
    assert relative_error(found.forces, pinned) <= 1e-7
    assert relative_error(robot.induced_accelerations(q, qd, tau).total, expected) <= 1e-7
    moved = robot.simulate(q, qd, [0.0, 1e-4, 2e-4], tau)
    assert relative_error((4.0 * moved.qd[1] - 3.0 * moved.qd[0] - moved.qd[2]) / 2e-4, expected) <= 1e-3
    assert float(abs(moved.energy_drift).max()) <= 1e-9 * float(abs(moved.energy).max())
    # Without ties, if that is asked for, each is free.
    free = robot.simulate(q, qd, [0.0, 1e-4, 2e-4], tau, constraints=False).qd
    alone = np.linalg.solve(inertia(model, data), force)
    assert relative_error((4.0 * free[1] - 3.0 * free[0] - free[2]) / 2e-4, alone) <= 1e-3


def test_motion_and_out_are_refused_by_name(hand: ModuleType) -> None:
    model = hand.load("numpy")
    q = np.zeros((4, 2))
    with pytest.raises(ValueError, match=r"qd has shape \(4, 3\); its last axis must be 2"):
        model.passive_torque(q, np.zeros((4, 3)), q)
    with pytest.raises(ValueError, match=r"out\.armature has shape \(3, 2\); the answer has \(4, 2\)"):
        model.passive_torque(q, q, q, out=[q.copy(), q.copy(), q.copy(), np.empty((3, 2))])


def test_robot_without_any_has_zeros(package_of: Callable[[str], ModuleType]) -> None:
    found = package_of("planar3").load("numpy").passive_torque(*random_states(3, 4))
    assert not np.any(found)


def test_a_real_robots_file_has_the_losses_that_pinocchio_reads(
    package_of: Callable[[str], ModuleType],
) -> None:
    pinocchio = pytest.importorskip("pinocchio")
    full = pinocchio.buildModelFromUrdf(str(PANDA))
    fingers = [full.getJointId(f"panda_finger_joint{finger}") for finger in (1, 2)]
    model = pinocchio.buildReducedModel(full, fingers, pinocchio.neutral(full))
    q, qd, qdd = random_states(7, 20)
    found = package_of(str(PANDA)).load("numpy").passive_torque(q, qd, qdd)
    assert np.any(model.damping)
    assert relative_error(found.damping, model.damping * qd) <= 1e-15
    np.testing.assert_array_equal(found.friction, model.friction * np.sign(qd))


def test_armature_is_that_of_pinocchios_inverse_dynamics(tmp_path: Path) -> None:
    pinocchio = pytest.importorskip("pinocchio")
    rotors = """<transmission xmlns:drake="http://drake.mit.edu"><joint name="{}"/><actuator>
    <drake:rotor_inertia value="{}"/></actuator></transmission>"""
    text = robot(
        *map(link, "abc"),
        joint("ab", "a", "b"),
        joint("bc", "b", "c", type="prismatic"),
        rotors.format("ab", 0.7),
        rotors.format("bc", 0.4),
    )
    (tmp_path / "arm.urdf").write_text(text)
    model = pinocchio.buildModelFromXML(text)
    model.armature[:] = [0.7, 0.4]
    write_package(generate(read_system(tmp_path / "arm.urdf"), ["numpy"]), tmp_path / "arm")
    arm = import_package(tmp_path / "arm").load("numpy")
    states = random_states(2, 30)
    data = model.createData()
    expected = [pinocchio.rnea(model, data, *state) for state in zip(*states, strict=True)]
    found = arm.inverse_dynamics(*states) + arm.passive_torque(*states).total
    assert relative_error(found, expected) <= 1e-13
    expected = [pinocchio.aba(model, data, *state) for state in zip(*states, strict=True)]
    assert relative_error(arm.forward_dynamics(*states), expected) <= 1e-12


def test_check_holds_them_against_the_manifest(tmp_path: Path) -> None:
    directory = written(tmp_path, ["numpy"])
    told = {result.name: result for result in check_package(directory, 20)}
    assert not any(result.failed for result in told.values())
    assert "numpy: passive torques of the joints" in told
    for file, old, new in (
        ("names.py", "damping=0.7", "damping=0.8"),
        ("manifest.json", '"rest": 0.1', '"rest": 0.15'),
    ):
        text = (directory / file).read_text()
        assert old in text
        forged(directory, file, text.replace(old, new))
        failed = {result.name for result in check_package(directory, 20) if result.failed}
        assert {"made", "numpy: passive torques of the joints"} <= failed
        forged(directory, file, text)


def test_check_calls_the_c_of_them(tmp_path: Path) -> None:
    directory = written(tmp_path, ["c"])
    of_joints = {f"c: test_{name}" for name in ("passive_torque", "passive_torquef", "forward_dynamics")}
    told = {result.name: result.held for result in check_package(directory, 20)}
    assert {told[name] for name in of_joints} == {True}
    tree = (directory / "c" / "test_tree.h").read_text()
    forged(directory, "c/test_tree.h", tree.replace("R(0.0), R(0.5), R(0.2)", "R(0.0), R(0.6), R(0.2)"))
    assert of_joints <= {result.name for result in check_package(directory, 20) if result.failed}


def forged(directory: Path, file: str, text: str) -> None:
    """Write a file, with its hash in the manifest, or with the manifest's own checksums."""
    (directory / file).write_text(text)
    path = directory / "manifest.json"
    data = json.loads(path.read_text())
    if file != path.name:
        data["files"][file] = hashlib.sha256(text.encode()).hexdigest()
    data["checksums"] = {
        key: hashlib.sha256(json.dumps(data[key], sort_keys=True).encode()).hexdigest()
        for key in data["checksums"]
    }
    path.write_text(json.dumps(data))
