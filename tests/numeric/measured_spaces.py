"""Impedances that are asked for and then measured: of planar3's joints, of Panda's, and of Panda's hand."""

from typing import Any

import numpy as np

from numeric.finite_rate import HandSpace, JointSpace
from numeric.impedance_fit import Impedance
from numeric.mujoco_plant import PANDA_AT_WORK

FREQUENCY = 10.0
"""rad/s, the natural one of what is asked for."""
RATIO = 0.7
"""Damping, in a ratio to critical."""
HAND = "panda_hand_tcp"
HAND_MASS = 3.0
"""kg, along x, y and z alike; at PANDA_AT_WORK the natural ones are from 0.8 to 5.6, by direction."""


def spring_and_damper(inertia: Any) -> Impedance:
    """Return the impedance of an inertia that moves at FREQUENCY and RATIO."""
    return Impedance(inertia, 2 * RATIO * FREQUENCY * inertia, FREQUENCY**2 * inertia)


def planar3_joints(package: Any) -> JointSpace:
    """Inertia stays, wherever the arm goes, what it is where the arm starts."""
    robot, start = package.load("native"), np.array([-1.0, 0.8, 0.6])
    wanted = spring_and_damper(robot.mass_matrix(start))
    return JointSpace(package, robot, robot.partial_impedance(*wanted), wanted, start, start + 0.4)


def panda_joints(package: Any) -> JointSpace:
    """Natural inertia with springs and dampers of each joint alone: no force needs to be measured."""
    robot, start = package.load("native"), PANDA_AT_WORK
    natural = robot.mass_matrix(start)
    wanted = spring_and_damper(np.diag(np.diag(natural)))
    controller = robot.partial_impedance(
        package.Natural(), package.Natural(plus=wanted.damping), wanted.stiffness
    )
    return JointSpace(
        package, robot, controller, wanted._replace(inertia=natural), start, start + 0.1, sensed=False
    )


def panda_hand(package: Any) -> HandSpace:
    """A hand that weighs the same in each direction."""
    wanted = spring_and_damper(HAND_MASS * np.eye(3))
    return _hand(package, wanted, True, *wanted)


def natural_hand(package: Any) -> HandSpace:
    """A hand as heavy as it is, on springs and dampers along x, y and z; no force is measured."""
    robot = package.load("native")
    jacobian = robot.kinematics.jacobian(PANDA_AT_WORK, HAND)[3:]
    natural = np.linalg.inv(jacobian @ np.linalg.inv(robot.mass_matrix(PANDA_AT_WORK)) @ jacobian.T)
    wanted = spring_and_damper(np.diag(np.diag(natural)))._replace(inertia=natural)
    return _hand(
        package, wanted, False, package.Natural(), package.Natural(plus=wanted.damping), wanted.stiffness
    )


def _hand(package: Any, wanted: Impedance, sensed: bool, *targets: Any) -> HandSpace:
    """Return the space of the hand; what the hand leaves free stays by a weak spring."""
    robot, start = package.load("native"), PANDA_AT_WORK
    natural = robot.mass_matrix(start)
    controller = robot.partial_impedance(
        damping=package.Natural(plus=10.0 * natural),
        stiffness=25.0 * natural,
        frame=package.FrameImpedance(HAND, *targets, rows=("x", "y", "z")),
    )
    return HandSpace(package, robot, controller, wanted, start, start + 0.1, HAND, sensed=sensed)
