"""Torque terms of a block of samples, from its positions, velocities and accelerations."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, NamedTuple, Self

import numpy as np
from linkwise_runtime.motion.tracer import TraceState

from linkwise.analysis.borne_joints import ReactionShares
from linkwise.analysis.chosen_columns import chosen_places
from linkwise.analysis.closed_motion import reason_of
from linkwise.analysis.closing_sums import ClosingSums, closing
from linkwise.analysis.contacts.ground import Standing
from linkwise.analysis.contacts.terms import ContactTerms
from linkwise.analysis.contacts.times import ContactTimes
from linkwise.analysis.deviation_rows import DeviationRows
from linkwise.analysis.induced_power import PowerShares
from linkwise.analysis.induced_shares import InducedShares
from linkwise.analysis.loads.placed import LoadShift, PlacedLoad
from linkwise.analysis.net_causes import NET
from linkwise.analysis.net_torques import NetTorques
from linkwise.analysis.opened_robot import OpenedRobot
from linkwise.analysis.reaction_forces import ReactionForces
from linkwise.analysis.result_quantities import PASSIVE, TERMS, TORQUE_OF
from linkwise.analysis.result_rows import Place, ResultRows, torque_places
from linkwise.analysis.settings import Convention
from linkwise.analysis.term_rows import TermArrays, term_rows
from linkwise.analysis.told_beside import NOTHING_BESIDE, ToldBeside
from linkwise.analysis.traced_rows import ExtendedBlock, TracedRows
from linkwise.analysis.turned_rows import spread
from linkwise.analysis.verify import Closure, against_recursion
from linkwise.arrays import Array
from linkwise.errors import LinkwiseError
from linkwise.escape import listed

QUANTITY_OF = TermArrays("tau_qdd", "tau_qd", "tau_gravity", "tau_link")
"""Quantities of the kinds of terms."""


class Filled(NamedTuple):
    """Packed values that rows were filled from, less what contacts bear, and what follows beside."""

    packed: Any
    partial: Array
    """tau_ij (S, n, N) before contacts carry any; empty without contacts."""
    standing: Standing | None
    closure: Closure


@dataclass(frozen=True)
class Decomposer:
    """Computes blocks of the result, stored row by row: (rows, samples).

    With q̈_k and q̇_k the coordinates' motion, and index order joint i, link j, coordinate k:
    τ_i = Σ_j τ_ij + passive torques of the joint + Σ_e τ_ie, with τ_ie = −J_iᵀ (n, f) of load e
    τ_ij = Σ_k c2_ijk q̈_k + Σ_k c1_ijk q̇_k + g_ij
    P_ij = τ_ij q̇_i, the power that joint i sends into link j

    Where the robot stands on contacts, all of these torques are those that the contacts leave to the joints.
    """

    robot: OpenedRobot
    loads: tuple[PlacedLoad, ...]
    convention: Convention
    rows: ResultRows
    sources: TermArrays
    """Places of the rows of τ_ij and its terms among packed values, for each kind in the order of rows."""
    parts: ClosingSums
    """Terms of each τ_ij."""
    wholes: ClosingSums
    """Parts of each τ_i: τ_ij, passive torques of the joint, τ_ie."""
    nets: NetTorques
    induced: InducedShares
    power: PowerShares
    forces: ReactionForces
    reactions: ReactionShares
    deviations: DeviationRows
    times: ContactTimes | None
    terms: ContactTerms | None
    """Terms of the robot on its contacts; None without contacts."""
    traced: TracedRows | None = None
    """Rows of a trace; None where none is asked for."""
    whole: "Decomposer | None" = None
    """Decomposer with all rows of torques, by which samples are checked where columns were chosen."""

    @classmethod
    def of(
        cls,
        robot: OpenedRobot,
        convention: Convention,
        loads: Sequence[PlacedLoad] = (),
        times: ContactTimes | None = None,
        told: ToldBeside = NOTHING_BESIDE,
    ) -> "Decomposer":
        """Plan where each packed value of the robot goes."""
        of_robot, terms = term_rows(robot.model.layout), None
        if robot.contacts is not None:
            terms = ContactTerms.of(of_robot, robot.contacts)
            of_robot = terms.rows
        measured = [] if times is None else [at for at, loads in enumerate(times.measured) if loads]
        every_place = torque_places(robot, of_robot, loads, told.power_terms, measured)
        chosen = chosen_places(robot, every_place, loads, told.columns, told.asked, told.power_terms)
        places, points, left_out = [*chosen.torques, *chosen.nets], told.induced.points, chosen.left_out
        sources = _sources(of_robot, places)
        induced = InducedShares.of(robot, told.induced, ResultRows.of(robot, places, loads))
        reactions = ReactionShares(robot, tuple(told.borne), tuple(loads), convention)
        traced = told.traced
        places += induced.places
        sums = ResultRows.of(robot, places, loads, points)
        power = PowerShares.of(robot, loads, sums, told.induced_power)
        velocities = [at for at in places if at[0] == "tau_qd"]
        every = [*places, *power.places, *reactions.places]
        every += [] if traced is None else traced.places(velocities)
        deviations = DeviationRows(robot, told.uncertain, convention, sources)
        every += deviations.places(every)
        bearings, origins = [joint.name for joint in told.borne], () if traced is None else traced.origins
        rows = ResultRows.of(robot, every, loads, points, bearings, origins, left_out)
        parts = ClosingSums(robot.units, rows, "tau_link", *TERMS)
        wholes = ClosingSums(robot.units, rows, "tau", "tau_link", *PASSIVE, "tau_load")
        nets = NetTorques.of(robot, len(loads), of_robot, rows, chosen.every_net)
        forces = ReactionForces(robot, tuple(loads), times)
        return cls(
            *(robot, tuple(loads), convention, rows, sources, parts, wholes, nets),
            *(induced, power, forces, reactions),
            *(deviations.of_rows(rows), times, terms, traced),
            cls.of(robot, convention, loads, times) if left_out else None,
        )

    def at(self, time: Array, inputs: Array) -> "Decomposer":
        """Return the decomposer of the robot at the time (S,) and with the inputs (S, count) of samples."""
        robot = self.robot.at(time, inputs)
        if robot is self.robot:
            return self
        return self.with_robot(robot)

    def with_robot(self, robot: OpenedRobot) -> Self:
        """Return the decomposer of another robot of the same joints and links."""
        sources = replace(self.induced.sources, robot=robot)
        return replace(
            self,
            robot=robot,
            induced=replace(self.induced, robot=robot, sources=sources),
            power=replace(self.power, robot=robot, sources=replace(self.power.sources, robot=robot)),
            forces=replace(self.forces, robot=robot),
            reactions=replace(self.reactions, robot=robot),
        )

    def with_rows(self, places: Sequence[Place]) -> Self:
        """Return the decomposer of these rows alone, of which none is a share by link or cause."""
        nothing = TermArrays(*(some[:0] for some in self.sources))
        rows = replace(self.rows, places=tuple(places))
        return replace(self, rows=rows, sources=nothing, nets=replace(self.nets, rows=rows))

    def with_load_off(self, e: int, shift: LoadShift) -> Self:
        """Return the decomposer in which load e is off by a shift."""
        loads = tuple(load.off_by(shift) if e == at else load for at, load in enumerate(self.loads))
        return replace(
            self,
            loads=loads,
            power=replace(self.power, loads=loads),
            forces=replace(self.forces, loads=loads),
            reactions=replace(self.reactions, loads=loads),
        )

    def values(self, time: Array, q: Array, qd: Array, qdd: Array) -> Array:
        """Return all rows but those of a trace and of deviations, then factors; arguments are as of `fill`.

        They are (rows, S); factors are c2 of all rows tau_qdd and c1 of all rows tau_qd, which times the
        cause's motion are these. Such products, and powers, are not filled.
        """
        plain, (acceleration, velocity) = self.rows.plain, self.sources[:2]
        ends = plain + len(acceleration), plain + len(acceleration) + len(velocity)
        out = np.empty((ends[1], len(time)))
        motion = self._consistent(time, q, qd, qdd)
        packed, _, standing, _ = self._fill(out[:plain], time, motion)
        self._fill_gradient(out, packed, standing, motion)
        spread(out, slice(plain, ends[0]), getattr(packed, "acceleration", None), acceleration)
        spread(out, slice(*ends), getattr(packed, "velocity", None), velocity)
        if self.convention == "gradient":
            out[slice(*ends)] *= 2.0
        return out

    def fill(self, out: Array, time: Array, q: Array, qd: Array, qdd: Array) -> Closure:
        """Fill `out` (rows, S) from time (S,) and q, qd, qdd (S, n); return how well it closes.

        Where joints are tied, the motion of the independent ones counts. Raises LinkwiseError, with the time,
        where ties cannot be closed or joints do not follow.
        """
        motion = q, qd, qdd = self._consistent(time, q, qd, qdd)
        packed, partial, standing, closure = self._fill(out, time, motion)
        rows, sources = self.rows, self.sources
        for name, kind, places, moved in (
            ("tau_qdd", "acceleration", sources.acceleration, qdd),
            ("tau_qd", "velocity", sources.velocity, qd),
        ):
            values = getattr(packed, kind, None)
            spread(out, rows[name].rows, values, places, (moved, rows[name].at[:, 2]))
        sums = {"terms": self.parts, "links": self.wholes} if self.whole is None else {}
        closure |= closing({**sums, **self.nets.closing_sums}, out, partial, self.robot.units)
        self._fill_gradient(out, packed, standing, motion)
        self._fill_power(out, qd)
        self.deviations.fill(out, self, time, motion)
        return closure

    def _fill(self, out: Array, time: Array, motion: tuple[Array, Array, Array]) -> Filled:
        """Fill `out` but for deviations, torques by cause and powers."""
        q, qd, qdd = motion
        rows, sources = self.rows, self.sources
        packed: Any = self.robot.model.packed(q, qd, qdd) if self._needs_terms else None
        standing = self._standing(time, q)
        unborne = packed
        partial = self._dense(packed, q.shape[1])
        if standing is not None and self.terms is not None:
            packed = self.terms.left(packed, standing, q.shape[1])
        out[0] = time
        for name, moved in zip(("q", "qd", "qdd"), motion, strict=True):
            rows.put(out, name, moved)
        if "tau" in rows:
            rows.put(out, "tau", _left(standing, self.robot.model.inverse_dynamics(q, qd, qdd)))
        self._add_passive(out, standing, q, qd, qdd)
        self._add_loads(out, standing, time, q)
        spread(out, rows["tau_link"].rows, getattr(packed, "torque", None), sources.torque)
        self.nets.fill(out, packed, qdd, qd)
        if "tau_share" in rows or self.nets.are_shares:
            shares = self.robot.model.named_shares(q, qd)
            rows.put(out, "tau_share", shares)
            self.nets.put(out, "tau_share", np.asarray(shares).sum(axis=2))
        if "tau_gravity" in rows:
            spread(out, rows["tau_gravity"].rows, packed.gravity, sources.gravity)
        self.forces.fill(out, rows, standing, time, motion, partial)
        closure = self.induced.fill(out, unborne, standing, q, qd, qdd)
        self.reactions.fill(out, rows, standing, time, motion)
        closure |= self.power.fill(out, unborne, standing, time, motion)
        return Filled(packed, partial, standing, closure)

    def _fill_gradient(
        self, out: Array, packed: Any, standing: Standing | None, motion: tuple[Array, Array, Array]
    ) -> None:
        """Fill anew what is by velocity, where that is of the gradient convention."""
        if self.convention == "closing" or not ("tau_qd" in self.rows or self.nets.are_of_terms):
            return
        velocity = self.robot.model.propagation(*motion, convention="gradient").velocity
        velocity = _left(standing, velocity)
        self.rows.put(out, "tau_qd", velocity)
        self.nets.fill(out, packed, motion[2], motion[1], velocity.sum(axis=2))

    @property
    def is_quick(self) -> bool:
        """True if compiled code computes nearly all, so that a call for few samples costs no more of each."""
        robot, asked = self.robot, (self.induced.points, self.power.is_asked, self.reactions.borne)
        slow = robot.constrained, robot.contacts, self.traced, self.loads, robot.is_written, *asked
        return robot.backend == "native" and not any(slow) and self.deviations.is_quick

    def checked(self, some: Array, inputs: Array) -> Closure:
        """Return the errors of some samples (rows, S) against an independent recursion.

        Where columns were chosen, all rows are computed of these samples, and how they close is told too.
        """
        if self.whole is None:
            return against_recursion(self.robot, self.loads, self.times, self.rows, some)
        every = np.empty((len(self.whole.rows), some.shape[1]))
        motion = (self.rows.dense(name, some) for name in ("q", "qd", "qdd"))
        closure = self.whole.at(some[0], inputs).fill(every, some[0], *motion)
        return closure | self.whole.checked(every, inputs)

    def trace(
        self, out: Array, block: ExtendedBlock, state: TraceState | None
    ) -> tuple[Closure, TraceState | None]:
        """Fill the rows of a trace, once all others are filled, as `TracedRows.fill` does."""
        if self.traced is None:
            return Closure(), None
        standing = self._standing(out[0], out[self.rows["q"].rows].T)
        return self.traced.fill(self.rows, out, block, standing, state)

    def _consistent(self, time: Array, q: Array, qd: Array, qdd: Array) -> tuple[Array, Array, Array]:
        """Return the motion in which ties close; raise LinkwiseError, with the time, where they cannot."""
        if self.robot.constrained is None:
            return q, qd, qdd
        try:
            return self.robot.constrained.consistent(q, qd, qdd)
        except ValueError as error:
            raise LinkwiseError(
                f"between {time[0]:.6g} and {time[-1]:.6g} s: {reason_of(error)}; mend the log, or filter"
                " it less where a filter carries joints out of reach"
            ) from None

    def _fill_power(self, out: Array, qd: Array) -> None:
        """Fill the powers P = τ q̇_i from the torques."""
        for name, torque in TORQUE_OF.items():
            if name in self.rows:
                powers = self.rows[name]
                out[powers.rows] = out[self.rows[torque].rows] * qd.T[powers.at[:, 0]]

    @cached_property
    def _needs_terms(self) -> bool:
        """True if rows are made of packed values: of torques by link and cause, or of what contacts bear."""
        beside = self.terms is not None, self.induced.points, self.power.is_asked, self.nets.are_of_terms
        return any(beside) or any(len(places) for places in self.sources)

    def _dense(self, packed: Any, n: int) -> Array:
        """Return tau_ij (S, n, N) from packed values, before contacts carry any; empty without contacts."""
        if self.terms is None:
            return np.zeros((0, n, 0))
        torque = packed.torque
        out = np.zeros((len(torque), n, len(self.robot.links)))
        i, j = self.robot.model.layout.torque.T
        out[:, i, j] = torque
        return out

    def _standing(self, time: Array, q: Array) -> Standing | None:
        """Return the rows of the contacts that are on at each sample; None without contacts.

        Raises LinkwiseError, with the time, where the torques of unactuated joints do not determine what
        contacts carry.
        """
        if self.times is None or self.robot.contacts is None:
            return None
        model, ground = self.robot.model, self.robot.contacts
        blind = ground.blind(model, q)
        if blind is not None:
            joints = listed([self.robot.joints[i] for i in ground.unactuated])
            raise LinkwiseError(
                f"time {time[blind]:.6g} s: two of {joints} turn about one axis there, so that their torques"
                " do not tell all that contacts bear, nor the log how the base turns; cut the log there, or"
                " describe the base by turns that stay apart"
            )
        times = self.times
        return ground.standing(model, q, times.shares(model, time, q), times.press(model, time, q))

    def _add_passive(self, out: Array, standing: Standing | None, q: Array, qd: Array, qdd: Array) -> None:
        """Fill the passive torques of the joints, and add them to the joint torques."""
        if not self._passive:
            return
        every = self.robot.model.passive_torque(q, qd, qdd)
        for name, torque in zip(PASSIVE, every, strict=True):
            if name in self._passive:
                self._add(out, name, _left(standing, torque)[..., None])

    @cached_property
    def _passive(self) -> tuple[str, ...]:
        """Passive torques that some joint has, where they or joint torques are told."""
        if not {"tau", NET, *PASSIVE}.intersection(self.rows.named):
            return ()
        return tuple(name for name, field in PASSIVE.items() if self.robot.with_own(field))

    def _add_loads(self, out: Array, standing: Standing | None, time: Array, q: Array) -> None:
        """Fill the torques by which joints carry loads, and add them to the joint torques."""
        if self.loads and {"tau", NET, "tau_load", "tau_before_muscles"}.intersection(self.rows.named):
            asked = [_left(standing, borne.torque(self.robot.model, time, q)) for borne in self.loads]
            torque = np.stack(asked, axis=-1)
            self._add(out, "tau_load", torque)
            if "tau_before_muscles" in self.rows:
                muscles = [borne.is_muscle for borne in self.loads]
                whole = self.rows.dense("tau", out) - torque[..., muscles].sum(-1)
                self.rows.put(out, "tau_before_muscles", whole)

    def _add(self, out: Array, name: str, torque: Array) -> None:
        """Fill the rows of a quantity from torques (S, n, X), and add them to the joint torques."""
        self.rows.put(out, name, torque if name == "tau_load" else torque[..., 0])
        self.nets.put(out, name, torque)
        rows, _, at = self.rows["tau"]
        for e in range(torque.shape[2]):
            out[rows] += torque[:, at[:, 0], e].T


def _sources(terms: TermArrays, places: Sequence[Place]) -> TermArrays:
    """Return the places among packed values of the terms that have rows, in the order of rows, by kind."""
    kept = frozenset(places)
    found = (
        np.array([row[-1] for row in some if (name, row[:-1]) in kept], np.intp)
        for name, some in zip(QUANTITY_OF, terms, strict=True)
    )
    return TermArrays(*found)


def _left(standing: Standing | None, torque: Array) -> Array:
    """Return what contacts leave to the joints of torques (S, n, ...)."""
    return np.asarray(torque) if standing is None else standing.left(np.asarray(torque))
