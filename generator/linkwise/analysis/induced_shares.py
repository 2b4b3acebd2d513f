"""Shares of accelerations by source, from the torques that a result has: M q̈_x = F_x, point by point.

A point accelerates by J q̈_x of each source of `InducedSources`, and by J̇ q̇ itself.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from linkwise.analysis.contacts.ground import Standing
from linkwise.analysis.induced_points import InducedPlan, InducedPoint
from linkwise.analysis.induced_sources import AT_ONCE, InducedSources, timed
from linkwise.analysis.opened_robot import OpenedRobot
from linkwise.analysis.result_rows import Place, ResultRows
from linkwise.analysis.term_rows import NAMES, TermArrays
from linkwise.analysis.verify import NO_ERRORS, Closure, worst_of
from linkwise.arrays import Array
from linkwise.errors import LinkwiseError


@dataclass(frozen=True)
class InducedShares:
    """Plans and fills the rows of induced accelerations, which follow all others."""

    robot: OpenedRobot
    points: tuple[InducedPoint, ...]
    sources: InducedSources
    first: int
    """Row of the result at which these begin."""

    @classmethod
    def of(cls, robot: OpenedRobot, plan: InducedPlan, others: ResultRows) -> "InducedShares":
        """Plan the rows of the points; others: all rows of torques and motion."""
        empty = InducedSources(robot, {})
        sources = InducedSources.of(robot, others, plan.whole) if plan.points else empty
        return cls(robot, plan.points, sources, len(others))

    @property
    def places(self) -> Iterator[Place]:
        """Places of the rows, for each component of a point.

        They are its acceleration, the shares of the sources, those of ties and contacts, and J̇ q̇ by cause.
        """
        shares: list[Place] = [("acc", ()), *self.sources.places, *self.sources.shares_beside()]
        if not self.sources.whole:
            shares += [("acc_kinematic", (s,)) for s in range(len(self.robot.joints))]
        components = list(dict.fromkeys(row for point in self.points for row in point.rows))
        for number, point in enumerate(self.points):
            for row in point.rows:
                yield from ((name, (number, components.index(row), *at)) for name, at in shares)

    def fill(
        self, out: Array, packed: Any, standing: Standing | None, q: Array, qd: Array, qdd: Array
    ) -> Closure:
        """Fill the induced accelerations in `out` (rows, S); return the largest errors of their sums.

        The torques of `out` must be filled already. packed: values of the robot's model
        """
        worst = NO_ERRORS
        numbers = max(1, len(self.sources.places) * q.shape[1])
        step = max(1, AT_ONCE // numbers)
        for at in range(0, len(q), step) if self.points else ():
            some = slice(at, at + step)
            part = TermArrays(*(getattr(packed, name)[some] for name in NAMES))
            rows = None if standing is None else standing.every[some]
            worst |= self._fill(out[:, some], part, rows, q[some], qd[some], qdd[some])
        return worst

    def _fill(
        self, out: Array, packed: TermArrays, rows: Array | None, q: Array, qd: Array, qdd: Array
    ) -> Closure:
        terms = self.sources.open_terms(packed, q, qd, qdd)
        forces = self.sources.forces(out, terms, q, qd, qdd)
        try:
            moved = self.sources.answers(terms, forces, rows, q, qd, qdd).accelerations
        except ValueError as error:
            raise LinkwiseError(f"--induced: {timed(str(error), out[0], '--induced')}") from error
        row, worst = self.first, Closure()
        for point in self.points:
            jacobian, rate = point.maps(self.robot, q, qd)
            own = np.einsum("src,sc->sr", rate, qd)
            whole = np.einsum("src,sc->sr", jacobian, qdd) + own
            shares = jacobian @ moved
            if self.sources.whole:
                shares[..., len(self.sources.places) - 1] += own
            else:
                shares = np.concatenate([shares, rate * qd[:, None, :]], axis=2)
            apart = np.abs(shares.sum(axis=2) - whole).max(axis=0, initial=0.0)
            sizes = np.abs(shares).sum(axis=2).max(axis=0, initial=0.0)
            for r, unit in enumerate(point.units):
                out[row] = whole[:, r]
                out[row + 1 : row + 1 + shares.shape[2]] = shares[:, r].T
                row += 1 + shares.shape[2]
                alike = [k for k, other in enumerate(point.units) if other == unit]
                absolute, relative = worst_of([(float(apart[k]), float(sizes[k])) for k in alike])
                worst |= Closure(induced_absolute=absolute, induced_relative=relative)
        return worst
