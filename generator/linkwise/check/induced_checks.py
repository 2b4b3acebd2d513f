"""Checks of induced accelerations and power by source, against the reference's shares and a solution of M."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from linkwise_runtime.dynamics import Dynamics
from linkwise_runtime.structure import PassiveJoint

from linkwise.arrays import Array, Index
from linkwise.check.compare import Entries, Result, compare, skipped
from linkwise.check.frame_checks import FrameReference, chosen_rows
from linkwise.check.model_calls import FLOAT32
from linkwise.check.sum_checks import SINGLE, passive_reference, regular
from linkwise.oracle.reference import Reference
from linkwise.oracle.states import States

Quantity = tuple[Array, Array]
"""Values (samples, n, ...) and their scales."""


@dataclass(frozen=True)
class _Sources:
    """Forces by source at some of the reference's states, and the mass matrix there."""

    states: States
    mass: Quantity
    forces: dict[str, Quantity]

    def accelerations(self) -> dict[str, Quantity]:
        """Return M^-1 F by source; rounding of F and of M qdd moves qdd by |M^-1| times as much.

        A force that is zero but for rounding moves the joints by that rounding, of which M qdd rounds again.
        """
        mass, noise = self.mass
        # Scaled to comparable joints, so that a finger's digits are not lost beside a leg's.
        own = np.abs(np.einsum("sii->si", mass))
        units = np.sqrt(np.where(own > 0.0, own, 1.0))
        inverse = (
            np.linalg.inv(mass / units[:, :, None] / units[:, None]) / units[:, :, None] / units[:, None]
        )
        found = {}
        for source, (force, size) in self.forces.items():
            columns = inverse @ flat(force)
            rounded = np.abs(columns) + FLOAT32["epsilon"] * (np.abs(inverse) @ flat(size))
            scale = np.abs(inverse) @ (flat(size) + noise @ rounded)
            found[source] = columns.reshape(force.shape), scale.reshape(force.shape)
        return found


def induced_calls(
    name: str,
    model: Dynamics,
    joints: Sequence[PassiveJoint],
    reference: Reference,
    frames: FrameReference | None,
    load_of: Callable[..., Any],
) -> Iterator[Result]:
    """Yield checks of the coordinates' shares, also for a motion's torques; for a tree of rigid links, whose
    frames there are, of links' power, and of a point under a load.
    """
    rows = chosen_rows(len(reference.states.q))
    rows, at = rows[regular(reference)[rows]], np.flatnonzero(regular(reference)[rows])
    if not rows.size:
        yield skipped(f"{name}: induced accelerations", "no mass matrix can be inverted here")
        return
    told = f"against {reference.name}"
    shares = [*_given(model, joints, reference, rows), *_asked(model, reference, rows)]
    yield compare(f"{name}: induced accelerations {told}", shares, reference.tolerance)
    if frames is not None:
        power = list(_power(model, joints, reference, rows))
        yield compare(f"{name}: induced power {told}", power, reference.tolerance)
        seen = _of_a_point(model, reference, rows, frames, at, load_of)
        yield compare(f"{name}: induced accelerations of a point {told}", seen, reference.tolerance)
    single = rows[(reference.fits_single() & regular(reference, SINGLE))[rows]]
    if single.size:
        shares = list(_given(model, joints, reference, single, np.float32))
        yield compare(f"{name}: induced accelerations in single precision", shares, **FLOAT32)
    else:
        yield skipped(
            f"{name}: induced accelerations in single precision", "no mass matrix is regular enough"
        )


def _given(
    model: Dynamics,
    joints: Sequence[PassiveJoint],
    reference: Reference,
    rows: Index,
    kind: type = np.float64,
) -> Iterator[Entries]:
    """Yield accelerations by given torques, with the passive torques of the joints."""
    sources = _sources(reference, rows, joints)
    motion: list[Any] = [a.astype(kind) for a in sources.states.motion]
    calls: Any = model
    found = calls.induced_accelerations(*motion, constraints=False)
    for source, (value, scale) in sources.accelerations().items():
        yield Entries(source, getattr(found, source), value, scale)


def _asked(model: Dynamics, reference: Reference, rows: Index) -> Iterator[Entries]:
    """Yield accelerations by the actuators that produce a given motion."""
    states = reference.states.at(rows)
    torque, size = (a["tau"][rows].sum(-1) for a in (reference.values, reference.scales))
    sources = _sources(reference, rows, ())
    own = _Sources(states, sources.mass, {"actuators": (diagonal(torque), diagonal(size))})
    found = model.induced_accelerations(states.q, states.qd, qdd=states.qdd, passive=False, constraints=False)
    yield Entries("actuators asked for", found.actuators, *own.accelerations()["actuators"])


