"""Accelerations and constraint forces by source: sources side by side, solved for at once.

Coordinates respond to forces freely, or under constraints A qd = 0 that they must keep.

With constraints each source x solves

    [M  -A^T; A  0] [qdd_x; lambda_x] = [F_x; b_x]      b = -dA/dt qd for the constraints' own source, else 0

in the null space of A: with qd = G yd of the independent coordinates y and A beta = b,

    qdd_x = G (G^T M G)^-1 G^T (F_x - M beta_x) + beta_x      A^T lambda_x = M qdd_x - F_x
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol

import numpy as np

from ..answers.inertia_solve import solve_inertia_columns
from ..arrays.backend import ArrayBackend
from ..chosen_names import short
from ..constraints.closed_places import ClosedPlace, tie_forces
from ..constraints.robot_constraints import Constraints, TiedRobot
from ..interface import Numbers
from ..kinematics.frame_answers import LINKS, frame_index, vectors_beside
from ..quantities import InducedAccelerations
from ..structure import Structure
from .source_forces import AppliedLoads, SourceForces, loads_of, source_forces, with_actuators


class DrivenRobot(TiedRobot, Protocol):
    """Attributes of a robot that induced accelerations need."""

    @property
    def name(self) -> str:
        """Name of the robot's package."""

    @property
    def constraints(self) -> Constraints[Any]:
        """Constraints of the robot's file."""


@dataclass(frozen=True)
class FreeResponse:
    """Response of an open tree to forces: M qdd = F."""

    structure: Structure
    mass: Numbers

    def accelerations(self, forces: Numbers) -> Numbers:
        """Return the accelerations (..., n, X) that columns of forces (..., n, X) cause."""
        return solve_inertia_columns(self.mass, forces, self.structure.joint_names)

    def actuator_torques(self, forces: Numbers) -> Numbers:
        """Return the torques of the actuators that carry forces (..., n, X): all of them."""
        return forces

    def of_velocities(self) -> Numbers:
        """Return the accelerations of the constraints' own source, by cause (..., n, n): zeros."""
        return 0.0 * self.mass

    def reactions(self, forces: Numbers | None, accelerations: Numbers) -> Numbers:
        """Raise ValueError: nothing reacts."""
        raise ValueError(
            f"nothing reacts on {self.structure.name}: it has no constraints; give some, such as "
            "robot.constrained(contacts=...)"
        )


@dataclass(frozen=True)
class TiedResponse:
    """Response of coordinates to forces under constraints."""

    backend: ArrayBackend
    mass: Numbers
    constraints: Constraints[Any]
    place: ClosedPlace
    bias: Numbers
    """Accelerations beta by cause, (..., n, n)."""

    def accelerations(self, forces: Numbers) -> Numbers:
        """Return the accelerations (..., n, X) that columns of forces (..., n, X) cause."""
        g = self.place.found.map
        projected = g.mT @ self.mass @ g
        return g @ solve_inertia_columns(projected, g.mT @ forces, self.constraints.independent)

    def actuator_torques(self, forces: Numbers) -> Numbers:
        """Return the torques of actuators at independent joints that carry forces (..., n, X)."""
        own = np.eye(self.mass.shape[-1])[:, list(self.constraints.ties.chosen.independent)]
        return self.backend.constant(own, self.mass) @ (self.place.found.map.mT @ forces)

    def of_velocities(self) -> Numbers:
        """Return the accelerations of the constraints' own source, by cause (..., n, n)."""
        return self.bias - self.accelerations(self.mass @ self.bias)

    def reactions(self, forces: Numbers | None, accelerations: Numbers) -> Numbers:
        """Return lambda (..., C, X), for columns of forces, or None, and their accelerations."""
        torque = self.mass @ accelerations
        return tie_forces(self.place.found, torque if forces is None else torque - forces)


@dataclass(frozen=True)
class FunctionResponse:
    """Response of coordinates to forces under constraints, as a back end's own functions answer it."""

    response: Numbers
    """G (G^T M G)^-1 G^T, (..., n, n)."""
    by_forces: Numbers
    """Forces of rows by forces on the joints, (..., C, n)."""
    by_velocity: Numbers
    """Accelerations of the constraints' own source, by cause (..., n, n)."""
    borne: Numbers
    """Forces of rows by this source, (..., C, n)."""

    def accelerations(self, forces: Numbers) -> Numbers:
        """Return the accelerations (..., n, X) that columns of forces (..., n, X) cause."""
        return self.response @ forces

    def of_velocities(self) -> Numbers:
        """Return the accelerations of the constraints' own source, by cause (..., n, n)."""
        return self.by_velocity

    def reactions(self, forces: Numbers | None, accelerations: Numbers) -> Numbers:
        """Return lambda (..., C, X), for columns of forces, or None for the constraints' own source."""
        return self.borne if forces is None else self.by_forces @ forces


Response = FreeResponse | TiedResponse | FunctionResponse


def response_of(
    backend: ArrayBackend, constraints: Constraints[Any] | None, q: Numbers, qd: Numbers, mass: Numbers
) -> Response:
    """Return how coordinates respond at a state that has been read, with these constraints or none."""
    if constraints is None:
        return FreeResponse(backend.structure, mass)
    place = constraints.ties.place(backend, q)
    return TiedResponse(backend, mass, constraints, place, place.bias_by_cause(place.velocity(place.own(qd))))


