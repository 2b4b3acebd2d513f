"""Impedance of joints: targets at a state, and the acceleration and the torque that follow.

    M* (qdd - qdd_d) + B* (qd - qd_d) + K* (q - q_d) = f + v        u = H qdd + C qd + g + p - f

Under ties both hold along what these leave free: G^T times each of them, for qdd = G ydd + dG/dt yd
(`Freedom`).
H is the inertia of links and armature; p is the torque of the joints' own springs and damping, and of the
part of their friction that is to be compensated; v is what a task asks for where motions are cancelled.
"""

from collections.abc import Iterable
from numbers import Real
from typing import NamedTuple

import numpy as np

from ..answers.inertia_solve import Told
from ..arrays.backend import ArrayBackend
from ..chosen_names import short
from ..constraints.closed_places import times
from ..interface import Numbers
from ..structure import Structure, passive_torques, smooth_friction
from .freedom import Freedom
from .gains import Gain, TargetShares
from .target_solve import TargetInertia, solve_target

ORDERS = (1, 2)
"""Orders of motion propagation torques that can be cancelled: 1, of velocity, and 2, of acceleration."""
Entry = tuple[int, int, int, int]
"""Indices i, j, k and the order."""


class JointTargets(NamedTuple):
    """Targets of the joints."""

    inertia: TargetShares
    damping: TargetShares
    stiffness: Gain | None
    positive: bool
    """True if M* must be positive definite; else it must be regular, as where motions are cancelled."""
    passive: bool
    """True if the joints' own springs, damping and armature count."""
    friction_width: float | None
    """Width of the joints' friction, in rad/s or m/s; None where it is not compensated."""


class JointState(NamedTuple):
    """Robot at q and qd: the terms that its joints obey, and the targets for it."""

    freedom: Freedom
    """Coordinates that ties leave, and the velocities qd."""
    inertia: Numbers
    """H (..., n, n)."""
    coriolis: Numbers
    """C (..., n, n)."""
    rest: Numbers
    """g + p (..., n)."""
    target_inertia: Numbers
    """M* (..., n, n)."""
    target_damping: Numbers
    """B* (..., n, n)."""


class Errors(NamedTuple):
    """Differences of a state from its target, and forces on it, (..., n) each; None if there is none."""

    place: Numbers | None
    rate: Numbers
    wanted: Numbers | None
    """Wanted acceleration qdd_d."""
    force: Numbers | None
    """Sum of f, from outside, and v, of a task."""


class JointImpedance:
    """Joint targets of one robot, for any motion."""

    def __init__(self, structure: Structure, targets: JointTargets) -> None:
        self.targets, self._structure = targets, structure
        self._shares = any(not isinstance(t.kept, float) for t in (targets.inertia, targets.damping))

    def state(self, backend: ArrayBackend, q: Numbers, freedom: Freedom) -> JointState:
        """Return the terms that the joints obey at q (..., n) and velocities, and their targets there."""
        targets, c2, c1, qd = self.targets, None, None, freedom.qd
        if self._shares:
            c2, c1, by_link = backend.answers.coefficients(q, qd)
            mass, coriolis, rest = c2.sum(-2), c1.sum(-2), by_link.sum(-1)
        else:
            mass, coriolis, rest = backend.answers.sums(q, qd)
        inertia, wanted = mass, targets.inertia.of(backend, mass, c2, q)
        if targets.passive:
            sums = self._structure.passive_sums
            armature = backend.constant(np.diag(sums.armature), q)
            spring, damping, _, _ = passive_torques(backend, sums, q, qd, qd)
            inertia, rest = mass + armature, rest + spring + damping
            if targets.friction_width is not None:
                rest = rest + smooth_friction(backend, sums, qd, targets.friction_width)
            # a share of the links leaves out the armature, a sum that is given whole includes it
            wanted = wanted if targets.inertia.whole else wanted + armature
        damping = targets.damping.of(backend, coriolis, c1, q)
        return JointState(freedom, inertia, coriolis, rest, wanted, damping)

    def pull(self, backend: ArrayBackend, state: JointState, errors: Errors) -> Numbers:
        """Return -B* ed - K* e, (..., n)."""
        pull = -times(state.target_damping, errors.rate)
        if self.targets.stiffness is None or errors.place is None:
            return pull
        return pull - times(self.targets.stiffness.matrix(backend, errors.place), errors.place)

    def acceleration(
        self, backend: ArrayBackend, state: JointState, errors: Errors, told: bool = False
    ) -> Numbers:
        """Return qdd = qdd_d + M*^-1 (f + v - B* ed - K* e), (..., n), or what ties leave of it.

        Under ties, from any qdd_0 that they allow, qdd = qdd_0 + G (G^T M* G)^-1 G^T F, where F is
        f + v - B* ed - K* e - M* (qdd_0 - qdd_d).

        told: whether the accuracy that a natural M* allows is reported elsewhere
        """
        pull = self.pull(backend, state, errors)
        if errors.force is not None:
            pull = pull + errors.force
        freedom, positive = state.freedom, self.targets.positive
        allowed, off = freedom.beside(errors.wanted)
        if off is not None:
            pull = pull - times(state.target_inertia, off)
        whose = "what is left of the mass matrix"
        if positive:
            whose = "the mass matrix" if self.targets.inertia.natural else "the wanted inertia"
        singular = "the wanted inertia is not positive" if positive else f"{whose} is singular"
        about = TargetInertia(singular, Told(f"{whose} is nearly singular", freedom.names))
        natural = freedom.inner(state.inertia).diagonal(0, -2, -1)
        told = told and self.targets.inertia.natural
        force, wanted = freedom.projected(pull[..., None]), freedom.inner(state.target_inertia)
        moved = freedom.moved(solve_target(about, wanted, force, natural, positive, told))[..., 0]
        return moved if allowed is None else allowed + moved

    def natural_torque(self, backend: ArrayBackend, state: JointState, errors: Errors) -> Numbers:
        """Return u = H qdd_d + C qd + g + p - B* ed - K* e, (..., n).

        f drops out where all inertia stays natural, and so does what ties leave of qdd.
        """
        torque = times(state.coriolis, state.freedom.qd) + state.rest + self.pull(backend, state, errors)
        return torque if errors.wanted is None else torque + times(state.inertia, errors.wanted)

    def torque(self, state: JointState, qdd: Numbers, external: Numbers | None) -> Numbers:
        """Return u = H qdd + C qd + g + p - f, (..., n)."""
        torque = times(state.inertia, qdd) + times(state.coriolis, state.freedom.qd) + state.rest
        return torque if external is None else torque - external

    def stored(self, backend: ArrayBackend, state: JointState, errors: Errors) -> Numbers:
        """Return the stored energy (ed' M* ed + e' K* e) / 2, (...)."""
        energy = (errors.rate * times(state.target_inertia, errors.rate)).sum(-1) / 2.0
        if self.targets.stiffness is None or errors.place is None:
            return energy
        stiffness = self.targets.stiffness.matrix(backend, errors.place)
        return energy + (errors.place * times(stiffness, errors.place)).sum(-1) / 2.0


