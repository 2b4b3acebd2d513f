"""Closed mechanisms as data, and what Pinocchio says of their ties: nothing of linkwise takes part.

Pinocchio has the open tree: its Jacobians, accelerations, mass matrix and torques. The ties' rows are
written down here anew, and M qdd + h = tau + A^T lambda with A qdd + gamma = 0 is solved as one system.
"""

from dataclasses import dataclass, replace
from math import pi
from typing import Any

import numpy as np
import pinocchio as pin
from fuzz.valid_robots import JointData, LinkData, RobotData, Row, rotation, toml_data, toml_text

from numeric.oracle_models import link_alone
from numeric.random_pinocchio import RandomOracle

AXES = pin.LOCAL_WORLD_ALIGNED
Z: Row = (0.0, 0.0, 1.0)
NONE: Row = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class End:
    """A place on a link."""

    frame: str
    xyz: Row = NONE
    rpy: Row = NONE


@dataclass(frozen=True)
class TieData:
    name: str
    type: str
    first: End
    second: End
    length: float = 0.0


@dataclass(frozen=True)
class Mechanism:
    """A robot with ties; near the position q they close."""

    name: str
    robot: RobotData
    ties: tuple[TieData, ...]
    q: tuple[float, ...]
    free: int

    @property
    def text(self) -> str:
        """The file."""
        ties = [
            {"name": tie.name, "type": tie.type}
            | {"first": _end(tie.first), "second": _end(tie.second)}
            | ({"length": tie.length} if tie.length else {})
            for tie in self.ties
        ]
        return toml_text(toml_data(self.robot) | {"name": self.name, "constraint": ties})


def _end(end: End) -> dict[str, Any]:
    return {"frame": end.frame, "xyz": list(end.xyz), "rpy": list(end.rpy)}


def body(name: str, mass: float, com: Row) -> LinkData:
    """A body that is a little skew."""
    a, b, c, d, e = (mass * part for part in (0.02, 0.03, 0.025, 0.002, 0.003))
    return LinkData(name, mass, com, ((a, d, 0.0), (d, b, -e), (0.0, -e, c)))


def hinge(name: str, parent: str, child: str, xyz: Row, rpy: Row = NONE, axis: Row = Z) -> JointData:
    return JointData(name, "revolute", parent, child, xyz, rpy, axis)


def fourbar() -> Mechanism:
    """Return a four-bar in a plane: a pin in space, of whose rows one is held twice."""
    joints = (
        hinge("crank", "base", "a", NONE),
        hinge("knee", "a", "b", (0.3, 0.0, 0.0)),
        hinge("rocker", "base", "c", (0.6, 0.1, 0.0)),
    )
    links = LinkData("base"), body("a", 1.2, (0.15, 0.01, 0.02)), body("b", 2.0, (0.3, -0.02, 0.0))
    robot = RobotData("toml", (0.3, -9.81, 0.2), (*links, body("c", 1.5, (0.2, 0.01, 0.0))), joints)
    tie = TieData("pin", "point", End("b", (0.7, 0.0, 0.0)), End("c", (0.5, 0.0, 0.0)))
    return Mechanism("fourbar", robot, (tie,), (0.8, -0.5, 1.2), 1)


def fivebar() -> Mechanism:
    """Return a five-bar in a plane: a hinge, of whose five rows three are held twice."""
    joints = (
        hinge("left", "base", "a", NONE),
        hinge("left_elbow", "a", "b", (0.2, 0.0, 0.0)),
        hinge("right", "base", "c", (0.15, 0.0, 0.0)),
        hinge("right_elbow", "c", "d", (0.21, 0.0, 0.0)),
    )
    names = zip("abcd", (0.5, 0.4, 0.5, 0.4), strict=True)
    links = LinkData("base"), *(body(name, mass, (0.1, 0.01, 0.02)) for name, mass in names)
    tie = TieData("tip", "hinge", End("b", (0.25, 0.0, 0.0)), End("d", (0.26, 0.0, 0.0)))
    robot = RobotData("toml", (0.0, -9.81, 0.0), links, joints)
    return Mechanism("fivebar", robot, (tie,), (2.0, -1.2, 1.1, 1.2), 2)


def bennett() -> Mechanism:
    """Four skew hinges that move, against all counting: sin(alpha) / a = sin(beta) / b."""
    a, b, alpha = 0.3, 0.2, 1.0
    beta = float(np.arcsin(np.sin(alpha) * b / a))
    joints = (
        hinge("one", "base", "p", NONE),
        hinge("two", "p", "q", (a, 0.0, 0.0), (alpha, 0.0, 0.0)),
        hinge("three", "q", "r", (b, 0.0, 0.0), (beta, 0.0, 0.0)),
    )
    links = LinkData("base"), *(body(name, 1.0, (0.1, 0.02, 0.03)) for name in "pqr")
    tie = TieData(
        "four",
        "hinge",
        End("r", (a, 0.0, 0.0), (alpha, 0.0, 0.0)),
        End("base", (-b, 0.0, 0.0), (-beta, 0.0, 0.0)),
    )
    robot = RobotData("toml", (0.0, 0.0, -9.81), links, joints)
    return Mechanism("bennett", robot, (tie,), (0.7, 2.0, 0.7), 1)


