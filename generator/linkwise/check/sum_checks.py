"""Checks of sums over the links, accelerations, energies, power and passive torques of a back end."""

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from linkwise_runtime.dynamics import Dynamics
from linkwise_runtime.structure import PassiveJoint

from linkwise.arrays import Array, Mask
from linkwise.check.compare import Entries, Result, compare, skipped
from linkwise.check.model_calls import FLOAT32, TOO_LARGE
from linkwise.oracle.reference import Reference
from linkwise.oracle.states import NUMBERS, States

REGULAR = 1e-8
"""Least eigenvalue of a mass matrix, with ones on its diagonal, for which accelerations are checked."""
SINGLE = 1e-3
"""Least such eigenvalue for which accelerations in single precision are checked."""
MOST = 12
"""Most states for Christoffel symbols; fewer for many joints."""

FLOAT = " in single precision"
LARGEST = 1 << 27
"""Most bytes of Christoffel symbols by link that are asked for."""


def sum_calls(name: str, model: Dynamics, reference: Reference) -> Iterator[Result]:
    """Yield checks of every call, at all states, none and one, and in single precision."""
    every = np.arange(len(reference.states.q))
    few = [every[:0], *([every[0], every[:1, None]] if len(every) else [])]
    batches = [every, *(() if reference.is_large else few)]
    groups = (each for at in batches for each in _sums(model, reference, at))
    yield compare(f"{name}: sums over the links", groups, reference.tolerance)
    yield from _symbols(f"{name}: Christoffel symbols", model, reference)
    powers = _power(model, reference)
    yield compare(f"{name}: power is what each link's energy gains", powers, reference.tolerance)
    if reference.energies:
        energies = (each for at in batches for each in _energies(model, reference, at))
        yield compare(f"{name}: energies of the links", energies, reference.tolerance)
    if not is_tied(model):  # under ties it is checked where these close
        yield _forward_dynamics(name, model, reference)
    fitting = np.flatnonzero(reference.fits_single())
    if fitting.size:
        single = _sums(model, reference, fitting, np.float32)
        yield compare(f"{name}: sums in single precision", single, **FLOAT32)
    else:
        yield skipped(f"{name}: sums in single precision", TOO_LARGE)


def _sums(model: Dynamics, reference: Reference, at: Any, kind: Any = float) -> Iterator[Entries]:
    """Yield matrices and gravity of some samples, whole and link by link."""
    q, qd, _ = (a.astype(kind) for a in reference.states.at(at).motion)
    has_mass = max(model.structure.degrees, default=2) <= 2
    for by_link in (False, True):
        velocity = reference.values["c1"], reference.scales["c1"]
        if has_mass:
            yield _summed("M", model.mass_matrix(q, by_link=by_link), reference.at_rest("c2"), at, by_link)
        yield _summed("C", model.coriolis_matrix(q, qd, by_link=by_link), velocity, at, by_link)
        yield _summed("g", model.gravity_torque(q, by_link=by_link), reference.at_rest("g"), at, by_link)


def _summed(what: str, value: Array, shares: tuple[Array, Array], at: Any, by_link: bool) -> Entries:
    at = np.asarray(at)
    source, scale = (kept[at] if by_link else kept[at].sum(at.ndim + 1) for kept in shares)
    return _flat(f"{what}{' by link' * by_link}", value, source, scale, at.ndim)


