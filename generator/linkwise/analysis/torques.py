"""Torque terms of a block of samples, from its positions, velocities and accelerations."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from linkwise.analysis.borne_forces import BorneForces
from linkwise.analysis.closed_motion import reason_of
from linkwise.analysis.contacts.contact_terms import ContactTerms
from linkwise.analysis.contacts.contact_times import ContactTimes
from linkwise.analysis.contacts.ground_contacts import Standing
from linkwise.analysis.induced_points import InducedPoint
from linkwise.analysis.induced_shares import InducedShares
from linkwise.analysis.loaded_robot import LoadedRobot
from linkwise.analysis.loads.placed_load import PlacedLoad
from linkwise.analysis.result_columns import Column, Key, columns_of, load_unit
from linkwise.analysis.result_quantities import PASSIVE, TERMS, TORQUE_OF, Quantity
from linkwise.analysis.settings import Convention
from linkwise.analysis.term_rows import TermRows, term_rows
from linkwise.analysis.verify import Closure, residual, worst_of
from linkwise.errors import LinkwiseError
from linkwise.escape import listed
from linkwise.package.load import Array

Source = tuple[int, int, int]
"""Row of the result, column of the packed values, the coordinate that multiplies (-1: none)."""


@dataclass(frozen=True)
class Decomposer:
    """Computes blocks of the result, stored by column: (columns, samples).

    With q̈_k and q̇_k the coordinates' motion, and index order joint i, link j, coordinate k:
    τ_i = Σ_j τ_ij + passive torques of the joint + Σ_e τ_ie, with τ_ie = −J_iᵀ (n, f) of load e
    τ_ij = Σ_k c2_ijk q̈_k + Σ_k c1_ijk q̇_k + g_ij
    P_ij = τ_ij q̇_i, the power that joint i sends into link j

    Where the robot stands on contacts, all of these torques are those that the contacts leave to the joints.
    """

    robot: LoadedRobot
    loads: tuple[PlacedLoad, ...]
    convention: Convention
    columns: tuple[Column, ...]
    sources: dict[Quantity, tuple[Source, ...]]
    parts: tuple[tuple[int, tuple[int, ...]], ...]
    """Row of each τ_ij, and the rows of its terms."""
    wholes: tuple[tuple[int, tuple[int, ...]], ...]
    """Row of each τ_i, and the rows of its parts: τ_ij, passive torques of the joint, τ_ie."""
    powers: tuple[tuple[int, int, int], ...]
    """Row of each power, the row of its torque, and the joint whose velocity multiplies."""
    induced: InducedShares
    forces: BorneForces
    times: ContactTimes | None
    terms: ContactTerms | None
    """Terms of the robot on its contacts; None without contacts."""

    @classmethod
    def of(
        cls,
        robot: LoadedRobot,
        convention: Convention,
        power_terms: bool = False,
        loads: Sequence[PlacedLoad] = (),
        points: Sequence[InducedPoint] = (),
        times: ContactTimes | None = None,
    ) -> "Decomposer":
        """Plan where each packed value of the robot goes."""
        rows, terms = term_rows(robot.model.layout), None
        if robot.contacts is not None:
            terms = ContactTerms.of(rows, robot.contacts)
            rows = terms.rows
        measured = [] if times is None else [at for at, loads in enumerate(times.measured) if loads]
        columns = columns_of(robot, rows, loads, power_terms, measured)
        row = {column.key: at for at, column in enumerate(columns)}
        parts = [
            (at, _rows(columns, TERMS, joint=c.joint, link=c.link))
            for at, c in enumerate(columns)
            if c.quantity == "tau_link"
        ]
        wholes = [
            (at, _rows(columns, ("tau_link", *PASSIVE, "tau_load"), joint=c.joint))
            for at, c in enumerate(columns)
            if c.quantity == "tau"
        ]
        powers = [
            (at, row[TORQUE_OF[c.quantity], c.joint, c.link, c.cause], c.joint)
            for at, c in enumerate(columns)
            if c.quantity in TORQUE_OF and c.joint is not None
        ]
        sources = _sources(rows, row)
        induced = InducedShares.of(robot, points, columns, [borne.name for borne in loads])
        planned = tuple(parts), tuple(wholes), tuple(powers)
        every = (*columns, *induced.columns)
        forces = BorneForces(robot, tuple(loads), times)
        return cls(robot, tuple(loads), convention, every, sources, *planned, induced, forces, times, terms)

    def rows(self, quantity: Quantity) -> slice:
        """Return the slice of a quantity's columns, which stand together."""
        found = [at for at, column in enumerate(self.columns) if column.quantity == quantity]
        return slice(found[0], found[-1] + 1) if found else slice(0, 0)

    def fill(self, out: Array, time: Array, q: Array, qd: Array, qdd: Array) -> Closure:
        """Fill `out` (columns, S) from time (S,) and q, qd, qdd (S, n); return how well it closes.

        Where joints are tied, the motion of the independent ones counts. Raises LinkwiseError, with the time,
        where ties cannot be closed or joints do not follow.
        """
        if self.robot.constrained is not None:
            try:
                q, qd, qdd = self.robot.constrained.consistent(q, qd, qdd)
            except ValueError as error:
                raise LinkwiseError(
                    f"between {time[0]:.6g} and {time[-1]:.6g} s: {reason_of(error)}; mend the log, or filter"
                    " it less where a filter carries joints out of reach"
                ) from None
        packed: Any = self.robot.model.packed(q, qd, qdd)
        standing = self._standing(time, q)
        unborne, free = packed, self.robot.model.inverse_dynamics(q, qd, qdd)
        partial = self._dense(packed.torque, q.shape[1])
        if standing is not None and self.terms is not None:
            packed = self.terms.left(packed, standing, q.shape[1])
        out[0] = time
        out[self.rows("q")], out[self.rows("qd")], out[self.rows("qdd")] = q.T, qd.T, qdd.T
        out[self.rows("tau")] = _left(standing, free).T[list(self.robot.driven)]
        self._add_passive(out, standing, q, qd, qdd)
        self._add_loads(out, standing, time, q)
        for row, source, _ in self.sources["tau_link"]:
            out[row] = packed.torque[..., source]
        for row, source, k in self.sources["tau_qdd"]:
            np.multiply(packed.acceleration[..., source], qdd[:, k], out=out[row])
        for row, source, k in self.sources["tau_qd"]:
            np.multiply(packed.velocity[..., source], qd[:, k], out=out[row])
        for row, source, _ in self.sources["tau_gravity"]:
            out[row] = packed.gravity[..., source]
        self.forces.fill(out, self.columns, standing, time, (q, qd, qdd), partial)
        closure = self._closure(out, partial) | self.induced.fill(out, unborne, standing, q, qd, qdd)
        if self.convention == "gradient":
            velocity = self.robot.model.propagation(q, qd, qdd, convention="gradient").velocity
            velocity = _left(standing, velocity)
            for column, values in zip(self.columns, out, strict=True):
                if column.quantity == "tau_qd":
                    values[:] = velocity[:, column.joint, column.link, column.cause]
        for power, torque, i in self.powers:
            np.multiply(out[torque], qd[:, i], out=out[power])
        return closure

    def _dense(self, torque: Array, n: int) -> Array:
        """Return tau_ij (S, n, N) from packed values, before contacts carry any; empty without contacts."""
        if self.terms is None:
            return np.zeros((0, n, 0))
        out = np.zeros((len(torque), n, len(self.robot.links)))
        for i, j, source in term_rows(self.robot.model.layout).torque:
            out[:, i, j] = torque[:, source]
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
        return ground.standing(q, self.times.shares(model, time, q))

    def _add_passive(self, out: Array, standing: Standing | None, q: Array, qd: Array, qdd: Array) -> None:
        """Fill the passive torques of the joints, and add them to the joint torques."""
        if not self.robot.passive:
            return
        every = self.robot.model.passive_torque(q, qd, qdd)
        found = {share: _left(standing, torque) for share, torque in zip(PASSIVE, every, strict=True)}
        whole = self._wholes()
        for column, values in zip(self.columns, out, strict=True):
            if column.quantity in PASSIVE and column.joint is not None:
                values[:] = found[column.quantity][:, column.joint]
                out[whole[column.joint]] += values

    def _add_loads(self, out: Array, standing: Standing | None, time: Array, q: Array) -> None:
        """Fill the torques by which joints carry loads, and add them to the joint torques."""
        asked = [_left(standing, borne.torque(self.robot.model, time, q)) for borne in self.loads]
        whole = self._wholes()
        for column, values in zip(self.columns, out, strict=True):
            if column.quantity == "tau_load" and column.joint is not None and column.cause is not None:
                values[:] = asked[column.cause][:, column.joint]
                out[whole[column.joint]] += values

    def _wholes(self) -> dict[int, int]:
        """Return the row of each joint's whole torque, by joint."""
        return {
            c.joint: at for at, c in enumerate(self.columns) if c.quantity == "tau" and c.joint is not None
        }

    def _closure(self, out: Array, partial: Array) -> Closure:
        """Return the largest errors of the closing sums, by unit.

        A joint that carries only rounding is measured by its peers.

        partial: tau_ij (S, n, N) before contacts carry any; what they leave may be only its rounding
        """
        worst, units = Closure(), self.robot.units
        before = np.abs(partial).sum(axis=-1).max(axis=0, initial=0.0)
        for unit in dict.fromkeys(self.columns[whole].unit for whole, _ in self.wholes):
            alike = [(whole, links) for whole, links in self.wholes if self.columns[whole].unit == unit]
            parts = [(link, rows) for link, rows in self.parts if self.columns[link].unit == unit]
            size = max(size for size, other in zip(before, units, strict=True) if load_unit(other) == unit)
            terms = [residual([out[row] for row in rows], out[link]) for link, rows in parts]
            sums = [residual([out[row] for row in links], out[whole]) for whole, links in alike]
            least = (0.0, float(size))
            worst |= Closure(*worst_of([*terms, least]), *worst_of([*sums, least]))
        return worst


