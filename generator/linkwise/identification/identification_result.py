"""The result of `identify`."""

from dataclasses import dataclass

import numpy as np

from linkwise.analysis.opened_robot import OpenedRobot
from linkwise.arrays import Array
from linkwise.identification.base_parameters import BaseParameters
from linkwise.identification.bearings import Bearings, floating_coordinates
from linkwise.identification.fit import Fit
from linkwise.identification.normal_factors import JointEquations
from linkwise.identification.physical_fit import PhysicalFit
from linkwise.identification.torque_log import TorqueLog


@dataclass(frozen=True, eq=False)
class Identification:
    """Result of an identification: a robot's parameters by a log."""

    robot: OpenedRobot
    log: TorqueLog
    base: BaseParameters
    bearings: Bearings
    fit: Fit
    """Base parameters and friction, by weighted least squares."""
    physical: PhysicalFit
    """Every link's parameters, which a physical body can have."""
    own: Array
    """Parameters of the links in the package, (N, 10)."""
    seen: JointEquations
    unseen: JointEquations
    """Equations of the part of the log that was not fitted; `seen` are those of the part that was."""
    warnings: tuple[str, ...]

    @property
    def joints(self) -> tuple[str, ...]:
        """Joints whose torques are measured, in the robot's order: the joints of noise and errors."""
        return tuple(self.robot.joints[i] for i in self.log.measured)

    @property
    def followers(self) -> tuple[str, ...]:
        """Joints that follow these; their friction comes after that of these."""
        return tuple(self.robot.joints[i] for i in self.bearings.joints[len(self.log.measured) :])

    @property
    def unmeasured(self) -> tuple[str, ...]:
        """Joints whose torques are not measured, without those that follow."""
        return tuple(joint for joint in self.robot.driven_joints if joint not in self.joints)

    @property
    def floating(self) -> tuple[str, ...]:
        """Coordinates of a floating base whose torques are measured: without bearings, and friction."""
        floats = floating_coordinates(self.robot)
        return tuple(self.robot.joints[i] for i in self.log.measured if i in floats)

    @property
    def shared_friction(self) -> tuple[str, ...]:
        """Followers whose friction counts in that of other joints: no motion tells it from theirs."""
        if not self.bearings.rubs.any():
            return ()
        rubs = self.bearings.rubs[len(self.log.measured) :]
        return tuple(joint for joint, own in zip(self.followers, rubs, strict=True) if not own)

    @property
    def frictions(self) -> dict[str, Array]:
        """Viscous and Coulomb friction by joint, (2,) each: 0 where it counts in that of another joint.

        Joints whose friction was not fitted are left out.
        """
        fitted = zip((*self.joints, *self.followers), self.bearings.rubs, self.physical.friction, strict=True)
        found = {joint: own for joint, rubs, own in fitted if rubs or joint in self.shared_friction}
        for joint in self.robot.tree.joints if self.robot.tree else ():
            if self.robot.joints[joint.coordinate] in found:
                found.setdefault(joint.name, np.zeros(2))
        return found

    def errors(self, equations: JointEquations) -> dict[str, Array]:
        """Return the root mean square error of each joint's torque, (n,), by fit, bodies and package."""
        combinations, none = self.base.combinations, np.zeros_like(self.fit.friction)
        bodies = combinations @ self.physical.pi.reshape(-1)
        return {
            "fit": equations.errors(self.fit.beta, self.fit.friction),
            "bodies": equations.errors(bodies, self.physical.friction),
            "package": equations.errors(combinations @ self.own.reshape(-1), none),
        }
