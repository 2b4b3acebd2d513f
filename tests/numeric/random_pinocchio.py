"""A random robot in Pinocchio, built joint by joint from the drawn data, and each link's mass alone.

Nothing of linkwise takes part: mimic joints move by themselves in the model, and a matrix ties them together.
"""

from collections.abc import Iterator
from typing import Any

import numpy as np
import pinocchio as pin
from fuzz.valid_robots import JointData, RobotData, rotation

from numeric.oracle_models import link_alone

X, Y, Z = np.eye(3)
TURNS = (("yaw", False, Z), ("pitch", False, Y), ("roll", False, X))
CYCLE = {0: (1, 2), 1: (2, 0), 2: (0, 1)}


def axes_of(joint: JointData) -> list[tuple[str, bool, Any]]:
    """(coordinate, whether it slides, direction) of each axis, the one next to the parent first."""
    axis = np.array(joint.axis) / np.linalg.norm(joint.axis)
    match joint.type:
        case "fixed":
            return []
        case "revolute" | "continuous" | "prismatic":
            return [(joint.name, joint.type == "prismatic", axis)]
        case "planar":
            u, v = plane(axis)
            parts = [("x", True, u), ("y", True, v), ("yaw", False, axis)]
        case "ball":
            parts = list(TURNS)
        case "floating":
            parts = [("x", True, X), ("y", True, Y), ("z", True, Z), *TURNS]
    return [(f"{joint.name}_{suffix}", slides, direction) for suffix, slides, direction in parts]


def plane(normal: Any) -> tuple[Any, Any]:
    """Directions x and y of a planar joint: z turned onto the normal by the shortest way takes them along.

    For a normal along x or y they are the next two axes in turn, the first with its sign; for −z, x and −y.
    """
    at = int(np.abs(normal).argmax())
    if abs(normal[at]) == 1.0 and at < 2:
        u, v = (np.eye(3)[k] for k in CYCLE[at])
        return normal[at] * u, v
    if normal[2] == -1.0:
        return X, -Y
    turn = pin.Quaternion.FromTwoVectors(Z, normal).matrix()
    return turn[:, 0], turn[:, 1]


def depth_first(robot: RobotData, link: str) -> Iterator[JointData]:
    """The joints below a link, branch by branch, as Pinocchio numbers the joints of a subtree in a row."""
    for joint in robot.joints:
        if joint.parent == link:
            yield joint
            yield from depth_first(robot, joint.child)


class RandomOracle:
    """c2, c1, g and τ of every link of a robot, by Pinocchio."""

    def __init__(self, robot: RobotData, coordinates: tuple[str, ...]) -> None:
        self.model = pin.Model()
        self.model.gravity.linear = np.array(robot.gravity)
        self.owner: dict[str, int] = {}
        places, slots = {robot.links[0].name: (0, pin.SE3.Identity())}, dict[str, int]()
        for joint in depth_first(robot, robot.links[0].name):
            at, before = places[joint.parent]
            place = before * pin.SE3(rotation(*joint.rpy), np.array(joint.xyz))
            for name, slides, direction in axes_of(joint):
                kind = pin.JointModelPrismaticUnaligned if slides else pin.JointModelRevoluteUnaligned
                at, place = self.model.addJoint(at, kind(*direction), place, name), pin.SE3.Identity()
                slots[name] = self.model.joints[at].idx_v
                self.owner[joint.child] = at
            places[joint.child] = at, place
        for link in robot.links:
            at, place = places[link.name]
            if at and link.mass:
                body = pin.Inertia(link.mass, np.array(link.com), np.array(link.inertia))
                self.model.appendBodyToJoint(at, body, place)
        self.tie = np.zeros((self.model.nv, len(coordinates)))
        self.shift = np.zeros(self.model.nv)
        rules = {joint.name: joint.mimic for joint in robot.joints if joint.mimic}
        for name, slot in slots.items():
            master, ratio, offset = rules.get(name, (name, 1.0, 0.0))
            self.tie[slot, coordinates.index(master)] = ratio
            self.shift[slot] = offset

    def decomposition(self, links: tuple[str, ...], q: Any, qd: Any, qdd: Any) -> dict[str, Any]:
        """Dense c2, c1 (S, n, N, n), g and tau (S, n, N)."""
        tie, (samples, n), answer = self.tie, q.shape, dict[str, Any]()
        for field, rank in (("acceleration", 2), ("velocity", 2), ("gravity", 1), ("torque", 1)):
            answer[field] = np.zeros((samples, n, len(links), n)[: rank + 2])
        for j, link in enumerate(links):
            model = link_alone(self.model, self.owner[link])
            data = model.createData()
            for s in range(samples):
                x, v, a = tie @ q[s] + self.shift, tie @ qd[s], tie @ qdd[s]
                mass = np.triu(pin.crba(model, data, x))
                mass = mass + np.triu(mass, 1).T
                answer["acceleration"][s, :, j] = tie.T @ mass @ tie
                answer["velocity"][s, :, j] = tie.T @ pin.computeCoriolisMatrix(model, data, x, v) @ tie
                answer["gravity"][s, :, j] = tie.T @ pin.computeGeneralizedGravity(model, data, x)
                answer["torque"][s, :, j] = tie.T @ pin.rnea(model, data, x, v, a)
        return answer