def delta() -> Mechanism:
    """Three rods of constant length from arms to a platform that slides."""
    joints, links, ties = [], [LinkData("base"), LinkData("sx"), LinkData("sy")], []
    for k, angle in enumerate((0.0, 2 * pi / 3, 4 * pi / 3), 1):
        x, y = float(np.cos(angle)), float(np.sin(angle))
        joints.append(
            hinge(f"arm{k}", "base", f"upper{k}", (0.12 * x, 0.12 * y, 0.0), (0, 0, angle), (0.0, 1.0, 0.0))
        )
        links.append(body(f"upper{k}", 0.3, (0.08, 0.01, 0.0)))
        ends = End(f"upper{k}", (0.16, 0.0, 0.0)), End("platform", (0.04 * x, 0.04 * y, 0.0))
        ties.append(TieData(f"rod{k}", "distance", *ends, 0.3))
    chain = ("base", "sx", "sy", "platform")
    for at, axis in enumerate(((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), Z)):
        place = (0.0, 0.0, -0.25) if at == 0 else NONE
        joints.append(JointData("xyz"[at], "prismatic", chain[at], chain[at + 1], place, NONE, axis))
    links.append(body("platform", 0.2, (0.01, 0.0, 0.0)))
    robot = RobotData("toml", (0.0, 0.0, -9.81), tuple(links), tuple(joints))
    return Mechanism("delta", robot, tuple(ties), (0.4, 0.5, 0.3, 0.02, -0.01, -0.05), 3)


def held_arm() -> Mechanism:
    """An arm of eight hinges whose hand is held by the ground, all of it."""
    turns = [
        (0.3, 0.0, 0.1),
        (1.5, 0.2, 0.0),
        (-1.4, 0.0, 0.3),
        (1.3, 0.1, 0.0),
        (-1.5, 0.0, 0.0),
        (1.4, 0.2, 0.1),
    ]
    turns += [(-1.3, 0.0, 0.2), (1.6, 0.1, 0.0)]
    names = ["base", *(f"l{k}" for k in range(8))]
    joints = [hinge(f"j{k}", names[k], names[k + 1], (0.05, 0.02, 0.2), turns[k]) for k in range(8)]
    links = [
        LinkData("base"),
        *(body(name, 1.0 - 0.08 * k, (0.02, 0.01, 0.1)) for k, name in enumerate(names[1:])),
    ]
    robot = RobotData("toml", (0.0, 0.5, -9.81), tuple(links), tuple(joints))
    q = (0.3, -0.5, 0.4, 0.9, -0.3, 0.6, 0.2, -0.4)
    model = RandomOracle(robot, tuple(joint.name for joint in joints)).model
    data = model.createData()
    pin.forwardKinematics(model, data, np.array(q))
    hand = data.oMi[8] * pin.SE3(rotation(0.2, 0.3, -0.4), np.array([0.0, 0.0, 0.1]))
    (roll, pitch, yaw), (x, y, z) = pin.rpy.matrixToRpy(hand.rotation).tolist(), hand.translation.tolist()
    ends = End("l7", (0.0, 0.0, 0.1), (0.2, 0.3, -0.4)), End("base", (x, y, z), (roll, pitch, yaw))
    tie = TieData("hand", "frame", *ends)
    return Mechanism("held_arm", robot, (tie,), q, 2)


def upright() -> Mechanism:
    """The five-bar in a plane upright: turned by a right angle, rows held twice are no more than rounding."""
    flat, turn = fivebar(), (pi / 2, 0.0, 0.0)

    def stood(joint: JointData) -> JointData:
        x, y, z = (rotation(*turn) @ np.array(joint.xyz)).tolist()
        return replace(joint, xyz=(x, y, z), rpy=turn) if joint.parent == "base" else joint

    joints = tuple(stood(joint) for joint in flat.robot.joints)
    robot = replace(flat.robot, joints=joints, gravity=(0.0, 0.0, -9.81))
    return replace(flat, name="upright", robot=robot)


MADE = (fourbar(), fivebar(), upright(), bennett(), delta(), held_arm())
MECHANISMS = {made.name: made for made in MADE}


