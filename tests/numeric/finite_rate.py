"""Remains of an impedance where the controller runs at a rate, late, or believes the wrong masses.

Robots that MuJoCo moves are pushed by known forces, to which an impedance is fitted; let go beside their
target, which shows the stored energy; and led along a moving target.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from numeric.impedance_fit import Impedance, Sines, errors, fitted, sines_for
from numeric.mujoco_plant import MujocoPlant

PERIOD = 1e-3
"""s, of the controller's step."""
SWING = 1.0
"""s, in which a moving target goes to and fro."""


@dataclass(frozen=True)
class Loop:
    """Loop in which a controller is run."""

    name: str
    held: bool = True
    """Torques are held over a period; else they follow the motion at once."""
    late: bool = False
    """A torque acts one period after its measurement."""
    differences: bool = False
    """Velocities are differences of positions, one period apart."""
    ahead: bool = False
    """The controller is asked for the state expected in the middle of the time in which its torque acts."""
    heavier: float = 0.0
    """Share by which each link is heavier than the controller believes, and its inertia larger."""


HELD = Loop("torques held over 1 ms")
AHEAD = Loop("held, asked half a step ahead", ahead=True)
LOOPS = (
    Loop("ideal: torques follow the motion at once", held=False),
    HELD,
    AHEAD,
    Loop("held, and one step late", late=True),
    Loop("one step late, asked one and a half ahead", late=True, ahead=True),
    Loop("held, velocities by differences of positions", differences=True),
    Loop("held, every link 5 % heavier than believed", heavier=0.05),
    Loop("all of it together", late=True, differences=True, heavier=0.05),
)


@dataclass(frozen=True)
class JointSpace:
    """An impedance of all joints: x = q - start."""

    package: Any
    robot: Any
    controller: Any
    wanted: Impedance
    start: Any
    away: Any
    """Positions at which joints are let go."""
    pushed: str | None = None
    """A body of the plant; None where forces act on the joints."""
    unit: str = "mrad"
    sensed: bool = True
    """True if the controller is told what acts from outside."""

    def offset(self, q: Any) -> Any:
        return q - self.start

    def target(self, x: Any, xd: Any, xdd: Any) -> Any:
        """Return the controller's target at x (..., m)."""
        return self.package.Target(self.start + x, xd, xdd)

    def external(self, q: Any, force: Any) -> Any:
        """Return what a force (m,) at one position puts on the joints."""
        return force

    def push(self, force: Callable[[float], Any]) -> dict[str, Callable[[float], Any]]:
        """Return the same force for the plant, by the name that it has there."""
        return {"joints": force}


@dataclass(frozen=True)
class HandSpace:
    """An impedance of a point of a frame, x, y and z; `pushed` is the frame."""

    package: Any
    robot: Any
    controller: Any
    wanted: Impedance
    start: Any
    away: Any
    pushed: str
    unit: str = "mm"
    sensed: bool = True

    @cached_property
    def pose(self) -> Any:
        return self.robot.kinematics.pose(self.start, self.pushed)

    def offset(self, q: Any) -> Any:
        return self.robot.kinematics.pose(q, self.pushed)[..., :3, 3] - self.pose[:3, 3]

    def target(self, x: Any, xd: Any, xdd: Any) -> Any:
        pose = np.broadcast_to(self.pose, (*x.shape[:-1], 4, 4)).copy()
        pose[..., :3, 3] += x
        still = np.zeros_like(x)
        velocity, acceleration = (np.concatenate([still, a], -1) for a in (xd, xdd))
        q = np.broadcast_to(self.start, (*x.shape[:-1], len(self.start)))
        return self.package.Target(q, pose=pose, velocity=velocity, acceleration=acceleration)

    def external(self, q: Any, force: Any) -> Any:
        return force @ self.robot.kinematics.jacobian(q, self.pushed)[3:]

    def push(self, force: Callable[[float], Any]) -> dict[str, Callable[[float], Any]]:
        return {"body": lambda t: np.hstack([np.zeros_like(force(t)), force(t)])}


@dataclass(frozen=True)
class Course:
    """Course of one copy: a push, a moving target, or a start away from it."""

    force: Sines | None = None
    swing: Any = None
    """(m,): the target goes to this and back, as (1 - cos) / 2."""
    released: bool = False

    def pushed(self, t: float, m: int) -> Any:
        return np.zeros(m) if self.force is None else self.force(t)

    def moved(self, t: float, m: int) -> tuple[Any, Any, Any]:
        """x, xd and xdd of the target, to and fro in SWING seconds each."""
        if self.swing is None:
            return (np.zeros(m),) * 3
        w = 2.0 * np.pi / SWING
        shape = (1.0 - np.cos(w * t), w * np.sin(w * t), w * w * np.cos(w * t))
        return tuple(np.asarray(self.swing) * s / 2.0 for s in shape)  # type: ignore[return-value]


@dataclass(frozen=True)
class Copy:
    """One robot of those that move side by side."""

    loop: Loop
    course: Course


