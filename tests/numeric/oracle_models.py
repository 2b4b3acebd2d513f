"""Pinocchio models of the built-in robots, from their published tables, and of Panda's arm."""

import tomllib
from pathlib import Path
from typing import Any

import linkwise.robot.builtin
import numpy as np
import pinocchio as pin


def planar3() -> Any:
    """Return the arm of Table 2; I = 5e-3 kg m² is about the centre of mass."""
    model = pin.Model()
    model.gravity.linear = np.array([0.0, -9.80665, 0.0])
    body = pin.Inertia(0.6, np.array([0.125, 0.0, 0.0]), np.diag([0.0, 5e-3, 5e-3]))
    joint = 0
    for j in range(3):
        offset = np.array([0.25 if j else 0.0, 0.0, 0.0])
        joint = model.addJoint(joint, pin.JointModelRZ(), pin.SE3(np.eye(3), offset), f"joint{j + 1}")
        model.appendBodyToJoint(joint, body, pin.SE3.Identity())
    return model


def puma560() -> Any:
    """Return the arm of Armstrong, Khatib and Burdick, read off its table a second time."""
    path = Path(linkwise.robot.builtin.__path__[0]) / "puma560.toml"
    table = tomllib.loads(path.read_text())
    quarter = {"pi/2": np.pi / 2, "-pi/2": -np.pi / 2}
    model = pin.Model()
    model.gravity.linear = np.array(table["gravity"])
    ids = {"base": 0}
    for joint, link in zip(table["joint"], table["link"], strict=True):
        turn = [quarter.get(angle, angle) for angle in joint.get("rpy", [0, 0, 0])]
        offset = np.array(joint.get("xyz", [0, 0, 0]), dtype=float)
        placement = pin.SE3(pin.rpy.rpyToMatrix(*map(float, turn)), offset)
        parent = ids[joint["parent"]]
        ids[joint["child"]] = model.addJoint(parent, pin.JointModelRZ(), placement, joint["name"])
        moments = np.diag([float(link["inertia"][axis]) for axis in ("xx", "yy", "zz")])
        com = np.array(link.get("com", [0, 0, 0]), dtype=float)
        model.appendBodyToJoint(
            ids[joint["child"]], pin.Inertia(float(link["mass"]), com, moments), pin.SE3.Identity()
        )
    return model


def level_arm() -> Any:
    """Return the pendulum and the level arm of tests/data/level_arm.toml."""
    model = pin.Model()
    model.gravity.linear = np.array([0.0, 0.0, -9.81])
    moments, along, about_z = np.diag([0.01, 0.02, 0.02]), np.array([0.2, 0.0, 0.0]), pin.JointModelRZ()
    table = (
        ("swing", 0, pin.JointModelRY(), 1.0, 0.0),
        ("yaw", 0, about_z, 0.8, 0.0),
        ("elbow", 2, about_z, 0.6, 0.05),
        ("wrist", 3, about_z, 0.4, 0.0),
    )
    for name, parent, kind, mass, aside in table:
        place = pin.SE3(np.eye(3), along if parent else np.zeros(3))
        joint = model.addJoint(parent, kind, place, name)
        body = pin.Inertia(mass, np.array([0.1, aside, 0.0]), moments)
        model.appendBodyToJoint(joint, body, pin.SE3.Identity())
    return model


def panda(path: Path) -> Any:
    """Return Panda's arm with its fingers locked at zero."""
    full = pin.buildModelFromUrdf(str(path))
    fingers = [full.getJointId(name) for name in full.names if "finger" in name]
    return pin.buildReducedModel(full, fingers, pin.neutral(full))


def link_alone(model: Any, joint: int) -> Any:
    """Return the model with no inertia but that of the link behind `joint`."""
    alone = model.copy()
    for other in range(model.njoints):
        if other != joint:
            alone.inertias[other] = pin.Inertia.Zero()
    return alone


def decomposition(model: Any, joints: tuple[str, ...], q: Any, qd: Any, qdd: Any) -> dict[str, Any]:
    """Dense c2, c1, g, tau and c0 of every link, one model a link, joints in the order of `joints`."""
    ids = [model.getJointId(name) for name in joints]
    at = np.array([model.joints[i].idx_v for i in ids])
    samples, n = q.shape
    cube, square = (samples, n, n, n), (samples, n, n)
    shapes = {"acceleration": cube, "velocity": cube, "position_gradient": cube, "gravity": square}
    answer = {field: np.zeros(shape) for field, shape in (shapes | {"torque": square}).items()}
    for j, joint in enumerate(ids):
        alone = link_alone(model, joint)
        data = alone.createData()
        for s in range(samples):
            x, v, a = np.empty(n), np.empty(n), np.empty(n)
            x[at], v[at], a[at] = q[s], qd[s], qdd[s]
            mass = np.triu(pin.crba(alone, data, x))
            mass = mass + np.triu(mass, 1).T
            answer["acceleration"][s, :, j, :] = mass[np.ix_(at, at)]
            answer["velocity"][s, :, j, :] = pin.computeCoriolisMatrix(alone, data, x, v)[np.ix_(at, at)]
            answer["gravity"][s, :, j] = pin.computeGeneralizedGravity(alone, data, x)[at]
            answer["torque"][s, :, j] = pin.rnea(alone, data, x, v, a)[at]
            slope = pin.computeRNEADerivatives(alone, data, x, v, a)[0]
            answer["position_gradient"][s, :, j, :] = slope[np.ix_(at, at)]
    return answer
