"""Sources of acceleration in a result, their forces from its torques, and the response of the robot to them.

    M q̈ = Σ_i u_i − Σ_js c1_ijs q̇_s − Σ_j g_ij − spring, damping, friction − Σ_e τ_ie + Aᵀ λ

with u_i = τ_i, the torque of the joint, and with the armatures in M. M, c1, g and passive torques are those
of the open tree. Where joints are tied, τ_i and τ_ie are torques of the independent joints: on these alone,
they move the robot as do any other forces with the same Gᵀ F. With A q̇ = 0, each source x then solves

    [M −Aᵀ; A 0] [q̈_x; λ_x] = [F_x; b_x]      b = −Ȧ q̇ for the constraints' own source, else 0

as `induced_accelerations` of the package does. Velocities are therefore those of all joints, and a link's
share of the velocity forces is c1_ijs q̇_s of the open tree. What c1^ of the independent joints has in
addition, c2 Ġ, is due to the constraints, which turn: it counts in their own source, by the joint whose
velocity turns them.

Where the robot stands on contacts, `StandingResponse` gives its response, and contacts are sources too.
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple, cast

import numpy as np
from linkwise_runtime.motion.induced_accelerations import Response, response_of

from linkwise.analysis.opened_robot import OpenedRobot
from linkwise.analysis.payload import PayloadModel
from linkwise.analysis.result_quantities import LOSSES, PASSIVE
from linkwise.analysis.result_rows import ResultRows
from linkwise.analysis.term_rows import TermArrays, mirrored
from linkwise.arrays import Array
from linkwise.errors import LinkwiseError

AT_ONCE = 1 << 21
"""Force values of the sources that are computed at once."""
VELOCITY, WEIGHT = "acc_velocity", "acc_weight"
WHOLE = {WEIGHT: "acc_gravity", VELOCITY: "acc_qd"}
"""Sources as one each, and the quantity of their parts by link and joint."""
Source = tuple[str, tuple[int, ...]]
"""Quantity of a source's shares, and the index along each axis behind those of points: link, cause, load."""


