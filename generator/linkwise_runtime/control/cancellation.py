"""Controllers that cancel chosen motion propagation torques."""

from collections.abc import Iterable
from typing import Any, Generic, cast

import numpy as np

from ..arrays.backend import ArrayBackend
from ..constraints.closed_places import times
from ..interface import Array
from ..motion.induced_accelerations import DrivenRobot
from .controller import Controller, Given, Made, Need, Stance, StanceRead, errors_of, standing_of
from .gains import TargetShares
from .joint_impedance import ORDERS, JointTargets, cancelled_motions, friction_width_of


class Cancellation(Controller, Generic[Array]):
    """Controller that cancels chosen motion propagation torques and leaves the others; see `Dynamics.cancel`.

    It returns u = tau + the sum over the cancelled c_m,ijk q_k^(m) + g, and the joints' own torques as
    `partial_impedance` compensates them. Under u the robot obeys

        (M - M_S) qdd + (C - C_S) qd = tau + f

    with S for what is cancelled, and under ties along all motions that these leave. Arguments, batches and
    errors are as for `PartialImpedance`.
    """

    entries: tuple[tuple[str, str, str, int], ...]
    """Names of joint, link and coordinate, and the order, of each torque that is cancelled."""

    def __init__(
        self,
        robot: DrivenRobot,
        standing: StanceRead,
        targets: JointTargets,
        entries: tuple[tuple[str, str, str, int], ...],
        made: Made,
    ) -> None:
        super().__init__(robot, standing, targets, None, made)
        self.entries = entries

    def __repr__(self) -> str:
        return f"<{len(self.entries)} motion propagation torques of {self._about()} cancelled>"

    def __call__(
        self,
        q: Array,
        qd: Array,
        tau: Array | None = None,
        external: Array | None = None,
        qdd: Array | None = None,
    ) -> Array:
        """Return the torque u of the actuators, (..., n), in N m or N.

        tau: torques that the task asks for, (..., n); zero unless given
        qdd: acceleration at which the cancelled torques are taken, measured or wanted; unless given, the one
        that follows. With all torques cancelled and a wanted acceleration, this is computed torque control,
        except for armature, which belongs to no link.
        """
        backend, given = self._given(q, qd, tau, external, qdd)
        torque = self._torque_of_one(backend, given)
        if torque is not None:
            return cast("Array", torque)
        if self._grips and qdd is not None:
            raise ValueError(
                "qdd is given, but what contacts bear depends on the acceleration that follows; leave it "
                "out, or the grips"
            )
        return cast("Array", self._torque(self._followed(backend, given, bool(self._grips))))

    def acceleration(
        self, q: Array, qd: Array, tau: Array | None = None, external: Array | None = None
    ) -> Array:
        """Return the acceleration qdd that follows, (..., n), in rad/s^2 or m/s^2."""
        backend, given = self._given(q, qd, tau, external)
        found = self._acceleration_of_one(backend, given)
        return cast("Array", self._moved(self._followed(backend, given)) if found is None else found)

    def forces(self, q: Array, qd: Array, tau: Array | None = None, external: Array | None = None) -> Array:
        """Return the forces lambda of ties and contacts that follow, (..., C), as `Constraints` has them."""
        backend, given = self._given(q, qd, tau, external)
        found = self._forces_of_one(backend, given)
        return cast("Array", self._borne(self._followed(backend, given, True)) if found is None else found)

    def _followed(self, backend: ArrayBackend, given: Given, whole: bool = False) -> Need:
        """Return what the acceleration that follows, or one that is given, needs of the joints.

        whole: whether what ties bear is asked for, which tau + M_S qdd + C_S qd + g + p leaves out
        """
        state, given = self._state(backend, given)
        qdd = given.get("qdd")
        follows = qdd is None
        if qdd is None:
            qdd = self._joints.acceleration(backend, state, errors_of(given))
        if whole:
            return Need(backend, state, self._joints.torque(state, qdd, given.get("external")), qdd)
        # tau + M_S qdd + C_S qd + g + p
        cancelled = times(state.inertia - state.target_inertia, qdd)
        cancelled = cancelled + times(state.coriolis - state.target_damping, given["qd"]) + state.rest
        torque = cancelled + given["task"] if "task" in given else cancelled
        return Need(backend, state, torque, qdd if follows else None)

    def _given(
        self, q: object, qd: object, tau: object, external: object, qdd: object = None
    ) -> tuple[ArrayBackend, Given]:
        return self._arrays(q, qd, {"task": tau, "external": external, "qdd": qdd})


def cancellation(
    robot: DrivenRobot,
    stance: Stance,
    entries: Iterable[object],
    passive: bool,
    friction_width: float | None,
) -> Cancellation[Any]:
    """Return the controller of `Dynamics.cancel`."""
    structure, on = robot.structure, standing_of(robot, stance)
    chosen = cancelled_motions(entries, structure)
    kept = {order: np.ones((structure.n, structure.N, structure.n)) for order in ORDERS}
    for i, j, k, order in chosen:
        kept[order][i, j, k] = 0.0
    acceleration, velocity = (TargetShares(kept[m], None, None, False, False) for m in (2, 1))
    width = friction_width_of(friction_width, passive)
    targets = JointTargets(acceleration, velocity, None, False, bool(passive), width)
    names = structure.joint_names, structure.link_names
    named = tuple((names[0][i], names[1][j], names[0][k], m) for i, j, k, m in chosen)
    return Cancellation(robot, on, targets, named, ("cancel", (named, passive, friction_width, *stance)))