def constraints_of(robot: DrivenRobot, given: object) -> Constraints[Any] | None:
    """Return the constraints of a motion: those given, or the robot's own; None where there are none.

    given: False for none, None for the robot's own
    Raises TypeError for what is not constraints, and ValueError for those of another robot.
    """
    if given is False:
        return None
    if given is not None:
        if not isinstance(given, Constraints):
            raise TypeError(
                f"constraints is {short(given)}; give what robot.constrained(...) makes, or False"
            )
        if not given.are_of(robot):
            raise ValueError(
                f"constraints are of another robot than this {robot.name} on {robot.backend.name}; make them "
                "by its own constrained(...)"
            )
        return given
    return robot.constraints if robot.backend.ties_joints else None


CENTRE_OF_MASS = "centre of mass"
"""Name that `frame` has for the centre of mass; a frame of this name comes first."""


class Driven(NamedTuple):
    """Arguments of `Dynamics.induced_accelerations`."""

    q: object
    qd: object
    tau: object
    qdd: object
    loads: object
    passive: bool
    constraints: object


class DrivenSources(NamedTuple):
    """Motion, the forces of all sources, and the response to them."""

    backend: ArrayBackend
    q: Numbers
    qd: Numbers
    point: dict[str, Numbers]
    """Point of the frame that is asked for, in as many samples; empty where none is given."""
    forces: SourceForces
    response: Response
    loads: AppliedLoads
    pulls: list[list[Numbers]]
    """Torques (..., n) that joints need for each force and moment of each load."""


def induced_accelerations(
    robot: DrivenRobot, asked: Driven, frame: object, point: object
) -> InducedAccelerations[Any]:
    """Return the answer of `Dynamics.induced_accelerations`."""
    if frame is None and point is not None:
        raise ValueError("point is given without the frame that it is a point of; give frame too")
    at = driven_sources(robot, asked, point)
    by_velocity = at.response.of_velocities()
    moved = at.forces.split(at.response.accelerations(at.forces.columns))
    shares: InducedAccelerations[Any] = InducedAccelerations(*[*moved, by_velocity, 0.0 * by_velocity])
    if frame is None:
        return shares
    return shares.mapped(*_jacobians(at, frame), at.qd)


def induced_reactions(robot: DrivenRobot, asked: Driven) -> InducedAccelerations[Any]:
    """Return the answer of `Dynamics.induced_reactions`."""
    at = driven_sources(robot, asked, None)
    by_velocity = at.response.reactions(None, at.response.of_velocities())
    moved = at.response.reactions(at.forces.columns, at.response.accelerations(at.forces.columns))
    return InducedAccelerations(*[*at.forces.split(moved), by_velocity, 0.0 * by_velocity])


def driven_sources(robot: DrivenRobot, asked: Driven, point: object = None) -> DrivenSources:
    """Return motion, forces and response; raises as `Dynamics.induced_accelerations` does."""
    tau, qdd = asked.tau, asked.qdd
    if (tau is None) == (qdd is None):
        raise TypeError(
            "give tau, the torques of the actuators, or qdd, the acceleration that they are to give: one of "
            "the two"
        )
    named = {"q": asked.q, "qd": asked.qd} | ({"qdd": qdd} if tau is None else {"tau": tau})
    loads, points = loads_of(robot.backend, asked.loads), vectors_beside({"point": point})
    backend, (q, qd, last, *vectors) = robot.door.read(named, beside={**loads.beside, **points})
    constraints = constraints_of(robot, asked.constraints)
    pulls = loads.torques_by_frame(backend, q, vectors[: len(loads.beside)])
    found = None if constraints is None or tau is None else _by_functions(constraints, asked, backend, q, qd)
    place = None if constraints is None or found is not None else constraints.ties.place(backend, q)
    if found is not None:
        qd = found[0]
    elif place is not None:
        qd = place.velocity(place.own(qd))
    others = source_forces(backend, q, qd, [sum(parts, 0.0 * q) for parts in pulls], asked.passive)
    if found is not None:
        response: Response = FunctionResponse(*found[1:])
    elif constraints is not None and place is not None:
        response = TiedResponse(backend, others.mass, constraints, place, place.bias_by_cause(qd))
    else:
        response = FreeResponse(robot.structure, others.mass)
    if tau is None and not isinstance(response, FunctionResponse):
        if place is not None:
            last = place.velocity(place.own(last)) + place.bias(qd)
        needed = (others.mass @ last[..., None])[..., 0] - others.columns.sum(-1)
        last = response.actuator_torques(needed[..., None])[..., 0]
    identity = backend.constant(np.eye(robot.n), q)
    placed = dict(zip(points, vectors[len(loads.beside) :], strict=True))
    forces = with_actuators(others, last, identity)
    return DrivenSources(backend, q, qd, placed, forces, response, loads, pulls)


def _by_functions(
    constraints: Constraints[Any], asked: Driven, backend: ArrayBackend, q: Numbers, qd: Numbers
) -> Sequence[Numbers] | None:
    """Return velocities that follow, and the response, of the back end's own functions; None without any."""
    functions = constraints.ties.functions(backend)
    call = "response" if asked.passive else "response_of_links"
    return None if functions is None else functions.answer(call, [q, qd])


def _jacobians(at: DrivenSources, frame: object) -> tuple[Numbers, Numbers]:
    frames, motion = at.backend.frames, [at.q, at.qd]
    if isinstance(frame, str) and frame == CENTRE_OF_MASS and frame not in frames.names:
        if at.point:
            raise ValueError("point is given for the centre of mass, which has none; leave it away")
        return (
            frames.answer("centre_of_mass_jacobian", motion[:1], LINKS),
            frames.answer("centre_of_mass_jacobian_rate", motion, LINKS),
        )
    number = frame_index(frame, frames.names)
    return (
        frames.answer("jacobian", motion[:1], number, at.point),
        frames.answer("jacobian_rate", motion, number, at.point),
    )
