"""The impedance of joints: what is wanted of a state, and the acceleration and the torque that follow.

    M* (qdd - qdd_d) + B* (qd - qd_d) + K* (q - q_d) = f + v        u = H qdd + C qd + g + p - f

H is the inertia of links and armature, p what the joints' own springs and damping take, and of their friction
what is to be compensated, v what a task asks for where motions are cancelled.
"""

from typing import Any, NamedTuple

import numpy as np

from ..dense import Dense
from ..passive_joints import passive_torques, smooth_friction
from ..sums.joint_matrices import JointMatrices
from ..sums.known_digits import Told
from .gains import Gain
from .wanted_coefficients import WantedShares
from .wanted_solve import WantedInertia, solved_wanted


class JointTargets(NamedTuple):
    """What is wanted of the joints."""

    inertia: WantedShares
    damping: WantedShares
    stiffness: Gain | None
    positive: bool
    """Whether M* must be positive; else it must be regular, as where motions are cancelled."""
    passive: bool
    """Whether the joints' own springs, damping and armature count."""
    friction_width: float | None
    """In rad/s or m/s, the width of their friction; None where it is not compensated."""


class JointState(NamedTuple):
    """A robot at q and qd: what its joints obey, and the targets for it."""

    inertia: Any
    """H (..., n, n)."""
    coriolis: Any
    """C (..., n, n)."""
    rest: Any
    """g + p (..., n)."""
    wanted_inertia: Any
    """M* (..., n, n)."""
    wanted_damping: Any
    """B* (..., n, n)."""


class Errors(NamedTuple):
    """How far a state is from its target, and what else there is, (..., n) each; None for nothing."""

    place: Any
    rate: Any
    wanted: Any
    """qdd_d."""
    force: Any
    """f, from outside, and v, of a task."""


class JointImpedance:
    """The targets of one robot, for whatever motion."""

    def __init__(self, robot: Any, targets: JointTargets) -> None:
        self.targets, self._robot, self._side = targets, robot, robot.backend
        self._dense = Dense(robot.structure, robot.backend)
        self._matrices = JointMatrices(robot.structure, robot.backend)
        self._shares = any(not isinstance(t.kept, float) for t in (targets.inertia, targets.damping))

    def state(self, q: Any, qd: Any) -> JointState:
        """What its joints obey at q and qd (..., n), and what they shall."""
        side, targets = self._robot.backend.side(q), self.targets
        c2 = c1 = None
        if self._shares:
            c2, c1, by_link = self._robot.coefficients(q, qd)
            mass, coriolis, rest = c2.sum(-2), c1.sum(-2), by_link.sum(-1)
        else:
            packed = self._robot.packed(q, qd, 0.0 * q)
            mass = self._matrices.summed(packed.acceleration, "acceleration")
            coriolis = self._matrices.summed(packed.velocity, "velocity")
            rest = self._dense.summed(packed.gravity)
        inertia, wanted = mass, targets.inertia.of(side, mass, c2, q)
        if targets.passive:
            sums = self._robot.structure.passive_sums
            armature = side.constant(np.diag(sums.armature), q)
            spring, damping, _, _ = passive_torques(side, sums, q, qd, qd)
            inertia, rest = mass + armature, rest + spring + damping
            if targets.friction_width is not None:
                rest = rest + smooth_friction(side, sums, qd, targets.friction_width)
            # a share of links leaves the armature beside it, a sum that is given whole has it in it
            wanted = wanted if targets.inertia.whole else wanted + armature
        return JointState(inertia, coriolis, rest, wanted, targets.damping.of(side, coriolis, c1, q))

    def pull(self, state: JointState, errors: Errors, like: Any) -> Any:
        """-B* ed - K* e, (..., n)."""
        pull = -times(state.wanted_damping, errors.rate)
        if self.targets.stiffness is None:
            return pull
        return pull - times(self.targets.stiffness.matrix(self._robot.backend.side(like), like), errors.place)

    def acceleration(self, state: JointState, errors: Errors, like: Any, told: bool = False) -> Any:
        """qdd = qdd_d + M*^-1 (f + v - B* ed - K* e), (..., n).

        told: whether it is said elsewhere how well a natural M* tells it
        """
        pull = self.pull(state, errors, like)
        if errors.force is not None:
            pull = pull + errors.force
        names, positive = self._robot.joint_names, self.targets.positive
        whose = "what is left of the mass matrix"
        if positive:
            whose = "the mass matrix" if self.targets.inertia.natural else "the wanted inertia"
        singular = "the wanted inertia is not positive" if positive else f"{whose} is singular"
        about = WantedInertia(singular, Told(f"{whose} is nearly singular", names))
        natural = state.inertia.diagonal(0, -2, -1)
        told = told and self.targets.inertia.natural
        solved = solved_wanted(about, state.wanted_inertia, pull[..., None], natural, positive, told)
        moved = solved[..., 0]
        return moved if errors.wanted is None else errors.wanted + moved

    def natural_torque(self, state: JointState, qd: Any, errors: Errors) -> Any:
        """u = H qdd_d + C qd + g + p - B* ed - K* e: f drops out where all inertia stays."""
        torque = times(state.coriolis, qd) + state.rest + self.pull(state, errors, qd)
        return torque if errors.wanted is None else torque + times(state.inertia, errors.wanted)

    def torque(self, state: JointState, qd: Any, qdd: Any, external: Any) -> Any:
        """u = H qdd + C qd + g + p - f, (..., n)."""
        torque = times(state.inertia, qdd) + times(state.coriolis, qd) + state.rest
        return torque if external is None else torque - external

    def stored(self, state: JointState, errors: Errors, like: Any) -> Any:
        """(ed' M* ed + e' K* e) / 2, (...)."""
        energy = (errors.rate * times(state.wanted_inertia, errors.rate)).sum(-1) / 2.0
        if self.targets.stiffness is None:
            return energy
        stiffness = self.targets.stiffness.matrix(self._robot.backend.side(like), like)
        return energy + (errors.place * times(stiffness, errors.place)).sum(-1) / 2.0


def times(matrix: Any, vector: Any) -> Any:
    """(..., r, n) times (..., n)."""
    return (matrix @ vector[..., None])[..., 0]


def dissipates(inertia: WantedShares, damping: WantedShares) -> bool:
    """Whether c2 and c1 of each link are kept alike: then dM*/dt - 2 B* is skew but for what is added."""
    if not (inertia.positive and damping.positive) or inertia.by_link is None or damping.by_link is None:
        return False
    return bool((inertia.by_link == damping.by_link).all())
