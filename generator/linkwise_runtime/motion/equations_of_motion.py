"""Equations of motion as rates of a state, for an open tree or with constraints, and their energy.

State (q, v, W): v = qd, and W the work that was done:

    dq/dt = qd    dv/dt = qdd    dW/dt = qd . (tau - sum_e load torque_e - damping - friction) + R

with R the power that links which were written by hand get otherwise than from joints.

With constraints the dependent joints of every q are closed first, by Newton's method from where they are, and
qd = G v_y of the independent ones, so that they do not drift.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..arguments import NOTHING, Beside
from ..arrays.backend import ArrayBackend
from ..chosen_names import listed, sample_of, short
from ..constraints.closed_places import ClosedPlace, factor_dependent
from ..constraints.independent_joints import (
    JointColumns,
    chosen_independent,
    joint_columns,
    least_left,
    left_free,
)
from ..constraints.tied_joints import TiedJoints, without_gradient
from ..interface import Numbers, array_of, is_traced
from .source_forces import AppliedLoads, loads_of

DEAD = 1e-3
"""Part of what was left of columns of A_d where joints were chosen; where less is left, they tell nothing."""
WEAK = 0.5
"""Part below which other independent joints are looked for: the error of a step grows as it gets less."""
FAR = 0.1
"""Way of dependent joints, in rad and m, from where they follow in a straight line."""
LEAP = 0.5
"""Longest way from one place to the next, in rad and m: joints that go farther have left the motion."""


class TiesLost(ValueError):
    """Error for a state beside which ties do not close, or from which there is more than one way."""


class TiedMotion:
    """Closed places along a motion.

    Where independent joints come to tell little of the others, as at a crank's dead point, each sample goes
    on with others, which pivoting finds: the motion itself does not depend on the choice.
    """

    def __init__(self, ties: TiedJoints, backend: ArrayBackend, q: Numbers) -> None:
        """Begin at positions (..., n), where contacts also take hold.

        Raises ValueError where they cannot be closed, or constraints take fewer freedoms than elsewhere.
        """
        self._ties, self._backend, self._held_at = ties, backend, q
        self.start = self._settled = self._first(q)
        """Closed place of the start."""
        self._held_at = self.start.q
        self._last: tuple[Numbers, ClosedPlace] = self.start.q, self.start
        self._chosen = None if is_traced(q) else Followed.at(self.start, self.start.found.columns)

    def place(self, t: float, q: Numbers) -> ClosedPlace:
        """Return the closed place beside q (..., n), whose dependent joints are closed first.

        Raises TiesLost, with the time, where they cannot be closed, or do not follow.
        """
        asked, place = self._last
        if asked is q:
            return place
        found, error = self._closed(self._near(q), self._chosen)
        if self._chosen is not None and (found is None or self._chosen.lost_at(found) is not None):
            other = Followed.at(self._settled, self._pivoted(self._settled.rows))
            again = self._closed(self._near(q), other)[0]
            if again is not None:
                found, self._chosen = again, other
        if found is None:
            with without_gradient(q):
                raise TiesLost(f"at t = {t:g} s {self._leap(q) or error}")
        lost = None if self._chosen is None else self._chosen.lost_at(found)
        if lost is not None:
            raise TiesLost(f"at t = {t:g} s {self._singular(found, lost)}")
        self._last = q, found
        return found

    def settled(self, t: float, q: Numbers) -> ClosedPlace:
        """Return the closed place beside q (..., n), from whose positions the next step begins.

        Here other independent joints are chosen in time: within a step they would cost its order, for its
        stages are less exact than its end. Raises TiesLost as `place` does, and for a step across a place
        where constraints take fewer freedoms.
        """
        place, chosen = self.place(t, q), self._chosen
        if chosen is not None:
            crossed = _first_of(rank_lost_between(self._settled, place))
            if crossed is not None:
                raise TiesLost(f"at t = {t:g} s {self._singular(place, crossed)}")
            part = chosen.part_left(place)
            if part < chosen.weak:
                other = Followed.at(place, self._pivoted(place.rows))
                again = self._closed(place.q, other)[0]
                if again is None:
                    self._chosen = replace(chosen, weak=part / 2.0)
                else:
                    place, self._chosen = again, other
        self._last, self._settled = (place.q, place), place
        return place

    def acceleration(self, t: float, q: Numbers, qd: Numbers, tau: Numbers, passive: bool) -> Numbers:
        """Return the accelerations of all joints, (..., n)."""
        place = self.place(t, q)
        return self._ties.acceleration(self._backend, place, qd, tau, passive)

    def _first(self, q: Numbers) -> ClosedPlace:
        """Return the closed place of the start, by other independent joints where the chosen tell nothing."""
        try:
            return self._ties.closed_place(self._backend, q, q)
        except ValueError as error:
            if is_traced(q):
                raise
            rows = self._ties.scaled_rows(self._backend, q)
            try:
                return self._ties.closed_place(self._backend, q, q, self._pivoted(rows))
            except ValueError:
                raise error from None

    def _closed(self, q: Numbers, chosen: "Followed | None") -> tuple[ClosedPlace | None, str]:
        """Return the closed place beside q, or None and why there is none."""
        columns = None if chosen is None else chosen.columns
        try:
            return self._ties.closed_place(self._backend, q, self._held_at, columns), ""
        except ValueError as error:
            return None, str(error)

    def _near(self, q: Numbers) -> Numbers:
        """Return q (..., n), its dependent joints not far from where they follow from the last step.

        Implicit methods ask for slopes by dependent coordinates, and go as far as these change anything.
        """
        last = self._settled
        if is_traced(q) or not self._ties.chosen.of_positions:
            return q
        led = last.q + last.velocity(last.own(q - last.q))
        return led if bool((abs(q - led) > FAR).any()) else q

    def _pivoted(self, rows: Numbers) -> JointColumns:
        """Return the independent joints of each sample, by pivoting in rows A (..., C, n)."""
        n = rows.shape[-1]
        flat = array_of(rows).astype(float).reshape(-1, *rows.shape[-2:])
        tables = [joint_columns(chosen_independent(own, rank=len(self._ties.dependent)), n) for own in flat]
        columns = (np.stack([array_of(a) for a in of]) for of in zip(*tables, strict=True))
        kept = (a.reshape(*rows.shape[:-2], a.shape[-1]) for a in columns)
        return JointColumns(*(self._backend.index(a, rows) for a in kept))

    def _leap(self, q: Numbers) -> str | None:
        """Return a message if independent joints leap away from where they were, else None."""
        place = self._settled
        if is_traced(q):
            return None
        far = np.abs(array_of(place.own(q - place.q)))
        if not far.max(initial=0.0) > LEAP:
            return None
        sample = np.unravel_index(far.argmax(), far.shape)
        own = place.found.columns.of([int(k) for k in sample[:-1]]).independent.tolist()
        joint = self._backend.structure.joint_names[own[int(sample[-1])]]
        return (
            f"{joint} leaps by {far.max():.3g}: take smaller steps, or look at the torques; next to a "
            "singular mass matrix, as of a base pitched by 90 degrees, accelerations have no bound"
        )

    def _singular(self, place: ClosedPlace, sample: Sequence[int]) -> str:
        """Return where the motion leads, with the joints that are free there."""
        rows, columns = array_of(place.rows)[tuple(sample)], place.found.columns.of(sample)
        free = left_free(rows, columns, self._backend.structure.joint_names, "")
        return (
            f"the motion comes to a singular position{sample_of(sample)}, from which it can go on in more "
            f"than one way, or its steps are too long to tell: {free}"
        )


@dataclass(frozen=True)
class Followed:
    """Independent joints of a motion, and how well others followed them where they were chosen."""

    columns: JointColumns
    left: NDArray[np.floating]
    """Least part of a column of A_d that was left there, (...,)."""
    weak: float = WEAK
    """Part of this below which others are looked for."""

    @classmethod
    def at(cls, place: ClosedPlace, columns: JointColumns) -> "Followed":
        """Return how well others follow these at a place."""
        return cls(columns, least_left(factor_dependent(place.rows, columns)[1], place.unit_rows))

    def part_left(self, place: ClosedPlace) -> float:
        """Return the least part that is left at a place of what there was."""
        return float((least_left(place.factors[1], place.unit_rows) / self.left).min(initial=1.0))

    def lost_at(self, place: ClosedPlace) -> tuple[int, ...] | None:
        """Return the first sample whose independent joints tell the others no more, or None."""
        return _first_of(least_left(place.factors[1], place.unit_rows) < DEAD * self.left)


def rank_lost_between(before: ClosedPlace, after: ClosedPlace) -> NDArray[np.bool_]:
    """Return where A lost rank between two places, or turned by more than a right angle, (...,).

    There all minors of A, which are those of d rows and d columns, pass zero. With Q of A_d = Q R before,
    det (Q^T A) (Q^T A_after)^T is the sum of the products of minors before and after: below zero then.
    """
    basis = array_of(before.factors[0]).mT
    own, other = (basis @ array_of(place.rows) for place in (before, after))
    return np.asarray(np.linalg.slogdet(own @ other.mT)[0] < 0.0)


def _first_of(found: NDArray[np.bool_]) -> tuple[int, ...] | None:
    return tuple(int(k) for k in np.argwhere(found)[0]) if found.any() else None


Given = Callable[[float, Numbers, Numbers], object]
"""Function of the user's, of time, position and velocity."""


class State(NamedTuple):
    """State at one instant, or the rates of one."""

    q: Numbers
    """Positions of all joints, (..., n)."""
    v: Numbers
    """Velocities of all joints, (..., n); under constraints those of the independent ones count."""
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
        return place.q, place.velocity(place.own(state.v))

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
        """Return the accelerations of all joints, under constraints at the place for `asked`."""
        if self.ties is not None:
            return self.ties.acceleration(t, asked, qd, given, passive)
        answers = self.backend.answers
        solve = answers.forward_dynamics if passive else answers.forward_dynamics_of_links
        return solve(q, qd, given)[0]

    def close_ties(self, t: float, state: State) -> State:
        """Return the state with its dependent joints, and their velocities, as the constraints want them."""
        if self.ties is None:
            return state
        place = self.ties.settled(t, state.q)
        return state._replace(q=place.q, v=place.velocity(place.own(state.v)))

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
