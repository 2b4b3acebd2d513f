"""Cassie from its SDF file, whose legs are closed by rods: against a model that Pinocchio is given here."""

import xml.etree.ElementTree as ET
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from linkwise import Options, generate, read_system, write_package
from linkwise.check.constraint_checks import loop_calls
from linkwise.oracle.loop_reference import loop_reference
from linkwise.oracle.states import random_states
from linkwise.package.load import import_package
from linkwise.package.manifest import Manifest
from linkwise_runtime.targets import Natural

pytest.importorskip("pinocchio")

import pinocchio as pin
from tools.corpus import ROBOTS

FILE = ROBOTS / "cassie_description/robots/cassie_v2.sdf"
if not FILE.is_file():
    pytest.skip("needs real robots: pip install example-robot-data", allow_module_level=True)

ROUNDED = 1e-4
"""The file's poses are rounded, so that the rods that move the feet close to some micrometres only."""


class Cassie:
    """Links stand in the model, joints in their child, as SDF 1.6 has it; the rods' balls are left open."""

    def __init__(self) -> None:
        model = ET.parse(FILE).getroot().find("model")
        assert model is not None
        self.links = {link.get("name", ""): _pose(link) for link in model.findall("link")}
        self.model = pin.Model()
        self.balls: dict[str, tuple[tuple[str, Any], tuple[str, Any]]] = {}
        joints = list(model.findall("joint"))
        inertias = {link.get("name", ""): _inertia(link) for link in model.findall("link")}
        carried = {"pelvis": (0, self.links["pelvis"])}
        while joints:
            joint = joints.pop(0)
            parent, child = joint.findtext("parent", ""), joint.findtext("child", "")
            here = self.links[child] * _pose(joint)
            if joint.get("type") == "ball":
                ends = ((name, self.links[name].inverse() * here) for name in (parent, child))
                self.balls[joint.get("name", "")] = tuple(ends)  # type: ignore[assignment]
                continue
            if parent not in carried:
                joints.append(joint)
                continue
            axis = np.array([float(word) for word in joint.findtext("axis/xyz", "").split()])
            number, place = carried[parent]
            at = self.model.addJoint(
                number, pin.JointModelRevoluteUnaligned(axis), place.inverse() * here, joint.get("name")
            )
            self.model.appendBodyToJoint(at, inertias[child], here.inverse() * self.links[child])
            carried[child] = at, here
            self.model.addBodyFrame(child, at, here.inverse() * self.links[child], 0)
        self.data = self.model.createData()

    def order(self, names: tuple[str, ...]) -> Any:
        """Return where Pinocchio has the joints of these names."""
        return [self.model.joints[self.model.getJointId(name)].idx_v for name in names]


def _pose(element: ET.Element) -> Any:
    x, y, z, roll, pitch, yaw = (float(word) for word in element.findtext("pose", "0 0 0 0 0 0").split())
    return pin.SE3(pin.rpy.rpyToMatrix(roll, pitch, yaw), np.array([x, y, z]))


def _inertia(link: ET.Element) -> Any:
    inertial = link.find("inertial")
    assert inertial is not None
    told = {
        axes: float(inertial.findtext(f"inertia/i{axes}", "0"))
        for axes in ("xx", "yy", "zz", "xy", "xz", "yz")
    }
    tensor = np.array([[told["".join(sorted(a + b))] for b in "xyz"] for a in "xyz"])
    com = _pose(inertial)
    return com.act(pin.Inertia(float(inertial.findtext("mass", "")), np.zeros(3), tensor))


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    system = read_system(FILE, Options(base="fixed"))
    written: Path = tmp_path_factory.mktemp("cassie") / system.name
    write_package(generate(system, backends=["numpy"], kernel="loops"), written)
    return written


@pytest.fixture(scope="module")
def robot(folder: Path) -> Any:
    return import_package(folder).load("numpy")


def test_check_holds_the_rods_of_rounded_places(folder: Path, robot: Any) -> None:
    manifest = Manifest.read(folder)
    assert manifest.tree is not None
    reference = loop_reference(manifest, manifest.tree, random_states(manifest.joints, 15))
    assert reference is not None
    assert not any(result.failed for result in loop_calls("numpy", robot, reference))


def test_the_open_tree_is_the_files(robot: Any) -> None:
    theirs, rng = Cassie(), np.random.default_rng(0)
    order = theirs.order(robot.joint_names)
    for _ in range(10):
        motion = [rng.uniform(-1.0, 1.0, robot.n) for _ in range(3)]
        sorted_in = [np.zeros(robot.n) for _ in motion]
        for ours, put in zip(motion, sorted_in, strict=True):
            put[order] = ours
        expected = pin.rnea(theirs.model, theirs.data, *sorted_in)[order]
        np.testing.assert_allclose(robot.inverse_dynamics(*motion), expected, rtol=0, atol=1e-10)


def test_rods_stay_on_their_balls_while_the_motors_move(robot: Any) -> None:
    theirs, constraints = Cassie(), robot.constrained(tolerance=ROUNDED)
    assert set(constraints.names) == set(theirs.balls)
    order, rng = theirs.order(robot.joint_names), np.random.default_rng(1)
    chosen = [robot.joint_index(name) for name in constraints.independent]
    for _ in range(5):
        q = np.zeros(robot.n)
        q[chosen] = rng.uniform(-0.05, 0.05, len(chosen))
        q = constraints.closed(q)
        moved, there = constraints.velocity(q, rng.uniform(-1.0, 1.0, len(chosen))), np.zeros(robot.n)
        speed = np.zeros(robot.n)
        there[order], speed[order] = q, moved
        pin.forwardKinematics(theirs.model, theirs.data, there, speed)
        pin.updateFramePlacements(theirs.model, theirs.data)
        for ends in theirs.balls.values():
            places, velocities = zip(*(theirs_end(theirs, *end) for end in ends), strict=True)
            np.testing.assert_allclose(places[0], places[1], rtol=0, atol=ROUNDED)
            np.testing.assert_allclose(velocities[0], velocities[1], rtol=0, atol=ROUNDED)


