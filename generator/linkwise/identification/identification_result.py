"""What `identify` found."""

from dataclasses import dataclass

import numpy as np

from linkwise.analysis.loaded_robot import LoadedRobot
from linkwise.identification.base_parameters import BaseParameters
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
    floating: tuple[str, ...]
    """Those coordinates of floating joints whose torques are measured: without bearings, and friction."""

    @property
    def joints(self) -> tuple[str, ...]:
        """Joints whose torques are measured, in the robot's order: those of fit, friction and errors."""
        return tuple(self.robot.joints[i] for i in self.log.measured)

    @property
    def unmeasured(self) -> tuple[str, ...]:
        """The other joints."""
        return tuple(joint for joint in self.robot.joints if joint not in self.joints)

    def errors(self, equations: JointEquations) -> dict[str, Array]:
        """Root mean square error of each joint's torque: of the fit, of its bodies, and of the package."""
        combinations, none = self.base.combinations, np.zeros_like(self.fit.friction)
        bodies = combinations @ self.physical.pi.reshape(-1)
        return {
            "fit": equations.errors(self.fit.beta, self.fit.friction),
            "bodies": equations.errors(bodies, self.physical.friction),
            "package": equations.errors(combinations @ self.own.reshape(-1), none),
        }
