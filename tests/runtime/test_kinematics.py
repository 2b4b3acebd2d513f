"""`robot.kinematics`: frames by name, points, batches, gradients, parameters, bodies and `out`."""

import ctypes
import re
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from conftest import DATA, needs_compiler
from helpers.compiled import compile_library
from linkwise import Options, generate, read_system, write_package
from linkwise.package.load import import_package

torch = pytest.importorskip("torch")

TOOL = """schema = 1
name = "arm"
gravity = [0, -9.81, 0]
parameters = {L = 0.4, m = 1.0}
joint = [
  {name = "shoulder", type = "revolute", parent = "base", child = "upper"},
  {name = "elbow", type = "revolute", parent = "upper", child = "fore", xyz = ["L", 0, 0]},
  {name = "end", type = "fixed", parent = "fore", child = "tool", xyz = ["2*L", 0, 0], rpy = [0, 0, "pi/2"]},
]
link = [
  {name = "base"}, {name = "tool"},
  {name = "upper", mass = "m", com = ["L/2", 0, 0], inertia = {xx = 0.1, yy = 0.1, zz = 0.1}},
  {name = "fore", mass = 2, com = ["L", 0, 0], inertia = {xx = 0.1, yy = 0.1, zz = 0.1}},
]
"""
Q, QD, QDD = (np.array(row) for row in ([0.3, -1.1], [0.7, 0.4], [-0.2, 0.9]))
BACKENDS = ("numpy", "torch", "autograd", pytest.param("native", marks=needs_compiler))


@pytest.fixture(scope="module")
def arm(tmp_path_factory: pytest.TempPathFactory) -> ModuleType:
    folder = tmp_path_factory.mktemp("arm")
    (folder / "arm.toml").write_text(TOOL)
    system = read_system(folder / "arm.toml", Options("symbolic"))
    write_package(generate(system, ["numpy", "torch", "autograd", "native"]), folder / "arm")
    return import_package(folder / "arm")


def as_array(value: Any) -> Any:
    return value.detach().numpy() if torch.is_tensor(value) else value


@pytest.mark.parametrize("backend", BACKENDS)
def test_a_merged_tool_moves_as_by_hand_for_other_parameters(arm: ModuleType, backend: str) -> None:
    length = 0.5
    kinematics = arm.load(backend, parameters={"L": length, "m": 3.0}).kinematics
    assert kinematics.frames == ("base", "upper", "fore", "tool")
    a, b = Q[0], Q.sum()
    x, y = length * (np.cos(a) + 2 * np.cos(b)), length * (np.sin(a) + 2 * np.sin(b))
    # The tool's axes are turned by a right angle.
    expected = [[-np.sin(b), -np.cos(b), 0, x], [np.cos(b), -np.sin(b), 0, y], [0, 0, 1, 0], [0, 0, 0, 1]]
    np.testing.assert_allclose(as_array(kinematics.pose(Q, "tool")), expected, atol=1e-15)
    jacobian = np.zeros((6, 2))
    jacobian[2] = 1.0
    jacobian[3:5] = [[-y, -2 * length * np.sin(b)], [x, 2 * length * np.cos(b)]]
    np.testing.assert_allclose(as_array(kinematics.jacobian(Q, "tool")), jacobian, atol=1e-15)
    centre = 3 * length / 2 * np.array([np.cos(a), np.sin(a)])
    centre += 2 * length * np.array([np.cos(a) + np.cos(b), np.sin(a) + np.sin(b)])
    np.testing.assert_allclose(as_array(kinematics.centre_of_mass(Q))[:2], centre / 5, atol=1e-15)


