"""Equations of motion as rates of a state, for an open tree or with constraints, and their energy.

State (q, v, W): v = qd, or with constraints that of the independent joints, and W the work that was done:

    dq/dt = qd    dv/dt = qdd (ydd)    dW/dt = qd . (tau - sum_e load torque_e - damping - friction) + R

with R the power that links which were written by hand get otherwise than from joints.

With constraints the dependent joints of every q are closed first, by Newton's method from where they are, and
qd = G v, so that they do not drift.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..arguments import NOTHING, Beside
from ..arrays.backend import ArrayBackend
from ..chosen_names import listed, sample_of, short
from ..constraints.closed_places import ClosedPlace
from ..constraints.independent_joints import least_left, why_not_following
from ..constraints.tied_joints import TiedJoints, without_gradient
from ..interface import Numbers, array_of, is_traced
from .source_forces import AppliedLoads, loads_of

HALVES = 30
"""Limit of the halvings of the way to a position that does not close, to find how far it goes."""
DEAD = 1e-3
"""Part of what is left of columns of A_d at the start; where less is left, joints are at a dead point."""
LEAP = 0.5
"""Longest way from one place to the next, in rad and m: joints that go farther have left the motion."""
NEAR = 10.0
"""Factor of the limit of a dead point, for the last position beside it that closes."""


class TiedMotion:
    """Closed places along a motion; the last one is kept, since a step begins where the one before ended."""

    def __init__(self, ties: TiedJoints, backend: ArrayBackend, start: ClosedPlace) -> None:
        """Begin at `start`, where contacts also took hold."""
        self._ties, self._backend, self._held_at = ties, backend, start.q
        self._last: tuple[Numbers, ClosedPlace] = start.q, start
        self._dead = 0.0 if is_traced(start.q) else DEAD * float(_left_of(start).min(initial=1.0))
        self._turned = _turning(start)

    def place(self, t: float, q: Numbers) -> ClosedPlace:
        """Return the closed place beside q (..., n), whose dependent joints are closed first.

        Raises ValueError, with the time, where they cannot be closed, or independent joints go no further.
        """
        asked, place = self._last
        if asked is q:
            return place
        try:
            found = self._ties.closed_place(self._backend, q, self._held_at)
        except ValueError as error:
            with without_gradient(q):
                reason = self._leap(q) or self._dead_point(self._furthest(self._last[1], q), NEAR)
            raise ValueError(f"at t = {t:g} s {reason or error}") from None
        reason = self._dead_point(found)
        if reason is not None:
            raise ValueError(f"at t = {t:g} s {reason}")
        self._last = q, found
        return found

    def close_ties(self, t: float, q: Numbers) -> Numbers:
        """Return q (..., n) with its dependent joints where the constraints want them."""
        place = self.place(t, q)
        self._last = place.q, place
        return place.q

    def acceleration(self, t: float, q: Numbers, qd: Numbers, tau: Numbers, passive: bool) -> Numbers:
        """Return the accelerations of the independent joints, (..., m)."""
        place = self.place(t, q)
        return self._ties.acceleration(self._backend, place, qd, tau, passive)

    def _leap(self, q: Numbers) -> str | None:
        """Return a message if independent joints leap away from where they were, else None."""
        place = self._last[1]
        if is_traced(q):
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
        """Return the last place that closes on the straight way of the independent joints to q."""
        way, reached = q - place.q, 0.0
        for k in range(1, HALVES):
            tried = reached + 0.5**k
            # Dependent joints start from the last place that closed, not from far along the way.
            mover = place.velocity(place.own(way)) * (tried - reached)
            try:
                place = self._ties.closed_place(self._backend, place.q + mover, self._held_at)
            except ValueError:
                continue
            reached = tried
        return place

    def _dead_point(self, place: ClosedPlace, near: float = 1.0) -> str | None:
        """Return why independent joints go no further than a place; None where they do."""
        if is_traced(place.q):
            return None
        left, turned = _left_of(place), _turning(place)
        passed = None if turned is None or self._turned is None else turned != self._turned
        if not left.min(initial=1.0) < near * self._dead and (passed is None or not passed.any()):
            return None
        worst = left.argmin() if passed is None or not passed.any() else passed.argmax()
        at = np.unravel_index(worst, left.shape)
        values = array_of(place.rows[at])
        own, names = self._ties.independent, self._backend.structure.joint_names
        told = why_not_following(values.astype(float), place.found.columns, NEAR * self._dead, names, "")
        go = "goes" if len(own) == 1 else "go"
        return f"{listed(own)} {go} no further{sample_of([int(k) for k in at])}: {told}"


def _left_of(place: ClosedPlace) -> NDArray[np.floating]:
    return least_left(place.triangle, place.unit_rows)


def _turning(place: ClosedPlace) -> NDArray[np.bool_] | None:
    """Return the sign of det A_d (...,), which a dead point between two places changes; None without one.

    Of ties positions alone tell: steps do not lead across.
    """
    dependent = array_of(place.found.columns.dependent)
    if not place.unit_rows or is_traced(place.q) or place.rows.shape[-2] != len(dependent):
        return None
    signs = np.linalg.slogdet(array_of(place.rows)[..., dependent])[0]
    return np.asarray(signs > 0.0)


Given = Callable[[float, Numbers, Numbers], object]
"""Function of the user's, of time, position and velocity."""


