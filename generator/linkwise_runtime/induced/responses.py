"""How coordinates answer to forces: freely, or with constraints A qd = 0 that they must keep.

With constraints each source x solves

    [M  -A^T; A  0] [qdd_x; lambda_x] = [F_x; b_x]      b = -dA/dt qd for the constraints' own source, else 0

in the null space of A: with qd = G yd of the independent coordinates y and A beta = b,

    qdd_x = G (G^T M G)^-1 G^T (F_x - M beta_x) + beta_x      A^T lambda_x = M qdd_x - F_x
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..chosen_names import short
from ..robot_constraints import Constraints
from ..sums.inertia_solve import solved_columns


@dataclass(frozen=True)
class FreeResponse:
    """Of an open tree: M qdd = F."""

    robot: Any
    q: Any
    mass: Any

    def accelerations(self, forces: Any) -> Any:
        """Of columns of forces (..., n, X)."""
        return solved_columns(self.mass, forces, self.robot.joint_names)

    def needed(self, forces: Any) -> Any:
        """Torques of the actuators that bear these (..., n, X): all of them."""
        return forces

    def of_velocities(self) -> Any:
        """Accelerations of the constraints' own source, by cause (..., n, n)."""
        return 0.0 * self.mass

    def reactions(self, forces: Any, accelerations: Any) -> Any:
        """Raises ValueError: nothing reacts."""
        raise ValueError(
            f"nothing reacts on {self.robot.name}: it has no constraints; give some, such as "
            "robot.constrained(contacts=...)"
        )


@dataclass(frozen=True)
class TiedResponse:
    """Of coordinates that keep constraints."""

    robot: Any
    q: Any
    mass: Any
    constraints: Any
    velocity_map: Any
    """G (..., n, m)."""
    bias: Any
    """beta by cause, (..., n, n)."""

    def accelerations(self, forces: Any) -> Any:
        """Of columns of forces (..., n, X)."""
        g = self.velocity_map
        projected = g.mT @ self.mass @ g
        return g @ solved_columns(projected, g.mT @ forces, self.constraints.independent)

    def needed(self, forces: Any) -> Any:
        """Torques of actuators at the independent joints that bear these (..., n, X)."""
        side = self.robot.backend.side(self.q)
        at = [self.robot.joint_index(name) for name in self.constraints.independent]
        return side.constant(np.eye(self.robot.n)[:, at], self.q) @ (self.velocity_map.mT @ forces)

    def of_velocities(self) -> Any:
        """Accelerations of the constraints' own source, by cause (..., n, n)."""
        return self.bias - self.accelerations(self.mass @ self.bias)

    def reactions(self, forces: Any, accelerations: Any) -> Any:
        """lambda (..., C, X), by columns of forces and what they accelerate."""
        return self.constraints.forces_of(self.q, self.mass @ accelerations - forces, by_link=True)


Response = FreeResponse | TiedResponse


def constraints_of(robot: Any, given: Any) -> Any:
    """What a motion keeps: that which is given, or the robot's own; None where it keeps nothing.

    Raises TypeError for what is no constraints, and ValueError for those of another robot.
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
    tree = robot.backend.tree
    return robot.constraints if tree is not None and tree.tied else None


def following(robot: Any, constraints: Any, q: Any, qd: Any) -> Any:
    """Velocities that keep the constraints, of which those of the independent joints are taken."""
    return qd if constraints is None else constraints.velocity(q, qd[..., _own(robot, constraints, q)])


def accelerating(robot: Any, constraints: Any, q: Any, qd: Any, qdd: Any) -> Any:
    """Accelerations that keep them, likewise."""
    if constraints is None:
        return qdd
    return constraints.acceleration(q, qd, qdd[..., _own(robot, constraints, q)])


def _own(robot: Any, constraints: Any, q: Any) -> Any:
    """Positions of the independent joints."""
    return robot.backend.index(np.array([robot.joint_index(name) for name in constraints.independent]), q)


def response_of(robot: Any, constraints: Any, q: Any, qd: Any, mass: Any) -> Response:
    """How a robot with these constraints answers at a state, None for an open tree."""
    if constraints is None:
        return FreeResponse(robot, q, mass)
    return TiedResponse(
        robot,
        q,
        mass,
        constraints,
        constraints.velocity_map(q),
        constraints.velocity_accelerations(q, qd),
    )
