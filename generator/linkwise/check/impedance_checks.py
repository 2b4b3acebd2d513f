"""Checks of a back end's controllers: their promised impedance, by the reference's coefficients."""

from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np
from linkwise_runtime.dynamics import Dynamics
from linkwise_runtime.rule.joint_tree import JointTree
from linkwise_runtime.structure import PassiveJoint

from linkwise.arrays import Array
from linkwise.check.compare import Entries, Result, compare, skipped
from linkwise.check.sum_checks import is_tied, passive_reference, regular
from linkwise.oracle.loop_reference import LoopReference
from linkwise.oracle.reference import Reference
from linkwise.oracle.states import States

REGULAR = 1e-6
"""Least eigenvalue of an inertia that is asked for, by its largest entry, where one is."""
WIDTH = 0.5
"""Width `friction_width` of the friction that is compensated."""


def impedance_calls(
    name: str,
    model: Dynamics,
    tree: JointTree | None,
    joints: Sequence[PassiveJoint],
    reference: Reference,
    natural: Callable[..., Any],
) -> Iterator[Result]:
    """Yield checks of a scaled impedance with springs, and of a cancelled motion.

    natural: the package's `Natural`
    """
    if is_tied(model):
        return
    rows = np.flatnonzero(regular(reference))
    if not rows.size:
        yield skipped(f"{name}: controllers", "no mass matrix can be inverted here")
        return
    # impedance needs a positive definite M, which negative masses do not give
    positive = rows[np.linalg.eigvalsh(reference.values["c2"][rows].sum(2)).min(-1) > 0.0]
    entries = [_cancelled(model, joints, reference, rows)]
    if positive.size:
        links = len(model.link_names)
        kept = np.linspace(0.5, 1.5, links) if _are_masses(tree) else np.full(links, 0.7)
        entries += _shaped(model, joints, reference, positive, kept, natural)
    yield compare(f"{name}: controllers make the impedance that is asked for", entries, reference.tolerance)


def tied_impedance_calls(
    name: str, model: Dynamics, reference: LoopReference, natural: Callable[..., Any]
) -> Iterator[Result]:
    """Yield a check of a scaled impedance of tied joints, at states where it is positive.

    natural: the package's `Natural`
    """
    kept = np.linspace(0.5, 1.5, len(model.link_names))
    wanted = (kept[:, None] * reference.values["c2^"]).sum(2)
    rows = np.flatnonzero(np.linalg.eigvalsh(wanted).min(-1) > REGULAR * np.abs(wanted).max((1, 2)))
    told = f"{name}: controllers make the impedance that is asked for in closed loops"
    if rows.size:
        yield compare(told, _tied(model, reference, rows, kept, natural))
    else:
        yield skipped(told, "what is asked for is not positive at any state")


def _tied(
    model: Dynamics, reference: LoopReference, rows: Any, kept: Array, natural: Callable[..., Any]
) -> Iterator[Entries]:
    """Yield the sum of w_j (c2^ ydd + c1^ yd) = f^ of the acceleration, and the torque it needs.

    kept: share w_j of each link, (N,)
    """
    own = list(reference.independent)
    shares = natural(np.broadcast_to(kept, (len(model.joint_names), len(kept))))
    controller = model.partial_impedance(inertia=shares, damping=shares, passive=False)
    q, qd, force = (a[rows] for a in (reference.states.q, reference.states.qd, reference.tau))
    qdd, tau = (
        np.asarray(call(q, qd, None, force))[:, own] for call in (controller.acceleration, controller)
    )
    sources = reference.values, reference.scales
    (mass, scale), (coriolis, size), (gravity, gravity_size), (push, push_size) = (
        [source[what][rows] for source in sources] for what in ("c2^", "c1^", "g^", "projected")
    )
    yd, weight = qd[:, own], kept[:, None]
    inertia, pull = (weight * mass).sum(2), push - _along((weight * coriolis).sum(2), yd)
    wanted_size = _along((weight * scale).sum(2) + _eliminated(inertia), np.abs(qdd))
    pull_size = push_size + _along((weight * size).sum(2), np.abs(yd))
    yield Entries("M* ydd", _along(inertia, qdd), pull, wanted_size + pull_size)
    taken = _along(mass.sum(2), qdd) + _along(coriolis.sum(2), yd) + gravity.sum(-1)
    taken_size = _along(scale.sum(2), np.abs(qdd)) + _along(size.sum(2), np.abs(yd)) + gravity_size.sum(-1)
    yield Entries("torque", tau + push, taken, taken_size + push_size)