def _symbols(name: str, model: Dynamics, reference: Reference) -> Iterator[Result]:
    """Yield checks that Christoffel symbols make the Coriolis matrix of random velocities.

    Links whose velocity forces have more than two velocities at once have none.
    """
    if max(model.structure.degrees, default=2) > 2:
        return
    n, links = len(model.joint_names), len(model.link_names)
    few = np.arange(min(max(1, min(MOST, NUMBERS // (n**3 * links))), len(reference.states.q)))
    shares = reference.values["c1"], reference.scales["c1"]

    def entries(rows: Any, by_link: bool, kind: Any) -> Iterator[Entries]:
        for at in (rows, *(() if reference.is_large else (rows[:0], *rows[:1]))):
            q, qd = (a[at].astype(kind) for a in (reference.states.q, reference.states.qd))
            symbols = model.christoffel(q, by_link=by_link)
            value = np.einsum("...l,...l->...", symbols, qd[(..., *[None] * (2 + by_link), slice(None))])
            yield _summed("Gamma qd", value, shares, at, by_link)

    ways = (False, True) if 8 * n**3 * links <= LARGEST else (False,)
    groups = (each for by_link in ways for each in entries(few, by_link, float))
    yield compare(name, groups, reference.tolerance)
    fitting = few[reference.fits_single()[few]]
    if fitting.size:
        groups = (each for by_link in ways for each in entries(fitting, by_link, np.float32))
        yield compare(f"{name}{FLOAT}", groups, **FLOAT32)
    else:
        yield skipped(f"{name}{FLOAT}", TOO_LARGE)
    if len(ways) == 1:
        size = 8 * n**3 * links / 2**30
        yield skipped(f"{name} by link", f"one sample of {n} joints and {links} links takes {size:.1f} GiB")


def _power(model: Dynamics, reference: Reference) -> Iterator[Entries]:
    """Yield each part of the power, and their sum for each link."""
    q, qd, qdd = reference.states.motion
    values, scales, power = reference.values, reference.scales, model.power(q, qd, qdd)
    rate = qd[:, :, None, None]
    for what, part, k in (("c2", power.acceleration, qdd), ("c1", power.velocity, qd)):
        over = k[:, None, None, :] * rate
        yield Entries(f"{what} power", part, values[what] * over, scales[what] * np.abs(over))
    gravity, scale = (
        kept["g"] * factor for kept, factor in ((values, rate[..., 0]), (scales, np.abs(rate[..., 0])))
    )
    yield Entries("g power", power.gravity, gravity, scale)
    if reference.power is not None:
        scale = np.einsum("sij,si->sj", scales["tau"], np.abs(qd))
        yield Entries("power", power.total.sum(1), reference.power, scale)


def _energies(model: Dynamics, reference: Reference, at: Any) -> Iterator[Entries]:
    states = reference.states.at(at)
    for (what, (value, scale)), found in zip(
        reference.energies.items(), model.energy(*states.motion[:2]), strict=True
    ):
        yield _flat(f"{what} energy", found, value[at], scale[at], np.ndim(at))


def _forward_dynamics(name: str, model: Dynamics, reference: Reference) -> Result:
    """Check that forward dynamics undoes inverse dynamics, at all states and at one."""
    invertible = np.flatnonzero(regular(reference))
    if not invertible.size:
        return skipped(f"{name}: forward dynamics", "no mass matrix can be inverted here")
    moved = (each for at in (invertible, invertible[0]) for each in _accelerations(model, reference, at))
    return compare(f"{name}: forward dynamics undoes inverse dynamics", moved, reference.tolerance)


def _accelerations(model: Dynamics, reference: Reference, at: Any) -> Iterator[Entries]:
    """Yield accelerations by the reference's torques.

    Rounding of these and of M qdd moves qdd by |M^-1| times as much.
    """
    q, qd, qdd = reference.states.at(at).motion
    found = model.forward_dynamics(q, qd, reference.values["tau"][at].sum(-1), passive=False)
    yield _flat("qdd", found, qdd, acceleration_scales(reference, at), np.ndim(at))


def is_tied(model: Dynamics) -> bool:
    """Return whether constraints tie the joints."""
    return model.backend.ties_joints


def acceleration_scales(
    reference: Reference, at: Any, armature: Array | float = 0.0, own: Array | float = 0.0
) -> Array:
    """Return sizes of what the accelerations of some samples are summed from: |M^-1| times their torques'.

    armature (n, n) is added to M; own (n) are sizes of the passive torques.
    """
    mass = reference.values["c2"][at].sum(np.ndim(at) + 1) + armature
    noise = (reference.scales["tau"][at].sum(-1) + own)[..., None]
    qdd = np.abs(reference.states.at(at).qdd)[..., None]
    noise = noise + reference.scales["c2"][at].sum(np.ndim(at) + 1) @ qdd
    scale: Array = (np.abs(np.linalg.inv(mass)) @ noise)[..., 0]
    return scale


def regular(reference: Reference, least: float = REGULAR) -> Mask:
    """Return which samples have a mass matrix far from singular, in whatever units joints are measured."""
    far: Mask = reference.regularity > least
    return far


def _flat(what: str, value: Array, expected: Array, scale: Array, axes: int) -> Entries:
    """Return entries of a batch of `axes` axes, with samples on one axis."""
    if value.shape != expected.shape:
        return Entries(what, value, expected, scale)
    value, expected, scale = (a.reshape(-1, *a.shape[axes:]) for a in (value, expected, scale))
    return Entries(what, value, expected, scale)


SHARES = ("spring", "damping", "friction", "armature")


def passive_calls(
    name: str, model: Dynamics, joints: Sequence[PassiveJoint], reference: Reference
) -> Iterator[Result]:
    """Yield checks of the call for many states, for one, and in single precision.

    All values are zero where no joint has passive torques.
    """
    states = reference.states
    values, scales = passive_reference(joints, states)

    def entries(dtype: Any, rows: Any) -> Iterator[Entries]:
        motion: list[Any] = [x[rows].astype(dtype) for x in states.motion]
        found = model.passive_torque(*motion)
        for what, value, expected, scale in zip(SHARES, found, values, scales, strict=True):
            # A single state becomes a batch of one, as errors are reported by sample.
            shape = (-1, expected.shape[1])
            yield Entries(
                what,
                np.asarray(value).reshape(shape),
                expected[rows].reshape(shape),
                scale[rows].reshape(shape),
            )

    every = [*entries(float, slice(None)), *(entries(float, 0) if len(states.q) else ())]
    yield compare(f"{name}: passive torques of the joints", every)
    single = entries(np.float32, slice(None))
    yield compare(f"{name}: passive torques in single precision", single, **FLOAT32)
    if joints and len(states.q) and not is_tied(model):
        check, invertible = f"{name}: accelerations that passive torques leave", regular(reference)
        if invertible.any():
            yield compare(check, [_torques_of_accelerations(model, joints, reference, invertible)])
        else:
            yield skipped(check, "no mass matrix can be inverted here")


def _torques_of_accelerations(
    model: Dynamics, joints: Sequence[PassiveJoint], reference: Reference, at: Mask
) -> Entries:
    """Return torques given to forward dynamics beside those that its accelerations need.

    Both are summed from the torques of the links, also at rest: gravity alone has rounding.
    """
    states = reference.states.at(at)
    q, qd, qdd = states.motion
    values, scales = passive_reference(joints, states)
    tau = model.inverse_dynamics(q, qd, qdd) + values.sum(0)
    found = model.forward_dynamics(q, qd, tau)
    taken, sizes = passive_reference(joints, States(q, qd, found))
    mass = reference.scales["c2"][at].sum(2) @ (np.abs(found) + np.abs(qdd))[..., None]
    scale = reference.scales["tau"][at].sum(-1) + mass[..., 0] + scales.sum(0) + sizes.sum(0)
    return Entries("tau", model.inverse_dynamics(q, qd, found) + taken.sum(0), tau, scale)


def passive_reference(joints: Sequence[PassiveJoint], states: States) -> tuple[Array, Array]:
    """Return shares (4, samples, n), and the sizes of what they are summed from.

    For a joint at p = r q a torque f does the work f dp = r f dq: it counts r times on the coordinate.
    """
    q, qd, qdd = states.motion
    values, scales = np.zeros((2, len(SHARES), *q.shape))
    for joint in joints:
        k, r = joint.coordinate, joint.ratio
        p, pd, pdd = (r * x[:, k] for x in (q, qd, qdd))
        own = (
            joint.stiffness * (p - joint.rest),
            joint.damping * pd,
            joint.friction * np.sign(pd),
            joint.armature * pdd,
        )
        values[..., k] += r * np.stack(own)
        scales[..., k] += abs(r) * np.abs(own)
        scales[0, :, k] += abs(r * joint.stiffness) * (np.abs(p) + abs(joint.rest))
    return values, scales
