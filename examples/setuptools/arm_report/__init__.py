"""Loads that one arm's joints bear, and through which link."""

import numpy as np

from arm_report import arm

_ROBOT = arm.load("numpy")


def shares(q: list[float], qd: list[float], qdd: list[float]) -> dict[tuple[str, str], float]:
    """N m on each joint through each link, by their names; the motion in rad, rad/s and rad/s^2."""
    tau = np.asarray(_ROBOT.partial_torque(q, qd, qdd))
    return {
        (joint, link): float(tau[i, j])
        for i, joint in enumerate(arm.joint_names)
        for j, link in enumerate(arm.link_names)
    }
