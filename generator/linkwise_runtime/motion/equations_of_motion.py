"""The equations of motion as rates of a state, of an open tree or with constraints, and their energy.

State (q, v, W): v = qd, or with constraints those of the independent joints, and the work W that was done:

    dq/dt = qd    dv/dt = qdd (ydd)    dW/dt = qd . (tau - sum_e load torque_e - damping - friction)

With constraints the dependent joints of every q are closed first, by Newton's method from where they are, and
qd = G v: they do not drift.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..answers.namespace import array_of, hidden
from ..arguments import NOTHING, Beside
from ..arrays.array_backend import ArrayBackend
from ..chosen_names import listed, sample_of
from ..constraints.closed_places import ClosedPlace
from ..constraints.independent_joints import least_left, why_not_following
from ..constraints.tied_joints import TiedJoints, without_gradient
from ..interface import Numbers
from .source_forces import AppliedLoads, loads_of

HALVES = 30
"""Of the way to a position that does not close, to find how far it goes."""
DEAD = 1e-3
"""Joints are at a dead point where no more is left of columns of A_d than this part of that at the start."""
LEAP = 0.5
"""rad and m: joints that go farther from one place to the next have left the motion."""
NEAR = 10.0
"""So many times as much is left where the last position beside a dead point closes."""


class TiedMotion:
    """Places along a motion; the last one is kept, for a step begins where the one before ended."""

    def __init__(self, ties: TiedJoints, engine: ArrayBackend, start: ClosedPlace) -> None:
        """`start` is also where contacts took hold."""
        self._ties, self._engine, self._held_at = ties, engine, start.q
        self._last: tuple[Numbers, ClosedPlace] = start.q, start
        self._dead = 0.0 if hidden(start.q) else DEAD * float(least_left(start.triangle).min(initial=1.0))

    def place(self, t: float, q: Numbers) -> ClosedPlace:
        """The place beside q (..., n), whose dependent joints are closed first.

        Raises ValueError, with the time, where they cannot be closed, or independent joints go no further.
        """
        asked, place = self._last
        if asked is q:
            return place
        try:
            found = self._ties.closed_place(self._engine, q, self._held_at)
        except ValueError as error:
            with without_gradient(q):
                reason = self._leap(q) or self._dead_point(self._furthest(self._last[1], q), NEAR)
            raise ValueError(f"at t = {t:g} s {reason or error}") from None
        reason = self._dead_point(found)
        if reason is not None:
            raise ValueError(f"at t = {t:g} s {reason}")
        self._last = q, found
        return found

    def settled(self, t: float, q: Numbers) -> Numbers:
        """q with its dependent joints where the constraints want them."""
        place = self.place(t, q)
        self._last = place.q, place
        return place.q

    def accelerated(self, t: float, q: Numbers, qd: Numbers, tau: Numbers, passive: bool) -> Numbers:
        """Accelerations of the independent joints."""
        place = self.place(t, q)
        return self._ties.acceleration(self._engine, place, qd, tau, passive)

    def _leap(self, q: Numbers) -> str | None:
        """That independent joints leap away from where they were; None where they do not."""
        place = self._last[1]
        if hidden(q):
            return None
        far = np.abs(array_of(place.own(q - place.q)))
        if not far.max(initial=0.0) > LEAP:
            return None
        joint = self._ties.independent[int(far.reshape(-1, far.shape[-1]).max(0).argmax())]
        return (
            f"{joint} leaps by {far.max():.3g}: take smaller steps, or look at the torques; next to a "
            "singular mass matrix, as of a base pitched by 90 degrees, accelerations have no bound"
        )

    def _furthest(self, place: ClosedPlace, q: Numbers) -> ClosedPlace:
        """The last place that closes on the straight way of the independent joints."""
        way, reached = q - place.q, 0.0
        for k in range(1, HALVES):
            tried = reached + 0.5**k
            # Others start from the last place that closed, not from far along the way.
            mover = place.velocity(place.own(way)) * (tried - reached)
            try:
                place = self._ties.closed_place(self._engine, place.q + mover, self._held_at)
            except ValueError:
                continue
            reached = tried
        return place

    def _dead_point(self, place: ClosedPlace, near: float = 1.0) -> str | None:
        """Why independent joints go no further than a place; None where they do."""
        if hidden(place.q):
            return None
        left = least_left(place.triangle)
        if not left.min(initial=1.0) < near * self._dead:
            return None
        at = np.unravel_index(left.argmin(), left.shape)
        values = array_of(place.rows[at])
        own, names = self._ties.independent, self._engine.structure.joint_names
        told = why_not_following(values.astype(float), place.found.columns, NEAR * self._dead, names, "")
        go = "goes" if len(own) == 1 else "go"
        return f"{listed(own)} {go} no further{sample_of([int(k) for k in at])}: {told}"


Given = Callable[[float, Numbers, Numbers], object]
"""What somebody gives by time, position and velocity."""


class State(NamedTuple):
    """Of one instant, or rates of it."""

    q: Numbers
    """(..., n)."""
    v: Numbers
    """(..., n), or (..., m) of the independent joints."""
    work: Numbers
    """(...)."""


class ReadLoads(NamedTuple):
    """Loads, and their vectors as they were read."""

    loads: AppliedLoads
    vectors: Sequence[Numbers]


@dataclass(frozen=True)
class EquationsOfMotion:
    """Those of a robot on one back end."""

    engine: ArrayBackend
    tau: Numbers | Given
    """Torques (..., n), or what gives them."""
    loads: ReadLoads | Given
    """Loads, or what gives them."""
    passive: bool
    ties: TiedMotion | None
    """None for an open tree."""

    def motion(self, t: float, state: State) -> tuple[Numbers, Numbers]:
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
        if not self.passive:
            return State(qd, self._accelerated(t, state.q, q, qd, given, False), (qd * given).sum(-1))
        spring, damping, friction, _ = self.engine.answers.passive_torque(q, qd, 0.0 * qd)
        work = (qd * (given - damping - friction)).sum(-1)
        if any(self.engine.structure.passive_sums.armature):
            return State(qd, self._accelerated(t, state.q, q, qd, given, True), work)
        left = given - spring - damping - friction
        return State(qd, self._accelerated(t, state.q, q, qd, left, False), work)

    def _accelerated(
        self, t: float, asked: Numbers, q: Numbers, qd: Numbers, given: Numbers, passive: bool
    ) -> Numbers:
        """Accelerations of all joints, or of the independent ones at the place that `asked` leads to."""
        if self.ties is not None:
            return self.ties.accelerated(t, asked, qd, given, passive)
        answers = self.engine.answers
        solve = answers.forward_dynamics if passive else answers.forward_dynamics_of_links
        return solve(q, qd, given)[0]

    def settled(self, t: float, state: State) -> State:
        """The same state with its dependent joints where the constraints want them."""
        return state if self.ties is None else state._replace(q=self.ties.settled(t, state.q))

    def torques(self, t: float, q: Numbers, qd: Numbers) -> Numbers:
        """What the actuators give, (..., n)."""
        if not callable(self.tau):
            return self.tau
        (tau,) = read_at(self.engine, q, {"tau": self.tau(t, q, qd)})
        return tau

    def load_torque(self, t: float, q: Numbers, qd: Numbers) -> Numbers | None:
        """What loads ask of the joints, (..., n); None for none."""
        found = self.loads
        if callable(found):
            loads = loads_of(self.engine, found(t, q, qd))
            found = ReadLoads(loads, read_at(self.engine, q, {}, loads.beside))
        torques = found.loads.torques(self.engine, q, found.vectors)
        return sum(torques[1:], torques[0]) if torques else None

    def energy(self, q: Numbers, qd: Numbers) -> Numbers:
        """That of links, springs and armature, (...)."""
        total = _conserved(self.engine, q, qd).sum(-1)
        if self.passive:
            sums = self.engine.structure.passive_sums
            stiffness, pull, armature = (
                self.engine.constant(a, q) for a in (sums.stiffness, sums.pull, sums.armature)
            )
            total = total + ((stiffness * q / 2.0 + pull) * q + armature * qd * qd / 2.0).sum(-1)
        return total


def read_at(
    engine: ArrayBackend, q: Numbers, named: Mapping[str, object], beside: Mapping[str, Beside] = NOTHING
) -> list[Numbers]:
    """What somebody gave at an instant, as q (..., n) is: by then it is settled how many motions there are.

    Raises ValueError for what is of more samples, and as `arrays` does.
    """
    at, *read = engine.arrays({"q": q, **named}, q.shape[-1], beside)
    if at.shape != q.shape:
        raise ValueError(
            f"{', '.join((*named, *beside))}: {tuple(at.shape[:-1])} samples are more than the "
            f"{tuple(q.shape[:-1])} of q and qd; give these as many from the start"
        )
    return [engine.weights(name, a, q) for name, a in zip((*named, *beside), read, strict=True)]


def _conserved(engine: ArrayBackend, q: Numbers, qd: Numbers) -> Numbers:
    """qd . dK/dqd - K + P of each link, which nothing but torques and loads changes: K + P of rigid links.

    With K = K2 + K1 + K0 by its order in qd it is K2 - K0 + P.
    """
    kinetic, potential = engine.answers.energy(q, qd)
    if engine.tree is not None:
        return kinetic + potential
    back, rest = (engine.answers.energy(q, rate)[0] for rate in (-qd, 0.0 * qd))
    return (kinetic + back) / 2.0 - 2.0 * rest + potential