class State(NamedTuple):
    """State at one instant, or the rates of one."""

    q: Numbers
    """Positions of all joints, (..., n)."""
    v: Numbers
    """Velocities of all joints, (..., n), or of the independent ones, (..., m)."""
    work: Numbers
    """Work W, (...)."""


class ReadLoads(NamedTuple):
    """Loads, and their vectors as they were read."""

    loads: AppliedLoads
    vectors: Sequence[Numbers]


@dataclass(frozen=True)
class EquationsOfMotion:
    """Equations of motion of a robot on one back end."""

    backend: ArrayBackend
    tau: Numbers | Given
    """Torques (..., n), or a function that gives them."""
    loads: ReadLoads | Given
    """Loads, or a function that gives them."""
    passive: bool
    ties: TiedMotion | None
    """Motion under constraints; None for an open tree."""
    varying: "Varying | None" = None
    """Time and inputs that the robot depends on; None without any."""

    def motion(self, t: float, state: State) -> tuple[Numbers, Numbers]:
        """Return q and qd of all joints, (..., n) each, which keep the constraints."""
        if self.ties is None:
            return state.q, state.v
        place = self.ties.place(t, state.q)
        return place.q, place.velocity(state.v)

    def rates(self, t: float, state: State) -> State:
        """Return the rates of a state."""
        q, qd = self.motion(t, state)
        if self.varying is not None:
            self.varying.move(t, q, qd)
        tau, pull = self.torques(t, q, qd), self.load_torque(t, q, qd)
        given = tau if pull is None else tau - pull
        if not self.passive:
            work = (qd * given).sum(-1)
            if self.backend.structure.shares:
                work = work + self.backend.power_beside(q, qd).sum(-1)
            return State(qd, self._accelerated(t, state.q, q, qd, given, False), work)
        spring, damping, friction, _ = self.backend.answers.passive_torque(q, qd, 0.0 * qd)
        work = (qd * (given - damping - friction)).sum(-1)
        if any(self.backend.structure.passive_sums.armature):
            return State(qd, self._accelerated(t, state.q, q, qd, given, True), work)
        left = given - spring - damping - friction
        return State(qd, self._accelerated(t, state.q, q, qd, left, False), work)

    def _accelerated(
        self, t: float, asked: Numbers, q: Numbers, qd: Numbers, given: Numbers, passive: bool
    ) -> Numbers:
        """Return accelerations of all joints, or of the independent ones at the place for `asked`."""
        if self.ties is not None:
            return self.ties.acceleration(t, asked, qd, given, passive)
        answers = self.backend.answers
        solve = answers.forward_dynamics if passive else answers.forward_dynamics_of_links
        return solve(q, qd, given)[0]

    def close_ties(self, t: float, state: State) -> State:
        """Return the state with its dependent joints where the constraints want them."""
        return state if self.ties is None else state._replace(q=self.ties.close_ties(t, state.q))

    def torques(self, t: float, q: Numbers, qd: Numbers) -> Numbers:
        """Return the torques of the actuators, (..., n)."""
        if not callable(self.tau):
            return self.tau
        (tau,) = read_at(self.backend, q, {"tau": self.tau(t, q, qd)})
        return tau

    def load_torque(self, t: float, q: Numbers, qd: Numbers) -> Numbers | None:
        """Return the torques that loads need from the joints, (..., n); None without loads."""
        found = self.loads
        if callable(found):
            loads = loads_of(self.backend, found(t, q, qd))
            found = ReadLoads(loads, read_at(self.backend, q, {}, loads.beside))
        torques = found.loads.torques(self.backend, q, found.vectors)
        return sum(torques[1:], torques[0]) if torques else None

    def energy(self, t: float, q: Numbers, qd: Numbers) -> Numbers:
        """Return the energy of links, springs and armature in J, (...)."""
        if self.varying is not None:
            self.varying.move(t, q, qd)
        kinetic, potential = self.backend.answers.energy(q, qd)
        total = (kinetic + potential).sum(-1)
        if self.passive:
            sums = self.backend.structure.passive_sums
            stiffness, pull, armature = (
                self.backend.constant(a, q) for a in (sums.stiffness, sums.pull, sums.armature)
            )
            total = total + ((stiffness * q / 2.0 + pull) * q + armature * qd * qd / 2.0).sum(-1)
        return total


