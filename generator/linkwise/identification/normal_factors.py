"""Least squares of a long log in one pass: each joint's equations reduced by QR to a triangle.

Row s of joint i is  [Y1_i | F_i | tau_i]  with the base columns Y1 and F_i the load on it by every joint's
friction: qd_i, sign(qd_i) in its own columns where joints are free. Of A = Q R, a fit needs R alone:
||A x|| = ||R x||. So blocks of a log are stacked below the present triangle and reduced again.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from linkwise.analysis.filtering import derivatives
from linkwise.analysis.settings import Processing
from linkwise.arrays import Array
from linkwise.identification.base_parameters import BaseParameters
from linkwise.identification.bearings import Bearings
from linkwise.identification.torque_log import TorqueLog
from linkwise.progress import Progress

NUMBERS = 1 << 23
"""Numbers in the regressors of one block."""


@dataclass(frozen=True)
class JointEquations:
    """Triangles (n, base + 2 B + 1, base + 2 B + 1) of equations, and how many rows each stands for.

    n here and below are the joints whose torques are measured, in the robot's order, B those of `Bearings`.
    """

    triangles: Array
    rows: int

    def errors(self, beta: Array, friction: Array) -> Array:
        """Return the root mean square error of each joint, (n,), for beta (base,) and friction (B, 2)."""
        residuals = self.triangles @ np.concatenate([beta, friction.reshape(-1), [-1.0]])
        found: Array = np.linalg.norm(residuals, axis=1) / np.sqrt(max(self.rows, 1))
        return found

    def sizes(self) -> Array:
        """Return the root mean square torque of each joint, (n,)."""
        found: Array = np.linalg.norm(self.triangles[:, :, -1], axis=1) / np.sqrt(max(self.rows, 1))
        return found


def joint_equations(
    log: TorqueLog,
    span: tuple[int, int],
    bearings: Bearings,
    base: BaseParameters,
    processing: Processing,
    progress: Progress,
) -> JointEquations:
    """Return the equations of samples span[0] to span[1] - 1.

    The torques of a joint's own spring and armature are known, and subtracted; friction is identified anew.
    """
    robot = bearings.robot
    n, columns, start = log.q.shape[1], base.combinations.shape[1], span[0]
    size = base.count + 2 * len(bearings.joints) + 1
    triangles = np.zeros((len(log.measured), size, size))
    picked = np.array(base.picked, dtype=np.intp)
    for first, last in _blocks(span, max(1, NUMBERS // (n * columns))):
        q, qd, qdd = derivatives(log.q, log.rate, first, last, processing)
        if robot.constrained is not None:
            q, qd, qdd = robot.constrained.consistent(q, qd, qdd)
        spring, _, _, armature = robot.model.passive_torque(q, qd, qdd)
        torque = log.torque[first:last] - (spring + armature)[:, list(log.measured)]
        y = robot.model.regressor(q, qd, qdd).reshape(last - first, n, columns)
        rubbed = bearings.columns(q, qd).reshape(last - first, len(log.measured), -1)
        for at, i in enumerate(log.measured):
            own = y[:, i, picked], rubbed[:, at], torque[:, at : at + 1]
            stacked = np.concatenate([triangles[at], np.concatenate(own, axis=1)])
            triangles[at] = np.linalg.qr(stacked, mode="r")
        progress("fitting", last - start, span[1] - start)
    return JointEquations(triangles, span[1] - start)


def _blocks(span: tuple[int, int], rows: int) -> Iterator[tuple[int, int]]:
    for at in range(*span, rows):
        yield at, min(at + rows, span[1])
