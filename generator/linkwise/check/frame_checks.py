"""Checks of the kinematics of frames against the recursion's own frames, one unit velocity at a time.

With q̇ = e_k the recursion's velocities are column k of the Jacobian, and their complex step along q̇ is that
column's rate. Scales are bounds of what each number is summed from, as in `magnitudes`.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from linkwise_runtime.dynamics import Dynamics
from linkwise_runtime.rule.joint_tree import JointTree

from linkwise.arrays import Array, Index
from linkwise.check.compare import Entries, Result, compare
from linkwise.oracle.magnitudes import Magnitudes
from linkwise.oracle.newton_euler import NewtonEuler
from linkwise.oracle.reference import COMPLEX_STEP, TOLERANCE
from linkwise.oracle.states import States
from linkwise.package.manifest import Manifest

STATES = 12
MOST_FRAMES = 16
"""Most frames that calls for a single one are tried with; poses are checked for all."""

Quantity = tuple[Array, Array]
"""Values and their scales."""


@dataclass(frozen=True)
class FrameReference:
    """Answers at `states`, samples first, then frames: those of the `chosen` frames, each at its point."""

    states: States
    chosen: tuple[str, ...]
    points: Array
    poses: Quantity
    jacobian: Quantity
    rate: Quantity
    velocity: Quantity
    acceleration: Quantity
    centre: tuple[Quantity, Quantity, Quantity] | None
    """Centre of mass, its Jacobian and rate; None for links whose masses cancel."""


def frame_reference(manifest: Manifest, tree: JointTree, states: States) -> FrameReference:
    """Return the recursion's answers at some of the states."""
    states = states.at(chosen_rows(len(states.q)))
    count = len(tree.frames)
    chosen = np.unique(np.linspace(0, count - 1, min(count, MOST_FRAMES)).astype(int))
    frames = [tree.frames[f] for f in chosen]
    points = np.random.default_rng(3).uniform(-1.0, 1.0, (len(frames), 3))
    recursion, sizes = NewtonEuler(manifest, tree), Magnitudes(manifest, tree)
    at = [(frame.joint, frame.translation, frame.rotation) for frame in frames]
    seen = [(body, np.array(t) + np.array(r) @ x) for (body, t, r), x in zip(at, points, strict=True)]
    (q, qd, qdd), most = states.motion, [np.abs(x) for x in states.motion]
    speed, change = recursion.points(seen, q, qd, qdd)
    speeds, changes = sizes.points(seen, *most)
    whole = [(frame.joint, np.array(frame.translation)) for frame in tree.frames]
    return FrameReference(
        states,
        tuple(frame.name for frame in frames),
        points,
        (recursion.poses(tree.frames, q), sizes.poses(whole, most[0])),
        *_columns(
            lambda *motion: recursion.points(seen, *motion)[0], lambda *m: sizes.points(seen, *m), states
        ),
        (speed, speeds),
        (change, changes),
        _centre(recursion, sizes, tree, states),
    )


