"""The robot's file after an identification: the user's own with other numbers, or what a package knows."""

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from conftest import DATA
from helpers.motion_logs import write_csv
from helpers.urdf_text import joint, link, mimic, robot
from linkwise import LinkwiseError, Options, generate, read_robot, read_system, write_package
from linkwise.analysis.load_robot import load_robot
from linkwise.cli.app import app
from linkwise.identification.identified_robot import constraint_text
from linkwise.identification.shared_mass import shared_mass
from linkwise.package.manifest import Manifest
from typer.testing import CliRunner

from identification.test_identify import other_bodies, own_parameters, swings

mujoco = pytest.importorskip("mujoco", reason="needs mujoco: pip install 'linkwise[mjcf]'")
pinocchio = pytest.importorskip("pinocchio", reason="needs pinocchio: pip install pin")

OWN = DATA / "own_arm.urdf"
FRICTION = np.array([[0.4, 0.3], [0.25, 0.0], [1.5, 0.5]])


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Twenty seconds of an arm that weighs other than its file says, and rubs."""
    folder = tmp_path_factory.mktemp("log")
    arm = load_robot(generate_package(OWN, folder / "own_arm"))
    t, q, qd, qdd = swings(3, 20, 100)
    torque = np.einsum("sijp,jp->si", arm.model.regressor(q, qd, qdd), other_bodies(own_parameters(arm)))
    torque += FRICTION[:, 0] * qd + FRICTION[:, 1] * np.sign(qd)
    names = [*arm.joints, *(f"tau/{joint}" for joint in arm.joints)]
    return write_csv(folder / "log.csv", np.column_stack([t, q, torque]), names)


def identified(log: Path, robot: Path, out: Path, *more: str) -> dict[str, Any]:
    """The record; the robot's file stands beside it."""
    command = ["identify", str(log), "--robot", str(robot), "--out", str(out), "--backend", "numpy", *more]
    done = CliRunner().invoke(app, command, catch_exceptions=False)
    assert done.exit_code == 0, done.output
    return json.loads((out / "identified.json").read_text())