def dissipates(inertia: TargetShares, damping: TargetShares) -> bool:
    """Return whether c2 and c1 of each link are kept alike.

    dM*/dt - 2 B* is then skew-symmetric, except for what is added.
    """
    if not (inertia.positive and damping.positive) or inertia.by_link is None or damping.by_link is None:
        return False
    return bool((inertia.by_link == damping.by_link).all())


def cancelled_motions(entries: Iterable[object], structure: Structure) -> tuple[Entry, ...]:
    """Return the indices of entries chosen by name or number; None in a place stands for all there are.

    Raises ValueError for an entry that does not exist, is always zero, or is named twice.
    """
    found: dict[Entry, None] = {}
    if isinstance(entries, str) or not isinstance(entries, Iterable):
        raise TypeError(
            f"{short(entries)} is to be cancelled; give a set of (joint, link, coordinate, order)"
        )
    for entry in entries:
        if not isinstance(entry, tuple) or len(entry) != 4:
            raise ValueError(f"{short(entry)} is to be cancelled; give (joint, link, coordinate, order)")
        here = _meant(entry, structure)
        if not here:
            raise ValueError(
                f"{short(entry)} is to be cancelled, but is always zero, as a joint "
                "acts on the links that it moves"
            )
        if None not in entry and here[0] in found:
            raise ValueError(f"{short(entry)} is to be cancelled twice; name it once")
        found.update(dict.fromkeys(here))
    if not found:
        raise ValueError("nothing is to be cancelled; give (joint, link, coordinate, order), one or more")
    return tuple(sorted(found))


def _meant(entry: tuple[int | str | None, ...], structure: Structure) -> list[Entry]:
    """Return all entries that one stands for, without those that are always zero."""
    joint, link, coordinate, order = entry
    if order is not None and (isinstance(order, bool) or order not in ORDERS):
        raise ValueError(
            f"the order of {short(entry)} is {short(order)}; cancel 1, of velocity, or 2, of "
            "acceleration, as gravity, as any potential, is compensated in any case"
        )
    i_wanted = None if joint is None else structure.joint_index(joint)
    j_wanted = None if link is None else structure.link_index(link)
    k_wanted = None if coordinate is None else structure.joint_index(coordinate, "coordinate")
    return [
        (i, j, k, m)
        for j, path in enumerate(structure.paths)
        for i in path
        for k in path
        for m in ORDERS
        if i_wanted in (None, i) and j_wanted in (None, j) and k_wanted in (None, k) and order in (None, m)
    ]


def friction_width_of(given: object, passive: bool) -> float | None:
    """Return the width of friction, or None; raises ValueError if it is no velocity, or without friction."""
    if given is None:
        return None
    if isinstance(given, bool) or not isinstance(given, Real) or not 0.0 < float(given) < np.inf:
        raise ValueError(
            f"friction_width is {short(given)}; give a velocity above 0, in rad/s or m/s, within which "
            "friction is smooth, or None to compensate none"
        )
    if not passive:
        raise ValueError(
            "friction_width is given, and passive=False takes friction for not being there; leave one away"
        )
    return float(given)
