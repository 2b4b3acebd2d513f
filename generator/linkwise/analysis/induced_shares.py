"""Shares of accelerations by source, from the torques that a result has: M q̈_x = F_x, point by point.

Where joints are tied, A q̇ = 0, each source x solves

    [M −Aᵀ; A 0] [q̈_x; λ_x] = [F_x; b_x]      b = −Ȧ q̇ for the constraints' own source, else 0

as `induced_accelerations` of the package does. Velocities are therefore those of all joints, and a link's
share of the velocity forces is c1_ijs q̇_s of the open tree. What c1^ of the independent joints has in
addition, c2 Ġ, is due to the constraints, which turn: it counts in their own source, by the joint whose
velocity turns them.

Where the robot stands on contacts, `StandingResponse` gives its response, and contacts are sources too.

A point accelerates by J q̈_x, and by J̇ q̇ itself.
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, cast

import numpy as np
from linkwise_runtime.motion.induced_accelerations import Response, response_of

from linkwise.analysis.contacts.ground_contacts import Standing
from linkwise.analysis.contacts.standing_response import StandingResponse
from linkwise.analysis.induced_points import InducedPoint
from linkwise.analysis.induced_sources import InducedSources, opened
from linkwise.analysis.loaded_robot import LoadedRobot
from linkwise.analysis.model_side import NAMES, Side
from linkwise.analysis.result_columns import Column
from linkwise.analysis.result_quantities import Quantity
from linkwise.analysis.verify import Closure, worst_of
from linkwise.errors import LinkwiseError
from linkwise.escape import column_part
from linkwise.package.load import Array

AT_ONCE = 1 << 21
"""Force values of the sources that are computed at once."""


@dataclass(frozen=True)
class InducedShares:
    """Plans and fills the columns of induced accelerations, which follow all others."""

    robot: LoadedRobot
    points: tuple[InducedPoint, ...]
    sources: InducedSources
    columns: tuple[Column, ...]
    first: int
    """Row of the result at which these columns begin."""

    @classmethod
    def of(
        cls,
        robot: LoadedRobot,
        points: Sequence[InducedPoint],
        others: Sequence[Column],
        loads: Sequence[str],
    ) -> "InducedShares":
        """Plan the columns of the points.

        others: all columns of torques and motion; loads: names of the loads
        """
        sources = InducedSources.of(robot, others if points else ())
        columns = tuple(
            column
            for number, point in enumerate(points)
            for row in range(len(point.rows))
            for column in _columns(sources, loads, point, number, row)
        )
        return cls(robot, tuple(points), sources, columns, len(others))

    def fill(
        self, out: Array, packed: Any, standing: Standing | None, q: Array, qd: Array, qdd: Array
    ) -> Closure:
        """Fill the induced accelerations in `out` (columns, S); return the largest errors of their sums.

        The torques of `out` must be filled already. packed: values of the robot's model
        """
        worst = Closure()
        numbers = max(1, len(self.sources.every) * q.shape[1])
        step = max(1, AT_ONCE // numbers)
        for at in range(0, len(q), step) if self.points else ():
            some = slice(at, at + step)
            part = Side(*(getattr(packed, name)[some] for name in NAMES))
            rows = None if standing is None else standing.every[some]
            worst |= self._fill(out[:, some], part, rows, q[some], qd[some], qdd[some])
        return worst

    def _fill(self, out: Array, packed: Side, rows: Array | None, q: Array, qd: Array, qdd: Array) -> Closure:
        mass, forces = self.sources.mass_and_forces(out, packed, q, qd, qdd)
        try:
            moved = self._moved(self._response(mass, q, qd), forces, rows, qdd)
        except ValueError as error:
            raise LinkwiseError(f"--induced: {_timed(str(error), out[0])}") from error
        row, worst = self.first, Closure()
        for point in self.points:
            jacobian, rate = point.maps(self.robot, q, qd)
            own = np.einsum("src,sc->sr", rate, qd)
            whole = np.einsum("src,sc->sr", jacobian, qdd) + own
            shares = np.concatenate([jacobian @ moved, rate * qd[:, None, :]], axis=2)
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

    def _moved(self, free: Response, forces: Array, rows: Array | None, qdd: Array) -> Array:
        """Return q̈_x (S, n, X) of forces, then of ties, then of contacts with rows A (S, C, n)."""
        ground = self.robot.contacts
        response = free if rows is None else StandingResponse(free, rows)
        moved = [response.accelerations(forces)]
        if self.robot.constrained is not None:
            moved.append(response.of_velocities())
        if isinstance(response, StandingResponse) and ground is not None:
            moved.append(response.of_contacts(qdd, ground.owners, len(ground.names)))
        return np.concatenate(cast("list[Array]", moved), axis=2)

    def _response(self, mass: Array, q: Array, qd: Array) -> Response:
        model = opened(self.robot)
        ties = None if self.robot.constrained is None else self.robot.constrained.constraints
        return response_of(model.backend, ties, q, qd, mass)


def _timed(text: str, time: Array) -> str:
    """Return the text of an error with the time in place of the sample's number, and with advice.

    A text without a sample's number is returned as it is.
    """
    found = re.search(r" at sample (\d+)", text)
    if found is None:
        return text
    told = text.replace(found[0], f" at {time[int(found[1])]:.6g} s", 1)
    return f"{told}; cut the log there, or leave --induced out"


def _columns(
    sources: InducedSources, loads: Sequence[str], point: InducedPoint, number: int, row: int
) -> list[Column]:
    """Return the columns of one component of a point.

    They are its acceleration, the shares of the sources, and J̇ q̇ by its causes.
    """
    unit, robot = point.units[row], sources.robot

    def column(quantity: Quantity, link: int | None, cause: int | None, names: Sequence[str]) -> Column:
        name = "/".join([quantity, *map(column_part, (point.name, point.rows[row], *names))])
        return Column(quantity, name, unit, None, link, cause, number, row)

    made = [column("acc", None, None, ())]
    for source in sources.every:
        causes = loads if source.quantity == "acc_load" else robot.joints
        names = [] if source.link is None else [robot.links[source.link]]
        names += [] if source.cause is None else [causes[source.cause]]
        made.append(column(source.quantity, source.link, source.cause, names))
    if robot.constrained is not None:
        made += [column("acc_constraint", None, s, [joint]) for s, joint in enumerate(robot.joints)]
    if robot.contacts is not None:
        made += [column("acc_contact", None, c, [name]) for c, name in enumerate(robot.contacts.names)]
    made += [column("acc_kinematic", None, s, [joint]) for s, joint in enumerate(robot.joints)]
    return made
