"""The result of `identify`."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any, cast

import numpy as np
from linkwise_runtime.certainty.share_variances import spread_of
from linkwise_runtime.certainty.uncertain_bodies import UncertainBodies

from linkwise.analysis.opened_robot import OpenedRobot
from linkwise.analysis.uncertain_file import UncertainRobot
from linkwise.arrays import Array
from linkwise.identification.base_parameters import BaseParameters
from linkwise.identification.bearings import Bearings, floating_coordinates
from linkwise.identification.fit import Fit
from linkwise.identification.normal_factors import JointEquations
from linkwise.identification.physical_fit import PhysicalFit
from linkwise.identification.torque_log import TorqueLog
from linkwise.identification.written_covariance import base_triangle, written_factor


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
    prior: UncertainRobot | None = None
    """Uncertainty of the package's own bodies; None where they count as certain."""

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

    @cached_property
    def uncertain_bodies(self) -> UncertainBodies:
        """Covariance of the identified links' parameters, for `uncertainty` of a robot that has them.

        It is that of `written_covariance`: what torques do not tell is as uncertain as the package's own
        bodies are said to be, and else counts as certain. Friction has no part in it.
        """
        prior = None
        if self.prior is not None and self.prior.bodies is not None:
            prior = spread_of(cast(Any, self.robot.model.backend), self.prior.bodies).factor
        return UncertainBodies(parameters=written_factor(self.fit, self.base, self.own, prior))

    @cached_property
    def leaning(self) -> tuple[str, ...] | None:
        """Partial torques that lean on masses which these torques do not tell, as JOINT/LINK.

        None where it is not clear which: a rank that rounding does not let be told.
        """
        try:
            known = self.robot.model.identifiability(self.joints)
        except ValueError:
            return None
        there, follows = known.shares["torque"]
        places = np.argwhere(there & ~follows).tolist()
        return tuple(f"{known.joints[i]}/{known.links[j]}" for i, j in places)

    @property
    def unbound_distance(self) -> float:
        """Distance of the physical bodies from the fit, in standard errors (Mahalanobis').

        Where it is 1 or more, conditions on bodies have moved them, and the fit's covariance is not quite
        theirs.
        """
        off = self.base.combinations @ self.physical.pi.reshape(-1) - self.fit.beta
        return float(np.linalg.norm(base_triangle(self.fit, self.base) @ off))

    def errors(self, equations: JointEquations) -> dict[str, Array]:
        """Return the root mean square error of each joint's torque, (n,), by fit, bodies and package."""
        combinations, none = self.base.combinations, np.zeros_like(self.fit.friction)
        bodies = combinations @ self.physical.pi.reshape(-1)
        return {
            "fit": equations.errors(self.fit.beta, self.fit.friction),
            "bodies": equations.errors(bodies, self.physical.friction),
            "package": equations.errors(combinations @ self.own.reshape(-1), none),
        }