def chosen_rows(count: int) -> Index:
    """Return the indices, among `count` states, of those that the reference is for."""
    return np.linspace(0, count - 1, min(STATES, max(2, count // 2))).astype(np.intp)


def _columns(
    velocity: Callable[..., Array], sizes: Callable[..., Quantity], states: States
) -> tuple[Quantity, Quantity]:
    """Return the Jacobian of a velocity function and its rate, (samples, ..., n), each with its scale."""
    n = states.q.shape[1]
    q, qd = (np.repeat(x, n, 0) for x in (states.q, states.qd))
    units, rest = np.tile(np.eye(n), (len(states.q), 1)), 0.0 * q

    def sorted_out(a: Array) -> Array:
        return np.moveaxis(a.reshape(-1, n, *a.shape[1:]), 1, -1)

    moved = velocity(q + 1j * COMPLEX_STEP * qd, units, rest).imag / COMPLEX_STEP
    at, speed = np.abs(q), np.abs(qd)
    # A is an acceleration bound, quadratic in velocities: A(q̇ + e_k) - A(q̇) - A(e_k) bounds dJ_k/dt.
    bound = sizes(at, speed + units, rest)[1] - sizes(at, speed, rest)[1] - sizes(at, units, rest)[1]
    jacobian = sorted_out(velocity(q, units, rest)), sorted_out(sizes(at, units, rest)[0])
    return jacobian, (sorted_out(moved), sorted_out(bound))


def _centre(
    recursion: NewtonEuler, sizes: Magnitudes, tree: JointTree, states: States
) -> tuple[Quantity, Quantity, Quantity] | None:
    masses = np.array([link.mass for link in tree.links])
    total, whole = masses.sum(), np.abs(masses).sum()
    if abs(total) <= TOLERANCE * whole:
        return None
    seen = [(link.joint, np.array(link.com)) for link in tree.links]

    def velocity(*motion: Array) -> Array:
        speed: Array = masses @ recursion.points(seen, *motion)[0][..., 3:] / total
        return speed

    def bounds(*motion: Array) -> Quantity:
        speed, change = (np.abs(masses) @ a[..., 3:] / abs(total) for a in sizes.points(seen, *motion))
        return speed, change

    places = recursion.places(seen, states.q), sizes.poses(seen, np.abs(states.q))[..., :3, 3]
    centre = masses @ places[0] / total, np.abs(masses) @ places[1] / abs(total)
    return (centre, *_columns(velocity, bounds, states))


def frame_calls(name: str, model: Dynamics, reference: FrameReference) -> Iterator[Result]:
    """Yield the results of each call of a back end's kinematics."""
    states, told = reference.states, "against Newton-Euler recursion"
    kinematics: Any = model.kinematics
    value, scale = reference.poses
    poses = [Entries("pose", kinematics.poses(states.q), value, scale)]
    index = [kinematics.frames.index(frame) for frame in reference.chosen]
    for f, frame in zip(index, reference.chosen, strict=True):
        poses.append(Entries(f"pose of {frame}", kinematics.pose(states.q, frame), value[:, f], scale[:, f]))
    yield compare(f"{name}: poses of frames {told}", poses)
    yield compare(f"{name}: velocities of points {told}", _of_points(kinematics, reference))
    yield compare(f"{name}: torque of loads on points {told}", _of_loads(kinematics, reference))
    if reference.centre is not None:
        calls = (
            kinematics.centre_of_mass(states.q),
            kinematics.centre_of_mass_jacobian(states.q),
            kinematics.centre_of_mass_jacobian_rate(states.q, states.qd),
        )
        named = zip(("centre", "its Jacobian", "its rate"), calls, reference.centre, strict=True)
        entries = [Entries(what, found, *quantity) for what, found, quantity in named]
        yield compare(f"{name}: centre of mass {told}", entries)


def _of_points(kinematics: Any, reference: FrameReference) -> Iterator[Entries]:
    q, qd, qdd = reference.states.motion
    for f, (frame, point) in enumerate(zip(reference.chosen, reference.points, strict=True)):
        calls = {
            "jacobian": kinematics.jacobian(q, frame, point),
            "rate": kinematics.jacobian_rate(q, qd, frame, point),
            "velocity": kinematics.velocity(q, qd, frame, point),
            "acceleration": kinematics.acceleration(q, qd, qdd, frame, point),
        }
        for what, found in calls.items():
            value, scale = getattr(reference, what)
            yield Entries(f"{what} of {frame}", found, value[:, f], scale[:, f])


def _of_loads(kinematics: Any, reference: FrameReference) -> Iterator[Entries]:
    """Yield -J^T (moment, force) of loads given at a point of the frame, and at its place in the world."""
    q = reference.states.q
    wrenches = np.random.default_rng(4).uniform(-1.0, 1.0, (len(reference.chosen), 6))
    for f, (frame, point) in enumerate(zip(reference.chosen, reference.points, strict=True)):
        wrench, at = wrenches[f], kinematics.frames.index(frame)
        jacobian, scale = (a[:, f] for a in reference.jacobian)
        pose, reach = (a[:, at] for a in reference.poses)
        expected, bound = -wrench @ jacobian, np.abs(wrench) @ scale
        loads = {"moment": wrench[:3], "force": wrench[3:]}
        yield Entries(
            f"load on {frame}", kinematics.load_torque(q, frame, point=point, **loads), expected, bound
        )
        place = pose[:, :3, :3] @ point + pose[:, :3, 3]
        # This moment is summed from numbers as large as the force's moment about the world's origin.
        arm = reach[:, :3, 3].sum(-1) + np.abs(point).sum()
        bound = bound + arm[:, None] * np.abs(wrench[3:]).sum() * scale[:, :3].sum(1)
        yield Entries(
            f"load at {frame}", kinematics.load_torque(q, frame, at=place, **loads), expected, bound
        )
