"""Least squares of a long log in one pass: each joint's equations as the triangle that QR leaves of them.

Row s of joint i is  [Y1_i | qd_i, sign(qd_i) | tau_i]  with the base columns Y1. Of A = Q R, R alone says all
that a fit needs: ||A x|| = ||R x||. So blocks of a log are stacked on the triangle so far and made one again.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from linkwise.analysis.derivatives import derivatives
from linkwise.analysis.settings import Processing
from linkwise.identification.base_parameters import BaseParameters
from linkwise.identification.torque_log import TorqueLog
from linkwise.package.load import Array, Model
from linkwise.progress import Progress

NUMBERS = 1 << 23
"""Of a block's regressors."""


@dataclass(frozen=True)
class JointEquations:
    """Triangles (n, base + 3, base + 3) of equations, and how many rows each stands for.

    n here and below are the joints whose torques are measured, in the robot's order.
    """

    triangles: Array
    rows: int

    def errors(self, beta: Array, friction: Array) -> Array:
        """Root of the mean square error of each joint, (n,), for beta (base,) and friction (n, 2)."""
        unknowns = [np.concatenate([beta, own, [-1.0]]) for own in friction]
        residuals = [triangle @ x for triangle, x in zip(self.triangles, unknowns, strict=True)]
        found: Array = np.linalg.norm(residuals, axis=1) / np.sqrt(max(self.rows, 1))
        return found

    def sizes(self) -> Array:
        """Root of the mean square torque of each joint, (n,)."""
        n, base = len(self.triangles), self.triangles.shape[1] - 3
        return self.errors(np.zeros(base), np.zeros((n, 2)))


def joint_equations(
    log: TorqueLog,
    span: tuple[int, int],
    model: Model,
    base: BaseParameters,
    processing: Processing,
    progress: Progress,
) -> JointEquations:
    """Equations of samples span[0] to span[1] - 1.

    What a joint's own spring and armature take is known, and off; friction is found anew.
    """
    n, columns, start = log.q.shape[1], base.combinations.shape[1], span[0]
    triangles = np.zeros((len(log.measured), base.count + 3, base.count + 3))
    picked = np.array(base.picked, dtype=np.intp)
    for first, last in _blocks(span, max(1, NUMBERS // (n * columns))):
        q, qd, qdd = derivatives(log.q, log.rate, first, last, processing)
        known = model.passive_torque(q, qd, qdd)
        torque = log.torque[first:last] - (known.spring + known.armature)[:, list(log.measured)]
        y = model.regressor(q, qd, qdd).reshape(last - first, n, columns)
        for at, i in enumerate(log.measured):
            own = (
                y[:, i, picked],
                qd[:, i : i + 1],
                np.sign(qd[:, i : i + 1]),
                torque[:, at : at + 1],
            )
            stacked = np.concatenate([triangles[at], np.concatenate(own, axis=1)])
            triangles[at] = np.linalg.qr(stacked, mode="r")
        progress("fitting", last - start, span[1] - start)
    return JointEquations(triangles, span[1] - start)


def _blocks(span: tuple[int, int], rows: int) -> Iterator[tuple[int, int]]:
    for at in range(*span, rows):
        yield at, min(at + rows, span[1])
