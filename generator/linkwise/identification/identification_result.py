"""What `identify` found."""

from dataclasses import dataclass

import numpy as np

from linkwise.analysis.loaded_robot import LoadedRobot
from linkwise.identification.base_parameters import BaseParameters
from linkwise.identification.bearings import Bearings, floating_coordinates
from linkwise.identification.fit import Fit
from linkwise.identification.normal_factors import JointEquations
from linkwise.identification.physical_fit import PhysicalFit
from linkwise.identification.torque_log import TorqueLog
from linkwise.package.load import Array


@dataclass(frozen=True, eq=False)
class Identification:
    """What a log says of a robot."""

    robot: LoadedRobot
    log: TorqueLog
    base: BaseParameters
    bearings: Bearings
    fit: Fit
    """Base parameters and friction, by weighted least squares."""
    physical: PhysicalFit
    """Every link's parameters, such as a body can have."""
    own: Array
    """Those of the package, (N, 10)."""
    seen: JointEquations
    unseen: JointEquations
    """Equations of the part of the log that was fitted, and of the rest."""
    warnings: tuple[str, ...]

    @property
    def joints(self) -> tuple[str, ...]:
        """Joints whose torques are measured, in the robot's order: those of noise and errors."""
        return tuple(self.robot.joints[i] for i in self.log.measured)

    @property
    def followers(self) -> tuple[str, ...]:
        """Joints that follow these, whose friction stands behind theirs."""
        return tuple(self.robot.joints[i] for i in self.bearings.joints[len(self.log.measured) :])

    @property
    def unmeasured(self) -> tuple[str, ...]:
        """Joints whose torques are not measured, without those that follow."""
        return tuple(joint for joint in self.robot.driven_joints if joint not in self.joints)

    @property
    def floating(self) -> tuple[str, ...]:
        """Coordinates of a base that floats whose torques are measured: without bearings, and friction."""
        floats = floating_coordinates(self.robot)
        return tuple(self.robot.joints[i] for i in self.log.measured if i in floats)

    @property
    def shared_friction(self) -> tuple[str, ...]:
        """Followers whose friction counts in that of the others: no motion tells it from theirs."""
        if not self.bearings.rubs.any():
            return ()
        rubs = self.bearings.rubs[len(self.log.measured) :]
        return tuple(joint for joint, own in zip(self.followers, rubs, strict=True) if not own)

    @property
    def frictions(self) -> dict[str, Array]:
        """Viscous and Coulomb friction by joint, (2,) each: 0 where it counts in that of another joint.

        Joints of which none was fitted are not there.
        """
        fitted = zip((*self.joints, *self.followers), self.bearings.rubs, self.physical.friction, strict=True)
        found = {joint: own for joint, rubs, own in fitted if rubs or joint in self.shared_friction}
        for body in self.robot.bodies or ():
            if self.robot.joints[body.coordinate] in found:
                found.setdefault(body.joint, np.zeros(2))
        return found

    def errors(self, equations: JointEquations) -> dict[str, Array]:
        """Root mean square error of each joint's torque: of the fit, of its bodies, and of the package."""
        combinations, none = self.base.combinations, np.zeros_like(self.fit.friction)
        bodies = combinations @ self.physical.pi.reshape(-1)
        return {
            "fit": equations.errors(self.fit.beta, self.fit.friction),
            "bodies": equations.errors(bodies, self.physical.friction),
            "package": equations.errors(combinations @ self.own.reshape(-1), none),
        }