def _power(
    model: Dynamics, joints: Sequence[PassiveJoint], reference: Reference, rows: Index
) -> Iterator[Entries]:
    """Yield what each source gives each link, then each armature.

    That is qd^T M_j qdd_x, and to link j what its own velocity forces and weight took from it.
    """
    sources = _sources(reference, rows, joints)
    qd, sizes = sources.states.qd, np.abs(sources.states.qd)
    rotors = passive_reference(joints, States(0.0 * qd, 0.0 * qd, np.ones_like(qd)))[0][3]
    turning = diagonal(rotors * qd)[:, np.flatnonzero(rotors.any(0))]
    momenta, bounds = (
        np.concatenate([np.einsum("sijk,si->sjk", of["c2"][rows], speed), own], 1)
        for of, speed, own in ((reference.values, qd, turning), (reference.scales, sizes, np.abs(turning)))
    )
    found: Any = model.induced_power(*sources.states.motion, constraints=False)
    for source, (moved, scale) in sources.accelerations().items():
        gain, size = momenta @ flat(moved), bounds @ (flat(scale) + np.abs(flat(moved)))
        if source in ("velocity", "gravity"):
            force, bound = map(flat, sources.forces[source])
            columns = np.arange(force.shape[2])
            links = columns // (force.shape[2] // model.N)
            gain[:, links, columns] -= np.einsum("si,six->sx", qd, force)
            size[:, links, columns] += np.einsum("si,six->sx", sizes, bound)
        shape = *gain.shape[:2], *moved.shape[2:]
        yield Entries(f"power of {source}", getattr(found, source), gain.reshape(shape), size.reshape(shape))


def _of_a_point(
    model: Dynamics,
    reference: Reference,
    rows: Index,
    frames: FrameReference,
    at: Index,
    load_of: Callable[..., Any],
) -> Iterator[Entries]:
    """Yield accelerations of the last frame at its point under a load; one source has that load twice."""
    sources = _sources(reference, rows, ())
    f, point, frame = len(frames.chosen) - 1, frames.points[-1], frames.chosen[-1]
    (jacobian, reach), (rate, change) = ((a[at, f] for a in q) for q in (frames.jacobian, frames.rate))
    moment, force = np.random.default_rng(6).uniform(-1.0, 1.0, (2, 3))
    wrench = np.concatenate([moment, force])
    lifted, bound = wrench @ jacobian, np.abs(wrench) @ reach
    sources.forces["loads"] = np.stack([lifted, 2.0 * lifted], -1), np.stack([bound, 2.0 * bound], -1)
    load = load_of(frame, force, moment, point)
    q, qd, tau = sources.states.motion
    found: Any = model.induced_accelerations(
        q,
        qd,
        tau,
        loads=(load, [load, load]),
        passive=False,
        frame=frame,
        point=point,
        constraints=False,
    )
    for source, (value, scale) in sources.accelerations().items():
        moved = jacobian @ flat(value)
        size = np.abs(jacobian) @ flat(scale) + reach @ np.abs(flat(value))
        shape = len(rows), 6, *value.shape[2:]
        yield Entries(
            f"{source} of {frame}", getattr(found, source), moved.reshape(shape), size.reshape(shape)
        )
    qd = sources.states.qd[:, None, :]
    yield Entries(f"kinematic of {frame}", found.kinematic, rate * qd, change * np.abs(qd))


def _sources(reference: Reference, rows: Index, joints: Sequence[PassiveJoint]) -> _Sources:
    """Return all sources but loads; the states' qdd serve as the actuators' torques."""
    states = reference.states.at(rows)
    values, scales = ({k: a[rows] for k, a in kept.items()} for kept in (reference.values, reference.scales))
    over = states.qd[:, None, None, :]
    shares, sizes = passive_reference(joints, states)
    rotor = passive_reference(joints, States(states.q, states.qd, np.ones_like(states.q)))[0][3]
    return _Sources(
        states,
        (values["c2"].sum(2) + diagonal(rotor), scales["c2"].sum(2) + diagonal(rotor)),
        {
            "actuators": (diagonal(states.qdd), diagonal(np.abs(states.qdd))),
            "velocity": (-values["c1"] * over, scales["c1"] * np.abs(over)),
            "gravity": (-values["g"], scales["g"]),
            "passive": (_by_kind(-shares[:3]), _by_kind(sizes[:3])),
        },
    )


def _by_kind(shares: Array) -> Array:
    """Return the diagonal matrices (samples, n, 3, n) of shares (3, samples, n)."""
    return np.moveaxis(diagonal(shares), 0, 2)


def diagonal(values: Array) -> Array:
    """Return matrices (..., n, n) with these values (..., n) on their diagonals."""
    matrices: Array = np.eye(values.shape[-1]) * values[..., None, :]
    return matrices


def flat(values: Array) -> Array:
    """Return values (samples, n, ...) as columns (samples, n, X)."""
    return values.reshape(*values.shape[:2], int(np.prod(values.shape[2:])))
