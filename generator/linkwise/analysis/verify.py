"""Checks of a result: its parts sum to the whole, and an independent recursion agrees."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from linkwise_runtime.rule.joint_tree import TreeFrame

from linkwise.analysis.contacts.ground import GroundContacts
from linkwise.analysis.contacts.times import ContactTimes
from linkwise.analysis.loads.placed import PlacedLoad
from linkwise.analysis.opened_robot import OpenedRobot
from linkwise.analysis.result_rows import ResultRows
from linkwise.arrays import Array
from linkwise.errors import LinkwiseError
from linkwise.oracle.contacts import contact_rows
from linkwise.oracle.loop_equations import LoopEquations
from linkwise.oracle.newton_euler import NewtonEuler

LIMIT = 1e-9
"""A relative error above this is not rounding: the package does not compute what it says."""

AGAINST_RECURSION = 1e-6
"""Largest relative error against an independent computation, whose rounding differs."""

SAMPLES = 8
"""Samples of each block that are computed again, by a recursion that is slow in Python."""

STEP = 1e-30
"""Complex step in s: its square is nothing beside 1."""

LARGEST = 1e6
"""Largest coordinate in rad or m; beyond it, its own rounding hides what the comparison would show."""


@dataclass(frozen=True)
class Closure:
    """Largest errors of the sum Σ_k τp_ij + g_ij against τ_ij (terms) and of the sum for τ_i (links).

    The sum for τ_i is Σ_j τ_ij, the passive torques of joint i, and Σ_e τ_ie of loads.

    Absolute errors are in N·m (N), relative ones to the largest sum of magnitudes in a block of samples.
    Packages may sum τ_i from the τ_ij, so both sums show only that nothing was lost; `recursion` is the
    largest error of τ_ij and τ_ie against an independent Newton–Euler recursion, and `energy` that of
    Σ_i P_ij, in W, against dE_j/dt of link j's energy there; None where the energies are hand-written.
    `induced` is the residual of induced accelerations, the sum of all shares less J q̈ + J̇ q̇; None where
    none were asked for. `power` is that of power by source, in W: of the gains of links' energies, and of
    flows through joints. `trace` is that of traced velocities, the sum of all parts less q̇, which integration
    between samples leaves. `nets` is that of net torques by cause against τ_i, of the joints that have all of
    them; None where there is none.
    """

    terms_absolute: float = 0.0
    terms_relative: float = 0.0
    links_absolute: float = 0.0
    links_relative: float = 0.0
    recursion_absolute: float | None = None
    recursion_relative: float | None = None
    energy_absolute: float | None = None
    energy_relative: float | None = None
    induced_absolute: float | None = None
    induced_relative: float | None = None
    power_absolute: float | None = None
    power_relative: float | None = None
    trace_absolute: float | None = None
    trace_relative: float | None = None
    nets_absolute: float | None = None
    nets_relative: float | None = None

    def __or__(self, other: "Closure") -> "Closure":
        """Return the larger of both, error by error."""
        if other is NO_ERRORS:
            return self
        a, b = vars(self), vars(other)
        return Closure(**{name: _larger(a[name], b[name]) for name in a})

    def check(self) -> None:
        """Raise LinkwiseError where the parts do not sum to the whole, or the recursion disagrees."""
        worst = np.max([self.terms_relative, self.links_relative, self.nets_relative or 0.0])
        if not worst <= LIMIT:
            raise LinkwiseError(
                f"the robot's torques do not close (relative error {worst:.2g}); run `linkwise check` on it"
            )
        if self.recursion_relative is not None and not self.recursion_relative <= AGAINST_RECURSION:
            raise LinkwiseError(
                "the robot's partial torques are not those of the Newton-Euler recursion (relative error"
                f" {self.recursion_relative:.2g}); run `linkwise check` on it"
            )
        if self.energy_relative is not None and not self.energy_relative <= AGAINST_RECURSION:
            raise LinkwiseError(
                "the power that the robot's joints send into its links is not the gain of the links' energies"
                f" (relative error {self.energy_relative:.2g}); run `linkwise check` on it"
            )
        if self.induced_relative is not None and not self.induced_relative <= AGAINST_RECURSION:
            raise LinkwiseError(
                "the induced accelerations do not sum to the acceleration (relative error"
                f" {self.induced_relative:.2g}): the mass matrix is next to singular"
            )
        if self.power_relative is not None and not self.power_relative <= AGAINST_RECURSION:
            raise LinkwiseError(
                "the power of the sources does not sum to the gain of the links' energies (relative error"
                f" {self.power_relative:.2g}): the mass matrix is next to singular"
            )


NO_ERRORS = Closure()
"""Errors where nothing was compared."""


def _larger(a: Any, b: Any) -> Any:
    if a is None or b is None:
        return b if a is None else a
    return float(np.maximum(a, b))  # unlike Python's max, it never loses a NaN


def worst_of(pairs: list[tuple[float, float]]) -> tuple[float, float]:
    """Return the largest error of (error, scale) pairs, absolute and relative to the largest scale."""
    error, scale = np.max(np.array([(0.0, 0.0), *pairs]), axis=0).tolist()
    return error, error / scale if scale else error


def against_recursion(
    robot: OpenedRobot,
    loads: Sequence[PlacedLoad],
    times: ContactTimes | None,
    rows: ResultRows,
    block: Array,
) -> Closure:
    """Return the errors of τ_ij, P_ij, τ_ie of some samples (rows, S) against Newton–Euler.

    There are none for robots of energies. Contacts at which a motion slips feed energy to links, beside the
    joints. Relative errors are by unit: a joint that carries nothing but rounding is measured by its peers.
    """
    if robot.recursion is None:
        return Closure()
    q, qd, qdd = (rows.dense(name, block) for name in ("q", "qd", "qdd"))
    if np.abs(q).max(initial=0.0) > LARGEST:
        return Closure()
    partial = robot.recursion.partial_torque(q, qd, qdd)
    asked = [load_torque(robot.recursion, borne, block[0], q) for borne in loads]
    every = np.concatenate([partial, *(torque[:, :, None] for torque in asked)], axis=2)
    press = None if times is None else times.press(robot.model, block[0], q)
    free, left = _borne(robot, robot.recursion, every, q, rows.dense("contact", block), press)
    ours = np.concatenate([rows.dense(name, block) for name in ("tau_link", "tau_load")], axis=2)
    apart, watts = [(0.0, 0.0)], 0.0
    for unit in dict.fromkeys(robot.units):
        alike = [i for i, other in enumerate(robot.units) if other == unit]
        # What contacts leave may be only the rounding of what they carry.
        scale = max(_largest_sum(left, alike), _largest_sum(free, alike))
        error = float(np.abs(ours - left)[:, alike].max(initial=0.0))
        apart.append((error, error / scale if scale else error))
        # Power that is only rounding is measured by the torques and speeds that it is made of.
        watts += _largest_sum(partial, alike) * float(np.abs(qd[:, alike]).max(initial=0.0))
    fed = rows.dense("power_link", block).sum(axis=1) + rows.dense("power_contact", block).sum(axis=2)
    gain = _gain(robot.recursion, q, qd, qdd)
    lost = float(np.abs(fed - gain).max(initial=0.0))
    if "gain" in rows:
        own = rows.dense("gain", block)[:, : len(robot.links)]
        lost = max(lost, float(np.abs(own - gain).max(initial=0.0)))
    absolute, relative = (max(errors) for errors in zip(*apart, strict=True))
    return Closure(
        recursion_absolute=absolute,
        recursion_relative=relative,
        energy_absolute=lost,
        energy_relative=lost / watts if watts else lost,
    )


def _borne(
    robot: OpenedRobot,
    recursion: NewtonEuler,
    torque: Array,
    q: Array,
    shares: Array,
    press: Array | None,
) -> tuple[Array, Array]:
    """Return what joints carry of torques (S, n, X) of the open tree: without contacts, and with them.

    shares: those of the contacts, (S, contacts); press: where loads press on these, (S, contacts, 3)
    """
    tree, mapped = robot.package.manifest.tree, None
    if robot.constrained is not None and tree is not None:
        mapped = LoopEquations(recursion, tree).velocity_map(q)
        projected = np.einsum("snm,snj->smj", mapped, torque)
        torque = np.zeros_like(torque)
        torque[:, list(robot.driven)] = projected
    if robot.contacts is None or tree is None or press is None:
        return torque, torque
    frames = {frame.name: frame for frame in tree.frames}
    rows = [
        contact_rows(recursion, frames[str(one.frame)], one, q, press[:, c])
        for c, one in enumerate(robot.contacts.contacts)
    ]
    return torque, _left(robot.contacts, rows, torque, shares, mapped)


def _largest_sum(torque: Array, joints: list[int]) -> float:
    """Return the largest sum of magnitudes of torques (S, n, X) on one of the joints."""
    return float(np.abs(torque).sum(axis=2)[:, joints].max(initial=0.0))


def load_torque(recursion: NewtonEuler, borne: PlacedLoad, time: Array, q: Array) -> Array:
    """Return τ_ie (S, n), in N·m or N.

    It is minus the power that the load gives to the body where q̇_i = 1 and all else rests.
    """

    def pose(frame: TreeFrame, q: Array) -> Array:
        return recursion.poses([frame], q)[:, 0]

    out = np.zeros_like(q) if borne.efforts is None else -borne.effort(time)
    for one in borne.wrenches:
        force, moment, place = one.wrench(time, q, pose)
        frame = [(one.acts_on.frame.joint, np.zeros(3))]
        arm = place - recursion.places(frame, q)[:, 0]
        for i in range(recursion.n):
            velocity, _ = recursion.points(frame, q, np.eye(recursion.n)[i] + 0.0 * q, 0.0 * q)
            omega, v = velocity[:, 0, :3], velocity[:, 0, 3:]
            out[:, i] -= (moment * omega).sum(-1) + (force * (v + np.cross(omega, arm))).sum(-1)
    return out


def _gain(recursion: NewtonEuler, q: Array, qd: Array, qdd: Array) -> Array:
    """Return dE_j/dt of K_j + P_j in W, (S, N), along the motion: by a complex step, free of cancellation."""
    kinetic, potential = recursion.energies(q + 1j * STEP * qd, qd + 1j * STEP * qdd)
    gain: Array = (kinetic + potential).imag / STEP
    return gain


RANK = 1e-11
"""Eigenvalues of B w B^T below this part of the largest are zero."""


def _left(
    ground: GroundContacts, each: Sequence[Array], torque: Array, shares: Array, mapped: Array | None
) -> Array:
    """Return what contacts with shares (S, contacts) leave of torques (S, n, X).

    each: rows (S, C, n) of each contact
    mapped: G (S, n, m) from the m joints that do not follow others, at whose indices the torques stand to
    all joints; None if no joint follows
    """
    weights = np.concatenate([np.repeat(shares[:, [c]], one.shape[1], 1) for c, one in enumerate(each)], 1)
    rows = np.concatenate(each, axis=1) * (weights > 0.0)[..., None]
    if mapped is not None:
        assert ground.tied is not None
        own = list(ground.tied.following.independent)
        projected = np.zeros_like(rows)
        projected[..., own] = rows @ mapped
        rows = projected
    base = list(ground.unactuated)
    forces = _least(np.swapaxes(rows[..., base], 1, 2), weights, torque[:, base])
    left: Array = torque - np.swapaxes(rows, 1, 2) @ forces
    return left


def _least(equations: Array, weights: Array, torque: Array) -> Array:
    """Return lambda (S, C, X) with B lambda = tau and the least sum of lambda^2 / w.

    It is found from lambda = w B^T mu and (B w B^T) mu = tau.
    """
    scaled = weights[..., None] * np.swapaxes(equations, 1, 2)
    found: Array = scaled @ np.linalg.pinv(equations @ scaled, rcond=RANK, hermitian=True) @ torque
    return found