@dataclass(frozen=True)
class Record:
    """Record of one copy at every period."""

    offset: Any
    """(samples, m)"""
    force: Any
    wanted: Any
    """x of the target."""
    energy: Any
    """Stored, (samples,)."""


def run(space: Any, copies: Sequence[Copy], model: Callable[[float], Any], seconds: float) -> list[Record]:
    """Records of all copies, under one controller; all held, or none.

    model: MuJoCo's, heavier by a share
    """
    m, loops = len(space.wanted.inertia), [copy.loop for copy in copies]
    late, differences = np.array([(loop.late, loop.differences) for loop in loops]).T[..., None]
    plant = MujocoPlant([model(loop.heavier) for loop in loops], space.pushed)
    plant.start([space.away if copy.course.released else space.start for copy in copies])

    def forces(t: float) -> Any:
        return np.array([copy.course.pushed(t, m) for copy in copies])

    def law(t: float, q: Any, qd: Any) -> Any:
        # one by one, as samples of their own are what C answers
        return np.array([_torque(space, *each, t) for each in zip(copies, q, qd, strict=True)])

    push, times, states = space.push(forces), PERIOD * np.arange(round(seconds / PERIOD)), []
    last, waiting = plant.q, None
    for t in times:
        q, qd = plant.q, plant.qd
        states.append((q, qd))
        if not loops[0].held:
            plant.follow(law, PERIOD, **push)
            continue
        tau = law(t, q, np.where(differences, (q - last) / PERIOD, qd))
        plant.hold(tau if waiting is None else np.where(late, waiting, tau), PERIOD, **push)
        waiting, last = tau, q
    q, qd = (np.stack(column, 1) for column in zip(*states, strict=True))
    return [_record(space, copy.course, times, *state) for copy, *state in zip(copies, q, qd, strict=True)]


def _torque(space: Any, copy: Copy, q: Any, qd: Any, t: float) -> Any:
    """Return the torque of one copy (joints,), for what is measured at t, or what that lets expect of a time
    ahead."""
    course, m = copy.course, len(space.wanted.inertia)
    force = course.pushed(t, m)

    def asked(t: float, q: Any, qd: Any, force: Any) -> Any:
        external = space.external(q, force) if space.sensed else None
        return space.controller(q, qd, space.target(*course.moved(t, m)), external)

    tau = asked(t, q, qd, force)
    if not copy.loop.ahead:
        return tau
    ahead = PERIOD * (0.5 + copy.loop.late)
    qdd = space.robot.forward_dynamics(q, qd, tau + space.external(q, force))
    trend = (force - course.pushed(t - PERIOD, m)) / PERIOD
    expected = q + ahead * qd + ahead**2 / 2 * qdd, qd + ahead * qdd, force + ahead * trend
    return asked(t + ahead, *expected)


def _record(space: Any, course: Course, times: Any, q: Any, qd: Any) -> Record:
    m = len(space.wanted.inertia)
    moved = [np.array(column) for column in zip(*(course.moved(t, m) for t in times), strict=True)]
    energy = space.controller.stored_energy(q, qd, space.target(*moved))
    return Record(space.offset(q), np.array([course.pushed(t, m) for t in times]), moved[0], energy)


def measured(record: Record, seconds: float) -> Impedance:
    """The impedance that pushes show, fitted to the last so many seconds."""
    last = slice(-round(seconds / PERIOD), None)
    return fitted(record.force[last], record.offset[last], seconds)


@dataclass(frozen=True)
class Outcome:
    """Outcome of one way to run the loop."""

    loop: Loop
    found: Impedance
    error: Impedance
    """Error of the measured impedance, in a ratio to what was asked for."""
    rise: float
    """The most that stored energy rose again after the robot was let go, in a ratio to the start's."""
    tracking: float
    """Largest distance from the moving target, in m or rad."""


def studied(
    space: Any,
    loops: Sequence[Loop],
    model: Callable[[float], Any],
    motion: Any,
    swing: Any,
    seconds: float,
) -> list[Outcome]:
    """Return what is left under each loop; all held, or none.

    motion: how far each direction is pushed at each frequency; swing: how far the target goes and back;
    seconds: of the fitted record, before which as many pass for the start to die away
    """
    courses = (
        Course(sines_for(space.wanted, motion, seconds)),
        Course(released=True),
        Course(swing=swing),
    )
    copies = [Copy(loop, course) for loop in loops for course in courses]
    records = iter(run(space, copies, model, 2 * seconds))
    outcomes = []
    for loop, pushed, released, led in zip(loops, records, records, records, strict=True):
        energy = released.energy
        rise = (energy - np.minimum.accumulate(energy)).max() / energy[0]
        away = np.linalg.norm(led.offset - led.wanted, axis=-1).max()
        found = measured(pushed, seconds)
        outcomes.append(Outcome(loop, found, errors(found, space.wanted), float(rise), float(away)))
    return outcomes
