"""Tracing of a motion's velocities to their sources: arguments are read and checked, blocks are joined."""

from collections.abc import Sequence
from numbers import Real
from typing import Any, NamedTuple

import numpy as np

from ..arguments import as_array, check_numbers, rising_instants, shape_of
from ..arrays.backend import ArrayBackend
from ..chosen_names import short
from ..constraints.independent_joints import loose_base
from ..interface import Numbers, namespace
from ..motion_quantities import TracedMotion
from ..structure import Structure
from .between_samples import SampledMotion, sample_slopes
from .induced_accelerations import DrivenRobot, constraints_of
from .source_forces import AppliedLoads, loads_of
from .trace_equations import BETWEEN, LOAD, TraceEquations
from .tracer import TraceParts, Tracer

WEIGHTS = ("apart", "borne")
"""Ways to count weight: as a source, or as what torques hold."""
GAP = 5.0
"""Steps longer than this many usual ones are a gap in the log."""


class Traced(NamedTuple):
    """Arguments of `Dynamics.trace`."""

    q: object
    qd: object
    qdd: object
    time: object
    tau: object
    loads: object
    passive: bool
    constraints: object
    windows: object = ()
    restarts: object = ()
    by_link: bool = False
    weight: object = "apart"


class ReadTrace(NamedTuple):
    """A motion that was read, and its equations."""

    times: list[float]
    samples: SampledMotion
    equations: TraceEquations
    loads: AppliedLoads
    vectors: Sequence[Numbers]
    """Vectors of the loads, (T, ..., 3)."""


def read_trace(robot: DrivenRobot, asked: Traced) -> ReadTrace:
    """Return the motion of a call, and its equations; raises as `Dynamics.trace` does."""
    constraints = constraints_of(robot, asked.constraints)
    loads = loads_of(robot.backend, asked.loads)
    named = {"q": asked.q, "qd": asked.qd, "qdd": asked.qdd}
    named |= {} if asked.tau is None else {"tau": asked.tau}
    backend, numbers = robot.door.read(named, beside=loads.beside)
    motion = dict(zip(named, numbers[: len(named)], strict=True))
    check_numbers(motion, robot.joint_names, loads.beside)
    times = _instants(asked.time, motion["q"])
    check_traceable(backend.structure)
    _check_parameters(backend, motion["q"])
    names = tuple(f"{LOAD}{BETWEEN}{name}" for name in loads.names(backend))
    loose = () if backend.tree is None else loose_base(backend.tree)
    equations = TraceEquations(
        backend,
        constraints,
        bool(asked.passive),
        "tau" in motion,
        names,
        asked.by_link,
        _borne(asked, backend),
        loose,
    )
    vectors = numbers[len(named) :]
    _check_loads(loads, motion["q"])
    return ReadTrace(times, _sampled(backend, loads, times, motion, vectors), equations, loads, vectors)


def trace_motion(robot: DrivenRobot, asked: Traced) -> TracedMotion[Any]:
    """Return the answer of `Dynamics.trace`."""
    read = read_trace(robot, asked)
    parts = trace_parts(asked.windows, asked.restarts, read.times)
    windows = window_ends(parts, read.times)
    arrays: Any = Tracer(read.equations, parts).advance(read.samples, 0, None)[0]
    coordinates = tuple(robot.joint_names.index(name) for name in read.equations.coordinates)
    return TracedMotion._make([*arrays, read.equations.sources, windows, coordinates])


def _sampled(
    backend: ArrayBackend,
    loads: AppliedLoads,
    times: Sequence[float],
    motion: dict[str, Numbers],
    vectors: Sequence[Numbers],
) -> SampledMotion:
    """Return the motion with the forces that are given: of actuators, where they are, then of loads."""
    q, qd, qdd, *tau = motion.values()
    columns = [*tau, *(-torque for torque in loads.torques(backend, q, vectors))]
    time, steps = (backend.weights("time", a, q) for a in (times, np.diff(times, append=times[-1])))
    if not columns:
        nothing = backend.zeros(q, 0)[..., None, :] + 0.0 * q[..., None]
        return SampledMotion(time, steps, q, qd, qdd, nothing, nothing)
    given = namespace(q).stack(columns, -1)
    return SampledMotion(time, steps, q, qd, qdd, given, sample_slopes(steps[:-1], given))


def _instants(time: object, q: Numbers) -> list[float]:
    """Return the instants of the samples; raises ValueError for others than those of q, and for a gap."""
    times = rising_instants("time", time)
    if q.ndim < 2 or q.shape[0] != len(times):
        raise ValueError(
            f"time has {len(times)} instants, but q, qd and qdd have shape {tuple(q.shape)}; their first "
            "axis is that of time, (T, ..., n)"
        )
    if len(times) < 2:
        raise ValueError("time has one instant; a motion to trace has two or more")
    steps = np.diff(times)
    usual = float(np.median(steps))
    if (steps > GAP * usual).any():
        at = int((steps > GAP * usual).argmax())
        raise ValueError(
            f"time has a gap of {steps[at]:.4g} s after {times[at]:.6g} s, where samples follow each other "
            f"by {usual:.4g} s; trace the parts before and after it alone"
        )
    return times