@pytest.mark.parametrize("backend", BACKENDS)
def test_points_and_batches_of_any_shape(arm: ModuleType, backend: str) -> None:
    kinematics = arm.load(backend).kinematics
    generator = np.random.default_rng(0)
    q, qd, qdd = generator.uniform(-2, 2, (3, 2, 5, 2))
    points = generator.uniform(-1, 1, (5, 3))
    velocity = as_array(kinematics.velocity(q, qd, "tool", points))
    acceleration = as_array(kinematics.acceleration(q, qd, qdd, "tool", points))
    jacobian, rate = (
        as_array(found)
        for found in (
            kinematics.jacobian(q, "tool", points),
            kinematics.jacobian_rate(q, qd, "tool", points),
        )
    )
    np.testing.assert_allclose(velocity, (jacobian @ qd[..., None])[..., 0], atol=1e-14)
    moved = (jacobian @ qdd[..., None] + rate @ qd[..., None])[..., 0]
    np.testing.assert_allclose(acceleration, moved, atol=1e-14)
    one = as_array(kinematics.jacobian(q[1, 3], "tool", points[3]))
    np.testing.assert_allclose(jacobian[1, 3], one, atol=1e-15)
    # Many points of one configuration.
    spread = as_array(kinematics.jacobian(q[0, 0], "tool", points))
    assert spread.shape == (5, 6, 2)
    assert as_array(kinematics.poses(q[:0])).shape == (0, 5, 4, 4, 4)


def test_a_wrench_on_a_point_loads_the_joints_by_the_transpose(package_of: Callable[..., ModuleType]) -> None:
    robot = package_of("puma560").load("numpy")
    q = np.random.default_rng(1).uniform(-2, 2, robot.n)
    weights = robot.backend.rule.bodies()
    force = -9.81 * weights.masses[:, None] * np.array([0, 0, 1.0])
    torque = sum(
        robot.kinematics.jacobian(q, link)[3:].T @ f
        + np.cross(robot.kinematics.pose(q, link)[:3, :3] @ c, f) @ robot.kinematics.jacobian(q, link)[:3]
        for link, f, c in zip(robot.link_names, force, centres_in_files_axes(robot), strict=True)
    )
    rest = 0 * q
    np.testing.assert_allclose(-torque, robot.inverse_dynamics(q, rest, rest), atol=1e-12)


def centres_in_files_axes(robot: Any) -> Any:
    """Yield the centre of mass of each link, in the axes of its frame from that frame's origin."""
    tree = robot.backend.tree
    at = {frame.name: frame for frame in tree.frames}
    for j, link in enumerate(tree.links):
        frame = at[tree.link_name(j)]
        yield np.array(frame.rotation).T @ (np.array(link.com) - np.array(frame.translation))


@pytest.mark.parametrize("backend", BACKENDS)
def test_a_load_asks_joints_for_the_torque_that_holds_it(arm: ModuleType, backend: str) -> None:
    kinematics = arm.load(backend).kinematics
    generator = np.random.default_rng(2)
    q, (force, moment, point) = generator.uniform(-2, 2, (4, 2)), generator.uniform(-5, 5, (3, 4, 3))
    jacobian = as_array(kinematics.jacobian(q, "tool", point))
    expected = -np.einsum("sci,sc->si", jacobian, np.concatenate([moment, force], 1))
    given = as_array(kinematics.load_torque(q, "tool", force, moment, point))
    np.testing.assert_allclose(given, expected, rtol=0, atol=1e-14)
    pose = as_array(kinematics.pose(q, "tool"))
    world = np.einsum("sab,sb->sa", pose[:, :3, :3], point) + pose[:, :3, 3]
    at = as_array(kinematics.load_torque(q, "tool", force, moment, at=world))
    np.testing.assert_allclose(at, expected, rtol=0, atol=1e-13)
    # One weight on many configurations: what holds it up is what gravity adds to the torques.
    weight = as_array(kinematics.load_torque(q, "tool", [0, -9.81, 0]))
    x = as_array(kinematics.jacobian(q, "tool"))[:, 4]
    np.testing.assert_allclose(weight, 9.81 * x, rtol=0, atol=1e-14)
    assert not as_array(kinematics.load_torque(q, "base", [1.0, 2.0, 3.0])).any()


