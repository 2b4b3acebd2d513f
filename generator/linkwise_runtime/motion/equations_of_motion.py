"""Equations of motion as rates of a state, for an open tree or with constraints, and their energy.

State (q, v, W): v = qd, and W the work that was done:

    dq/dt = qd    dv/dt = qdd    dW/dt = qd . (tau - sum_e load torque_e - damping - friction) + R

with R the power that links which were written by hand get otherwise than from joints.

With constraints the dependent joints of every q are closed first, by Newton's method from where they are, and
qd = G v_y of the independent ones, so that they do not drift.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple, cast

import numpy as np

from ..arguments import NOTHING, Beside
from ..arrays.backend import ArrayBackend
from ..chosen_names import listed, short
from ..interface import Numbers
from .source_forces import AppliedLoads, loads_of
from .tied_motion import TiedMotion

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
        given = (q, qd)
        if isinstance(q, np.ndarray):  # what a function writes into its arguments is not the motion
            given = (cast(Numbers, np.array(q)), cast(Numbers, np.array(qd)))
        found = self.tau(t, *given)
        if type(found) is np.ndarray is type(q) and found.dtype == q.dtype and found.shape == q.shape:
            return cast(Numbers, found.copy())
        (tau,) = read_at(self.backend, q, {"tau": found})
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