@dataclass(frozen=True)
class InducedSources:
    """The sources of a robot, and their forces."""

    robot: OpenedRobot
    every: dict[Source, list[tuple[int, int]]]
    """Pairs of a coordinate and the place of its torque, by source: a row of the result, a packed value, a
    joint."""
    summed: tuple[tuple[str, Array], ...] = ()
    """Sources that are one each: the quantity, and a matrix (packed values, n) that sums these by joint."""

    @classmethod
    def of(cls, robot: OpenedRobot, rows: ResultRows, whole: bool = False) -> "InducedSources":
        """Collect the sources of a robot; rows: those of torques; whole: weights and velocities as one each.

        Shares with names of links that are written stay apart.
        """
        if robot.constrained is not None:
            refuse_tensors(robot, "what --induced and --induced-power tell of tied joints is")
        found: dict[Source, list[tuple[int, int]]] = {}
        summed = [quantity for quantity in WHOLE if whole and not (robot.is_written and quantity == WEIGHT)]
        for quantity, at, i, place in _parts(robot, rows):
            if quantity not in [WHOLE[one] for one in summed]:
                found.setdefault((quantity, at), []).append((i, place))
        return cls(robot, found, tuple((one, _by_joint(robot, WHOLE[one])) for one in summed))

    @property
    def whole(self) -> bool:
        """True if all that velocities do is one source, the last of forces."""
        return bool(self.summed)

    @property
    def places(self) -> tuple[Source, ...]:
        """Sources of forces, in the order of their columns."""
        return (*self.every, *((quantity, ()) for quantity, _ in self.summed))

    def open_terms(self, packed: TermArrays, q: Array, qd: Array, qdd: Array) -> TermArrays:
        """Return the packed values of the tree without ties; packed: those of the robot's model."""
        return packed if self.robot.constrained is None else opened(self.robot).packed(q, qd, qdd)

    def shares_beside(self) -> tuple[tuple[str, tuple[int, ...]], ...]:
        """Return what accelerates beside forces: ties by cause, then contacts."""
        found: list[Source] = []
        if self.robot.constrained is not None and not self.whole:
            found += [("acc_constraint", (s,)) for s in range(len(self.robot.joints))]
        if self.robot.contacts is not None:
            found += [("acc_contact", (c,)) for c in range(len(self.robot.contacts.names))]
        return tuple(found)

    def answers(
        self, terms: TermArrays, forces: Array, rows: Array | None, q: Array, qd: Array, qdd: Array
    ) -> "SourceAnswers":
        """Return the answers to forces F_x (S, n, X), then to `shares_beside`.

        terms: packed values of the open tree; rows: A (S, C, n) of contacts

        Raises ValueError where M is singular.
        """
        ground, model = self.robot.contacts, opened(self.robot)
        ties = None if self.robot.constrained is None else self.robot.constrained.constraints
        free: Response = response_of(model.backend, ties, q, qd, self._mass(terms.acceleration, q.shape[1]))
        every = [free.accelerations(forces)]
        if ties is not None and self.whole:
            every[0][..., -1] += np.asarray(free.of_velocities()).sum(axis=-1)
        elif ties is not None:
            every.append(free.of_velocities())
        moved = np.concatenate(cast("list[Array]", every), axis=2)
        if rows is None or ground is None:
            return SourceAnswers(moved, np.zeros((len(q), 0, moved.shape[2])))
        own = StandingResponse(free, rows).of_contacts(qdd, ground.owners, len(ground.names))
        held = StandingResponse(free, rows).held(moved)
        return SourceAnswers(*(np.concatenate(two, axis=2) for two in zip(held, own, strict=True)))

    def forces(self, out: Array, packed: TermArrays, q: Array, qd: Array, qdd: Array) -> Array:
        """Return F_x (S, n, X).

        out: the torques (rows, S); packed: values of the open tree
        """
        model = opened(self.robot)
        own = model.passive_torque(q, qd, qdd)[:3] if self.robot.passive else ()
        torques: dict[str, Array] = dict(zip(LOSSES, own, strict=False))
        torques |= {"acc_qd": packed.velocity, "acc_gravity": packed.gravity}
        if self.robot.is_written:
            torques["acc_share"] = model.named_shares(q, qd)[:, *self.robot.structure.share_rows.T]
        forces = np.zeros((*q.shape, len(self.places)))
        for x, ((quantity, at), places) in enumerate(self.every.items()):
            there = torques.get(quantity, out.T)
            moved = qd[:, at[-1]] if quantity == "acc_qd" else 1.0
            for i, place in places:
                torque = there[:, place] * moved
                forces[:, i, x] += torque if quantity == "acc_tau" else -torque
        for x, (quantity, by_joint) in enumerate(self.summed, len(self.every)):
            each = np.asarray(torques[WHOLE[quantity]])
            if quantity == VELOCITY:
                each = each * qd[:, model.layout.velocity[:, 2]]
            forces[:, :, x] = -each @ by_joint
        return forces

    def _mass(self, packed: Array, n: int) -> Array:
        """Return M (S, n, n) of links, payloads and the armatures behind gears."""
        mass = np.zeros((len(packed), n, n))
        for i, _, k, source in mirrored(opened(self.robot).layout):
            mass[:, i, k] += packed[:, source]
        for own in self.robot.passive:
            mass[:, own.coordinate, own.coordinate] += own.ratio**2 * own.armature
        return mass


def _by_joint(robot: OpenedRobot, quantity: str) -> Array:
    """Return the matrix (packed values, n) that sums packed values of velocity or gravity by joint."""
    layout = opened(robot).layout
    joints = (layout.velocity if quantity == WHOLE[VELOCITY] else layout.gravity)[:, 0]
    found: Array = np.eye(len(robot.joints))[joints]
    return found


def opened(robot: OpenedRobot) -> Any:
    """Return the model of links and payloads without ties."""
    model: Any = robot.model
    return model if robot.constrained is None else model.open


def refuse_tensors(robot: OpenedRobot, what: str) -> None:
    """Raise LinkwiseError for a back end that computes in tensors, where arrays are needed."""
    model: Any = robot.model
    models = [
        opened(robot),
        *(part.model for part in (model.parts if isinstance(model, PayloadModel) else ())),
    ]
    read = [one.backend.read({"q": np.zeros((1, len(robot.joints)))}, len(robot.joints)) for one in models]
    if not all(isinstance(q, np.ndarray) for _, (q,) in read):
        raise LinkwiseError(
            f"--backend {robot.backend} computes in tensors, and {what} in arrays; give numpy or native"
        )