@pytest.mark.parametrize("backend", BACKENDS)
def test_where_a_pose_is_written_need_not_be_contiguous(arm: ModuleType, backend: str) -> None:
    kinematics = arm.load(backend).kinematics
    pose = kinematics.pose(Q, "tool")
    out = torch.zeros(4, 4, dtype=torch.float64).T if torch.is_tensor(pose) else np.zeros((4, 4)).T
    assert kinematics.pose(torch.from_numpy(Q) if torch.is_tensor(pose) else Q, "tool", out=out) is out
    np.testing.assert_array_equal(as_array(out), as_array(pose))


@pytest.mark.parametrize("backend", BACKENDS)
def test_where_an_arm_stands_takes_no_digits_from_how_it_moves(backend: str, tmp_path: Path) -> None:
    """A thousand kilometres from the world's origin float32 knows places to a tenth of a metre."""
    near, far = tmp_path / "near.toml", tmp_path / "far.toml"
    near.write_text(TOOL)
    far.write_text(TOOL.replace('child = "upper"}', 'child = "upper", xyz = [1e6, -2e6, 0]}'))
    for path in (near, far):
        write_package(generate(read_system(path), [backend]), path.with_suffix(""))
    one, other = (import_package(path.with_suffix("")).load(backend).kinematics for path in (near, far))
    q, qd = Q.astype("f4"), QD.astype("f4")
    answers = (
        lambda k: k.jacobian(q, "tool"),
        lambda k: k.jacobian_rate(q, qd, "tool"),
        lambda k: k.load_torque(q, "tool", [1.0, 2.0, 3.0]),
        lambda k: k.centre_of_mass_jacobian(q),
    )
    for call in answers:
        np.testing.assert_allclose(as_array(call(other)), as_array(call(one)), atol=1e-6)


def test_a_loads_torque_has_gradients_and_names_what_is_wrong(arm: ModuleType) -> None:
    kinematics = arm.load("torch").kinematics
    q = torch.from_numpy(Q)
    force = torch.tensor([1.0, 2.0, 3.0], dtype=torch.float64, requires_grad=True)
    kinematics.load_torque(q, "tool", force)[0].backward()
    torch.testing.assert_close(force.grad, -kinematics.jacobian(q, "tool")[3:, 0], rtol=0, atol=1e-15)
    out = torch.zeros(2, dtype=torch.float64)
    assert kinematics.load_torque(q, "tool", [1.0, 2.0, 3.0], out=out) is out
    with pytest.raises(
        ValueError, match=r"force has shape \(2,\); its last axis must be 3: x, y, z in the wo"
    ):
        kinematics.load_torque(q, "tool", [1.0, 2.0])
    told = (
        r"^the shapes do not go together: q \(3, 2\), force \(3,\), moment \(4, 3\); before the last axes, "
    )
    with pytest.raises(
        ValueError, match=told + "1 of motion, 1 of force, 1 of moment, axes must be equal or"
    ):
        kinematics.load_torque(np.zeros((3, 2)), "tool", [0.0, 1.0, 0.0], np.zeros((4, 3)))
    with pytest.raises(
        ValueError, match="point and at both say where the force acts; give point in the frame"
    ):
        kinematics.load_torque(q, "tool", [0.0, 1.0, 0.0], point=[0.0] * 3, at=[0.0] * 3)
    with pytest.raises(TypeError, match="force is None; give its x, y, z in the world's axes, in N"):
        kinematics.load_torque(q, "tool", None)


def test_gradients_flow_and_transformations_pass(arm: ModuleType) -> None:
    length = torch.tensor(0.4, dtype=torch.float64, requires_grad=True)
    kinematics = arm.load("torch", parameters={"L": length}).kinematics
    q, qd = torch.from_numpy(Q), torch.from_numpy(QD)
    jacobian = kinematics.jacobian(q, "tool")
    by_torch = torch.func.jacrev(lambda at: kinematics.pose(at, "tool")[:3, 3])(q)
    torch.testing.assert_close(jacobian[3:], by_torch, rtol=0, atol=1e-15)
    rate = torch.func.jacrev(lambda at: kinematics.jacobian(at, "tool"))(q) @ qd
    torch.testing.assert_close(kinematics.jacobian_rate(q, qd, "tool"), rate, rtol=0, atol=1e-15)
    both = torch.func.vmap(lambda at: kinematics.poses(at))(torch.stack([q, qd]))
    torch.testing.assert_close(both, kinematics.poses(torch.stack([q, qd])), rtol=0, atol=1e-15)
    kinematics.pose(q, "tool")[0, 3].backward()
    assert length.grad is not None
    assert float(length.grad) == pytest.approx(np.cos(Q[0]) + 2 * np.cos(Q.sum()))


