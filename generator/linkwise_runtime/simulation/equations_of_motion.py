"""The equations of motion as rates of a state, of an open tree or with constraints, and their energy.

State (q, v, W): v = qd, or with constraints those of the independent joints, and the work W that was done:

    dq/dt = qd    dv/dt = qdd (ydd)    dW/dt = qd . (tau - sum_e load torque_e - damping - friction)

With constraints the dependent joints of every q are closed first, by Newton's method from where they are, and
qd = G v: they do not drift.
"""

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from ..arguments import check_axes, no_common_shape
from ..induced.source_forces import listed, load_torques
from .tied_motion import TiedMotion


class State(NamedTuple):
    """Of one instant, or rates of it."""

    q: Any
    """(..., n)."""
    v: Any
    """(..., n), or (..., m) of the independent joints."""
    work: Any
    """(...)."""


@dataclass(frozen=True)
class EquationsOfMotion:
    """Of a robot; `tau` and `loads` are functions of (t, q, qd), or torques (..., n) and a list of loads."""

    robot: Any
    tau: Any
    loads: Any
    passive: bool
    ties: TiedMotion | None
    """None for an open tree."""

    def motion(self, t: float, state: State) -> tuple[Any, Any]:
        """q and qd of all joints, which keep the constraints."""
        if self.ties is None:
            return state.q, state.v
        place = self.ties.place(t, state.q)
        return place.q, place.velocity(state.v)

    def rates(self, t: float, state: State) -> State:
        """Rates of a state."""
        q, qd = self.motion(t, state)
        tau, pull = self.torques(t, q, qd), self.load_torque(t, q, qd)
        given = tau if pull is None else tau - pull

        def accelerated(given: Any, passive: bool) -> Any:
            if self.ties is not None:
                return self.ties.accelerated(t, state.q, qd, given, passive)
            # its face does not answer for a robot whose ties are cut
            return self.robot._answers.forward_dynamics(q, qd, given, passive)

        if not self.passive:
            return State(qd, accelerated(given, False), (qd * given).sum(-1))
        spring, damping, friction, _ = self.robot.passive_torque(q, qd, 0.0 * qd)
        work = (qd * (given - damping - friction)).sum(-1)
        if any(self.robot.structure.passive_sums.armature):
            return State(qd, accelerated(given, True), work)
        left = given - spring - damping - friction
        return State(qd, accelerated(left, False), work)

    def settled(self, t: float, state: State) -> State:
        """The same state with its dependent joints where the constraints want them."""
        return state if self.ties is None else state._replace(q=self.ties.settled(t, state.q))

    def torques(self, t: float, q: Any, qd: Any) -> Any:
        """What the actuators give, (..., n)."""
        return checked_torques(self.robot, self.tau(t, q, qd), q) if callable(self.tau) else self.tau

    def load_torque(self, t: float, q: Any, qd: Any) -> Any:
        """What loads ask of the joints, (..., n); None for none."""
        given = self.loads(t, q, qd) if callable(self.loads) else self.loads
        torques = load_torques(self.robot, q, listed(given))
        return sum(torques) if torques else None

    def energy(self, q: Any, qd: Any) -> Any:
        """Of links, springs and armature, (...)."""
        total = _conserved(self.robot, q, qd).sum(-1)
        if self.passive:
            sums, side = self.robot.structure.passive_sums, self.robot.backend.side(q)
            stiffness, pull, armature = (
                side.constant(a, q) for a in (sums.stiffness, sums.pull, sums.armature)
            )
            total = total + ((stiffness * q / 2.0 + pull) * q + armature * qd * qd / 2.0).sum(-1)
        return total


def checked_torques(robot: Any, given: Any, q: Any) -> Any:
    """Torques of the shape and kind of q (..., n); raises ValueError for what does not fit."""
    tau = robot.backend.weights("tau", given, q)
    check_axes({"tau": tau}, robot.n)
    try:
        fits = np.broadcast_shapes(tuple(tau.shape), tuple(q.shape)) == tuple(q.shape)
    except ValueError:
        fits = False
    if not fits:
        raise no_common_shape({"q": q, "tau": tau}, robot.n)
    return tau + 0.0 * q


def _conserved(robot: Any, q: Any, qd: Any) -> Any:
    """qd . dK/dqd - K + P of each link, which nothing but torques and loads changes: K + P of rigid links.

    With K = K2 + K1 + K0 by its order in qd it is K2 - K0 + P.
    """
    energy = robot.energy(q, qd)
    if robot.backend.tree is not None:
        return energy.total
    back, rest = (robot.energy(q, rate).kinetic for rate in (-qd, 0.0 * qd))
    return (energy.kinetic + back) / 2.0 - 2.0 * rest + energy.potential