class Varying:
    """Time and inputs of links that were written by hand, which move with a motion."""

    def __init__(self, backend: ArrayBackend, inputs: Mapping[str, object]) -> None:
        """Begin with a copy of a back end, whose parameters move while the robot's own stay."""
        self.backend, self._inputs = backend.separate(), inputs

    def move(self, t: float, q: Numbers, qd: Numbers) -> None:
        """Set time and inputs to what they are at an instant.

        Raises ValueError for an input that is no finite number, and as `weights` does.
        """
        structure = self.backend.structure
        values: dict[str, object] = {structure.time: t} if structure.time else {}
        for name, given in self._inputs.items():
            found = given(t, q, qd) if callable(given) else given
            if isinstance(found, float | np.ndarray) and not np.isfinite(found).all():
                raise ValueError(f"input {name!r} is not finite at t = {t:g}")
            values[name] = self.backend.weights(name, found, q)
        self.backend.set_parameters(values)


def varying_of(backend: ArrayBackend, inputs: object) -> Varying | None:
    """Return time and inputs as `simulate` is given them; None where the robot depends on neither.

    Raises ValueError for an input that the robot does not have.
    """
    structure = backend.structure
    given = inputs if inputs is not None else {}
    if not isinstance(given, Mapping):
        raise TypeError(
            f"inputs is a {type(given).__name__}; give a dictionary of values or functions by name"
        )
    for name in given:
        if name not in structure.inputs:
            there = f"its inputs are {listed(structure.inputs)}" if structure.inputs else "it has no inputs"
            raise ValueError(f"inputs names {short(name)}, which {structure.name} does not have; {there}")
    return Varying(backend, given) if structure.time or given else None


def read_at(
    backend: ArrayBackend, q: Numbers, named: Mapping[str, object], beside: Mapping[str, Beside] = NOTHING
) -> list[Numbers]:
    """Return what a user's function gave at an instant, of the shape of q (..., n).

    By then the number of motions is settled. Raises ValueError for an argument with more samples, and as
    `arrays` does.
    """
    at, *read = backend.arrays({"q": q, **named}, q.shape[-1], beside)
    if at.shape != q.shape:
        raise ValueError(
            f"{', '.join((*named, *beside))}: {tuple(at.shape[:-1])} samples are more than the "
            f"{tuple(q.shape[:-1])} of q and qd; give these as many from the start"
        )
    return [backend.weights(name, a, q) for name, a in zip((*named, *beside), read, strict=True)]