def test_autograd_uses_the_numbers_that_its_modules_have(package_of: Callable[..., ModuleType]) -> None:
    robot = package_of("planar3").load("autograd", requires_grad="place")
    q = torch.zeros(3, dtype=torch.float64)
    before = robot.kinematics.pose(q, "link3")[0, 3].detach()
    with torch.no_grad():
        robot.links["link3"].place += torch.tensor([0.5, 0.0, 0.0])
    after = robot.kinematics.pose(q, "link3")[0, 3]
    assert float(after.detach() - before) == pytest.approx(0.5)
    after.backward()
    assert robot.links["link3"].place.grad.tolist() == [1.0, 0.0, 0.0]


def test_other_bodies_move_the_centre_of_mass(package_of: Callable[..., ModuleType]) -> None:
    package = package_of("planar3")
    own = package.bodies()
    heavy = own._replace(masses=np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]))
    q = np.zeros((2, 3))
    centre = package.load("numpy", bodies=heavy).kinematics.centre_of_mass(q)
    np.testing.assert_allclose(centre[:, 0], [0.125, 0.625], atol=1e-15)


@pytest.mark.parametrize("backend", BACKENDS)
def test_single_precision_and_out(arm: ModuleType, backend: str) -> None:
    kinematics = arm.load(backend).kinematics
    q: Any = Q.astype(np.float32)
    if backend in ("torch", "autograd"):
        q = torch.from_numpy(q)
    jacobian = kinematics.jacobian(q, "tool")
    assert jacobian.dtype == q.dtype
    np.testing.assert_allclose(as_array(jacobian), as_array(kinematics.jacobian(Q, "tool")), atol=1e-6)
    out = 0 * jacobian
    assert kinematics.jacobian(q, "tool", out=out) is out
    assert (out == jacobian).all()
    with pytest.raises(ValueError, match=r"out has shape \(6, 2\); the answer has \(4, 4\)"):
        kinematics.pose(q, "tool", out=out)


def test_large_batches_are_computed_in_pieces_that_fit(arm: ModuleType) -> None:
    kinematics = arm.load("numpy", parameters={"L": np.linspace(0.3, 0.5, 40000)}).kinematics
    q = np.random.default_rng(2).uniform(-2, 2, (40000, 2))
    poses = kinematics.poses(q)
    some = slice(39990, 40000)
    few = arm.load("numpy", parameters={"L": np.linspace(0.3, 0.5, 40000)[some]}).kinematics.poses(q[some])
    np.testing.assert_array_equal(poses[some], few)


def of_frame(package: ModuleType, backend: str, frame: str | int) -> Any:
    """Return what each call that takes a frame answers."""
    robot = package.load(backend)
    about: Any = robot.kinematics
    motion = np.array([[0.3, -1.1, 0.7], [0.7, 0.4, -0.2], [-0.2, 0.9, 0.5]])
    yield about.pose(motion[0], frame)
    yield about.jacobian(motion[0], frame)
    yield about.jacobian_rate(*motion[:2], frame)
    yield about.velocity(*motion[:2], frame)
    yield about.acceleration(*motion, frame)
    yield about.load_torque(motion[0], frame, [1.0, 2.0, 3.0])
    load = package.AppliedLoad(frame, [1.0, 2.0, 3.0])
    shares = robot.induced_accelerations(*motion, loads=[load], frame=frame)
    yield from (shares.loads, shares.kinematic)
    yield robot.labelled("induced_accelerations", *motion, loads=[load], frame=frame).loads
    if robot.backend.takes_tensors:
        yield robot.module("kinematics.jacobian", frame=frame)(torch.from_numpy(motion[0]))
    if frame in ("base", 0):
        return  # What stands on the ground is neither held nor felt.
    yield robot.constrained(contacts=[package.Contact(frame, "point", (0.3, 0.0, 0.0))]).jacobian(motion[0])
    stiff = package.FrameImpedance(frame, damping=3.0, rows=("rz",))
    yield robot.partial_impedance(frame=stiff)(*motion[:2], package.Target())


