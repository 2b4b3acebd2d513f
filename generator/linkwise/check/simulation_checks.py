"""Check of a short simulated motion against the Runge-Kutta method on the recursion's equations of motion."""

from collections.abc import Callable, Iterator, Mapping
from typing import Any, NamedTuple

import numpy as np
from linkwise_runtime.answers.packed import AskedMotion, PackedBackend
from linkwise_runtime.dynamics import Dynamics
from linkwise_runtime.rule.joint_tree import JointTree

from linkwise.arrays import Array, Mask
from linkwise.check.compare import Entries, Result, compare, skipped
from linkwise.oracle.held_motion import held_motion, mass_matrix, steady
from linkwise.oracle.loop_equations import LoopEquations, following
from linkwise.oracle.magnitudes import Magnitudes
from linkwise.oracle.newton_euler import NewtonEuler
from linkwise.oracle.rounding import measure_rounding
from linkwise.oracle.states import States
from linkwise.package.manifest import Manifest

TRIED = 8
"""States tried; the motion starts from that with the least acceleration: next to a base's pitch of 90
degrees, or to a dead point, there is no bound to it."""
STEP = 2e-3
STEPS = 2
CLOSING = 8
"""Most steps that close ties after an integration step."""
CLOSED = 1e-12
"""Step of closing, in rad and m, below which ties are closed; what is left is about its square."""
AGREED = 3e-5
"""Largest disagreement of rows that follow from others, relative to their numbers: somewhat more than
`RANK`."""
SINGULAR = "no mass matrix can be inverted here"
HELD_TWICE = "what holds a loop twice does not agree where it moves to"
DEAD_POINT = "it moves to where no position near by closes a loop"
"""Reasons why there is no motion to compare."""


class SimulatedMotion(NamedTuple):
    """Torques tau that act from a state on, and the resulting q, qd and work, with their scales."""

    q: Array
    qd: Array
    tau: Array
    ends: dict[str, Array]
    scales: dict[str, Array]
    energies: Magnitudes | None = None
    """Sizes of the energies of rigid links; those of others are among the results."""
    inputs: Mapping[str, Callable[..., float]] = {}
    source: str = "Newton-Euler recursion"


class _NoMotionError(Exception):
    """Reason why there is no motion, where ties do not agree or cannot be closed."""


def simulated_motion(manifest: Manifest, tree: JointTree, states: States) -> SimulatedMotion | str:
    """Return a motion from the calmest of the first states in which ties close, or why there is none.

    Its torques are those of a modest acceleration: any others would throw a light link away.
    """
    try:
        return _simulated_motion(manifest, tree, states)
    except _NoMotionError as error:
        return str(error)


def _simulated_motion(manifest: Manifest, tree: JointTree, states: States) -> SimulatedMotion | str:
    recursion, n = NewtonEuler(manifest, tree), states.q.shape[1]
    own = list(tree.independent) if tree.tied else list(range(n))

    def motion(tree: JointTree, tau: Array) -> Rates:
        noisy = NewtonEuler(manifest, tree)
        return _tied(noisy, tree, tau) if tree.tied else _free(noisy, tau)

    tried = states.at(slice(0, TRIED))
    mapped = np.broadcast_to(np.eye(n), (len(tried.q), n, n))
    if tree.tied:
        rows = LoopEquations(recursion, tree).rows(tried.q)
        mapped = following(rows, own)
        agreed = _agree(rows, mapped)
        if not agreed.any():
            return HELD_TWICE
        tried, mapped = tried.at(agreed), mapped[agreed]
    tried = tried.at(steady(recursion, tried.q, mapped))
    if not len(tried.q):
        return SINGULAR
    sizes = np.abs(motion(tree, np.ones(n) + 0.0 * tried.q)(tried.q, tried.qd[:, own])[2]).max(axis=-1)
    calm = np.array([int(np.where(np.isfinite(sizes), sizes, np.inf).argmin())])
    q, qd, _ = tried.at(calm).motion
    qdd = np.random.default_rng(9).uniform(-1.0, 1.0, q.shape)  # the states' own may be zero
    tau = recursion.torque(q, qd, qdd)

    def ends(tree: JointTree) -> dict[str, Array]:
        found = _integrated(motion(tree, tau), (q, qd[:, own], np.zeros(1)))
        return dict(zip(("q", "qd", "work"), found, strict=True))

    return SimulatedMotion(q, qd, tau, *measure_rounding(ends, tree), Magnitudes(manifest, tree))


