"""Rows of net torques by cause, summed from packed values without rows of every link."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from linkwise.analysis.closing_sums import ClosingSums
from linkwise.analysis.net_causes import NET, NetCause, net_causes
from linkwise.analysis.opened_robot import OpenedRobot
from linkwise.analysis.result_quantities import MOTION
from linkwise.analysis.result_rows import Place, ResultRows
from linkwise.analysis.row_sums import RowSums
from linkwise.analysis.term_rows import TermArrays
from linkwise.analysis.turned_rows import TURNED, turned
from linkwise.arrays import Array, Index


class SummedTerms(NamedTuple):
    """Rows that terms of one kind are summed in, and the coordinate of each."""

    rows: Index
    coordinates: Index
    sums: RowSums


@dataclass(frozen=True, eq=False)
class NetTorques:
    """Fills the rows of net torques by cause."""

    causes: tuple[NetCause, ...]
    terms: TermArrays
    """Joint, link, coordinate where there is one, and place among packed values, of each kind of term."""
    rows: ResultRows
    whole: ClosingSums
    """Net torques of each joint's torque that is told with all of them."""

    @classmethod
    def of(
        cls, robot: OpenedRobot, loads: int, terms: TermArrays, rows: ResultRows, every: Sequence[Place]
    ) -> "NetTorques":
        """Return what fills these rows.

        loads: how many loads there are; every: places of all net torques, also of those without a row
        """
        told = {tuple(at) for _, at in rows[NET].listed()}
        missing = {at[0] for _, at in every if at not in told}
        joints = {at[0] for at in told} - missing
        sums = ClosingSums(robot.units, rows, "tau", NET, joints=joints)
        return cls(net_causes(robot, loads), terms, rows, sums)

    @property
    def closing_sums(self) -> dict[str, ClosingSums]:
        """Sums of net torques that are held to joint torques, if there are any."""
        return {"nets": self.whole} if self.whole.sums else {}

    @property
    def are_asked(self) -> bool:
        """True if there is a row of net torques."""
        return NET in self.rows

    @cached_property
    def are_of_terms(self) -> bool:
        """True if a row is summed from packed values."""
        return any(len(self._summed(kind).rows) for kind in TermArrays._fields[:3])

    @cached_property
    def are_shares(self) -> bool:
        """True if a row is of a share with a name."""
        return any(self.causes[at].quantity == "tau_share" for _, (_, at) in self.rows[NET].listed())

    def fill(
        self, out: Array, packed: Any, acceleration: Array, velocity: Array, by_velocity: Array | None = None
    ) -> None:
        """Fill the rows of motions and of gravity in `out` (rows, S) from packed values.

        acceleration, velocity: motion (S, n)
        by_velocity: torques (S, n, n) by each coordinate's velocity, all links together, in place of packed
        """
        if not self.are_asked:
            return
        out[self._moved] = 0.0
        self._add(out, "acceleration", packed, acceleration)
        self._add(out, "gravity", packed, None)
        if by_velocity is None:
            self._add(out, "velocity", packed, velocity)
            return
        plan = self._summed("velocity")
        joints = [self.rows.places[row][1][0] for row in plan.rows.tolist()]
        out[plan.rows] += by_velocity[:, joints, plan.coordinates].T

    def put(self, out: Array, quantity: str, torque: Array) -> None:
        """Fill the rows of shares with names, loads or passive torques from their torques (S, n, X)."""
        for row, (i, at) in self.rows[NET].listed():
            if self.causes[at].quantity == quantity:
                out[row] = torque[:, i, self.causes[at].number]

    @cached_property
    def _moved(self) -> Index:
        """Rows of motions and of gravity, that terms are added to."""
        kinds = (*MOTION, "tau_gravity")
        found = [row for row, (_, at) in self.rows[NET].listed() if self.causes[at].quantity in kinds]
        return np.array(found, np.intp)

    def _add(self, out: Array, kind: str, packed: Any, motion: Array | None) -> None:
        """Add the terms of a kind, times the motion of their coordinates if given."""
        plan = self._summed(kind)
        if not len(plan.rows):
            return
        values = getattr(packed, kind)
        for at in range(0, len(values), TURNED):
            some = slice(at, at + TURNED)
            found = plan.sums(turned(values[some], "turned"))
            if motion is not None:
                found *= motion[some].T[plan.coordinates]
            out[plan.rows, some] += found

    def _summed(self, kind: str) -> SummedTerms:
        """Return which rows have terms of a kind, and of which packed values these are made."""
        return self._plans[kind]

    @cached_property
    def _plans(self) -> dict[str, SummedTerms]:
        place = {tuple(at): row for row, at in self.rows[NET].listed()}
        found = {}
        for kind, terms in zip(TermArrays._fields[:3], self.terms[:3], strict=True):
            parts: dict[int, list[int]] = {}
            coordinates: dict[int, int] = {}
            for i, _, *k, source in terms:
                cause = NetCause(MOTION[0], k[0]) if k else NetCause("tau_gravity")
                row = place.get((i, self._numbers.get(cause, -1)))
                if row is not None:
                    parts.setdefault(row, []).append(source)
                    coordinates[row] = cause.number
            found[kind] = SummedTerms(
                np.array(list(parts), np.intp),
                np.array([coordinates[row] for row in parts], np.intp),
                RowSums([np.array(some, np.intp) for some in parts.values()]),
            )
        return found

    @cached_property
    def _numbers(self) -> dict[NetCause, int]:
        return {cause: at for at, cause in enumerate(self.causes)}
