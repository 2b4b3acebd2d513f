"""Power by source: what each source gives each link, and what flows through each joint.

With q̈_x of the sources of `InducedSources`, link j gets from source x

    q̇ᵀ M_j q̈_x, and of its own  q̇ᵀ c1_js q̇_s  from its velocity forces,  q̇ᵀ g_j  from its weight

as `induced_power` of the package says, and an armature a_i q̇_i q̈_x,i. Velocity forces are summed over the
links on which they act. Σ_x is dE_j/dt of kinetic and potential energy; what a source gives sums to its
power. What contacts feed in as they slip counts with the sources that press on them.

The flow through joint i is the gain of all that is behind it, less what sources give there without the joint,
as `induced_flow` of the package says, and less what contacts feed in there as they slip. Ties behind a joint
are part of its flow.
"""

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from linkwise_runtime.motion.induced_power import joints_behind
from linkwise_runtime.structure import IMPOSED_MOTION

from linkwise.analysis.contacts.ground import Standing
from linkwise.analysis.induced_sources import AT_ONCE, InducedSources, Source, opened, timed
from linkwise.analysis.loads.placed import PlacedLoad, moving_joints
from linkwise.analysis.opened_robot import OpenedRobot
from linkwise.analysis.result_rows import Place, ResultRows
from linkwise.analysis.term_rows import NAMES, TermArrays, mirrored
from linkwise.analysis.verify import NO_ERRORS, Closure, worst_of
from linkwise.arrays import Array, Mask
from linkwise.errors import LinkwiseError
from linkwise.escape import listed

FLAG = "--induced-power"
Motion = tuple[Array, Array, Array]
"""q, q̇ and q̈, (S, n) each."""
AT_JOINT = ("acc_tau", "acc_spring", "acc_damping", "acc_friction")
"""Sources between the bodies of a joint."""
ON_LINK = ("acc_qd", "acc_gravity", "acc_share")
"""Sources that take from a link what they give it back."""


