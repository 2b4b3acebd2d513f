"""A robot of planar joints and hinges about z in OpenSim, built by OpenSim's own interface."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import opensim as osim
from fuzz.valid_robots import JointData, LinkData, RobotData, Row

KINDS = {"planar": (osim.PlanarJoint, (1, 2, 0)), "revolute": (osim.PinJoint, (0,))}
"""OpenSim's coordinates of a joint that are linkwise's, in order."""


class OpenSimModel:
    """Coordinates are in the order of the robot's; Simbody numbers speeds otherwise."""

    def __init__(self, robot: RobotData) -> None:
        osim.Logger.setLevelString("Error")
        osim.Logger.removeFileSink()
        self.model = osim.Model()
        self.model.setGravity(osim.Vec3(*robot.gravity))
        self.root = robot.links[0].name
        bodies = {link.name: link for link in robot.links}
        for joint in robot.joints:
            self._add(joint, bodies[joint.child])
        self.bodies = [joint.child for joint in robot.joints]
        self.names = [name for joint in robot.joints for name in joint.axis_names]
        self.controls: dict[str, float] = {}

    def _add(self, joint: JointData, link: LinkData) -> None:
        assert joint.axis == (0.0, 0.0, 1.0), "only hinges about z are made"
        assert joint.rpy == (0.0, 0.0, 0.0), "only hinges about z are made"
        moments = [link.inertia[i][k] for i, k in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))]
        body = osim.Body(link.name, link.mass, osim.Vec3(*link.com), osim.Inertia(*moments))
        self.model.addBody(body)
        kind, places = KINDS[joint.type]
        ends = osim.Vec3(*joint.xyz), osim.Vec3(0), body, osim.Vec3(0), osim.Vec3(0)
        made = kind(f"joint_{joint.name}", self.body(joint.parent), *ends)
        for place, name in zip(places, joint.axis_names, strict=True):
            made.upd_coordinates(place).setName(name)
        self.model.addJoint(made)

    def body(self, name: str) -> Any:
        return self.model.getGround() if name == self.root else self.model.getBodySet().get(name)

    def path(self, name: str) -> str:
        return "/ground" if name == self.root else f"/bodyset/{name}"

    def actuate(self, name: str, actuator: Any, value: float) -> None:
        """Have one of OpenSim's actuators as a source of its own, which gives one value."""
        actuator.setName(name)
        actuator.setOptimalForce(1.0)
        self.model.addForce(actuator)
        self.controls[name] = float(value)

    def motors(self, torques: Any) -> None:
        """Give every coordinate a torque, or a force."""
        for name, torque in zip(self.names, torques, strict=True):
            self.actuate(f"motor_{name}", osim.CoordinateActuator(name), torque)

    def muscle(self, name: str, ends: dict[str, Row], tension: float) -> None:
        """Pull points of two bodies together."""
        line = osim.PathActuator()
        for body, point in ends.items():
            line.addNewPathPoint(f"on_{body}", self.body(body), osim.Vec3(*point))
        self.actuate(name, line, tension)

    def push(self, name: str, body: str, point: Row, force: Row) -> None:
        """Push on a point of a body; the force is in the world's axes."""
        size = float(np.linalg.norm(force))
        hand = osim.PointActuator(body)
        hand.set_point(osim.Vec3(*point))
        hand.set_direction(osim.Vec3(*(part / size for part in force)))
        hand.set_force_is_global(True)
        self.actuate(name, hand, size)

    def pin(self, name: str, first: tuple[str, Row], second: tuple[str, Row]) -> None:
        """Have two points coincide."""
        ends = [part for body, point in (first, second) for part in (self.body(body), osim.Vec3(*point))]
        constraint = osim.PointConstraint(*ends)
        constraint.setName(name)
        self.model.addConstraint(constraint)

    def borne(self, state: Any) -> Any:
        """Forces that pins give their first points, pin by pin: Simbody's multipliers have the other sign."""
        self.model.realizeAcceleration(state)
        pins = self.model.getConstraintSet()
        values = [pins.get(k).getRecordValues(state) for k in range(pins.getSize())]
        return np.concatenate([[-one.get(axis) for axis in range(3)] for one in values])

    def state(self, q: Any, qd: Any) -> Any:
        """Build the system, once, with positions and velocities."""
        controller = osim.PrescribedController()
        for force in self.controls:
            controller.addActuator(osim.ScalarActuator.safeDownCast(self.model.updForceSet().get(force)))
        for force, value in self.controls.items():
            controller.prescribeControlForActuator(force, osim.Constant(value))
        self.model.addController(controller)
        for name, position in zip(self.names, q, strict=True):  # where loops are closed already
            self.model.updCoordinateSet().get(name).setDefaultValue(float(position))
        state = self.model.initSystem()
        for name, position, speed in zip(self.names, q, qd, strict=True):
            coordinate = self.model.getCoordinateSet().get(name)
            coordinate.setValue(state, float(position), False)
            coordinate.setSpeedValue(state, float(speed))
        self.model.realizeVelocity(state)
        return state

    def order(self, state: Any) -> list[int]:
        """Return the places where Simbody has the speed of each coordinate."""
        numbered = osim.State(state)
        for k, name in enumerate(self.names):
            self.model.getCoordinateSet().get(name).setSpeedValue(numbered, float(k))
        speeds = [round(speed) for speed in numbers(numbered.getU())]
        return [speeds.index(k) for k in range(len(self.names))]


class LoadedModel(OpenSimModel):
    """A model of a file in place of one that is built."""

    def __init__(self, file: Path, names: Sequence[str]) -> None:
        osim.Logger.setLevelString("Error")
        osim.Logger.removeFileSink()
        self.model = osim.Model(str(file))
        self.root = "ground"
        every = self.model.getBodySet()
        self.bodies = [every.get(k).getName() for k in range(every.getSize())]
        self.names = list(names)
        self.controls = {}


def numbers(vector: Any) -> Any:
    """Return the numbers of a vector of Simbody."""
    return np.array([vector.get(k) for k in range(vector.size())])
