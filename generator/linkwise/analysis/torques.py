"""From positions, velocities and accelerations to every torque term of a block of samples."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from linkwise.analysis.induced_points import InducedPoint
from linkwise.analysis.induced_shares import InducedShares
from linkwise.analysis.loaded_robot import LoadedRobot
from linkwise.analysis.loads.placed_load import PlacedLoad
from linkwise.analysis.result_columns import (
    PASSIVE,
    TERMS,
    TORQUE_OF,
    Column,
    Key,
    Quantity,
    columns_of,
    mirrored,
)
from linkwise.analysis.settings import Convention
from linkwise.analysis.verify import Closure, residual, worst_of
from linkwise.errors import LinkwiseError
from linkwise.package.load import Array, PackedLayout

Source = tuple[int, int, int]
"""Row of the result, column of the packed values, the coordinate that multiplies (-1: none)."""


@dataclass(frozen=True)
class Decomposer:
    """Computes blocks of the result, stored by column: (columns, samples).

    With q̈_k and q̇_k the coordinates' motion, and index order joint i, link j, coordinate k:
    τ_i = Σ_j τ_ij + what the joint has of its own + Σ_e τ_ie, with τ_ie = −J_iᵀ (n, f) of load e
    τ_ij = Σ_k c2_ijk q̈_k + Σ_k c1_ijk q̇_k + g_ij
    P_ij = τ_ij q̇_i, what joint i sends into link j
    """

    robot: LoadedRobot
    loads: tuple[PlacedLoad, ...]
    convention: Convention
    columns: tuple[Column, ...]
    sources: dict[Quantity, tuple[Source, ...]]
    parts: tuple[tuple[int, tuple[int, ...]], ...]
    """Row of each τ_ij, and the rows of its terms."""
    wholes: tuple[tuple[int, tuple[int, ...]], ...]
    """Row of each τ_i, and the rows of its parts: τ_ij, what the joint has of its own, τ_ie."""
    powers: tuple[tuple[int, int, int], ...]
    """Row of each power, the row of its torque, and the joint whose velocity multiplies."""
    induced: InducedShares

    @classmethod
    def of(
        cls,
        robot: LoadedRobot,
        convention: Convention,
        power_terms: bool = False,
        loads: Sequence[PlacedLoad] = (),
        points: Sequence[InducedPoint] = (),
    ) -> "Decomposer":
        """Plan where each packed value of the robot goes."""
        columns = columns_of(robot, robot.model.layout, loads, power_terms)
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
        sources = _sources(robot.model.layout, row)
        induced = InducedShares.of(robot, points, columns, [borne.name for borne in loads])
        planned = tuple(parts), tuple(wholes), tuple(powers)
        every = (*columns, *induced.columns)
        return cls(robot, tuple(loads), convention, every, sources, *planned, induced)

    def rows(self, quantity: Quantity) -> slice:
        """Where a quantity's columns stand; they stand together."""
        found = [at for at, column in enumerate(self.columns) if column.quantity == quantity]
        return slice(found[0], found[-1] + 1) if found else slice(0, 0)

    def fill(self, out: Array, time: Array, q: Array, qd: Array, qdd: Array) -> Closure:
        """Fill `out` (columns, S) from time (S,) and q, qd, qdd (S, n); say how well it closes.

        Where joints are tied, the motion of the independent ones counts. Raises LinkwiseError, with the time,
        where ties cannot be closed or joints do not follow.
        """
        if self.robot.constrained is not None:
            try:
                q, qd, qdd = self.robot.constrained.consistent(q, qd, qdd)
            except ValueError as error:
                raise LinkwiseError(f"between {time[0]:.6g} and {time[-1]:.6g} s: {error}") from None
        packed = self.robot.model.packed(q, qd, qdd)
        out[0] = time
        out[self.rows("q")], out[self.rows("qd")], out[self.rows("qdd")] = q.T, qd.T, qdd.T
        out[self.rows("tau")] = self.robot.model.inverse_dynamics(q, qd, qdd).T[list(self.robot.driven)]
        self._add_passive(out, q, qd, qdd)
        self._add_loads(out, time, q)
        for row, source, _ in self.sources["tau_link"]:
            out[row] = packed.torque[..., source]
        for row, source, k in self.sources["tau_qdd"]:
            np.multiply(packed.acceleration[..., source], qdd[:, k], out=out[row])
        for row, source, k in self.sources["tau_qd"]:
            np.multiply(packed.velocity[..., source], qd[:, k], out=out[row])
        for row, source, _ in self.sources["tau_gravity"]:
            out[row] = packed.gravity[..., source]
        self._fill_forces(out, time, q, qd, qdd)
        closure = self._closure(out) | self.induced.fill(out, packed, q, qd, qdd)
        if self.convention == "gradient":
            velocity = self.robot.model.propagation(q, qd, qdd, convention="gradient").velocity
            for column, values in zip(self.columns, out, strict=True):
                if column.quantity == "tau_qd":
                    values[:] = velocity[:, column.joint, column.link, column.cause]
        for power, torque, i in self.powers:
            np.multiply(out[torque], qd[:, i], out=out[power])
        return closure

    def _add_passive(self, out: Array, q: Array, qd: Array, qdd: Array) -> None:
        """Fill what joints have of their own, and add it to their torques."""
        if not self.robot.passive:
            return
        found = dict(zip(PASSIVE, self.robot.model.passive_torque(q, qd, qdd), strict=True))
        whole = self._wholes()
        for column, values in zip(self.columns, out, strict=True):
            if column.quantity in PASSIVE and column.joint is not None:
                values[:] = found[column.quantity][:, column.joint]
                out[whole[column.joint]] += values

    def _add_loads(self, out: Array, time: Array, q: Array) -> None:
        """Fill what joints take to bear loads, and add it to their torques."""
        asked = [borne.torque(self.robot.model, time, q) for borne in self.loads]
        whole = self._wholes()
        for column, values in zip(self.columns, out, strict=True):
            if column.quantity == "tau_load" and column.joint is not None and column.cause is not None:
                values[:] = asked[column.cause][:, column.joint]
                out[whole[column.joint]] += values

    def _wholes(self) -> dict[int, int]:
        """Row of each joint's whole torque."""
        return {
            c.joint: at for at, c in enumerate(self.columns) if c.quantity == "tau" and c.joint is not None
        }

    def _fill_forces(self, out: Array, time: Array, q: Array, qd: Array, qdd: Array) -> None:
        """Fill what constraints bear of the links, and with what joints have of their own and loads."""
        tied = self.robot.constrained
        if tied is None:
            return
        model: Any = self.robot.model
        by_link = model.forces(q, qd, qdd)
        beside = sum(
            [
                *(np.asarray(a) for a in tied.open.passive_torque(q, qd, qdd)),
                *(borne.torque(tied.open, time, q) for borne in self.loads),
            ]
        )
        whole = by_link.sum(-1) + tied.forces_of(q, beside + 0.0 * q)
        for column, values in zip(self.columns, out, strict=True):
            if column.quantity == "force":
                values[:] = whole[:, column.cause]
            elif column.quantity == "force_link":
                values[:] = by_link[:, column.cause, column.link]

    def _closure(self, out: Array) -> Closure:
        """Check the closing sums, by unit: a joint that carries but rounding is measured by its peers."""
        worst = Closure()
        for unit in dict.fromkeys(self.columns[whole].unit for whole, _ in self.wholes):
            alike = [(whole, links) for whole, links in self.wholes if self.columns[whole].unit == unit]
            parts = [(link, rows) for link, rows in self.parts if self.columns[link].unit == unit]
            terms = [residual([out[row] for row in rows], out[link]) for link, rows in parts]
            sums = [residual([out[row] for row in links], out[whole]) for whole, links in alike]
            worst |= Closure(*worst_of(terms), *worst_of(sums))
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


def _sources(layout: PackedLayout, row: dict[Key, int]) -> dict[Quantity, tuple[Source, ...]]:
    def plain(quantity: Quantity, pairs: list[list[int]]) -> tuple[Source, ...]:
        return tuple((row[quantity, i, j, None], at, -1) for at, (i, j) in enumerate(pairs))

    return {
        "tau_link": plain("tau_link", layout.torque.tolist()),
        "tau_gravity": plain("tau_gravity", layout.gravity.tolist()),
        "tau_qdd": tuple((row["tau_qdd", i, j, k], at, k) for i, j, k, at in mirrored(layout)),
        "tau_qd": tuple(
            (row["tau_qd", i, j, k], at, k) for at, (i, j, k) in enumerate(layout.velocity.tolist())
        ),
    }
