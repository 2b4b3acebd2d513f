"""Equations of motion split by source along a motion that took place.

    M v'_s + C(q, qd) v_s = F_s + A^T lambda_s        A v'_s = -dA/dt v_s under constraints A qd = 0

for each source s of forces, with C_ik = sum_j c1_ijk. Their sum over s is the equation of motion, so that the
v_s sum to qd. As dM/dt = C + C^T, each 1/2 v_s^T M v_s changes by v_s^T F_s alone.

Under constraints v_s = G w_s of the independent coordinates, with

    G^T M G w'_s + G^T (M dG/dt + C G) w_s = G^T F_s
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from ..arrays.backend import ArrayBackend
from ..constraints.closed_places import ClosedPlace, times
from ..constraints.robot_constraints import Constraints
from ..interface import Numbers, namespace
from .between_samples import SampledMotion
from .collocation import LinearEquations

TORQUE, SHARE, LOAD, RESIDUAL, START = "torque", "share", "load", "residual", "start"
"""Kinds of sources, which the names of sources begin with.

The residual is what motion needs and given torques leave, or what it needs of a joint that nothing drives.
"""
BETWEEN = ":"
"""Sign between the kind of a source and the name of its joint, link or load."""


class TraceAt(NamedTuple):
    """Equations of all sources at instants, and the motion there."""

    qd: Numbers
    """Velocities of all joints, (..., n)."""
    equations: LinearEquations
    """Equations of the independent coordinates, whose columns are the sources."""
    place: ClosedPlace | None

    @property
    def own_velocity(self) -> Numbers:
        """Velocities of the independent joints, (..., m)."""
        return self.qd if self.place is None else self.place.own(self.qd)


@dataclass(frozen=True)
class TraceEquations:
    """Equations of motion of a robot for each source of forces."""

    backend: ArrayBackend
    """Back end of the robot."""
    constraints: Constraints[Any] | None
    passive: bool
    torques_given: bool
    """True if the first of the given columns is what the actuators gave; else they give what motion needs."""
    given: tuple[str, ...]
    """Names of the sources whose forces are the columns after that."""
    by_link: bool = False
    """True if gravity, or each share with a name, is a source for each link."""
    is_borne: bool = False
    """True if torques are those beyond what holds the weight, which is a source for `loose` alone."""
    loose: tuple[int, ...] = ()
    """Coordinates that nothing drives, such as those of a floating base: no torque holds their weight."""
    carried: tuple[ArrayBackend, ...] = ()
    """Back ends of the same joints with nothing but payloads, which are carried beside the robot's links."""
    backend_at: Callable[[Numbers], ArrayBackend] | None = None
    """Function that returns the back end at instants (T,), where the robot depends on more than time."""

    @cached_property
    def coordinates(self) -> tuple[str, ...]:
        """Names of the independent joints, in the order of the equations."""
        return (
            self.backend.structure.joint_names if self.constraints is None else self.constraints.independent
        )

    @cached_property
    def sources(self) -> tuple[str, ...]:
        """Names of the sources, in the order of the columns; the last one is the motion at the start."""
        structure = self.backend.structure
        joints = structure.joint_names if self.torques_given else self.coordinates
        # Of links that were written by hand a share may be called anything, such as start.
        named = [f"{SHARE}{BETWEEN}{name}" if structure.shares else name for name in structure.share_names]
        shares = [
            f"{share}{BETWEEN}{link}" if self.by_link else share
            for share in (() if self.is_borne and not self.loose else named)
            for link in (structure.link_names if self.by_link else ("",))
        ]
        own = [
            f"{kind}{BETWEEN}{structure.joint_names[i]}"
            for kind, joints in self._passive.items()
            for i in joints
        ]
        residual = [RESIDUAL] if self.torques_given else []
        # What motion needs where nothing drives it, no actuator gave.
        undriven = () if self.torques_given else [structure.joint_names[i] for i in self.loose]
        return (
            *(f"{RESIDUAL if joint in undriven else TORQUE}{BETWEEN}{joint}" for joint in joints),
            *shares,
            *own,
            *self.given,
            *residual,
            START,
        )

    @cached_property
    def _own(self) -> tuple[int, ...]:
        """Indices of the independent joints."""
        return tuple(map(self.backend.structure.joint_names.index, self.coordinates))

    @cached_property
    def _passive(self) -> dict[str, list[int]]:
        """Joints that have a spring, damping or friction."""
        if not (self.passive and self.backend.structure.passive):
            return {}
        sums = self.backend.structure.passive_sums
        springs = [bool(k or f) for k, f in zip(sums.stiffness, sums.pull, strict=True)]
        having = {"spring": springs, "damping": sums.damping, "friction": sums.friction}
        return {kind: np.flatnonzero(own).tolist() for kind, own in having.items()}

    def at(self, motion: SampledMotion, is_sample: bool) -> TraceAt:
        """Return the equations at instants of a motion.

        is_sample: whether they are samples of a log, where constraints have to hold; between these, dependent
        joints are closed first
        """
        backend = self.at_instants(motion.time, motion.q)
        q, qd, qdd = motion.q, motion.qd, motion.qdd
        place = None if self.constraints is None else self._place(backend, q, is_sample)
        if place is not None:
            q, qd = place.q, place.velocity(place.own(qd))
            qdd = place.velocity(place.own(qdd)) + place.bias(qd)
        terms = [one.answers.coefficients(q, qd) for one in (backend, *self.carried)]
        mass, coriolis = (sum(parts).sum(-2) for parts in list(zip(*terms, strict=True))[:2])
        g = namespace(q).concat([g for _, _, g in terms], -1)
        if self.passive and backend.structure.passive:
            mass = mass + backend.constant(np.diag(backend.structure.passive_sums.armature), q)
        given = motion.given[..., 1:] if self.torques_given else motion.given
        forces = self.forces(backend, q, qd, g, given)
        needed = times(mass, qdd) + times(coriolis, qd) - forces.sum(-1)
        if place is not None:
            found, rate = place.found.map, place.map_rate(qd)
            coriolis = found.mT @ (mass @ rate + coriolis @ found)
            mass, forces = found.mT @ mass @ found, found.mT @ forces
            needed = times(found.mT, needed)
        tau = motion.given[..., 0] if self.torques_given else None
        borne = g.sum(-1) * (1.0 - self._loose(backend, q)) if self.is_borne else 0.0 * q
        columns = self._with_actuators(backend, place, needed, forces, tau, borne)
        return TraceAt(qd, LinearEquations(mass, coriolis, columns), place)

    def at_instants(self, time: Numbers, q: Numbers) -> ArrayBackend:
        """Return the back end at instants (T,) beside q (T, ..., n), for what depends on time or inputs."""
        if self.backend_at is not None:
            return self.backend_at(time)
        if not self.backend.structure.time:
            return self.backend
        backend = self.backend.separate()
        instants = time.reshape(-1, *[1] * (q.ndim - 2))
        backend.set_parameters({self.backend.structure.time: instants})
        return backend

    def _place(self, backend: ArrayBackend, q: Numbers, is_sample: bool) -> ClosedPlace:
        assert self.constraints is not None
        ties = self.constraints.ties
        return ties.place(backend, q) if is_sample else ties.closed_place(backend, q, q)

    def forces(self, backend: ArrayBackend, q: Numbers, qd: Numbers, g: Numbers, given: Numbers) -> Numbers:
        """Return the forces (..., n, Y) of all sources but actuators, residual and start, on all joints.

        g: torques of shares that are not of motion, (..., n, N); given: forces by columns, (..., n, Y)
        """
        xp, structure = namespace(q), backend.structure
        shares = g[..., None]
        if structure.shares:
            (shares,) = backend.answers.named_shares(q, qd)
        # (..., n, N, M) in the order of the names: by share, then by link.
        by_link = xp.swapaxes(shares, -1, -2)
        kinds = [-by_link.reshape(*q.shape, -1) if self.by_link else -shares.sum(-2)]
        if self.is_borne:
            kinds = [self._loose(backend, q)[:, None] * kinds[0]] if self.loose else []
        if self._passive:
            own = backend.answers.passive_torque(q, qd, 0.0 * q)[:3]
            identity = np.eye(structure.n)
            for torque, joints in zip(own, self._passive.values(), strict=True):
                kinds.append(-backend.constant(identity[:, joints], q) * torque[..., None])
        return xp.concat([*kinds, given], -1)

    def _loose(self, backend: ArrayBackend, q: Numbers) -> Numbers:
        """Return a one for each coordinate that nothing drives, and zeros, (n,)."""
        ones = np.isin(np.arange(q.shape[-1]), self.loose).astype(float)
        return backend.constant(ones, q)

    def _with_actuators(
        self,
        backend: ArrayBackend,
        place: ClosedPlace | None,
        needed: Numbers,
        forces: Numbers,
        tau: Numbers | None,
        borne: Numbers,
    ) -> Numbers:
        """Return the forces (..., m, X) of all sources, with what the actuators give, and the start's zeros.

        needed: torques (..., m) that the motion needs of the actuators; tau: those (..., n) that they gave
        borne: what of these holds the weight, (..., n); under constraints, the independent joints hold it
        """
        xp, start = namespace(forces), 0.0 * needed[..., None]
        if tau is None:
            own = backend.constant(np.eye(needed.shape[-1]), needed) * needed[..., None]
            return xp.concat([own, forces, start], -1)
        each = np.eye(tau.shape[-1])
        own, held = backend.constant(each, tau) * tau[..., None], borne
        if place is not None:
            own, held = place.found.map.mT @ own, times(place.found.map.mT, borne)
            each = each[list(self._own)]
        own = own - backend.constant(each, tau) * held[..., None]
        left = needed - own.sum(-1)
        return xp.concat([own, forces, left[..., None], start], -1)