@pytest.mark.parametrize("backend", BACKENDS)
def test_a_frames_number_is_its_place_among_frames_in_every_call(
    backend: str, package_of: Callable[..., ModuleType]
) -> None:
    package = package_of("planar3")
    kinematics, q = package.load(backend).kinematics, np.array([0.3, -1.1, 0.7])
    poses = as_array(kinematics.poses(q))
    for number, name in enumerate(kinematics.frames):
        np.testing.assert_allclose(as_array(kinematics.pose(q, np.int64(number))), poses[number], atol=1e-15)
        for one, other in zip(
            of_frame(package, backend, number), of_frame(package, backend, name), strict=True
        ):
            np.testing.assert_array_equal(as_array(one), as_array(other))
            if hasattr(one, "coords"):
                assert one.identical(other)


@needs_compiler
def test_c_numbers_frames_as_python_does(
    package_of: Callable[..., ModuleType], directory_of: Any, tmp_path: Path
) -> None:
    kinematics, q = package_of("planar3").load("numpy").kinematics, np.array([0.3, -1.1, 0.7])
    compile_library(directory_of("planar3"), tmp_path / "planar3.so")
    pose_in_c, pose = ctypes.CDLL(str(tmp_path / "planar3.so")).planar3_pose, np.zeros((4, 4))
    header = (directory_of("planar3") / "c" / "planar3.h").read_text(encoding="utf-8")
    numbers = dict(re.findall(r"PLANAR3_FRAME_(\w+) = (\d+),", header))
    assert list(numbers) == list(kinematics.frames)
    for name, number in numbers.items():
        pose_in_c(int(number), ctypes.c_void_p(q.ctypes.data), ctypes.c_void_p(pose.ctypes.data))
        for frame in (name, int(number)):
            np.testing.assert_allclose(kinematics.pose(q, frame), pose, rtol=0.0, atol=1e-15)


def test_what_is_no_frame_is_named(arm: ModuleType) -> None:
    kinematics = arm.load("numpy").kinematics
    with pytest.raises(
        ValueError, match="frame is 'tol', which is not there; choose tool, fore, base, upper"
    ):
        kinematics.pose(Q, "tol")
    with pytest.raises(
        ValueError, match=r"frame is 4, but frames are numbered 0\.\.3, in the order of kinematics.frames; or"
    ):
        kinematics.pose(Q, 4)
    with pytest.raises(TypeError, match=r"frame is None; give the name of a frame, or its number in"):
        kinematics.pose(Q, None)
    with pytest.raises(ValueError, match=r"point has shape \(2,\); its last axis must be 3"):
        kinematics.jacobian(Q, "tool", [1.0, 2.0])
    with pytest.raises(ValueError, match=r"do not go together: q \(3, 2\), point \(4, 3\); before the last"):
        kinematics.jacobian(np.zeros((3, 2)), "tool", np.zeros((4, 3)))
    np.testing.assert_array_equal(kinematics.pose(Q, 2), kinematics.pose(Q, "fore"))


def test_links_of_energies_have_no_places(tmp_path: Path) -> None:
    write_package(generate(read_system(str(DATA / "cart_pendulum.py")), ["numpy"]), tmp_path / "cart")
    robot = import_package(tmp_path / "cart").load()
    with pytest.raises(ValueError, match="are energies, which do not say where anything is"):
        _ = robot.kinematics