def simulation_calls(name: str, model: Dynamics, expected: SimulatedMotion | str) -> Iterator[Result]:
    """Yield the result for the motion of one back end."""
    if isinstance(expected, str):
        yield skipped(f"{name}: a simulated motion", expected)
        return
    calls: Any = model
    time = [STEP * k for k in range(STEPS + 1)]
    more = {"inputs": expected.inputs} if expected.inputs else {}
    title = f"{name}: a simulated motion against {expected.source}"
    if (reached := _reached_by_functions(calls, expected, time)) < len(time):
        # Equations in arrays go on from there, so that the motion itself would not tell.
        yield Result(title, False, None, f"C stops at instant {reached} of {len(time)}")
        return
    found = calls.simulate(expected.q, expected.qd, time, expected.tau, passive=False, **more)
    yield compare(title, _compared(calls, found, expected))


def _reached_by_functions(calls: Any, expected: SimulatedMotion, time: list[float]) -> int:
    """Return how many instants a back end's own functions reach; all of them where it has none."""
    backend = getattr(calls, "backend", None)
    if not isinstance(backend, PackedBackend):
        return len(time)
    ties = calls.constraints.ties.functions(backend) if calls.backend.ties_joints else None
    if calls.backend.ties_joints and ties is None:
        return len(time)
    found = backend.moved(AskedMotion(expected.q, expected.qd, time, None, expected.tau, False, ties))
    return len(time) if found is None else len(found.q)


def _compared(calls: Any, found: Any, expected: SimulatedMotion) -> Iterator[Entries]:
    for what, value in expected.ends.items():
        yield Entries(what, np.asarray(getattr(found, what))[-1], value, expected.scales[what])
    if expected.energies is None:
        return
    q, qd = found.q[-1], found.qd[-1]
    energy = np.asarray(calls.energy(q, qd).total).sum(-1)
    size = expected.energies.lagrangian(np.abs(q), np.abs(qd)).sum(-1)
    yield Entries("energy", np.asarray(found.energy)[-1], energy, size)


Rates = Callable[[Array, Array], tuple[Array, Array, Array, Array]]
"""Function of q and v: q that ties allow, qd of all joints, accelerations of independent joints, and
power."""


def _integrated(motion: Rates, start: tuple[Array, Array, Array]) -> tuple[Array, Array, Array]:
    """Return q, qd and work after all steps, each of order 4."""
    q, v, work = start
    for _ in range(STEPS):
        slopes: list[tuple[Array, ...]] = []
        for part in (0.0, 0.5, 0.5, 1.0):
            by = part * STEP
            at, speed = (q + by * slopes[-1][0], v + by * slopes[-1][1]) if slopes else (q, v)
            slopes.append(motion(at, speed)[1:])
        by_q, by_v, by_work = (STEP * (a + 2 * b + 2 * c + d) / 6 for a, b, c, d in zip(*slopes, strict=True))
        q, v, work = q + by_q, v + by_v, work + by_work
        q = motion(q, v)[0]
    return q, motion(q, v)[1], work


def _free(recursion: NewtonEuler, tau: Array) -> Rates:
    def motion(q: Array, qd: Array) -> tuple[Array, Array, Array, Array]:
        bias = recursion.torque(q, qd, 0.0 * q)
        moved: Any = np.linalg.solve(mass_matrix(recursion, q), (tau - bias)[..., None])[..., 0]
        return q, qd, moved, (qd * tau).sum(-1)

    return motion


def _tied(recursion: NewtonEuler, tree: JointTree, tau: Array) -> Rates:
    ties, own = LoopEquations(recursion, tree), list(tree.independent)
    rest = [k for k in range(tau.shape[1]) if k not in own]

    def motion(q: Array, v: Array) -> tuple[Array, Array, Array, Array]:
        q, rows = q.copy(), ties.rows(q)
        for _ in range(CLOSING):
            step = (np.linalg.pinv(rows[..., rest]) @ ties.violation(q)[..., None])[..., 0]
            q[:, rest] -= step
            if np.abs(step).max() < CLOSED:
                break
            rows = ties.rows(q)
        else:
            raise _NoMotionError(DEAD_POINT)
        mapped = following(rows, own)
        if not _agree(rows, mapped).all():
            raise _NoMotionError(HELD_TWICE)
        qd = (mapped @ v[..., None])[..., 0]
        onto = np.swapaxes(np.linalg.svd(rows[..., rest])[0][..., : len(rest)], -1, -2)
        moved = held_motion(recursion, States(q, qd, qd), onto @ rows, onto @ ties.rates(q, qd), tau, own)[0]
        return q, qd, moved[:, own], (qd * tau).sum(-1)

    return motion


def _agree(rows: Array, mapped: Array) -> Mask:
    """Return at which samples A G is zero, up to the rounding of a file's numbers, as booleans (samples,)."""
    left, sizes = (np.abs(part).max((1, 2)) for part in (rows @ mapped, np.abs(rows) @ np.abs(mapped)))
    agreed: Mask = left <= AGREED * sizes
    return agreed