@dataclass(frozen=True)
class PowerShares:
    """Plans and fills the rows of power by source, which follow those of induced accelerations."""

    robot: OpenedRobot
    loads: tuple[PlacedLoad, ...]
    sources: InducedSources
    first: int
    """Row of the result at which these begin."""
    is_asked: bool

    @classmethod
    def of(
        cls, robot: OpenedRobot, loads: Sequence[PlacedLoad], others: ResultRows, is_asked: bool
    ) -> "PowerShares":
        """Plan the rows; others: all rows of torques, motion and induced accelerations.

        Raises LinkwiseError for links of energies of which nobody can say which share a power is of.
        """
        sources = InducedSources.of(robot, others) if is_asked else InducedSources(robot, {})
        if is_asked and robot.is_written:
            for j in range(len(robot.links)):
                _kinds(robot, j)
        return cls(robot, tuple(loads), sources, len(others), is_asked)

    @property
    def places(self) -> Iterator[Place]:
        """Places of the rows: energies of links, gains by source, flows by source."""
        if not self.is_asked:
            return
        for name in ("energy_kinetic", "energy_potential"):
            yield from ((name, (j,)) for j in range(len(self.robot.links)))
        for h in range(len(self.robot.holders)):
            yield "gain", (h,)
            yield from ((name.replace("acc", "gain", 1), (h, *at)) for name, at in self.columns)
        for i in range(len(self.robot.joints)) if self._has_flow else ():
            yield "flow_before", (i,)
            yield "flow", (i,)
            yield from ((name.replace("acc", "flow", 1), (i, *at)) for name, at in self.columns)

    @cached_property
    def every(self) -> tuple[Source, ...]:
        """All sources, with those beside forces."""
        return (*self.sources.every, *self.sources.shares_beside())

    @cached_property
    def columns(self) -> tuple[Source, ...]:
        """Sources as the result has them: velocity forces by the velocity alone."""
        return tuple(dict.fromkeys(map(_column, self.every)))

    @cached_property
    def _has_flow(self) -> bool:
        return self.robot.tree is not None

    @cached_property
    def _merged(self) -> Array:
        """Matrix (X, G) that sums sources up in columns."""
        merged = np.zeros((len(self.every), len(self.columns)))
        for x, source in enumerate(self.every):
            merged[x, self.columns.index(_column(source))] = 1.0
        return merged

    @cached_property
    def _behind(self) -> "Behind":
        assert self.robot.tree is not None
        n, links = len(self.robot.joints), len(self.robot.links)
        inside = joints_behind(self.robot.tree, n)
        holders = np.zeros((n, len(self.robot.holders)), dtype=np.bool_)
        holders[tuple(np.asarray(opened(self.robot).layout.torque).T)] = True
        turning = list(self.robot.with_own("armature"))
        given, own = np.zeros((2, n, len(self.columns)), dtype=np.bool_)
        for g, (quantity, at) in enumerate(self.columns):
            if quantity in AT_JOINT:
                given[:, g] = inside[:, at[0]]
                own[at[0], g] = True
        contacts = np.zeros((n, 0 if self.robot.contacts is None else len(self.robot.ground.names)))
        for c in range(contacts.shape[1]):
            joint = self.robot.joint_of(self.robot.ground.contacts[c].frame)
            contacts[list(moving_joints(self.robot.tree, joint)), c] = 1.0
        armatures = np.zeros_like(holders)
        armatures[turning, range(links, links + len(turning))] = True
        holders[:, links:] = inside[:, turning]
        return Behind(holders, holders | armatures, inside, given, given | own, contacts)

    def fill(
        self, out: Array, packed: TermArrays, standing: Standing | None, time: Array, motion: Motion
    ) -> Closure:
        """Fill the rows in `out` (rows, S); return the largest errors of their sums.

        The torques of `out` must be filled already. packed: values of the robot's model
        """
        worst = NO_ERRORS
        step = max(1, AT_ONCE // max(1, len(self.every) * (len(self.robot.holders) + len(self.robot.joints))))
        for at in range(0, len(time), step) if self.is_asked else ():
            some = slice(at, at + step)
            part = TermArrays(*(getattr(packed, name)[some] for name in NAMES))
            rows = None if standing is None else standing.every[some]
            q, qd, qdd = (a[some] for a in motion)
            worst |= self._fill(out[:, some], part, rows, time[some], (q, qd, qdd))
        return worst

    def _fill(
        self, out: Array, packed: TermArrays, rows: Array | None, time: Array, motion: Motion
    ) -> Closure:
        q, qd, qdd = motion
        terms = self.sources.open_terms(packed, q, qd, qdd)
        forces = self.sources.forces(out, terms, q, qd, qdd)
        for x, (quantity, at) in enumerate(self.sources.every):
            if quantity == "acc_load":  # as it presses on its body, also where contacts bear it
                forces[:, :, x] = -self.loads[at[0]].torque(opened(self.robot), time, q)
        try:
            moved, reactions = self.sources.answers(terms, forces, rows, q, qd, qdd)
        except ValueError as error:
            raise LinkwiseError(f"{FLAG}: {timed(str(error), out[0], FLAG)}") from error
        power = np.einsum("sn,snx->sx", qd, forces)
        gains = self._momenta(terms, qd) @ moved
        self._give_back(gains, power, q, qd)
        fed = self._fed(gains, rows, reactions, qd)
        gains, whole = gains @ self._merged, self._whole(terms, motion)
        blocks = [np.concatenate([np.asarray(e) for e in opened(self.robot).energy(q, qd)], axis=1)]
        blocks.append(_flat(whole[..., None], gains))
        sums = [_error(gains, whole)]
        if self._has_flow:
            behind = self._behind
            given, before_joint = self._given(power @ self._merged[: power.shape[1]], time, q, qd)
            fed = behind.contacts @ fed @ self._merged
            through = behind.holders @ gains - given - fed
            flow, before = (
                whole @ held.T.astype(float) - other.sum(axis=2) - fed.sum(axis=2)
                for held, other in ((behind.holders, given), (behind.before, before_joint))
            )
            blocks.append(_flat(before[..., None], flow[..., None], through))
            sums.append(_error(through, flow))
        filled = np.concatenate(blocks, axis=1).T
        out[self.first : self.first + len(filled)] = filled
        absolute, relative = worst_of(sums)
        return Closure(power_absolute=absolute, power_relative=relative)

    def _given(self, power: Array, time: Array, q: Array, qd: Array) -> tuple[Array, Array]:
        """Return the power (S, n, G) that sources give behind each joint, and that with the joint's own.

        power: that of each column of sources, (S, G)
        """
        behind, model = self._behind, opened(self.robot)
        given, before = (mask * power[:, None] for mask in (behind.given, behind.given_before))
        for g, (quantity, at) in enumerate(self.columns):
            if quantity != "acc_load":
                continue
            load = self.loads[at[0]]
            for one in load.wrenches:
                pushed = -(one.torque(model, time, q) * qd).sum(axis=1)
                given[:, list(one.acts_on.joints), g] += pushed[:, None]
            before[..., g] = given[..., g]
            if load.efforts is not None:
                driven = load.effort(time) * qd
                given[..., g] += driven @ behind.joints.T
                before[..., g] = given[..., g] + driven
        return given, before

    def _momenta(self, terms: TermArrays, qd: Array) -> Array:
        """Return q̇ᵀ M_j of links, and a_i q̇_i of armatures, (S, H, n)."""
        links = len(self.robot.links)
        momenta = np.zeros((len(qd), len(self.robot.holders), qd.shape[1]))
        for i, j, k, source in mirrored(opened(self.robot).layout):
            momenta[:, j, k] += terms.acceleration[:, source] * qd[:, i]
        for h, i in enumerate(self.robot.with_own("armature"), links):
            momenta[:, h, i] = self._armature(i) * qd[:, i]
        return momenta

    def _armature(self, joint: int) -> float:
        own = (one for one in self.robot.passive if one.coordinate == joint)
        return sum(one.ratio**2 * one.armature for one in own)

    def _give_back(self, gains: Array, power: Array, q: Array, qd: Array) -> None:
        """Give links what their velocity forces and weight took, but for what nothing stores."""
        for x, (quantity, at) in enumerate(self.sources.every):
            if quantity in ON_LINK and at not in self._lost:
                gains[:, at[0], x] -= power[:, x]
        if self.robot.is_written:
            for j, x, others in self._beside:
                gains[:, j, x] += self._power_beside(q, qd)[:, j] - power[:, others].sum(axis=1)

    def _whole(self, terms: TermArrays, motion: Motion) -> Array:
        """Return the rates of energy of all holders, (S, H)."""
        q, qd, qdd = motion
        whole = np.zeros((len(qd), len(self.robot.holders)))
        for at, (i, j) in enumerate(np.asarray(opened(self.robot).layout.torque).tolist()):
            whole[:, j] += terms.torque[:, at] * qd[:, i]
        for h, i in enumerate(self.robot.with_own("armature"), len(self.robot.links)):
            whole[:, h] = self._armature(i) * qdd[:, i] * qd[:, i]
        if self.robot.is_written:
            whole += self._power_beside(q, qd)
        return whole

    def _fed(self, gains: Array, rows: Array | None, reactions: Array, qd: Array) -> Array:
        """Return the power that contacts feed in as they slip, (S, contacts, X), each in its own column.

        It is taken out of the gains of what a contact answers, so that these sum to what a source gives.
        """
        ground = self.robot.contacts
        if rows is None or ground is None:
            return np.zeros((len(qd), 0, len(self.every)))
        power = np.einsum("scn,sn->sc", rows, qd)[..., None] * reactions
        own = np.zeros((len(qd), len(ground.names), len(self.every)))
        for c, link in enumerate(self._pressed):
            fed = power[:, ground.owners == c].sum(axis=1)
            own[:, c, self.every.index(("acc_contact", (c,)))] = fed.sum(axis=1)
            gains[:, link] += own[:, c] - fed
        return own

    @cached_property
    def _pressed(self) -> list[int]:
        """Links that contacts hold; of a frame without mass the link before it."""
        tree, found = self.robot.tree, []
        assert tree is not None
        for contact in self.robot.ground.contacts:
            joint = self.robot.joint_of(contact.frame)
            while joint is not None and tree.joints[joint].link not in self.robot.links:
                joint = tree.joints[joint].parent
            found.append(0 if joint is None else self.robot.links.index(tree.joints[joint].link))
        return found

    def _power_beside(self, q: Array, qd: Array) -> Array:
        """Return R (S, N), the power that links of energies get otherwise than from joints."""
        return np.asarray(opened(self.robot).backend.power_beside(q, qd))

    @cached_property
    def _lost(self) -> frozenset[tuple[int, ...]]:
        """Links and numbers of shares that store nothing: dissipation and forces."""
        if not self.robot.is_written:
            return frozenset()
        names = self.robot.share_names
        return frozenset(
            (j, names.index(name))
            for j in range(len(self.robot.links))
            for name, kind in _kinds(self.robot, j).items()
            if kind == "lost"
        )

    @cached_property
    def _beside(self) -> list[tuple[int, int, list[int]]]:
        """Links with a share whose power only R tells, the place of it, and of those that are lost."""
        places = {source: x for x, source in enumerate(self.sources.every)}
        names, found = self.robot.share_names, []
        for j in range(len(self.robot.links)):
            kinds = _kinds(self.robot, j)
            at = {name: places["acc_share", (j, names.index(name))] for name in kinds}
            lost = [at[name] for name, kind in kinds.items() if kind == "lost"]
            found += [(j, at[name], lost) for name, kind in kinds.items() if kind == "varying"]
        return found


@dataclass(frozen=True)
class Behind:
    """Holders behind each joint (n, H), and columns of sources whose power is given there (n, G)."""

    holders: Mask
    before: Mask
    """Holders, with the joint's own armature."""
    joints: Mask
    """Joints behind each joint, (n, n)."""
    given: Mask
    given_before: Mask
    """Columns, with those of the joint's own torque, spring and losses; loads are in neither."""
    contacts: Array
    """Contacts that hold a frame behind the joint, (n, contacts): 1, else 0."""


def _column(source: Source) -> Source:
    """Return the column of the result to which a source belongs."""
    quantity, at = source
    return (quantity, at[1:]) if quantity == "acc_qd" else source


def _flat(*parts: Array) -> Array:
    """Return parts (S, r, columns) side by side, row after row, (S, ...)."""
    joined = np.concatenate(parts, axis=2)
    return joined.reshape(len(joined), -1)


def _error(shares: Array, whole: Array) -> tuple[float, float]:
    """Return the largest error of sums of shares (S, r, X) against the whole (S, r), and their size."""
    apart = float(np.abs(shares.sum(axis=2) - whole).max(initial=0.0))
    return apart, float(np.abs(shares).sum(axis=2).max(initial=0.0))


def _kinds(robot: OpenedRobot, link: int) -> dict[str, str]:
    """Return the kind of each share of a link of energies: stored, lost or varying, by name.

    Raises LinkwiseError for a link with several varying shares: what each of them gives is not known apart.
    """
    energies = robot.package.manifest.energies
    assert energies is not None
    time = re.compile(rf"\b{re.escape(energies.time)}\b") if energies.time else None
    kinds = {}
    for share in energies.links[link].shares:
        moved = time is not None and time.search(f"{share.potential} {share.motion}")
        lost = share.dissipation != "0" or share.forces
        varies = moved or share.name == IMPOSED_MOTION
        kinds[share.name] = "lost" if lost else "varying" if varies else "stored"
    varying = [name for name, kind in kinds.items() if kind == "varying"]
    if len(varying) > 1:
        raise LinkwiseError(
            f"{FLAG}: of link {robot.links[link]!r}, {listed(map(repr, varying))} all change with time, and"
            " their power is only known together; make one share of them, or leave the flag out"
        )
    return kinds