def _rows(
    columns: tuple[Column, ...],
    quantities: tuple[Quantity, ...],
    joint: int | None,
    link: int | None = None,
) -> tuple[int, ...]:
    return tuple(
        at
        for at, c in enumerate(columns)
        if c.quantity in quantities and c.joint == joint and link in (None, c.link)
    )


def _left(standing: Standing | None, torque: Array) -> Array:
    """Return what contacts leave to the joints of torques (S, n, ...)."""
    return np.asarray(torque) if standing is None else standing.left(np.asarray(torque))


def _sources(terms: TermRows, row: dict[Key, int]) -> dict[Quantity, tuple[Source, ...]]:
    def plain(quantity: Quantity, rows: Sequence[tuple[int, ...]]) -> tuple[Source, ...]:
        return tuple((row[quantity, i, j, None], at, -1) for i, j, at in rows)

    def moved(quantity: Quantity, rows: Sequence[tuple[int, ...]]) -> tuple[Source, ...]:
        return tuple((row[quantity, i, j, k], at, k) for i, j, k, at in rows)

    return {
        "tau_link": plain("tau_link", terms.torque),
        "tau_gravity": plain("tau_gravity", terms.gravity),
        "tau_qdd": moved("tau_qdd", terms.acceleration),
        "tau_qd": moved("tau_qd", terms.velocity),
    }
