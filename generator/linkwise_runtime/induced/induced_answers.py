"""The calls for induced accelerations behind their face: motion is checked, sources are solved for."""

from typing import Any

import numpy as np

from ..arguments import check_numbers
from ..motion_quantities import InducedAccelerations
from .responses import Response, accelerating, constraints_of, following, response_of
from .source_forces import SourceForces, listed, source_forces, with_actuators

CENTRE_OF_MASS = "centre of mass"
"""What `frame` says for it; a frame of this name comes first."""


class InducedAnswers:
    """The calls of a robot on any back end; arguments as `MotionCalls` says."""

    def __init__(self, robot: Any) -> None:
        self._robot = robot

    def accelerations(
        self,
        q: Any,
        qd: Any,
        tau: Any,
        qdd: Any,
        loads: Any,
        passive: bool,
        frame: Any,
        point: Any,
        constraints: Any,
    ) -> InducedAccelerations[Any]:
        """See `MotionCalls.induced_accelerations`."""
        if frame is None and point is not None:
            raise ValueError("point is given without the frame that it is a point of; give frame too")
        q, qd, forces, response = self._sources(q, qd, tau, qdd, loads, passive, constraints)
        by_velocity = response.of_velocities()
        moved = forces.split(response.accelerations(forces.columns))
        shares: InducedAccelerations[Any] = InducedAccelerations(*[*moved, by_velocity, 0.0 * by_velocity])
        if frame is None:
            return shares
        seen: InducedAccelerations[Any] = shares.mapped(*self._jacobians(q, qd, frame, point), qd)
        return seen

    def reactions(
        self, q: Any, qd: Any, tau: Any, qdd: Any, loads: Any, passive: bool, constraints: Any
    ) -> InducedAccelerations[Any]:
        """See `MotionCalls.induced_reactions`."""
        q, qd, forces, response = self._sources(q, qd, tau, qdd, loads, passive, constraints)
        by_velocity = response.reactions(0.0, response.of_velocities())
        moved = response.reactions(forces.columns, response.accelerations(forces.columns))
        return InducedAccelerations(*[*forces.split(moved), by_velocity, 0.0 * by_velocity])

    def _sources(
        self, q: Any, qd: Any, tau: Any, qdd: Any, loads: Any, passive: bool, constraints: Any
    ) -> tuple[Any, Any, SourceForces, Response]:
        """Motion in one shape, the forces of all sources, and what answers to them."""
        if (tau is None) == (qdd is None):
            raise TypeError(
                "give tau, the torques of the actuators, or qdd, the acceleration that they are to give: one "
                "of the two"
            )
        named = {"q": q, "qd": qd} | ({"qdd": qdd} if tau is None else {"tau": tau})
        q, qd, last = self._robot.backend.arrays(named, self._robot.n)
        if self._robot.check_finite:
            check_numbers(named, self._robot.joint_names)
        constraints = constraints_of(self._robot, constraints)
        qd = following(self._robot, constraints, q, qd)
        others = source_forces(self._robot, q, qd, listed(loads), passive)
        response = response_of(self._robot, constraints, q, qd, others.mass)
        if tau is None:
            last = accelerating(self._robot, constraints, q, qd, last)
            asked = (others.mass @ last[..., None])[..., 0] - others.columns.sum(-1)
            last = response.needed(asked[..., None])[..., 0]
        return q, qd, with_actuators(others, last, self._diagonal(q)), response

    def _diagonal(self, q: Any) -> Any:
        return self._robot.backend.side(q).constant(np.eye(self._robot.n), q)

    def _jacobians(self, q: Any, qd: Any, frame: Any, point: Any) -> tuple[Any, Any]:
        kinematics = self._robot.kinematics
        if isinstance(frame, str) and frame == CENTRE_OF_MASS and frame not in kinematics.frames:
            if point is not None:
                raise ValueError("point is given for the centre of mass, which has none; leave it away")
            return kinematics.centre_of_mass_jacobian(q), kinematics.centre_of_mass_jacobian_rate(q, qd)
        return kinematics.jacobian(q, frame, point), kinematics.jacobian_rate(q, qd, frame, point)