class LoopOracle:
    """A mechanism in Pinocchio."""

    def __init__(self, mechanism: Mechanism, coordinates: tuple[str, ...]) -> None:
        own = RandomOracle(mechanism.robot, coordinates)
        self.model, self.owner, self.n = own.model, own.owner, len(coordinates)
        # Coordinates in the order of Pinocchio's joints, and back.
        self.order = own.tie.argmax(1)
        self.ties = mechanism.ties
        self.ends = [
            tuple(self._frame(tie, end) for end in (tie.first, tie.second)) for tie in mechanism.ties
        ]
        self.data = self.model.createData()

    def _frame(self, tie: TieData, end: End) -> int:
        joint = self.owner.get(end.frame, 0)
        place = pin.SE3(rotation(*end.rpy), np.array(end.xyz))
        name = f"{tie.name} {end.frame} {len(self.model.frames)}"
        return int(self.model.addFrame(pin.Frame(name, joint, 0, place, pin.OP_FRAME)))

    def rows(self, q: Any, qd: Any) -> tuple[Any, Any]:
        """A (C, n) and gamma = dA/dt qd (C,)."""
        x, v = q[self.order], qd[self.order]
        pin.forwardKinematics(self.model, self.data, x, v, 0 * v)
        pin.computeJointJacobians(self.model, self.data, x)
        pin.updateFramePlacements(self.model, self.data)
        found = [self._tie_rows(tie, *ends) for tie, ends in zip(self.ties, self.ends, strict=True)]
        rows = np.concatenate([rows for rows, _ in found])
        return self._back(rows), np.concatenate([rate for _, rate in found])

    def _tie_rows(self, tie: TieData, one: int, two: int) -> tuple[Any, Any]:
        model, data = self.model, self.data
        first, second = (pin.getFrameJacobian(model, data, f, AXES) for f in (one, two))
        speeds = [pin.getFrameVelocity(model, data, f, AXES) for f in (one, two)]
        changes = [pin.getFrameClassicalAcceleration(model, data, f, AXES) for f in (one, two)]
        linear, angular = first[:3] - second[:3], first[3:] - second[3:]
        slip, spin = speeds[0].linear - speeds[1].linear, speeds[0].angular - speeds[1].angular
        push, twist = changes[0].linear - changes[1].linear, changes[0].angular - changes[1].angular
        if tie.type == "distance":
            way = data.oMf[one].translation - data.oMf[two].translation
            size = np.linalg.norm(way)
            u = way / size
            return (u @ linear)[None], np.array([u @ push + (slip @ slip - (u @ slip) ** 2) / size])
        if tie.type == "point":
            return linear, push
        if tie.type == "frame":
            return np.concatenate([angular, linear]), np.concatenate([twist, push])
        across = data.oMf[one].rotation[:, :2].T
        turned = np.cross(speeds[0].angular, across)
        return np.concatenate([across @ angular, linear]), np.concatenate(
            [across @ twist + turned @ spin, push]
        )

    def mass_and_bias(self, q: Any, qd: Any) -> tuple[Any, Any]:
        """M (n, n) and h + g (n,)."""
        x, v = q[self.order], qd[self.order]
        mass = np.triu(pin.crba(self.model, self.data, x))
        mass = mass + np.triu(mass, 1).T
        bias = pin.rnea(self.model, self.data, x, v, 0 * v)
        return self._back(self._back(mass).T), self._back(bias)

    def motion(self, q: Any, qd: Any, tau: Any) -> tuple[Any, Any]:
        """qdd and lambda, of least norm, from one system of equations."""
        (mass, bias), (rows, rate) = self.mass_and_bias(q, qd), self.rows(q, qd)
        count = len(rows)
        whole = np.block([[mass, -rows.T], [rows, np.zeros((count, count))]])
        found = np.linalg.lstsq(whole, np.concatenate([tau - bias, -rate]), rcond=1e-12)[0]
        return found[: self.n], found[self.n :]

    def torque(self, link: str, q: Any, qd: Any, qdd: Any) -> Any:
        """tau_ij of the open tree through one link, (n,)."""
        model = link_alone(self.model, self.owner[link])
        state = (a[self.order] for a in (q, qd, qdd))
        return self._back(pin.rnea(model, model.createData(), *state))

    def energy(self, link: str, q: Any, qd: Any) -> float:
        """Kinetic and potential energy of a link in J."""
        model = link_alone(self.model, self.owner[link])
        data, x = model.createData(), q[self.order]
        kinetic = pin.computeKineticEnergy(model, data, x, qd[self.order])
        return float(kinetic + pin.computePotentialEnergy(model, data, x))

    def _back(self, values: Any) -> Any:
        """Columns in the order of the coordinates."""
        back = np.empty_like(values)
        back[..., self.order] = values
        return back


def constraint_dynamics(oracle: LoopOracle, q: Any, qd: Any, tau: Any) -> Any:
    """qdd by Pinocchio's own solver of constraints, for ties of points and frames."""
    model, kinds = (
        oracle.model,
        {"point": pin.PointAnchorConstraintModel, "frame": pin.FrameAnchorConstraintModel},
    )
    models = pin.StdVec_RigidConstraintModel()
    for tie, ends in zip(oracle.ties, oracle.ends, strict=True):
        frames = [model.frames[f] for f in ends]
        anchor = kinds[tie.type](model, *(a for f in frames for a in (f.parentJoint, f.placement)))
        models.append(pin.convertToRigidConstraintModel(model, anchor, pin.LOCAL))
    datas = pin.StdVec_RigidConstraintData()
    datas.extend([one.createData() for one in models])
    data = model.createData()
    pin.initConstraintDynamics(model, data, models, datas)
    settings = pin.ProximalSettings(1e-14, 1e-10, 200)
    state = (a[oracle.order] for a in (q, qd, tau))
    return oracle._back(pin.constraintDynamics(model, data, *state, models, datas, settings))