@pytest.fixture(scope="module")
def written(log: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder that the command wrote for the user's file."""
    out = tmp_path_factory.mktemp("written")
    identified(log, OWN, out)
    return out


def masked(text: bytes) -> bytes:
    """A file without the elements whose numbers are identified."""
    inside = re.compile(rb"<inertial>.*?</inertial>", re.DOTALL)
    text = inside.sub(lambda found: re.sub(rb"\s*<(origin|mass|inertia)\b[^>]*/>", b"", found[0]), text)
    return re.sub(rb"\s*<dynamics[^>]*/>", b"", text)


def test_the_users_own_file_is_written_back_with_other_numbers_alone(log: Path, tmp_path: Path) -> None:
    own = tmp_path / "arm.urdf"
    text = OWN.read_bytes().replace(b' iyz="0" ixy="0" ixz="0"', b"").replace(b"\n", b"\r\n")
    own.write_bytes(b"\xef\xbb\xbf" + text)
    record = identified(log, own, tmp_path / "out")
    names = sorted(path.name for path in (tmp_path / "out").iterdir())
    assert names == ["arm.urdf", "identified.json", "identified.md", "uncertain.toml"]
    before, after = own.read_bytes(), (tmp_path / "out/arm.urdf").read_bytes()
    assert masked(after) == masked(before)
    for kept in (
        b'<mass value="7"/><inertia ixx="0.1"',  # the stand, which moves nothing
        b'<!-- weighed in March -->\r\n      <origin rpy="0.3 -0.2 0.5"   xyz=',
        b'rpy="0 0 1.5707963267948966"/>',
    ):
        assert before.count(kept) == after.count(kept) == 1
    rubs = {joint: (own["viscous"], own["coulomb"]) for joint, own in record["joints"].items()}
    assert np.array(list(rubs.values())) == pytest.approx(FRICTION, abs=1e-2)
    for axis in read_robot(tmp_path / "out/arm.urdf").passive:
        assert (axis.damping, axis.friction) == pytest.approx(rubs[axis.joint], abs=2e-3)


def test_pinocchio_reads_the_identified_inertias_link_by_link_and_all_else_as_before(
    written: Path, tmp_path: Path
) -> None:
    record = json.loads((written / "identified.json").read_text())
    found = {name: np.array([*own.values()]) for name, own in record["links"].items()}
    before, after = (pinocchio.buildModelFromUrdf(str(path)) for path in (OWN, written / OWN.name))
    same_joints_and_frames(before, after)
    package = generate_package(OWN, tmp_path / "package")
    tree = load_robot(package).package.manifest.tree
    assert tree is not None
    place = {
        frame.name: pinocchio.SE3(np.array(frame.rotation), np.array(frame.translation))
        for frame in tree.frames
    }
    carried = dict(zip(("upper", "lower", "finger"), after.inertias[1:], strict=True))
    assert set(carried) == set(found)
    for name, inertia in carried.items():
        # Of a body turned by R and shifted by t against the link's frame.
        expected = place[name].actInv(pinocchio.Inertia.FromDynamicParameters(found[name]))
        np.testing.assert_allclose(
            inertia.toDynamicParameters(), expected.toDynamicParameters(), rtol=1e-9, atol=1e-12
        )
    assert abs(after.inertias[2].mass / before.inertias[2].mass - 1) > 0.05


def test_pinocchio_finds_the_logs_torques_by_the_file(written: Path, log: Path) -> None:
    model = pinocchio.buildModelFromUrdf(str(written / OWN.name))
    data, torque = model.createData(), np.loadtxt(log, delimiter=",", skiprows=1)[:, 4:]
    _, *motion = swings(3, 20, 100)
    for at in range(0, 2000, 50):
        q, qd, qdd = (part[at] for part in motion)
        own = pinocchio.rnea(model, data, q, qd, qdd) + FRICTION[:, 0] * qd + FRICTION[:, 1] * np.sign(qd)
        np.testing.assert_allclose(own, torque[at], atol=1e-4)


def test_the_friction_of_a_joint_that_follows_counts_in_that_of_the_other(tmp_path: Path) -> None:
    follows = '<dynamics damping="3" friction="1"/>' + mimic("ab", 2.0)
    text = robot(*map(link, "abc"), joint("ab", "a", "b"), joint("bc", "b", "c", inner=follows))
    (tmp_path / "arm.urdf").write_text(text)
    arm = load_robot(generate_package(tmp_path / "arm.urdf", tmp_path / "arm"))
    t, q, qd, qdd = swings(1, 20, 100)
    torque = arm.model.inverse_dynamics(q, qd, qdd) + arm.model.passive_torque(q, qd, qdd).total
    log = write_csv(tmp_path / "log.csv", np.column_stack([t, q, torque]), ("ab", "tau/ab"))
    identified(log, tmp_path / "arm.urdf", tmp_path / "out")
    passive = {axis.joint: axis for axis in read_robot(tmp_path / "out/arm.urdf").passive}
    assert list(passive) == ["ab"]
    assert (passive["ab"].damping, passive["ab"].friction) == pytest.approx((12, 2), rel=1e-3)
    assert b'<dynamics damping="0" friction="0"/>' in (tmp_path / "out/arm.urdf").read_bytes()


def test_couplings_are_written_beside_the_file_as_they_were(tmp_path: Path) -> None:
    text = robot(*map(link, "abc"), joint("ab", "a", "b"), joint("bc", "b", "c"))
    (tmp_path / "arm.urdf").write_text(text)
    gear = 'name = "gear"\ntype = "coupling"\nterms = { ab = 1.5, bc = [0.1, -2.0, 0.3] }\n'
    (tmp_path / "own.toml").write_text(f"schema = 1\n[[constraint]]\n{gear}")
    tied = [tmp_path / "own.toml", tmp_path / "again.toml"]
    system = read_system(tmp_path / "arm.urdf", Options(constraints=str(tied[0])))
    write_package(generate(system, ["numpy"]), tmp_path / "arm")
    manifest = Manifest.read(tmp_path / "arm")
    assert manifest.tree is not None
    tied[1].write_text(constraint_text(manifest.tree, manifest.joints))
    one, other = (read_robot(tmp_path / "arm.urdf", Options(constraints=str(path))) for path in tied)
    assert one.couplings
    assert one.couplings == other.couplings


def test_friction_that_the_file_has_no_place_for_is_told(tmp_path: Path) -> None:
    text = robot(*map(link, "abc"), joint("ab", "a", "b"), joint("bc", "b", "c", type="planar"))
    (tmp_path / "arm.urdf").write_text(text)
    arm = load_robot(generate_package(tmp_path / "arm.urdf", tmp_path / "arm"))
    t, q, qd, qdd = swings(4, 20, 100)
    torque = arm.model.inverse_dynamics(q, qd, qdd) + 0.5 * qd
    names = [*arm.joints, *(f"tau/{name}" for name in arm.joints)]
    log = write_csv(tmp_path / "log.csv", np.column_stack([t, q, torque]), names)
    record = identified(log, tmp_path / "arm.urdf", tmp_path / "out")
    told = "arm.urdf has no place for the friction of {}, part of a joint of several axes"
    assert record["warnings"] == [told.format(name) for name in arm.joints[1:]]
    assert "## Not in the robot's file" in (tmp_path / "out/identified.md").read_text()


def test_mujoco_takes_every_link_of_the_file_as_a_body_that_can_exist(written: Path) -> None:
    """MuJoCo refuses a body whose moments break the triangle inequality; here no link is merged."""
    extension = b'<mujoco><compiler fusestatic="false" balanceinertia="false"/></mujoco></robot>'
    before, after = (
        mujoco.MjModel.from_xml_string(
            path.read_bytes().replace(b"</robot>", extension).split(b"?>")[1].decode()
        )
        for path in (OWN, written / OWN.name)
    )
    np.testing.assert_array_equal(after.jnt_range, before.jnt_range)
    np.testing.assert_array_equal(after.body_pos, before.body_pos)
    assert after.nbody == before.nbody == 8
    moved = [after.body(name).mass[0] / before.body(name).mass[0] for name in ("lower", "hand", "camera")]
    # What is one rigid body grows heavier alike.
    assert moved == pytest.approx([moved[0]] * 3, rel=1e-9)


def test_a_point_of_mass_stays_one(log: Path, tmp_path: Path) -> None:
    """MuJoCo takes moments of 0, and none that rounding has left below."""
    ballast = (
        b'<link name="ballast"><inertial><mass value="0.1"/>'
        b'<inertia ixx="0" ixy="0" ixz="0" iyy="0" iyz="0" izz="0"/></inertial></link>'
        b'<joint name="hung" type="fixed"><origin xyz="0.1 0.2 0.3" rpy="0.3 1 0.2"/>'
        b'<parent link="hand"/><child link="ballast"/></joint></robot>'
    )
    arm = tmp_path / "arm.urdf"
    arm.write_bytes(OWN.read_bytes().replace(b"</robot>", ballast))
    identified(log, arm, tmp_path / "out")
    text = (tmp_path / "out/arm.urdf").read_bytes().split(b"?>")[1].decode()
    own = re.search(r'<link name="ballast">.*?<inertia ([^>]*)/>', text, re.DOTALL)
    assert own is not None
    assert [float(said) for said in re.findall(r'"([^"]*)"', own[1])] == [0.0] * 6
    extension = '<mujoco><compiler fusestatic="false" balanceinertia="false"/></mujoco></robot>'
    assert mujoco.MjModel.from_xml_string(text.replace("</robot>", extension)).body("ballast").mass[0] != 0.1


def test_what_torques_do_not_tell_stays_as_the_file_has_it(log: Path, tmp_path: Path) -> None:
    identified(log, OWN, tmp_path, "--no-friction")
    assert b'<dynamics friction="0.1" damping="0.2"/>' in (tmp_path / OWN.name).read_bytes()
    assert (tmp_path / OWN.name).read_bytes().count(b"<dynamics") == 1


def test_the_users_own_file_is_not_overwritten(log: Path, tmp_path: Path) -> None:
    (tmp_path / "arm.urdf").write_bytes(OWN.read_bytes())
    command = ["identify", str(log), "--robot", str(tmp_path / "arm.urdf"), "--out", str(tmp_path)]
    with pytest.raises(
        LinkwiseError, match=r"--out .*: arm.urdf in it is the robot's own file; name another"
    ):
        CliRunner().invoke(app, command, catch_exceptions=False)
    assert (tmp_path / "arm.urdf").read_bytes() == OWN.read_bytes()


def test_of_a_package_the_file_has_the_limits_and_all_frames(log: Path, tmp_path: Path) -> None:
    identified(log, generate_package(OWN, tmp_path / "package"), tmp_path / "out")
    before, after = (pinocchio.buildModelFromUrdf(str(path)) for path in (OWN, tmp_path / "out/own_arm.urdf"))
    same_limits(before, after)
    q = np.array([0.3, -0.4, 0.2])
    data = [model.createData() for model in (before, after)]
    for model, own in zip((before, after), data, strict=True):
        pinocchio.framesForwardKinematics(model, own, q)
    for name in ("stand", "hand", "camera", "tcp"):
        at = [
            own.oMf[model.getFrameId(name)].homogeneous
            for model, own in zip((before, after), data, strict=True)
        ]
        np.testing.assert_allclose(at[1], at[0], atol=1e-12)


def generate_package(robot: Path, folder: Path) -> Path:
    write_package(generate(read_system(robot), ["numpy"]), folder)
    return folder


def same_limits(before: Any, after: Any) -> None:
    assert list(after.names) == list(before.names)
    for what in ("lowerPositionLimit", "upperPositionLimit", "velocityLimit", "effortLimit"):
        np.testing.assert_array_equal(getattr(after, what), getattr(before, what))


def same_joints_and_frames(before: Any, after: Any) -> None:
    same_limits(before, after)
    for one, other in zip(before.joints, after.joints, strict=True):
        assert one.shortname() == other.shortname()
    for one, other in zip(before.jointPlacements, after.jointPlacements, strict=True):
        np.testing.assert_array_equal(one.homogeneous, other.homogeneous)
    for one, other in zip(before.frames, after.frames, strict=True):
        assert (one.name, one.parentJoint, one.type) == (other.name, other.parentJoint, other.type)
        np.testing.assert_array_equal(one.placement.homogeneous, other.placement.homogeneous)


@pytest.mark.parametrize("flat", [0, 1, 3])
def test_links_of_one_body_share_it_as_bodies_that_can_exist(flat: int) -> None:
    """Points of mass in space, in a plane, or all at one place; and together they are what is wanted."""
    generator = np.random.default_rng(flat)
    points = np.concatenate([generator.standard_normal((3, 6, 3)), np.ones((3, 6, 1))], axis=2)
    points[:, :, :flat] = 0.25
    own = np.einsum("kpa,kpb->kab", points, points * generator.uniform(0.1, 1, (3, 6, 1)))
    wanted = own.sum(0) + np.diag([0.5, 0.75, 1.0, 0.25])
    shared = shared_mass(own, wanted)
    np.testing.assert_allclose(shared.sum(0), wanted, rtol=1e-12, atol=1e-12)
    assert np.linalg.eigvalsh(shared).min() > -1e-12
    np.testing.assert_allclose(shared_mass(own, own.sum(0)), own, rtol=0, atol=1e-7)