def theirs_end(theirs: Cassie, body: str, end: Any) -> tuple[Any, Any]:
    """Place and velocity of an end of a rod."""
    frame = theirs.model.getFrameId(body)
    place = theirs.data.oMf[frame] * end
    twist = pin.getFrameVelocity(theirs.model, theirs.data, frame, pin.LOCAL_WORLD_ALIGNED)
    arm = place.translation - theirs.data.oMf[frame].translation
    return place.translation, twist.linear + np.cross(twist.angular, arm)


MOTORS = ("roll-op", "yaw-op", "pitch-op", "knee-op", "tarsus-crank-joint")
"""Joints of a leg with motors; the shin and the heel are on springs."""


def test_legs_obey_an_impedance_that_their_motors_give(robot: Any) -> None:
    """Rods close both legs, springs are driven by nothing, and Pinocchio moves them by the torques."""
    theirs, ties, rng = Cassie(), robot.constrained(tolerance=ROUNDED), np.random.default_rng(2)
    motors = [f"{side}-{name}" for side in ("left", "right") for name in MOTORS]
    driven = sorted(robot.joint_index(name) for name in motors)
    at = np.zeros(robot.n)
    at[driven] = rng.uniform(-0.05, 0.05, len(driven))
    q = ties.closed(at)
    qd = ties.velocity(q, rng.uniform(-1.0, 1.0, len(ties.independent)))
    stiffness, damping, push = rng.uniform(1.0, 3.0, (3, robot.n))
    wanted = {"stiffness": stiffness, "damping": Natural(plus=damping), "passive": False}
    control = robot.partial_impedance(**wanted, constraints=ties, actuated=motors)
    assert control.actuated == tuple(robot.joint_names[k] for k in driven)
    assert control.undriven == len(ties.independent) - len(motors) == 2
    tau = control(q, qd, 0.9 * q, push)
    assert not np.delete(tau, driven).any()
    order = theirs.order(robot.joint_names)
    rows, rate = rods(theirs, order, q, qd)
    moved = moved_by(theirs, order, q, qd, (rows, rate), tau + push)
    size = np.abs(moved).max()
    np.testing.assert_allclose(control.acceleration(q, qd, 0.9 * q, push), moved, atol=1e-9 * size)
    # With motors at all joints that are free, M qdd + (C + D) qd + K e = f along all that rods leave.
    asked = moved_by(
        theirs, order, q, qd, (rows, rate), push - damping * qd - 0.1 * stiffness * q, gravity=False
    )
    np.testing.assert_allclose(moved[driven], asked[driven], atol=1e-9 * size)
    assert np.abs(moved - asked).max() > 1e-3 * size  # of the springs


def rods(theirs: Cassie, order: Any, q: Any, qd: Any) -> tuple[Any, Any]:
    """A (rows, n) and dA/dt qd (rows,) of the rods' balls, in the order of linkwise's coordinates."""
    there, speed = np.zeros_like(q), np.zeros_like(q)
    there[order], speed[order] = q, qd
    model, data, axes = theirs.model, theirs.data, pin.LOCAL_WORLD_ALIGNED
    pin.forwardKinematics(model, data, there, speed, 0.0 * speed)
    pin.computeJointJacobians(model, data, there)
    pin.updateFramePlacements(model, data)
    rows, rates = [], []
    for ends in theirs.balls.values():
        both = []
        for body, end in ends:
            at = model.getFrameId(body)
            whole = pin.getFrameJacobian(model, data, at, axes)
            turned = pin.getFrameVelocity(model, data, at, axes).angular
            change = pin.getFrameClassicalAcceleration(model, data, at, axes)
            arm = data.oMf[at].rotation @ end.translation
            both.append(
                (
                    whole[:3] - pin.skew(arm) @ whole[3:],
                    change.linear + np.cross(change.angular, arm) + np.cross(turned, np.cross(turned, arm)),
                )
            )
        rows.append(both[0][0] - both[1][0])
        rates.append(both[0][1] - both[1][1])
    return np.concatenate(rows)[:, order], np.concatenate(rates)


def moved_by(
    theirs: Cassie, order: Any, q: Any, qd: Any, rods: tuple[Any, Any], tau: Any, gravity: bool = True
) -> Any:
    """qdd (n,) under torques, in the null space of the rods' rows that are not rounding alone."""
    there, speed = np.zeros_like(q), np.zeros_like(q)
    there[order], speed[order] = q, qd
    rest, weight = 0.0 * there, pin.computeGeneralizedGravity(theirs.model, theirs.data, there)
    # Not by crba: it wants each joint's subtree in one piece, in which this model was not made.
    each = [pin.rnea(theirs.model, theirs.data, there, rest, unit) - weight for unit in np.eye(len(q))]
    mass = np.array(each)[np.ix_(order, order)]
    bias = pin.nonLinearEffects(theirs.model, theirs.data, there, speed)
    if not gravity:
        bias = bias - weight
    rows, rate = rods
    free = np.linalg.svd(rows)[2][np.linalg.matrix_rank(rows, ROUNDED) :]
    own = -np.linalg.pinv(rows, rcond=ROUNDED) @ rate
    return own + free.T @ np.linalg.solve(free @ mass @ free.T, free @ (tau - bias[order] - mass @ own))