def _borne(asked: Traced, backend: ArrayBackend) -> bool:
    """Return whether torques bear the weight; raises ValueError for a word that is not in WEIGHTS."""
    if asked.weight not in WEIGHTS:
        raise ValueError(f"weight is {short(asked.weight)}; give {' or '.join(WEIGHTS)}")
    if asked.weight == "borne" and backend.structure.shares:
        raise ValueError(
            f"the links of {backend.structure.name} were written by hand, and it is not said which of their "
            "shares torques bear; leave weight out"
        )
    return asked.weight == "borne"


def _check_loads(loads: AppliedLoads, q: Numbers) -> None:
    """Raise ValueError for vectors (T, 3) beside many motions, whose axis is then not that of time."""
    for name, vector in loads.beside.items():
        samples = shape_of(vector.value)[:-1]
        if 0 < len(samples) < q.ndim - 1:
            raise ValueError(
                f"{name} has shape {shape_of(vector.value)}, beside motion (T, ..., n) of shape "
                f"{tuple(q.shape)}; give as many axes, of length 1 where all motions share it"
            )


def check_traceable(structure: Structure) -> None:
    """Raise ValueError for a robot whose motions have no such parts."""
    for link, degree in zip(structure.link_names, structure.degrees, strict=False):
        if degree > 2:
            raise ValueError(
                f"the kinetic energy of {link} has velocities of degree {degree}, so that the mass matrix "
                "depends on them, and no part of a velocity has an energy of its own"
            )


def _check_parameters(backend: ArrayBackend, q: Numbers) -> None:
    """Raise ValueError for a robot that has parameters for each instant."""
    if len(backend.samples) >= q.ndim - 1:
        raise ValueError(
            f"parameters have samples of shape {backend.samples}, beside motion (T, ..., n) of shape "
            f"{tuple(q.shape)}; they cannot change with time here"
        )


def trace_parts(
    windows: object,
    restarts: object,
    times: Sequence[float],
    names: tuple[str, str] = ("windows", "restarts"),
) -> TraceParts:
    """Return where a trace of samples at these times begins anew, and where windows are cut.

    windows: length of each in s, or instants; restarts: instants; names: what messages call the two
    Raises ValueError for instants outside the motion, or too close to others.
    """
    cuts = _places(names[0], _window_begins(names[0], windows, times), times)
    return TraceParts(_places(names[1], restarts, times), cuts)


def window_ends(parts: TraceParts, times: Sequence[float]) -> tuple[tuple[float, float], ...]:
    """Return begin and end of each window, in s."""
    ends = [*parts.cuts[1:], len(times) - 1]
    return tuple((times[begin], times[end]) for begin, end in zip(parts.cuts, ends, strict=True))


def _window_begins(name: str, windows: object, times: Sequence[float]) -> object:
    """Return the instants at which windows begin, where their length is given."""
    if isinstance(windows, bool) or not isinstance(windows, Real):
        return windows
    length, least, whole = float(windows), min(np.diff(times)), times[-1] - times[0]
    # Steps are rounded as times are.
    if not (1.0 - 1e-6) * least <= length <= (1.0 + 1e-6) * whole:
        raise ValueError(
            f"{name} is {short(windows)} s; give a length from a step between samples, {least:.4g} s, to "
            f"all of the motion, {whole:.4g} s"
        )
    # One that begins next to the last sample has no step.
    last = times[-1] - 0.5 * (times[-1] - times[-2])
    return np.arange(times[0] + length, last, length)


def _places(name: str, given: object, times: Sequence[float]) -> list[int]:
    """Return 0 and the samples next to instants; raises ValueError for one outside the motion, or twice."""
    found = [0]
    if as_array(name, given).size == 0:
        return found
    for k, instant in enumerate(rising_instants(name, given)):
        if not times[0] < instant < times[-1]:
            raise ValueError(
                f"{name}[{k}] is {instant:.6g} s, which is not within the motion, from {times[0]:.6g} to "
                f"{times[-1]:.6g} s"
            )
        place = int(np.abs(np.asarray(times) - instant).argmin())
        if place in (found[-1], len(times) - 1):
            raise ValueError(
                f"{name}[{k}] is {instant:.6g} s, next to the sample at {times[place]:.6g} s, where another "
                "one is or the motion ends; give instants that are farther apart"
            )
        found.append(place)
    return found