def _parts(robot: OpenedRobot, rows: ResultRows) -> Iterator[tuple[str, tuple[int, ...], int, int]]:
    """Yield the quantity and the indices of a source, with a coordinate and the place of its torque."""
    layout = opened(robot).layout
    for row, (i,) in rows["tau"].listed():
        yield "acc_tau", (i,), i, row
    for i, j, k, at in sorted((*ijk, at) for at, ijk in enumerate(layout.velocity.tolist())):
        yield "acc_qd", (j, k), i, at
    if robot.is_written:
        for i, j, m, at in sorted((*ijm, at) for at, ijm in enumerate(robot.structure.share_rows.tolist())):
            yield "acc_share", (j, m), i, at
    else:
        for i, j, at in sorted((*ij, at) for at, ij in enumerate(layout.gravity.tolist())):
            yield "acc_gravity", (j,), i, at
    for quantity, field in zip(LOSSES, PASSIVE.values(), strict=False):
        for i in robot.with_own(field):
            yield quantity, (i,), i, i
    for row, (i, e) in rows["tau_load"].listed():
        yield "acc_load", (e,), i, row


HELD_RANK = 1e-11
"""Eigenvalues of A M⁻¹ Aᵀ below this part of the largest are zero."""


class SourceAnswers(NamedTuple):
    """Answers of a robot to X sources."""

    accelerations: Array
    """q̈_x (S, n, X)."""
    reactions: Array
    """Forces λ_x of contacts that are on, (S, C, X); no row without contacts."""


@dataclass(frozen=True)
class StandingResponse:
    """Response of a robot to forces at S samples, while contacts hold frames of it.

    With the rows A of the contacts that are on, and the mass matrix M of the response without contacts,

        q̈_x = P M⁻¹ F_x        P = 1 − K A        K = M⁻¹ Aᵀ (A M⁻¹ Aᵀ)⁺

    is the acceleration due to a force while the held frames stay fixed. In a measured motion they are not
    quite fixed: K A q̈ is the acceleration due to the contacts themselves, as the held frames turn and slip,
    and with it all sources sum to q̈. Forces that contacts could carry move nothing, so that it does not
    matter how contacts share them. The contacts answer a force with λ_x = −(A M⁻¹ Aᵀ)⁺ A M⁻¹ F_x.
    """

    free: Any
    """Response of the robot without contacts."""
    rows: Array
    """Contact rows A (S, C, n)."""

    def held(self, free: Array) -> SourceAnswers:
        """Return the answers where contacts hold, for accelerations (S, n, X) without them."""
        by_rows, inverse = self._by_rows
        moved = self.rows @ free
        return SourceAnswers(free - by_rows @ moved, -inverse @ moved)

    def of_contacts(self, qdd: Array, owners: Array, count: int) -> SourceAnswers:
        """Return the answers (…, contacts) to each contact itself.

        owners: contact of each row; count: number of contacts
        """
        moved = np.einsum("scn,sn->sc", self.rows, qdd)
        each = np.zeros((*moved.shape, count))
        each[:, np.arange(len(owners)), owners] = moved
        by_rows, inverse = self._by_rows
        return SourceAnswers(by_rows @ each, inverse @ each)

    @cached_property
    def _by_rows(self) -> tuple[Array, Array]:
        """Matrices K (S, n, C) and (A M⁻¹ Aᵀ)⁺ (S, C, C)."""
        answered = self.free.accelerations(np.swapaxes(self.rows, 1, 2))
        inverse: Array = np.linalg.pinv(self.rows @ answered, rcond=HELD_RANK, hermitian=True)
        return answered @ inverse, inverse


def timed(text: str, time: Array, flag: str) -> str:
    """Return the text of an error with the time in place of the sample's number, and with advice.

    A text without a sample's number is returned as it is.
    """
    found = re.search(r" at sample (\d+)", text)
    if found is None:
        return text
    told = text.replace(found[0], f" at {time[int(found[1])]:.6g} s", 1)
    return f"{told}; cut the log there, or leave {flag} out"