def _are_masses(tree: JointTree | None) -> bool:
    """Return whether no link has a negative mass or principal moment, so that each may be kept in part."""
    if tree is None:
        return False
    moments = np.linalg.eigvalsh([link.inertia for link in tree.links])
    return (
        bool((moments[:, 0] >= -1e-9 * moments[:, 2]).all()) and min(link.mass for link in tree.links) >= 0.0
    )


def _shaped(
    model: Dynamics,
    joints: Sequence[PassiveJoint],
    reference: Reference,
    rows: Any,
    kept: Array,
    natural: Any,
) -> Iterator[Entries]:
    """Yield M* qdd + B* qd + K* e = f of the acceleration, and the torque that the plant needs for it.

    kept: share of each link in M*, (N,)
    """
    n = len(model.joint_names)
    q, qd, _ = reference.states.at(rows).motion
    sources = reference.values, reference.scales
    mass, scale = (source["c2"][rows] for source in sources)
    coriolis, size = (source["c1"][rows] for source in sources)
    own = float(np.abs(mass.sum(2)).max())
    more, stiffness, at = own * np.linspace(0.1, 0.3, n), own * np.linspace(1.0, 3.0, n), 0.9 * q
    force = reference.values["tau"][rows].sum(-1)
    shares = np.broadcast_to(kept, (n, len(kept)))
    damping = natural(shares, plus=more)
    controller = model.partial_impedance(
        inertia=natural(shares), damping=damping, stiffness=stiffness, friction_width=WIDTH
    )
    qdd, tau = (np.asarray(call(q, qd, at, force)) for call in (controller.acceleration, controller))
    parts, sizes = passive_reference(joints, States(q, qd, qdd))
    rest, rest_size = parts[:2].sum(0) + parts[2] * np.tanh(np.abs(qd) / WIDTH), sizes[:3].sum(0)
    armature, armature_size = parts[3], sizes[3]
    weight = kept[:, None]
    inertia = (weight * mass).sum(2)
    wanted = _along(inertia, qdd) + armature
    pull = force - _along((weight * coriolis).sum(2), qd) - more * qd - stiffness * (q - at)
    wanted_size = _along((weight * scale).sum(2) + _eliminated(inertia), np.abs(qdd)) + armature_size
    pull_size = np.abs(force) + _along((weight * size).sum(2), np.abs(qd)) + more * np.abs(qd)
    yield Entries("M* qdd", wanted, pull, wanted_size + pull_size + stiffness * np.abs(q - at))
    gravity, gravity_size = (source["g"][rows].sum(-1) for source in sources)
    taken = _along(mass.sum(2), qdd) + armature + _along(coriolis.sum(2), qd) + gravity + rest
    taken_size = _along(scale.sum(2), np.abs(qdd)) + armature_size + _along(size.sum(2), np.abs(qd))
    yield Entries("torque", tau + force, taken, taken_size + gravity_size + rest_size + np.abs(force))


def _along(matrix: Array, vector: Array) -> Array:
    """Return products (samples, n) of matrices (samples, n, n) and vectors (samples, n)."""
    product: Array = np.einsum("sik,sk->si", matrix, vector)
    return product


def _eliminated(inertia: Array) -> Array:
    """Return what elimination sums for each entry of M (samples, n, n): |L| |L^T|, at most sqrt(M_ii M_kk).

    Any solution of M x = f has the rounding of that, also where M_ik is next to nothing (Higham, Accuracy and
    Stability of Numerical Algorithms, theorem 10.4).
    """
    size = np.sqrt(np.abs(np.einsum("sii->si", inertia)))
    entries: Array = size[:, :, None] * size[:, None]
    return entries


def _cancelled(model: Dynamics, joints: Sequence[PassiveJoint], reference: Reference, rows: Any) -> Entries:
    """Return a torque that cancels the last link's velocity torques on the first joint that moves it.

    No inertia is changed.
    """
    q, qd, task = reference.states.at(rows).motion
    moving = np.flatnonzero(np.abs(reference.values["c2"]).sum((0, 1, 3)))
    j = int(moving[-1])
    i = int(np.flatnonzero(np.abs(reference.values["c2"][:, :, j]).sum((0, 2)))[0])
    tau = np.asarray(model.cancel(entries={(i, j, None, 1)})(q, qd, task))
    sums = [source["g"][rows].sum(-1) for source in (reference.values, reference.scales)]
    sums[0][:, i] += (reference.values["c1"][rows, i, j] * qd).sum(-1)
    sums[1][:, i] += (reference.scales["c1"][rows, i, j] * np.abs(qd)).sum(-1)
    # springs and damping: friction is not compensated unless it is asked for
    rest, size = (a[:2].sum(0) for a in passive_reference(joints, States(q, qd, 0.0 * qd)))
    return Entries("cancelling torque", tau, sums[0] + rest + task, sums[1] + size + np.abs(task))
